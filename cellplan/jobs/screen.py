"""Screen candidate layouts: resolve the whole job of a cell in hundreds of them."""

from dataclasses import replace
from functools import reduce

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.planning.layout_screening import Candidates, Screening, screen_layouts
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths, schedule_paths


def screen(cell: Cell, candidates: Candidates, *, task: str | None = None, accuracy: float = 1e-5) -> Screening:
    """Resolve the job of a cell in many candidates for it; a job of several runs is as good as its worst.

    Only the figures of ``Screening`` are computed: no collision, no clearance. What passes is solved and verified
    afterwards, as any cell.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        candidates: Cells that differ from it in base poses, tool tips and start postures.
        task: Name of the only task to work on; None for all.
        accuracy: Largest tool error that is accepted, in [m] and [rad].

    Raises:
        InputError: The cell cannot be worked with, or there is no such task.
        ValueError: The candidates are not cells of these robots.
    """
    if cell.program.is_home_to_home:
        raise InputError(f"{cell.origin.at('program')}: expected a cell without a program from home to home")
    paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    runs = [
        screen_layouts(
            cell,
            schedule_paths(cell, [paths[name] for name in phase.tasks]),
            candidates,
            moving=phase.moving,
            accuracy=accuracy,
        )
        for phase in plan_phases(cell, only=task).program
    ]
    return replace(reduce(Screening.worst, runs), cell=cell)
