"""Errors of tools on the part and of co-holders on their grasps, from the joint positions that were read back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check, ClosureAccuracy, TaskAccuracy
from cellplan.model.task.task import Frame, Task
from cellplan.model.units import DEG, MM
from cellplan.scene.kinematics.screw_chain import ScrewChain

CURE: Final = "a shorter motion.step_s, a slower motion or a path farther from singularities reduces it"


def part_poses(cell: Cell, chains: Mapping[str, ScrewChain], q: Mapping[str, Array]) -> Array:
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
    X_WT = chain.tool_poses(q)
    return pose_accuracy(scheduled, relative_to_task_frame(scheduled.task, X_WT, X_WP))


def relative_to_task_frame(task: Task, X_WT: Array, X_WP: Array) -> Array:
    """Tool poses relative to what a task is given in: the part, or the world, shape (N, 4, 4)."""
    return X_WT if task.relative_to is Frame.WORLD else inverse(X_WP) @ X_WT


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
    )


def errors_on_part(X_PT: Array, desired: Array, relation: Relation) -> Array:
    """Position errors in [m], then rotation vectors in [rad], desired against actual, in P, shape (N, 6).

    Args:
        X_PT: Tool poses, shape (N, 4, 4).
        desired: Reference ones, shape (N, 4, 4).
        relation: The task or grasp; components that it leaves open are zero.
    """
    position = desired[:, :3, 3] - X_PT[:, :3, 3]
    if relation.is_spin_free:
        orientation = _turn_between(X_PT[:, None, :3, 2], desired[:, None, :3, 2])
    else:
        orientation = _turn_between(np.swapaxes(X_PT[:, :3, :3], 1, 2), np.swapaxes(desired[:, :3, :3], 1, 2))
    error = np.concatenate([position, orientation], axis=1)
    error[:, [axis for axis in range(6) if axis not in relation.axes]] = 0.0
    return error


def check_accuracy(schedule: Schedule, accuracy: TaskAccuracy, task: Task) -> tuple[Check, Check]:
    """Position and orientation error of one task against its tolerance, from the instant on that it has settled."""
    position = np.linalg.norm(accuracy.position_error, axis=1)
    orientation = np.linalg.norm(accuracy.orientation_error, axis=1)
    first, allowed = task.first_judged(schedule.times), task.tolerance
    checks = (
        worst_error(
            "position_error",
            schedule.times[first:],
            MM * position[first:],
            subject=task.name,
            limit=allowed.position_mm,
            words=("mm", f"of task '{task.name}'"),
        ),
        worst_error(
            "orientation_error",
            schedule.times[first:],
            DEG * orientation[first:],
            subject=task.name,
            limit=allowed.orientation_deg,
            words=("deg", f"of task '{task.name}'"),
        ),
    )
    since = f", evaluated from {task.judged_from:g} s" if task.settle > 0.0 else ""
    position_check, orientation_check = (replace(check, message=f"{check.message}{since}") for check in checks)
    return position_check, orientation_check


def worst_error(name: str, times: Array, error: Array, *, subject: str, limit: float, words: tuple[str, str]) -> Check:
    """The worst instant of one error against its limit.

    Args:
        times: Times in [s] at which it is judged, shape (N,).
        error: Lengths of the error in the unit of the limit, shape (N,).
        subject: Task or robot that is judged.
        words: Unit, and whose error it is.
    """
    worst = int(np.argmax(error))
    value, at_s = float(error[worst]), float(times[worst])
    unit, of = words
    return Check(
        name=name,
        subject=subject,
        passed=value <= limit,
        value=value,
        limit=limit,
        unit=unit,
        at_s=at_s,
        message=f"{name.replace('_', ' ')} {of}: {value:.3g} {unit} at {at_s:.3f} s, allowed {limit:g} {unit}",
    )


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


def closure_accuracy(
    cell: Cell, chains: Mapping[str, ScrewChain], q: Mapping[str, Array], X_WP: Array
) -> tuple[ClosureAccuracy, ...]:
    """Closure errors of every holder but the first ([Ribeiro2010]_ 4.5), in P; open components are zero.

    A rigid part cannot give way: what is an error here is force between the robots in the shop. Holders that stand
    still are checked as well.

    Args:
        q: Positions of each robot, shape (N, n).
        X_WP: The part as the first holder carries it, shape (N, 4, 4) or (1, 4, 4).
    """
    accuracies = []
    for grasp in cell.closures:
        X_PT = inverse(X_WP) @ chains[grasp.robot].tool_poses(q[grasp.robot])
        error = errors_on_part(X_PT, np.broadcast_to(grasp.X_PT, X_PT.shape), grasp)
        accuracies.append(
            ClosureAccuracy(
                robot=grasp.robot, axes=grasp.axes, position_error=error[:, :3], orientation_error=error[:, 3:]
            )
        )
    return tuple(accuracies)


def check_closure(cell: Cell, times: Array, closures: Sequence[ClosureAccuracy]) -> list[Check]:
    """Position and orientation error of every closure against what the cell allows."""
    checks = []
    for closure in closures:
        of = f"of '{closure.robot}' on the part"
        checks += [
            worst_error(
                "closure_position_error",
                times,
                MM * np.linalg.norm(closure.position_error, axis=1),
                subject=closure.robot,
                limit=cell.checks.closure_mm,
                words=("mm", of),
            ),
            worst_error(
                "closure_orientation_error",
                times,
                DEG * np.linalg.norm(closure.orientation_error, axis=1),
                subject=closure.robot,
                limit=cell.checks.closure_deg,
                words=("deg", of),
            ),
        ]
    return [check if check.passed else replace(check, message=f"{check.message}; {CURE}") for check in checks]
