"""Tool error on the part, from the joint positions that were read back."""

from collections.abc import Mapping

import numpy as np

from cellplan.geometry.transforms import Array, inverse
from cellplan.kinematics.screws import ScrewChain
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule, TaskSchedule
from cellplan.model.report import Check, TaskAccuracy
from cellplan.model.task import Task


def part_poses(cell: Cell, chains: Mapping[str, ScrewChain], q: Mapping[str, Array]) -> Array:
    """The part frame in the world at every instant, shape (N, 4, 4), or (1, 4, 4) for a part at a fixed place."""
    if not cell.part.held_by:
        if cell.part.X_WP is None:
            raise ValueError("a part that nobody holds needs a pose in the world")
        return cell.part.X_WP[None]
    grasp = cell.part.held_by[0]
    poses: Array = chains[grasp.robot].tool_poses(q[grasp.robot]) @ inverse(grasp.X_PT)
    return poses


def task_accuracy(scheduled: TaskSchedule, chain: ScrewChain, *, q: Array, X_WP: Array) -> TaskAccuracy:
    """Errors of one task in P; components that the task leaves open are zero.

    Args:
        scheduled: Wanted tool poses.
        chain: The operator.
        q: The operator's positions, shape (N, n).
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    return pose_accuracy(scheduled, inverse(X_WP) @ chain.tool_poses(q))


def pose_accuracy(scheduled: TaskSchedule, X_PT: Array) -> TaskAccuracy:
    """Errors of one task in P, from its tool poses on the part, shape (N, 4, 4); open components are zero."""
    wanted, task = scheduled.X_PT, scheduled.task
    position = wanted[:, :3, 3] - X_PT[:, :3, 3]
    if task.is_spin_free:
        orientation = _turn_between(X_PT[:, None, :3, 2], wanted[:, None, :3, 2])
    else:
        orientation = _turn_between(np.swapaxes(X_PT[:, :3, :3], 1, 2), np.swapaxes(wanted[:, :3, :3], 1, 2))
    open_axes = [axis for axis in range(6) if axis not in task.axes]
    error = np.concatenate([position, orientation], axis=1)
    error[:, open_axes] = 0.0
    return TaskAccuracy(
        task=task.name,
        robot=task.robot,
        position_error=error[:, :3],
        orientation_error=error[:, 3:],
        path_length=scheduled.length,
        end_s=scheduled.end,
    )


def check_accuracy(schedule: Schedule, accuracy: TaskAccuracy, task: Task) -> tuple[Check, Check]:
    """Position and orientation error of one task against its tolerance, from the instant on that it has settled."""
    position = np.linalg.norm(accuracy.position_error, axis=1)
    orientation = np.linalg.norm(accuracy.orientation_error, axis=1)
    return (
        _check("position_error", schedule, 1e3 * position, task=task, limit=1e3 * task.tolerance.position, unit="mm"),
        _check(
            "orientation_error",
            schedule,
            np.degrees(orientation),
            task=task,
            limit=float(np.degrees(task.tolerance.orientation)),
            unit="deg",
        ),
    )


def _check(name: str, schedule: Schedule, error: Array, *, task: Task, limit: float, unit: str) -> Check:
    """The worst instant of one error."""
    first = task.first_judged(schedule.times)
    worst = first + int(np.argmax(error[first:]))
    value, at_s = float(error[worst]), float(schedule.times[worst])
    words = name.replace("_", " ")
    since = f", judged from {task.judged_from:g} s" if task.settle > 0.0 else ""
    return Check(
        name=name,
        subject=task.name,
        passed=value <= limit,
        value=value,
        limit=limit,
        unit=unit,
        at_s=at_s,
        message=f"{words} of task '{task.name}': {value:.3g} {unit} at {at_s:.3f} s, allowed {limit:g} {unit}{since}",
    )


def _turn_between(axes: Array, wanted: Array) -> Array:
    """Rotation vectors in P that lay unit axes on the wanted ones, shape (N, k, 3) each to (N, 3).

    The direction is that of ``sum a_i x d_i``; the angle follows from the chord ``sum |d_i - a_i|^2``, which loses no
    digits at the small angles that matter: three axes turn by ``4 (1 - cos) = 8 sin^2(angle / 2)``, a single one by
    ``2 (1 - cos)``.
    """
    across = np.cross(axes, wanted).sum(axis=1)
    chord = ((wanted - axes) ** 2).sum(axis=(1, 2))
    per_half_sine = 8.0 if axes.shape[1] == 3 else 4.0
    angle = 2.0 * np.arcsin(np.minimum(1.0, np.sqrt(chord / per_half_sine)))
    length = np.linalg.norm(across, axis=1)
    safe = np.where(length > 0.0, length, 1.0)
    turn: Array = across * np.where(length > 0.0, angle / safe, 0.0)[:, None]
    undirected = (length == 0.0) & (angle > 0.0)
    turn[undirected, 0] = angle[undirected]
    return turn
