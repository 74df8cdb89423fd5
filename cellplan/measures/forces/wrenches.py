"""Wrenches of processes, weights and inertia on tools and part over the rows of a run.

A wrench is ``[f; m]``: a force in [N] and its moment about the origin of the world in [N m], expressed in W. Its power
with a twist at that origin is ``w . V``, so joints balance it by ``tau = -J^T w``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from cellplan.geometry.inertia import centre_and_inertia
from cellplan.geometry.transforms import Array, cross, rotation_vector, transform_points
from cellplan.measures.accelerations import changes_of_velocity, point_accelerations
from cellplan.model.cell.cell import Cell, Part, RobotRows
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.task.clocked_path import are_within
from cellplan.scene.dynamics.loads import GRAVITY

UP: Final = np.array([0.0, 0.0, 1.0])
NO_WRENCHES: Final[RobotRows] = MappingProxyType({})  # on robots, by their names


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wrenches:
    """What acts on tools and part at N rows, shape (N, 6) each; zero where nothing is stated."""

    on_tools: Mapping[str, Array]  # of the process on the tool, by robot
    of_tools: Mapping[str, Array]  # weight of the tool, by robot
    on_part: Array  # of all processes on the part
    of_part: Array  # weight of the part
    inertia_of_tools: Mapping[str, Array]  # of the tool as a point in the written motion, by robot
    inertia_of_part: Array  # of the part in the written motion


def wrenches(cell: Cell, schedule: Schedule, X_WT: Mapping[str, Array], X_WP: Array) -> Wrenches:
    """What processes and weights exert on tools and part.

    The opposite of what the process of a task on the part exerts on its tool acts on the part, at the same place. That
    of a task in the world acts on neither part nor robot.

    Args:
        X_WT: Tool poses, shape (N, 4, 4), by robot.
        X_WP: The part, shape (N, 4, 4).
    """
    nothing = np.zeros((len(X_WP), 6))
    on_tools, on_part = dict.fromkeys(X_WT, nothing), nothing
    for scheduled in schedule.tasks:
        task = scheduled.task
        wrench = _of_process(scheduled, schedule.times, X_WT[task.robot], X_WP)
        on_tools[task.robot] = on_tools[task.robot] + wrench
        on_part = on_part - (wrench if task.is_on_part else 0.0)
    of_tools, inertia_of_tools = {}, {}
    for robot in cell.robots:
        X, tool = X_WT[robot.name], robot.tool
        centre_T = np.zeros(3) if tool.centre is None else tool.X_FT[:3, :3].T @ (tool.centre - tool.X_FT[:3, 3])
        mass, centres = tool.mass or 0.0, transform_points(X, centre_T[None])[:, 0]
        of_tools[robot.name] = weight(mass, centres)
        inertia_of_tools[robot.name] = at_origin(-mass * point_accelerations(schedule.times, centres), centres)
    centres = transform_points(X_WP, centre_of(cell.part)[None])[:, 0]
    return Wrenches(
        on_tools=on_tools,
        of_tools=of_tools,
        on_part=on_part,
        of_part=weight(cell.part.mass or 0.0, centres),
        inertia_of_tools=inertia_of_tools,
        inertia_of_part=inertial_wrench(cell.part, schedule.times, X_WP),
    )


def at_origin(force: Array, points: Array, moment: Array | float = 0.0) -> Array:
    """Wrenches at the origin of the world from forces at points and moments about these, shape (N, 3) each."""
    return np.concatenate([force, moment + cross(points, force)], axis=1)


def weight(mass: float, points: Array) -> Array:
    """Weight of a mass in [kg] whose centre is at points in [m], shape (N, 3)."""
    return at_origin(np.broadcast_to(-mass * GRAVITY * UP, points.shape), points)


def inertial_wrench(part: Part, times: Array, X_WP: Array) -> Array:
    """``[-m a; -dL/dt]`` of the part, which stands still before its first and after its last row, shape (N, 6).

    Args:
        times: Times in [s], shape (N,).
        X_WP: The part, shape (N, 4, 4).
    """
    mass, R = part.mass or 0.0, X_WP[:, :3, :3]
    centres = transform_points(X_WP, centre_of(part)[None])[:, 0]
    spins = rotation_vector(R[1:] @ np.swapaxes(R[:-1], 1, 2)) / np.diff(times)[:, None]
    I_P = part.X_PS[:3, :3] @ centre_and_inertia(part.shape)[1] @ part.X_PS[:3, :3].T
    I_W = mass * R @ I_P @ np.swapaxes(R, 1, 2)
    momenta = np.einsum("nij,nj->ni", 0.5 * (I_W[1:] + I_W[:-1]), spins)
    force = -mass * point_accelerations(times, centres)
    return at_origin(force, centres, -changes_of_velocity(times, momenta))


def centre_of(part: Part) -> Array:
    """Centre of mass of the part in P in [m], shape (3,): the stated one, or that of uniform density."""
    if part.centre is not None:
        return part.centre
    return transform_points(part.X_PS, centre_and_inertia(part.shape)[0][None])[0]


def in_part(X_WP: Array, wrench: Array) -> Array:
    """Wrenches at the origin of P and expressed in it, shape (N, 6), from those at the origin of the world."""
    R, force = X_WP[:, :3, :3], wrench[:, :3]
    moment = wrench[:, 3:] - cross(X_WP[:, :3, 3], force)
    return np.concatenate([np.einsum("nji,nj->ni", R, vector) for vector in (force, moment)], axis=1)


def in_world(X_WP: Array, wrench_P: Array) -> Array:
    """Wrenches at the origin of the world, shape (N, 6), from those at the origin of P."""
    force, moment = (np.einsum("nij,nj->ni", X_WP[:, :3, :3], half) for half in (wrench_P[:, :3], wrench_P[:, 3:]))
    return at_origin(force, X_WP[:, :3, 3], moment)


def _of_process(scheduled: TaskSchedule, times: Array, X_WT: Array, X_WP: Array) -> Array:
    """What the process of a task exerts on its tool while it is on, shape (N, 6)."""
    process = scheduled.task.process
    if process is None or process.force is None:
        return np.zeros((len(times), 6))
    frame, wrench, lead = process.force.frame, process.force.wrench, process.lead_s
    acts = are_within(times, ((on + lead, off + lead) for on, off in scheduled.process_on))
    R = np.broadcast_to(np.eye(3), (len(times), 3, 3))
    if frame == "tool":
        R = X_WT[:, :3, :3]
    elif frame == "part" and scheduled.task.is_on_part:
        R = X_WP[:, :3, :3]
    force, moment = R @ wrench[:3], R @ wrench[3:]
    return at_origin(force, X_WT[:, :3, 3], moment) * acts[:, None]
