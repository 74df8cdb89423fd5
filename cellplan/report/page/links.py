"""Files of a run that its page leads to."""

from collections.abc import Collection, Iterable
from pathlib import PurePosixPath
from typing import Final
from urllib.parse import quote

Links = list[tuple[str, str]]  # text and address

TABLES: Final = {"tables": "Joint tables", "rejected": "Joint tables of a failed run, not for use"}
STILL: Final = "still.svg"  # picture of the worst instant, beside the page
FLOOR_PLAN: Final = "floor_plan.svg"  # likewise


def file_links(
    tables: Collection[str], plots: Iterable[str], beside: Iterable[str], *, phase: str | None
) -> dict[str, Links]:
    """Links to the files of a run by what they are.

    Args:
        tables: Names of the joint tables in the run folder.
        plots: Names of the plots in the folder of the page.
        beside: Names of other files in that folder.
        phase: Phase of the page, which lies in a folder of its own; None for the page in the run folder.
    """
    up = "../" if phase is not None else ""
    found = {title: _tables(tables, folder, up) for folder, title in TABLES.items()}
    of_the_run = [(name, f"{up}{name}") for name in ("cell.yaml", "manifest.json")]
    found["Results"] = [*((name, name) for name in beside), *of_the_run]
    found["Plots"] = [(PurePosixPath(name).stem.replace("_", " "), f"plots/{quote(name)}") for name in plots]
    return {title: links for title, links in found.items() if links}


def _tables(files: Collection[str], folder: str, up: str) -> Links:
    """The tables in one folder."""
    names = sorted(name for name in files if PurePosixPath(name).parent == PurePosixPath(folder))
    return [(PurePosixPath(name).stem, f"{up}{quote(name)}") for name in names]
