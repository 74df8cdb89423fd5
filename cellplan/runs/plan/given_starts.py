"""Starts before anything is searched: seeds moved to their tasks, approaches, and what no solve could be right with."""

from collections.abc import Mapping
from dataclasses import replace

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.branches import Branches, MovedStart
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.sequence.near_starts import with_approach_starts
from cellplan.planning.start.given import examine_given_starts, without_far_starts
from cellplan.planning.start.seeds import with_seeds
from cellplan.runs.plan.rounded import with_rounded_starts, with_start
from cellplan.scene.kinematics.screw_chain import Chains


def with_placed_starts(
    cell: Cell,
    toolpaths: Mapping[str, Toolpath],
    chains: Chains,
    *,
    near: Branches | None = None,
    drops_far: bool = False,
) -> tuple[Cell, tuple[MovedStart, ...]]:
    """The cell of one block with its starts on their tasks, and how far each was moved; missing ones stay missing.

    Args:
        cell: The cell as it is while its tasks are worked on.
        near: The run of which the branches are kept, where starts are missing.
        drops_far: Whether starts too far off their tasks are left out, not refused.

    Raises:
        InputError: A start is out of limits, or too far off its task.
        NoSolutionError: A branch does not lead to its task.
    """
    filled = cell if near is None else with_branches(cell, near)
    of_run = {robot.name for robot in filled.robots if robot.start is not cell.robot(robot.name).start}
    placed, moved = with_seeds(filled, toolpaths, run="" if near is None else near.run, of_run=of_run)
    if cell.program.is_home_to_home:
        placed = with_approach_starts(placed, chains, toolpaths)
    placed = with_rounded_starts(placed, filled)
    placed = without_far_starts(placed, toolpaths) if drops_far else placed
    examine_given_starts(placed, toolpaths)
    return placed, moved


def with_chosen_start(
    cell: Cell, start: Array, toolpaths: Mapping[str, Toolpath]
) -> tuple[Cell, tuple[MovedStart, ...]]:
    """The cell of one block with every start filled in, and how far given ones were moved to suit what was found.

    Args:
        cell: The cell; a start that it gives may fit only the configuration of the positioner that was searched for.
        start: The stacked start that was chosen in [rad] or [m], shape (nq,).
    """
    started = with_start(cell, start)
    pairs = list(zip(cell.robots, started.robots, strict=True))
    if all(given.start is None or given.start is chosen.start for given, chosen in pairs):
        return started, ()
    robots = tuple(chosen if given.start is None else given for given, chosen in pairs)
    return started, with_seeds(replace(cell, robots=robots), toolpaths)[1]


def with_branches(cell: Cell, near: Branches) -> Cell:
    """The cell of one block with its missing starts as an earlier run has them, each at its task if it has one."""
    begun = {task.robot: near.tasks[task.name] for task in cell.tasks if task.name in near.tasks}
    at_work = {task.robot for task in cell.tasks}
    robots = []
    for robot in cell.robots:
        known = begun.get(robot.name)
        if known is None and (robot.name not in at_work or not cell.program.is_home_to_home):
            known = near.starts.get(robot.name)
        robots.append(robot if robot.start is not None or known is None else replace(robot, start=known))
    return replace(cell, robots=tuple(robots))
