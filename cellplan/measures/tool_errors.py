"""Errors of tools on the part and of co-holders on their grasps, from the joint positions that were read back."""

from itertools import pairwise

import numpy as np

from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Relation, RobotRows
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import ClosureAccuracy, TaskAccuracy
from cellplan.model.task.clocked_path import on_line
from cellplan.model.task.task import Frame
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain


def part_poses(cell: Cell, chains: Chains, q: RobotRows) -> Array:
    """The part frame in the world at every sample, shape (N, 4, 4), or (1, 4, 4) for a part at a fixed pose."""
    if cell.carrier is None:
        return cell.part.X_CP[None]
    carrier = cell.robots[cell.carrier].name
    return chains[carrier].tool_poses(q[carrier]) @ cell.part.X_CP


def task_accuracy(scheduled: TaskSchedule, chain: ScrewChain, *, q: Array, X_WP: Array) -> TaskAccuracy:
    """Errors of one task in P, or in W for a task in the world; components that the task leaves open are zero.

    Args:
        q: The operator's positions, shape (N, n).
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    return pose_accuracy(scheduled, relative_to_task_frame(scheduled.task, chain.tool_poses(q), X_WP))


def relative_to_task_frame(relation: Relation, X_WT: Array, X_WP: Array) -> Array:
    """Tool poses relative to what a task or grasp is given in: the part, or the world, shape (N, 4, 4)."""
    return X_WT if relation.relative_to is Frame.WORLD else inverse(X_WP) @ X_WT


def points_of_travel(schedule: Schedule, scheduled: TaskSchedule, X_WT: Array, X_WP: Array) -> Array:
    """Tips in the frame of a task, without their weave: the points whose speed is the feed, in [m], shape (N, 3)."""
    points: Array = relative_to_task_frame(scheduled.task, X_WT, X_WP)[:, :3, 3]
    path = schedule.woven(scheduled.task)
    return points if path is None else points - on_line(path, scheduled.travelled)[1]


def pose_accuracy(scheduled: TaskSchedule, X_PT: Array) -> TaskAccuracy:
    """Errors of one task in P, from its tool poses on the part, shape (N, 4, 4); open components are zero."""
    task = scheduled.task
    error = errors_on_part(X_PT, scheduled.X_PT, task)
    return TaskAccuracy(
        task=task.name,
        robot=task.robot,
        position_error=error[:, :3],
        orientation_error=error[:, 3:],
        path_length=scheduled.length,
        path_bulge=scheduled.bulge,
        start_s=task.start,
        end_s=scheduled.end,
        judged_from=task.judged_from,
        lean=lean_of(X_PT, scheduled.X_PT) if task.tilt else None,
        runs=scheduled.runs,
        process_on=(scheduled.process_on[0][0], scheduled.process_on[-1][1]) if scheduled.process_on else (0.0, 0.0),
        process_off=tuple((off, on) for (_, off), (on, _) in pairwise(scheduled.process_on)),
    )


def errors_on_part(X_PT: Array, desired: Array, relation: Relation) -> Array:
    """Position errors in [m], then rotation vectors in [rad], desired against actual, in P, shape (N, 6).

    Args:
        X_PT: Tool poses, shape (N, 4, 4).
        desired: Reference ones, shape (N, 4, 4) or (1, 4, 4).
        relation: The task or grasp; components that it leaves open are zero, and of a tool whose axis may lean the
            rotation is that from the cone on.
    """
    position = desired[:, :3, 3] - X_PT[:, :3, 3]
    if relation.is_spin_free:
        orientation = _beyond(_turn_between(X_PT[:, None, :3, 2], desired[:, None, :3, 2]), relation.tilt)
    else:
        orientation = _turn_between(np.swapaxes(X_PT[:, :3, :3], 1, 2), np.swapaxes(desired[:, :3, :3], 1, 2))
    error = np.concatenate([position, orientation], axis=1)
    error[:, [axis for axis in range(6) if axis not in relation.axes]] = 0.0
    return error


def lean_of(X_PT: Array, desired: Array) -> float:
    """Largest angle in [rad] between tool axes and desired ones, from poses of shape (N, 4, 4)."""
    turns = _turn_between(X_PT[:, None, :3, 2], desired[:, None, :3, 2])
    return float(np.linalg.norm(turns, axis=1).max())


def error_lengths(X_PT: Array, desired: Array, relation: Relation) -> Array:
    """Lengths of these position errors in [m] and rotation vectors in [rad], shape (N, 2)."""
    error = errors_on_part(X_PT, desired, relation)
    return np.stack([np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)], axis=1)


def _beyond(turn: Array, tilt: float) -> Array:
    """Rotation vectors, shape (N, 3), without as much of each as lies within an angle in [rad]."""
    if tilt == 0.0:
        return turn
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    return turn * np.maximum(0.0, 1.0 - tilt / np.maximum(angle, tilt))


def _turn_between(axes: Array, desired: Array) -> Array:
    """Rotation vectors in P that turn unit axes onto the desired ones, shape (N, k, 3) each to (N, 3).

    The direction is that of ``sum a_i x d_i``; the angle follows from the chord ``sum |d_i - a_i|^2``, which loses no
    digits at the small angles that matter: three axes turn by ``4 (1 - cos) = 8 sin^2(angle / 2)``, a single one by
    ``2 (1 - cos)``.
    """
    across = np.cross(axes, desired).sum(axis=1)
    chord = ((desired - axes) ** 2).sum(axis=(1, 2))
    per_half_sine = 8.0 if axes.shape[1] == 3 else 4.0
    angle = 2.0 * np.arcsin(np.minimum(1.0, np.sqrt(chord / per_half_sine)))
    length = np.linalg.norm(across, axis=1)
    safe = np.where(length > 0.0, length, 1.0)
    turn: Array = across * np.where(length > 0.0, angle / safe, 0.0)[:, None]
    undirected = (length == 0.0) & (angle > 0.0)
    turn[undirected, 0] = angle[undirected]
    return turn


def closure_accuracy(cell: Cell, chains: Chains, q: RobotRows, X_WP: Array) -> tuple[ClosureAccuracy, ...]:
    """Closure errors of every holder but the first ([Ribeiro2010]_ 4.5), in P; open components are zero.

    A rigid part cannot give way: what is an error here is force between the robots in the shop. Holders that stand
    still are checked as well.

    Args:
        X_WP: The part as the first holder carries it, shape (N, 4, 4) or (1, 4, 4).
    """
    accuracies = []
    for grasp in cell.closures:
        X_PT = inverse(X_WP) @ chains[grasp.robot].tool_poses(q[grasp.robot])
        error = errors_on_part(X_PT, grasp.X_PT[None], grasp)
        accuracies.append(
            ClosureAccuracy(
                robot=grasp.robot, axes=grasp.axes, position_error=error[:, :3], orientation_error=error[:, 3:]
            )
        )
    return tuple(accuracies)
