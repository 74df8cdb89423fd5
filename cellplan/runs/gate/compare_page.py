"""Whether the page of a run says what was found when its tables were computed again; its pictures are those on disk."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

from cellplan.files.input.findings import listed, shown
from cellplan.files.run.stored import StoredRun
from cellplan.model.cell.cell import Cell
from cellplan.model.report.verified_run import VerifiedMotion
from cellplan.report.page.render import PageFiles, report_page
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.run import run_figures
from cellplan.report.record.common import Record
from cellplan.report.record.summary import ProgramRecords
from cellplan.runs.drawings.picture import FLOOR_PLAN, STILL
from cellplan.runs.gate.compare_drawings import CellDrawings, foreign_drawings, stored_drawings
from cellplan.runs.gate.compare_report import PLANNER_KEYS
from cellplan.runs.gate.equal_text import first_difference
from cellplan.runs.gate.picture_text import foreign_piece

Drawings = Mapping[str, Mapping[str, bytes]]

PAGE: Final = "report.html"
EXCERPT_LENGTH: Final = 40  # [characters] shown of a page from where it differs


def redrawn(motions: Sequence[VerifiedMotion]) -> Drawings:
    """The pictures of what was found, by the place of the run and by file name."""
    return {motion.name or "": pictures(run_figures(motion.report, cell=motion.cell)) for motion in motions}


def page_findings(
    stored: StoredRun, records: ProgramRecords, redrawn: Drawings, drawings: CellDrawings
) -> Iterator[str]:
    """Every page of a run that is not the one its tables, its report's planner facts and its pictures give.

    Args:
        stored: The run; its reports are known to say what was found.
    """
    yield from foreign_drawings(stored, drawings)
    for place, record in records.by_place.items():
        expected = redrawn.get(place, {})  # a program of several phases has pictures in these only
        yield from _foreign_pieces(stored, place, expected)
        given = _of_the_run(stored, place, record)
        yield from _page_finding(stored, place, given, cell=records.cells[place], plots=expected)


def other_pictures(stored: StoredRun, expected: Drawings) -> Iterator[str]:
    """Pictures of a run that are not, to the byte, what is drawn here of what was found.

    That may be rounding: curves that show nothing but the noise of the arithmetic look different on each processor.
    """
    for place, texts in expected.items():
        for name, picture in texts.items():
            if stored.content(place, f"plots/{name}") != picture:
                yield f"{place}/plots/{name}" if place else f"plots/{name}"


def _foreign_pieces(stored: StoredRun, place: str, expected: Mapping[str, bytes]) -> Iterator[str]:
    """Pictures of one run that hold something that cellplan does not draw; missing ones are reported elsewhere."""
    for name, picture in stored.drawings(place).items():
        if name in expected:
            foreign = foreign_piece(picture.decode("utf-8", "replace"), expected[name].decode())
            if foreign is not None:
                file = stored.file(place, f"plots/{name}")
                yield f"{file}: unexpected {foreign}, which cellplan does not draw; solve the cell again"


def _page_finding(
    stored: StoredRun, place: str, record: Record, *, cell: Cell, plots: Collection[str]
) -> Iterator[str]:
    """What is wrong with the page of one phase, or of the program.

    Args:
        plots: File names of its plots in their order.
    """
    drawings = stored.drawings(place)
    if sorted(drawings) != sorted(plots):
        names = f"expected the pictures {listed(plots)}, got {listed(drawings)}"
        yield f"{stored.file(place, 'plots')}: {names}; solve the cell again"
        return
    in_order = {name: drawings[name] for name in plots}
    try:
        page = report_page(record, cell=cell, plots=in_order, **_page_files(stored, place))
    except (KeyError, TypeError, ValueError, AttributeError):  # of what only the planner knows, or of a picture
        file = stored.file(place, "report.json")
        yield f"{file}: solver: expected the form that cellplan writes; solve the cell again"
        return
    yield from _difference(stored, place, page)


def _page_files(stored: StoredRun, place: str) -> PageFiles:
    """What lies beside a page of the run: its tables, and the drawings of the cell on disk."""
    drawings = stored_drawings(stored, place, (STILL, FLOOR_PLAN))
    return {"still": drawings[STILL], "floor_plan": drawings[FLOOR_PLAN], "files": tuple(stored.manifest.files)}


def _difference(stored: StoredRun, place: str, page: str) -> Iterator[str]:
    """Where a page on disk says something else than the one that was made anew."""
    text = stored.content(place, PAGE).decode("utf-8", "replace")
    different = first_difference(text, page)
    if different is not None:
        at, got, expected = different
        line = text.count("\n", 0, at) + 1
        words = f"expected {_shown(expected)}, got {_shown(got)}"
        yield f"{stored.file(place, PAGE)}:{line}: {words}; solve the cell again"


def _shown(text: str) -> str:
    """The beginning of a text, on one line."""
    return shown(" ".join(text[:EXCERPT_LENGTH].split()) or "nothing")


def _of_the_run(stored: StoredRun, place: str, expected: Record) -> Record:
    """A record with inputs and digests of the run, and with what only its planner knew as its report has it."""
    report: Any = stored.report(place)
    got = report.get("solver", {})
    solver = {key: got.get(key) if key in PLANNER_KEYS else value for key, value in expected["solver"].items()}
    inputs, digests = dict(stored.manifest.inputs), report.get("digests", {})
    return {**expected, "inputs": inputs, "digests": digests, "solver": solver}
