"""Cells that are solved and judged but for the clearance of their bodies, which takes half of the time of a program."""

from cellplan.checks.clearance.check import UNKNOWN
from cellplan.checks.verify import Clearance
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.runs import solve
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.runs.solution import Solution
from cellplan.scene.scene import Scene


class _Unknown(EarlyClearance):
    """The clearance of every run is left open."""

    def of(self, scene: Scene, schedule: Schedule, q: Array, progress: Progress) -> Clearance:
        return UNKNOWN, ()


def uncertified(cell: Cell, *, task: str | None = None) -> Solution:
    """What ``solve`` gives, without figures and checks of clearance, clocks and stops."""
    early = _Unknown()
    _, solution = solve.solve_motion(cell, task=task, progress=silent, early=early)
    return solve.certified(solution, is_reported=False, progress=silent, early=early)
