"""A single task of a program from home to home: the others are left out."""

from dataclasses import replace

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import Task


def with_only_task(cell: Cell, name: str) -> Cell:
    """The cell with one of its tasks only, in the order of its robot and after nothing else.

    Raises:
        InputError: There is no such task.
    """
    chosen = next((task for task in cell.tasks if task.name == name), None)
    if chosen is None:
        raise InputError(f"task: expected one of {', '.join(task.name for task in cell.tasks)}, got '{name}'")
    tasks: tuple[Task, ...] = (replace(chosen, after=()),)
    left_out = {task.name for task in cell.tasks} - {name}
    robots = (
        replace(robot, order=tuple(item for item in robot.order if item not in left_out)) for robot in cell.robots
    )
    return replace(cell, robots=tuple(robots), tasks=tasks)
