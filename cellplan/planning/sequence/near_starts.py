"""Starts of later tasks: near where the robots are anyway, so that no transfer move changes the branch for nothing.

A cell that is to run from home to home gets approaches; starts that were written for it without them stay valid.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.name_order import NameOrder
from cellplan.model.seeds import generator
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import Frame, Task
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.start.given import is_off, part_pose, tool_distance
from cellplan.planning.start.inverse_kinematics import finite_limits, reaching_configurations, within_limits
from cellplan.planning.start.trial_motion import StartTrial, StartTrials
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain
from cellplan.scene.scene import Scene

SEEDS: Final = 24  # configurations round the last one from which the inverse kinematics begins
SPREAD: Final = 0.5  # [rad or m] of these round it
MOST_TRIED: Final = 16  # configurations of an arm that are tried where the nearest leads through a singular one
WIDE_SPREAD: Final = 2.0  # [rad or m] of as many more for a tool in process, which may need another branch
FARTHEST: Final = 1.0  # [rad or m] that a joint turns while the tool is drawn back: more is another branch


def near_start(scene: Scene, paths: Mapping[str, ClockedPath], last: Mapping[str, Array]) -> Array | None:
    """The nearest starts that the robots find for their tasks, tried together as the search for starts does.

    Args:
        scene: The scene with the cell of a block; starts that are to be found are None.
        last: Configuration in which each robot was before, in [rad] or [m], shape (n,), by robot.

    Returns:
        The stacked start configuration, shape (nq,); None where nothing is to be found, a robot was nowhere before, or
        the motion from it is not sound.
    """
    cell = scene.cell
    if all(robot.start is not None for robot in cell.robots):
        return None
    by_robot = {task.robot: task for task in cell.tasks}
    choices: dict[str, Array] = {}
    for robot in cell.robots:
        if robot.start is not None:
            choices[robot.name] = robot.start[None]
        elif robot.name not in last:
            return None
        elif robot.name not in by_robot:
            choices[robot.name] = last[robot.name][None]
        else:
            task = by_robot[robot.name]
            choices[robot.name] = _nearest(scene, task, paths[task.name], last[robot.name])
        if not len(choices[robot.name]):
            return None
    return _without_crossing(scene, StartTrials(scene, paths), choices)


def _without_crossing(scene: Scene, trials: StartTrials, choices: Mapping[str, Array]) -> Array | None:
    """The nearest sound start, of each robot the nearest one from which its arm passes no singular configuration.

    ``choices`` are configurations of each robot, the nearest first, shape (K, n). Where all of an arm pass one, the
    nearest counts.
    """

    def stacked() -> Array:
        return np.concatenate([choices[robot.name][picks[robot.name]] for robot in scene.cell.robots])

    def trial() -> StartTrial:
        return trials.judge(NameOrder.of(scene.cell).sorted(stacked()), may_turn=False)

    picks = dict.fromkeys(choices, 0)
    nearest = trial()
    for name in sorted(nearest.crossing):
        for pick in range(1, len(choices[name]), -(-len(choices[name]) // MOST_TRIED)):
            picks[name] = pick
            other = trial()
            if other.is_sound and name not in other.crossing:
                nearest = other
                break
        else:
            picks[name] = 0
    return stacked() if nearest.is_sound else None


def _nearest(scene: Scene, task: Task, path: ClockedPath, last: Array) -> Array:
    """Configurations that put a tool on its start, the nearest to the last one by the time at top speed first."""
    cell, chain = scene.cell, scene.chains[task.robot]
    holder = cell.robot(cell.positioners[0]).start if cell.positioners else None
    X_WR = np.eye(4) if task.relative_to is Frame.WORLD else part_pose(cell, holder)
    if X_WR is None:
        return np.empty((0, len(last)))
    draw = generator(task.robot, cell.solver.seed).uniform
    spreads = (SPREAD,) if task.process is None else (SPREAD, WIDE_SPREAD)
    seeds = np.concatenate([last[None], *(last + draw(-spread, spread, (SEEDS, len(last))) for spread in spreads)])
    model = cell.robot(task.robot).model
    arrived = reaching_configurations(chain, task, path.toolpath.X_PT_start, X_WP=X_WR, seeds=seeds)
    inside = arrived[np.all((arrived >= model.lower) & (arrived <= model.upper), axis=1)]
    turned = within_limits(model, arrived)
    q = np.concatenate([inside, turned])
    times = (np.abs(q - last) / model.velocity).max(axis=1)
    return q[np.argsort(np.round(times, 6), kind="stable")]


def with_approach_starts(cell: Cell, chains: Chains, toolpaths: Mapping[str, Toolpath]) -> Cell:
    """The cell, with at most one task a robot, with starts on the paths moved back to the begin of the approaches."""
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
