"""Failed checks as text: grouped by what they check, with a count, the first ones of each group in full."""

from collections.abc import Iterable, Iterator
from typing import Final

from cellplan.model.report.check_kinds import CHECK_KINDS
from cellplan.report.record.common import Record

MOST_OF_A_GROUP: Final = 8  # [-] failed checks that are shown; further ones are counted


def failure_lines(checks: Iterable[Record], more: str) -> Iterator[str]:
    """A line for each failed check below a heading for each group; nothing if all checks passed.

    Args:
        more: Where the checks stand that are not shown.
    """
    groups: dict[str, list[str]] = {}
    for check in checks:
        if not check["passed"]:
            phase = f"{check['phase']}: " if check.get("phase") else ""
            groups.setdefault(CHECK_KINDS[check["name"]].heading, []).append(f"{phase}{check['message']}")
    for title, messages in groups.items():
        yield f"  {title}: {len(messages)} failed"
        yield from (f"    FAILED {message}" for message in messages[:MOST_OF_A_GROUP])
        if len(messages) > MOST_OF_A_GROUP:
            yield f"    and {len(messages) - MOST_OF_A_GROUP} more, all in {more}"


def count_text(checks: Iterable[Record]) -> str:
    """How many checks passed or failed."""
    outcomes = [bool(check["passed"]) for check in checks]
    failed = outcomes.count(False)
    if failed:
        return f"{failed} of {len(outcomes)} checks failed"
    return f"{len(outcomes)} checks passed" if len(outcomes) != 1 else "1 check passed"
