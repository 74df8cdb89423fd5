"""Certify a cell: all checks of ``solve``, and the verdict as the report words it."""

from cellplan.errors import InputError, NoSolutionError
from cellplan.model.cell.cell import Cell
from cellplan.report.record.common import Provenance
from cellplan.report.record.sections.solver import PlanningFacts
from cellplan.report.record.summary import program_records
from cellplan.report.text.run import verdict_lines
from cellplan.runs.solve import solve_in_parallel
from cellplan.scene.scene import Scene
from cellplan.session.works.events import Send, progress_of

WORK = "certify"


def make_ready(cell: Cell) -> None:
    """Load what a certificate needs, and the bodies of a cell, before it is asked for."""
    Scene.from_cell(cell)


def certify(cell: Cell, version: int, *, send: Send) -> None:
    """Send the verdict on a cell; without a motion it fails, with the reason.

    Args:
        version: Of the cell; stands in the event.
    """
    try:
        solution = solve_in_parallel(cell, progress=progress_of(WORK, send))
    except (InputError, NoSolutionError) as error:
        passed, lines = False, str(error).splitlines()
    else:
        planning = [PlanningFacts(motion=run.motion, transfers=run.transfers, moved=run.moved) for run in solution.runs]
        provenance = Provenance(versions={}, digests={})
        record = program_records(solution.runs, cell=solution.cell, provenance=provenance, planning=planning).whole
        passed, lines = solution.passed, verdict_lines(record)
        lines += [solution.remark] if solution.remark and not solution.passed else []
    send({"event": "verdict", "work": WORK, "version": version, "passed": passed, "lines": lines})
