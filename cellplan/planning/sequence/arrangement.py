"""Arrangement of the tasks of a cell into blocks that are worked on one after another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell, Mode
from cellplan.model.sequence import order_faults
from cellplan.model.task import Task
from cellplan.planning.sequence.progress import SequenceProgress


@dataclass(frozen=True, slots=True)
class Block:
    """Tasks that begin together with everything at rest; the next block begins when all of them are done.

    Attributes:
        tasks: Names of the tasks in the order of the cell, at most one for each robot; none for a rest after them all.
    """

    tasks: tuple[str, ...]
    dwell: float = 0.0  # time in [s] for which all robots stand still before the tasks begin


def arrange(cell: Cell) -> tuple[Block, ...]:
    """The tasks of one cycle that are worked on together, block after block.

    In every mode the orders of the robots, ``after`` and the marks hold, and a task comes as early as they allow.
    Pairwise has one task in each block, the first of the cell that may begin; semi-coordinated only tasks at one
    configuration of the first holder, the present one as long as there are any for it.

    Args:
        cell: The cell, with any number of tasks for each robot.

    Raises:
        InputError: A name does not exist or stands in the order of another robot, robots wait for one another in a
            circle, or tasks that begin together need different configurations of the holder.
    """
    _require_names(cell)
    progress = SequenceProgress(cell)
    blocks: list[Block] = []
    while True:
        dwell = progress.pass_marks()
        if progress.is_finished:
            return (*blocks, Block((), dwell)) if dwell > 0.0 else tuple(blocks)
        previous = cell.task(blocks[-1].tasks[0]) if blocks else None
        tasks = _chosen(cell, progress.ready(), previous)
        if not tasks:
            raise progress.deadlock()
        progress.finish(tasks)
        blocks.append(Block(tuple(task.name for task in tasks), dwell))


def _chosen(cell: Cell, ready: Sequence[Task], previous: Task | None) -> list[Task]:
    """Those of the tasks that may begin which the mode lets begin together."""
    match cell.motion.mode:
        case Mode.PAIRWISE:
            return list(ready[:1])
        case Mode.SEMI_COORDINATED:
            groups = [
                [task for task in ready if _same_configuration(cell, task, other)]
                for other in (previous, *ready)
                if other
            ]
            return next((group for group in groups if group), [])
        case Mode.SIMULTANEOUS:
            _require_one_configuration(cell, ready, "choose semi_coordinated, or let one come after the other")
        case Mode.PART_AT_REST:
            _require_one_configuration(cell, cell.tasks, "choose semi_coordinated")
    return list(ready)


def _require_one_configuration(cell: Cell, tasks: Sequence[Task], cure: str) -> None:
    """Refuse tasks that are worked on together at different configurations of the first holder.

    Where the holder has a task of its own, the others need not name the configuration in which that begins.
    """
    carrier_tasks = [task for task in tasks if task.robot in cell.positioners[:1]]
    first = next(iter(carrier_tasks or tasks), None)
    for task in tasks:
        if first and not (carrier_tasks and task.holder_posture is None) and not _same_configuration(cell, first, task):
            raise InputError(
                f"{task.where('holder_deg')}: expected the configuration of the holder for '{first.name}' in the mode "
                f"{cell.motion.mode}, got another: {cure}"
            )


def _same_configuration(cell: Cell, one: Task, other: Task) -> bool:
    """Whether two tasks begin at the same configuration of the first holder."""
    a, b = (_holder_configuration(cell, task) for task in (one, other))
    return bool(np.array_equal(a, b)) if a is not None and b is not None else a is b


def _holder_configuration(cell: Cell, task: Task) -> Array | None:
    """Configuration of the first holder at the start of a task; None for its start posture, when it is to be found."""
    if cell.carrier is None:
        return None
    start = task.start_posture if task.robot == cell.robots[cell.carrier].name else task.holder_posture
    return cell.robots[cell.carrier].start if start is None else start


def _require_names(cell: Cell) -> None:
    """Refuse orders and ``after`` with names that the cell does not have.

    Raises:
        InputError: The first of them.
    """
    operators = {task.name: task.robot for task in cell.tasks}
    marks = [mark.name for mark in cell.program.all_marks] if cell.program is not None else []
    for robot in cell.robots:
        for index, text in order_faults(robot.name, robot.order, operators, marks) if robot.order else ():
            place = f"robots.{robot.name}.order" if index is None else f"robots.{robot.name}.order[{index}]"
            raise InputError(f"{cell.origin.at(place)}: {text}")
    for task in cell.tasks:
        for other in task.after:
            if other not in operators:
                raise InputError(f"{task.where('after')}: expected a task of this cell, got '{other}'")
