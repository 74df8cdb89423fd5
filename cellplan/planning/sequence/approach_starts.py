"""Starts of approaches: a start that a cell states on the path of a task is moved back to where the approach begins.

A cell that is to run from home to home gets approaches; starts that were written for it without them stay valid.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.cell import Cell
from cellplan.model.task import Frame, Task
from cellplan.model.toolpath import Toolpath
from cellplan.planning.start.given import is_off, part_pose, tool_distance
from cellplan.planning.start.inverse_kinematics import finite_limits, reaching_configurations

FARTHEST: Final = 1.0  # [rad or m] that a joint turns while the tool is drawn back: more is another branch


def with_approach_starts(cell: Cell, chains: Mapping[str, ScrewChain], toolpaths: Mapping[str, Toolpath]) -> Cell:
    """The cell with starts on the paths of their tasks moved back to the begin of the approaches.

    Args:
        cell: The cell as it is while the tasks are worked on; each of its robots has at most one.
        chains: Kinematic chain of each robot, by name.
    """
    holder = cell.robot(cell.positioners[0]).start if cell.positioners else None
    X_WP = part_pose(cell, holder)
    starts: dict[str, Array] = {}
    for task in cell.tasks:
        start = cell.robot(task.robot).start
        X_WR = np.eye(4) if task.relative_to is Frame.WORLD else X_WP
        if start is not None and X_WR is not None and task.approach is not None:
            q = _moved_back(cell, chains[task.robot], task, start, X_WR=X_WR, X_PT=toolpaths[task.name].X_PT_start)
            starts[task.robot] = start if q is None else q
    robots = tuple(replace(robot, start=starts.get(robot.name, robot.start)) for robot in cell.robots)
    return replace(cell, robots=robots)


def _moved_back(cell: Cell, chain: ScrewChain, task: Task, start: Array, *, X_WR: Array, X_PT: Array) -> Array | None:
    """A start, shape (n,), drawn back along the axis of its tool; None where it is not on the path."""
    on_path = X_PT.copy()
    on_path[:3, 3] += X_PT[:3, 2] * (task.approach.distance if task.approach else 0.0)
    if is_off(cell, task, tool_distance(chain, task, start, on_path, X_WR=X_WR)):
        return None
    reaching = reaching_configurations(chain, task, X_PT, X_WP=X_WR, seeds=start[None])
    lower, upper = finite_limits(cell.robot(task.robot).model)
    near = [q for q in reaching if np.all((q >= lower) & (q <= upper)) and np.abs(q - start).max() <= FARTHEST]
    return near[0] if near else None
