"""Modes: which tasks are worked on together, and which robots move meanwhile (MODO 1, 2, 3 of [Ribeiro2010]_ ch. 5)."""

from collections.abc import Sequence
from dataclasses import dataclass

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell, Mode
from cellplan.model.idle import idle_robots
from cellplan.model.task import Task


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """One motion of the cell.

    Attributes:
        name: Name of the only task in a run of its own; None when all tasks are worked on together.
        tasks: Names of the tasks worked on.
        moving: Names of the robots that may move; all others stand still.
        idle: Names of the robots that have nothing to do and stand at their homes.
    """

    name: str | None
    tasks: tuple[str, ...]
    moving: tuple[str, ...]
    idle: tuple[str, ...] = ()


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
    _refuse_carrying_at_rest(cell, chosen)
    operators = tuple(task.robot for task in chosen)
    tasks = tuple(task.name for task in chosen)
    idle = idle_robots(cell, tasks)
    match cell.motion.mode:
        case Mode.SIMULTANEOUS:
            return (RunPlan(name=None, tasks=tasks, moving=_each_once(cell.positioners + operators), idle=idle),)
        case Mode.PART_AT_REST:
            return (RunPlan(name=None, tasks=tasks, moving=operators, idle=idle),)
        case Mode.PAIRWISE:
            return tuple(
                RunPlan(
                    name=task.name,
                    tasks=(task.name,),
                    moving=_each_once((*cell.positioners, task.robot)),
                    idle=idle_robots(cell, (task.name,)),
                )
                for task in chosen
            )


def standing(cell: Cell, plan: RunPlan, q: Array) -> Array:
    """Stacked configurations of a run with its idle robots at their homes, as far as these are known.

    Args:
        cell: The cell.
        plan: The run.
        q: Stacked joint positions in [rad] or [m], shape (..., nq).
    """
    placed = q.copy()
    for name in plan.idle:
        home = cell.robot(name).home
        if home is not None:
            placed[..., cell.columns(name)] = home
    return placed


def homeless(cell: Cell, plan: RunPlan) -> frozenset[str]:
    """Names of the idle robots of a run whose homes are still to be found."""
    return frozenset(name for name in plan.idle if cell.robot(name).home is None)


def _refuse_carrying_at_rest(cell: Cell, tasks: Sequence[Task]) -> None:
    """Refuse a task that carries the part where the part is to stand still."""
    for task in tasks:
        if cell.motion.mode is Mode.PART_AT_REST and task.robot in cell.positioners:
            raise InputError(
                f"{cell.origin.at(f'tasks.{task.name}.robot')}: expected a robot that does not hold the part in the "
                f"mode part_at_rest, got the positioner '{task.robot}'; choose another mode or leave the task out"
            )


def _each_once(names: Sequence[str]) -> tuple[str, ...]:
    """Names in their order; a holder that carries the part along a path of its own is named once."""
    return tuple(dict.fromkeys(names))
