"""Idle robots: who has nothing to do in a run, and where it stands meanwhile."""

from collections.abc import Collection

from cellplan.model.cell import Cell


def idle_robots(cell: Cell, tasks: Collection[str]) -> tuple[str, ...]:
    """Names of the robots that neither hold the part nor have one of some tasks, in the order of the cell.

    Args:
        cell: The cell.
        tasks: Names of the tasks that are worked on in a run.
    """
    busy = {*cell.positioners, *(task.robot for task in cell.tasks if task.name in tasks)}
    return tuple(robot.name for robot in cell.robots if robot.name not in busy)


def not_in_program(cell: Cell, tasks: Collection[str]) -> str:
    """One line on the idle robots of a run and on the moves that it leaves out; empty when everybody is at work."""
    idle = idle_robots(cell, tasks)
    if not idle:
        return ""
    stand = "stands at its home" if len(idle) == 1 else "stand at their homes"
    return f"idle in this run: {', '.join(idle)} {stand}; moves to and from home are not part of the program"
