"""Files of a run that its page leads to."""

from collections.abc import Collection, Iterable
from pathlib import PurePosixPath
from typing import Final
from urllib.parse import quote

Links = list[tuple[str, str]]  # text and address

TABLES: Final = {"tables": "Joint tables", "rejected": "Joint tables of a failed run, not for use"}
STILL: Final = "still.svg"  # picture of the worst instant, beside the page
FLOOR_PLAN: Final = "floor_plan.svg"  # likewise
VIEW_PAGE: Final = "view.html"  # the 3-D page in a run folder


def file_links(
    tables: Collection[str], plots: Iterable[str], files: Iterable[str], *, phase: str | None
) -> dict[str, Links]:
    """Links to the files of a run by what they are.

    Args:
        tables: Names of the joint tables in the run folder.
        plots: Names of the plots in the folder of the page.
        files: Names of other files in that folder.
        phase: Phase of the page, which lies in a folder of its own; None for the page in the run folder.
    """
    up = _up(phase)
    groups = {title: _tables(tables, folder, up) for folder, title in TABLES.items()}
    of_the_run = [(name, f"{up}{name}") for name in ("cell.yaml", "manifest.json")]
    groups["Results"] = [*((name, name) for name in files), *of_the_run]
    groups["Plots"] = [(PurePosixPath(name).stem.replace("_", " "), f"plots/{quote(name)}") for name in plots]
    return {title: links for title, links in groups.items() if links}


def view_link(phase: str | None) -> str:
    """Address of the 3-D page of a run, seen from the page of a phase, or from the page in the run folder."""
    return f"{_up(phase)}{VIEW_PAGE}"


def _up(phase: str | None) -> str:
    """The way from the folder of a page to the run folder, to be put before a name."""
    return "../" if phase is not None else ""


def _tables(files: Collection[str], folder: str, up: str) -> Links:
    """The tables in one folder."""
    names = sorted(name for name in files if PurePosixPath(name).parent == PurePosixPath(folder))
    return [(PurePosixPath(name).stem, f"{up}{quote(name)}") for name in names]
