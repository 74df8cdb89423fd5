"""The mark of 3-D pages, and what stands in a run folder in place of one until it is made."""

from pathlib import Path
from typing import Final

from cellplan.report.page.render import template

MARK: Final = '<meta name="generator" content="cellplan view">'  # stands in the first lines of every page
MARK_WITHIN: Final = 400  # [bytes]


def unmade_view_page(cell: str, *, cell_file: str) -> str:
    """What stands in a run folder in place of its 3-D page until that is made: the line that makes it.

    Args:
        cell_file: Name of its cell file where that line must name it; empty otherwise.
    """
    return template("unmade.html").render(cell=cell, cell_file=cell_file, mark=MARK)


def is_view_page(path: Path) -> bool:
    """Whether a file is a 3-D page that cellplan wrote."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return MARK.encode() in file.read(MARK_WITHIN)
