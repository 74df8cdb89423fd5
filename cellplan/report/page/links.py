"""Files of a run that its page leads to."""

from collections.abc import Collection, Iterable
from pathlib import PurePosixPath
from typing import Final
from urllib.parse import quote

Links = list[tuple[str, str]]  # text and address

TABLES: Final = {"tables": "Joint tables", "rejected": "Joint tables of a failed run, not for use"}
FLOOR_PLANS: Final = ("floor_plan.svg", "floor_plan.dxf")


def file_links(
    files: Collection[str], plots: Iterable[str], *, phase: str | None, has_series: bool
) -> dict[str, Links]:
    """Links to the files of a run by what they are.

    Args:
        files: Names of files in the run folder, beside those that every run has.
        plots: Names of the plots in the folder of the page.
        phase: Phase of the page, which lies in a folder of its own; None for the page in the run folder.
        has_series: Whether ``series.json`` lies beside the page.
    """
    up = "../" if phase is not None else ""
    beside = ["report.json", *(["series.json"] if has_series else [])]
    found = {title: _tables(files, folder, up) for folder, title in TABLES.items()}
    found["Results"] = [(name, name) for name in beside] + [
        (name, f"{up}{name}") for name in ("cell.yaml", "manifest.json")
    ]
    found["Floor plan"] = [(name, f"{up}{name}") for name in FLOOR_PLANS if name in files]
    found["Plots"] = [(PurePosixPath(name).stem.replace("_", " "), f"plots/{quote(name)}") for name in plots]
    return {title: links for title, links in found.items() if links}


def _tables(files: Collection[str], folder: str, up: str) -> Links:
    """The tables in one folder."""
    names = sorted(name for name in files if PurePosixPath(name).parent == PurePosixPath(folder))
    return [(PurePosixPath(name).stem, f"{up}{quote(name)}") for name in names]
