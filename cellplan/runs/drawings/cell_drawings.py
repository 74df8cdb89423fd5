"""Drawings of a run: the picture of the instant that decides its verdict, and its floor plan."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Report
from cellplan.report.floor_plan.sheet import floor_plan_svg
from cellplan.runs.drawings.floor_plan import floor_plan, schedule_paths, swept_state
from cellplan.runs.drawings.instant import graver, worst_instant
from cellplan.runs.drawings.picture import run_still

STILL: Final = "still.svg"
FLOOR_PLAN: Final = "floor_plan.svg"


class DepictedPhase(NamedTuple):
    """What is drawn of one phase: the cell as it is in it, its tasks and what was found."""

    cell: Cell
    schedule: Schedule
    report: Report


def phase_drawings(phase: DepictedPhase) -> dict[str, str]:
    """The drawings of one phase, by file name."""
    return {STILL: run_still(*phase), FLOOR_PLAN: _floor_plan(phase.cell, [phase])}


def program_drawings(cell: Cell, phases: Sequence[DepictedPhase]) -> dict[str, str]:
    """The drawings of a program with several phases: the picture of the one that decides, and all of its motion."""
    worst = min(phases, key=lambda phase: graver(worst_instant(phase.report, phase.cell)))
    return {STILL: run_still(*worst), FLOOR_PLAN: _floor_plan(cell, phases)}


def _floor_plan(cell: Cell, phases: Sequence[DepictedPhase]) -> str:
    """The floor plan at the begin of the first phase, with what all phases sweep."""
    motions = [phase.report.q for phase in phases]
    paths = {name: points for phase in phases for name, points in schedule_paths(phase.schedule).items()}
    whole = sum(phase.report.cycle_time for phase in phases)
    start = {name: q[0] for name, q in motions[0].items()}
    return floor_plan_svg(floor_plan(cell, start, motions, paths, state=swept_state(whole)))
