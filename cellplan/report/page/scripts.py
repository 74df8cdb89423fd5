"""Scripts of the pages, which run from within the page and are allowed there by their digests."""

from base64 import b64encode
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from typing import Final

SCRIPTS: Final = ("page.js", "figures.js")


@dataclass(frozen=True, slots=True)
class PageScripts:
    """Scripts as they stand in a page."""

    texts: tuple[str, ...]  # what stands between the tags, one text for each
    policy: str  # the sources of scripts that its content security policy allows: these, and no others


def page_scripts(texts: Iterable[str]) -> PageScripts:
    """Scripts with the policy that allows them.

    A browser compares the digest with the text between the tags to the byte, so that a script that was changed or
    added does not run; see https://www.w3.org/TR/CSP3/#match-element-to-source-list.
    """
    scripts = tuple(texts)
    digests = (b64encode(sha256(text.encode()).digest()).decode() for text in scripts)
    return PageScripts(scripts, " ".join(f"'sha256-{digest}'" for digest in digests))
