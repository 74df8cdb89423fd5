"""Idle robots: robots without a task in a run, and their configurations."""

from collections.abc import Collection

from cellplan.model.cell.cell import Cell


def idle_robots(cell: Cell, tasks: Collection[str]) -> tuple[str, ...]:
    """Names of the robots that neither hold the part nor have one of the tasks of a run, in the order of the cell."""
    busy = {*cell.positioners, *(task.robot for task in cell.tasks if task.name in tasks)}
    return tuple(robot.name for robot in cell.robots if robot.name not in busy)


def not_in_program(cell: Cell, tasks: Collection[str]) -> str:
    """One line on moves that a run omits: those of robots whose task is not part of the run, to and from home.

    Empty when there are none; a robot without work in the whole cell never leaves its home, and a program from home to
    home has all moves.
    """
    if cell.program.is_home_to_home:
        return ""
    workers = {task.robot for task in cell.tasks}
    idle = [name for name in idle_robots(cell, tasks) if name in workers]
    if not idle:
        return ""
    stand = "stands at its home" if len(idle) == 1 else "stand at their homes"
    return f"idle in this run: {', '.join(idle)} {stand}; moves to and from home are not part of the program"
