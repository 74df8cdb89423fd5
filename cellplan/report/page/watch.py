"""The page of a watched cell: the report and the 3-D page in frames, loaded again after each round.

A page that is opened from disk may not read other files, but it may run scripts that lie beside it: the page runs a
small script again and again, whose number changes with each round.
"""

import json
from collections.abc import Sequence
from typing import Final

from cellplan.report.page.render import template

MARK: Final = '<meta name="generator" content="cellplan watch">'  # stands in the first lines of every such page
RELOAD_MESSAGE: Final = "cellplan:reload"  # asks a page in a frame to load itself again, at its place and instant


def watch_page(title: str, *, pages: Sequence[tuple[str, str]], state: str) -> str:
    """The page as text."""
    return template("watch.html").render(title=title, pages=pages, state=state, mark=MARK, message=RELOAD_MESSAGE)


def state_script(*, number: int, run: str, phase: str, lines: Sequence[str]) -> str:
    """The script that tells the page what came of the last round.

    Args:
        number: Number of the results so far; the pages are loaded again when it changes.
        run: Where the run folder lies from the page, as a part of its address.
        phase: One of working, passed, failed and error.
        lines: What to say about it.
    """
    state = {"number": number, "run": run, "phase": phase, "lines": list(lines)}
    return f"cellplanState({json.dumps(state)});\n"
