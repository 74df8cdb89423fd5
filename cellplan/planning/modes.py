"""Modes: which tasks are worked on together, and which robots move meanwhile (MODO 1, 2, 3 of [Ribeiro2010]_ ch. 5)."""

from dataclasses import dataclass

from cellplan.errors import InputError
from cellplan.model.cell import Cell, Mode


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """One motion of the cell.

    Attributes:
        name: Name of the only task in a run of its own; None when all tasks are worked on together.
        tasks: Names of the tasks worked on.
        moving: Names of the robots that may move; all others stand still at their start posture.
    """

    name: str | None
    tasks: tuple[str, ...]
    moving: tuple[str, ...]


def plan_runs(cell: Cell, *, only: str | None = None) -> tuple[RunPlan, ...]:
    """The runs that the cell's mode asks for, in the order of the tasks.

    Args:
        cell: The cell.
        only: Name of the only task to work on; None for all.

    Raises:
        InputError: There is no such task.
    """
    chosen = [task for task in cell.tasks if only in (None, task.name)]
    if not chosen:
        raise InputError(f"task: expected one of {', '.join(task.name for task in cell.tasks)}, got '{only}'")
    operators = tuple(task.robot for task in chosen)
    tasks = tuple(task.name for task in chosen)
    match cell.motion.mode:
        case Mode.SIMULTANEOUS:
            return (RunPlan(name=None, tasks=tasks, moving=cell.positioners + operators),)
        case Mode.PART_AT_REST:
            return (RunPlan(name=None, tasks=tasks, moving=operators),)
        case Mode.PAIRWISE:
            return tuple(
                RunPlan(name=task.name, tasks=(task.name,), moving=(*cell.positioners, task.robot)) for task in chosen
            )
