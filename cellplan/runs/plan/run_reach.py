"""Runs that leave the reach are refused before any start is searched from which they would be tried."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.seeds import generator
from cellplan.model.task.task import Frame, Task
from cellplan.model.units import DEG, MM
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.branches import SEEDS
from cellplan.planning.start.given import leaning_angle
from cellplan.planning.start.inverse_kinematics import (
    random_configurations,
    reaching_configurations,
    within_limits,
)
from cellplan.planning.start.reasons import ARRIVED, nearest_reach
from cellplan.scene.kinematics.reach import reach_bound
from cellplan.scene.kinematics.screw_chain import ScrewChain

PLACES: Final = 7  # of each run that are tried, the end of the work first
TURNED: Final = 1e-3  # [rad] a tool that comes this near to its direction has it
POSITIONS: Final = {0, 1, 2}  # components of a task that hold its tip in place


def refuse_far_runs(cell: Cell) -> None:
    """Refuse runs that no configuration follows to their outer end.

    Where the part rests the inverse kinematics says so, from as many attempts at several places as a start has. Where a
    robot carries it the bases and the chains of both robots, however they are turned, say what cannot be.

    Raises:
        NoSolutionError: With the run, what its tool misses where, and the cure.
    """
    for task in cell.tasks:
        for key, what, length, X_PT in _runs(cell, task):
            for distance, pose in zip(np.linspace(0.0, length, PLACES), X_PT, strict=True):
                tip, angle = _beyond_reach(cell, task, pose)
                is_missed = tip > ARRIVED or angle > TURNED
                if is_missed and distance == 0.0:
                    break  # the work is out of reach, of which the search for a start says more
                if is_missed:
                    raise NoSolutionError(
                        f"{task.where(f'process.{key}')}: expected a {what} within the reach of '{task.robot}', got "
                        f"one of {MM * length:.4g} mm: {MM * distance:.4g} mm from the work its tool stays "
                        f"{MM * tip:.4g} mm and {DEG * angle:.3g} deg away at best; make it shorter, or move the base "
                        f"of '{task.robot}' or the part"
                    )


def _runs(cell: Cell, task: Task) -> Iterator[tuple[str, str, float, Array]]:
    """The runs of a task: key, name, length in [m], and poses of the tool from the work on, shape (PLACES, 4, 4)."""
    if task.process is None or not any(task.process.has_runs):
        return
    toolpath = build_toolpath(task, cell.part)
    run_in, run_out = toolpath.runs
    shares = np.linspace(0.0, 1.0, PLACES)
    if run_in:
        yield "run_in_mm", "run-in", run_in, toolpath.poses(run_in * (1.0 - shares))
    if run_out:
        yield "run_out_mm", "run-out", run_out, toolpath.poses(toolpath.length - run_out * (1.0 - shares))


def _beyond_reach(cell: Cell, task: Task, X_PT: Array) -> tuple[float, float]:
    """Distance in [m] and angle in [rad] by which the tool of an operator misses a pose; zeros where none is known."""
    robot, is_on_part = cell.robot(task.robot), task.relative_to is Frame.PART
    if is_on_part and cell.positioners:
        if not set(task.axes) >= POSITIONS or cell.program.attach is not None or cell.program.detach is not None:
            return 0.0, 0.0
        holder = cell.robot(cell.positioners[0])
        between = float(np.linalg.norm(_first_point(robot) - _first_point(holder)))
        lever = float(np.linalg.norm((cell.part.X_CP @ X_PT)[:3, 3]))  # from the tip of the holder
        return abs(between - lever) - reach_bound(robot) - reach_bound(holder), 0.0
    X_WP = cell.part.X_CP if is_on_part else np.eye(4)
    seeds = random_configurations(robot.model, SEEDS, generator(f"{robot.name} nearest", cell.solver.seed))
    arrived = reaching_configurations(ScrewChain(robot), task, X_PT, X_WP=X_WP, seeds=seeds)
    if len(within_limits(robot.model, arrived)):
        return 0.0, 0.0
    tip_only = leaning_angle(cell, task) > 0.0  # how the axis leans is then left to the search
    return nearest_reach(robot, task, X_PT, X_WP=X_WP, seeds=seeds, tip_only=tip_only)


def _first_point(robot: Robot) -> Array:
    """The point of the first axis of a robot in the world in [m], shape (3,)."""
    axis = robot.model.axes[robot.model.links_to_flange[0]]
    return robot.X_WB[:3, :3] @ axis.point_B + robot.X_WB[:3, 3]
