"""The scenes of a layout search: its best layouts, one after the other, at their start postures."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.io.cell.load import load_cell
from cellplan.io.input.files import read_regular_file
from cellplan.io.input.findings import shown
from cellplan.io.input.json_reader import parse_json, required
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress
from cellplan.pipeline.layout.result_file import BEST
from cellplan.pipeline.view.cell_scene import standing_scene
from cellplan.pipeline.view.geometries import Geometries
from cellplan.report.record.common import Record
from cellplan.report.record.layout import SCHEMA
from cellplan.report.record.view import SceneViewRecord
from cellplan.study.folder import RESULT

RESULT_LIMIT: Final = 200_000_000  # [bytes]
FIGURES: Final = (
    ("cycle_s", "cycle", "s"),
    ("margin_deg", "smallest margin", "deg"),
    ("clearance_mm", "smallest clearance", "mm"),
    ("change", "change", ""),
)


def read_layout_study(folder: Path) -> Record:
    """The result of a layout search.

    Raises:
        InputError: The study has no result yet, or is of another kind.
    """
    file = folder / RESULT
    if not file.exists():
        raise InputError(f"{file}: missing: the search has not ended; finish it with --resume")
    record = parse_json(read_regular_file(file, file=str(file), limit=RESULT_LIMIT), str(file))
    if record.get("schema") != SCHEMA or record.get("kind") != "layout":
        got = f"one of the kind {shown(record.get('kind', 'unknown'))}"
        raise InputError(f"{file}: expected the study of a layout search, got {got}: view one of its runs instead")
    required(record, "top", list, file=str(file))
    return record


def cell_of_study(folder: Path, given: Path | None, allow_dirs: Sequence[Path]) -> Cell:
    """The cell that the layouts are made of: the given one, else the best layout in the folder.

    Raises:
        InputError: There is none.
    """
    path = folder / BEST if given is None else given
    if given is None and not path.exists():
        raise InputError(f"{folder}: expected {BEST} in it, got none: no layout passed; name the cell file with --cell")
    return load_cell(path, allow_dirs=allow_dirs)


def study_scenes(
    record: Record, cell: Cell, file: str, geometries: Geometries, progress: Progress
) -> Iterator[SceneViewRecord]:
    """A scene for each of the best layouts.

    Args:
        record: The result of the search.
        cell: The cell that the layouts are made of.
        file: Where the result was read from.
        geometries: Takes the shapes.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: A layout does not fit the cell.
    """
    top: list[Any] = record["top"]
    for place, layout in enumerate(top):
        progress("placing the layouts", place / len(top))
        settings = required(layout, "settings", dict, file=file)
        try:
            scene = standing_scene(cell.with_values(settings), geometries)
        except InputError as error:
            raise InputError(f"{file}: top[{place}].settings: {str(error).splitlines()[0]}") from None
        yield {
            **scene,
            "name": f"{place + 1} of {len(top)}: trial {layout['trial']}, {layout['status']}",
            "facts": _facts(layout),
            "remarks": [*scene["remarks"], *([layout["reason"]] if layout["reason"] else [])],
            "passed": layout["status"] == "certified" or None,
        }


def _facts(layout: Record) -> list[list[str]]:
    """The figures of a layout."""
    facts = [["from", str(layout["origin"])]]
    for key, label, unit in FIGURES:
        if layout[key] is not None:
            facts.append([label, f"{layout[key]:.4g} {unit}".strip()])
    return facts
