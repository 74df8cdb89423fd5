"""Solve a cell on two processors: its clearance is checked beside everything else."""

from pathlib import Path

from cellplan.guard import ForkedWork
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.pipeline.early_clearance import EarlyClearance
from cellplan.pipeline.solution import Solution
from cellplan.pipeline.solve import certified, solve, solve_motion


def solve_in_parallel(
    cell: Cell, *, task: str | None = None, near: Path | None = None, progress: Progress = silent
) -> Solution:
    """Solve as ``solve`` does; copies of this process check the clearance while it does all else.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        task: Name of the only task to work on.
        near: Folder of a run of which the branches are kept.
        progress: Called with the stage and the fraction done.
    """
    with ForkedWork(progress) as work:
        if not work.is_possible:
            return solve(cell, task=task, near=near, progress=progress)
        early = EarlyClearance(work.begin, with_curves=True)
        scene, solution = solve_motion(cell, task=task, near=near, progress=progress, early=early)
        return certified(solution, scene, progress=progress, early=early)
