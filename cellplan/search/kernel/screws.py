r"""Screws of a moving cell, seen from the frames of its tasks, and what displaces them.

All twists are taken at the origin of the frame R that a task is relative to (the part or the world) and along its axes,
linear part first. Seen from R an axis is carried by the joints between it and R, and by displacements of the bases and
tools between them: :math:`d\xi_l = [w_l, \xi_l]`, the Lie bracket with the twist :math:`w_l` of the link that carries
it. Followers of a joint are axes of their own here.
"""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.kernel.job import Job, Layouts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Directions:
    """Directions in the space of layouts, in which derivatives are taken; p of them."""

    base: Array  # displacement of each base per unit: of its origin in [m], about it in [rad], in W, (robots, 6, p)
    tool: Array  # likewise of each tool tip, along the axes of the flange, shape (robots, 6, p)
    start: Array  # change of the start posture, shape (nq, p); joints that bring the tools to their paths follow
    weights: Array  # change of the joint weights, shape (nq, p)
    drift: Array | None = None  # of the velocities that are added in the null space, shape (N, nq, p); None for none

    @property
    def count(self) -> int:
        """Number of directions."""
        return self.base.shape[2]

    @classmethod
    def none(cls, job: Job, count: int) -> "Directions":
        """That many directions, all zero, to be filled in."""
        robots, nq = len(job.cell.robots), job.cell.joint_count
        base, tool = np.zeros((robots, 6, count)), np.zeros((robots, 6, count))
        return cls(base=base, tool=tool, start=np.zeros((nq, count)), weights=np.zeros((nq, count)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskScrews:
    """Screws and twists at N nodes of one motion, for T relations and p directions."""

    operators: Array  # axes of each relation's own robot, shape (N, T, levels, 6)
    shared: Array  # axes of the positioner in the part frame, shape (N, levels, 6); zero without one
    tip: Array  # tool tips in R in [m], shape (N, T, 3)
    based: Array  # what each direction gives the base of the own robot, seen from R, shape (N, T, p, 6)
    tooled: Array  # what it gives the own tool, seen from its flange, shape (N, T, p, 6)
    held: Array  # what it gives the part, seen from the positioner's flange, shape (N, p, 6)

    @classmethod
    def of(cls, job: Job, layout: Layouts, q: Array, directions: Directions) -> "TaskScrews":
        """Those of one layout at configurations in [rad] or [m], shape (N, nq)."""
        chains, constraints = job.tasks.chains, job.constraints
        state = chains.state(np.ascontiguousarray(q.T), layout.placement(job))
        axes, points, tips = (np.ascontiguousarray(part.T) for part in (state.axes, state.points, state.p_WT))
        R_WT = np.ascontiguousarray(np.swapaxes(state.R_WT.T, -1, -2))
        R_WP, p_WP = _part_poses(job, R_WT, tips)
        on_part = constraints.is_on_part[:, None]
        operators = constraints.operators
        turning = chains.is_turning.T[:, :, None]
        R = np.where(on_part[:, :, None], R_WP[:, None], np.eye(3))
        p = np.where(on_part, p_WP[:, None], np.zeros(3))
        bases, tools = np.swapaxes(directions.base, 1, 2), np.swapaxes(directions.tool, 1, 2)
        R_FW = layout.X_FT[0, :, :3, :3] @ np.swapaxes(R_WT, -1, -2)
        shared, held = np.zeros((*axes[:, 0].shape[:2], 6)), np.zeros((len(q), directions.count, 6))
        based, tooled = np.zeros((2, len(q), len(operators), directions.count, 6))
        if directions.count:
            based += bases[operators] @ _adjoint(R, p - layout.X_WB[0, operators, :3, 3])
            tooled += tools[operators] @ _adjoint(R, p - tips[:, operators], R_FW[:, operators])
        if (holder := constraints.carrier) is not None:
            shared = unit_screws(axes[:, holder], points[:, holder], turning[holder], R_WP, p_WP)
            held += tools[holder] @ _adjoint(R_WP, p_WP - tips[:, holder], R_FW[:, holder])
            moved = bases[holder] @ _adjoint(R_WP, p_WP - layout.X_WB[0, holder, :3, 3]) + held
            based[:, constraints.carrier_signs < 0.0] -= moved[:, None]
        return cls(
            operators=unit_screws(axes[:, operators], points[:, operators], turning[operators], R, p),
            shared=shared,
            tip=((tips[:, operators] - p)[..., None, :] @ R)[..., 0, :],
            based=based,
            tooled=tooled,
            held=held,
        )


def bracket(x: Array, y: Array) -> Array:
    """Lie brackets ``[x, y]`` of twists, linear part first, along the last axis."""
    v, w, a, b = x[..., :3], x[..., 3:], y[..., :3], y[..., 3:]
    return np.concatenate([cross(w, a) + cross(v, b), cross(w, b)], axis=-1)


def bracket_matrix(y: Array) -> Array:
    """Matrices ``B`` with ``x B = [x, y]`` for any twist x, a row, of twists y of shape (..., 6)."""
    matrix = np.zeros((*y.shape, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = cross_matrix(y[..., 3:])
    matrix[..., 3:, :3] = cross_matrix(y[..., :3])
    return matrix


def power_matrix(y: Array) -> Array:
    """Matrices ``B`` with ``(x B) . z = y . [z, x]`` for twists x and z, of wrenches y, force first, shape (..., 6)."""
    matrix = np.zeros((*y.shape, 6))
    matrix[..., :3, 3:] = matrix[..., 3:, :3] = cross_matrix(y[..., :3])
    matrix[..., 3:, 3:] = cross_matrix(y[..., 3:])
    return matrix


def cross_matrix(b: Array) -> Array:
    """Matrices ``S`` with ``a S = a x b`` for any row a, of vectors of shape (..., 3)."""
    matrix = np.zeros((*b.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[..., i, j], matrix[..., j, i] = -b[..., k], b[..., k]
    return matrix


def cross(a: Array, b: Array) -> Array:
    """Cross products along the last axis."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return product


def _part_poses(job: Job, R_WT: Array, tips: Array) -> tuple[Array, Array]:
    """Poses of the part frame in W at the nodes, shape (N, 3, 3) and (N, 3)."""
    holder, X_CP = job.constraints.carrier, job.cell.part.X_CP
    if holder is None:
        return np.tile(X_CP[:3, :3], (len(tips), 1, 1)), np.tile(X_CP[:3, 3], (len(tips), 1))
    return R_WT[:, holder] @ X_CP[:3, :3], tips[:, holder] + R_WT[:, holder] @ X_CP[:3, 3]


def unit_screws(axes: Array, points: Array, turning: Array, R: Array, p: Array) -> Array:
    """Unit screws of axes, directions and points in W of shape (..., levels, 3), seen from frames R at p."""
    linear = np.where(turning, cross(axes, p[..., None, :] - points), axes)
    return np.concatenate([linear @ R, (turning * axes) @ R], axis=-1)


def _adjoint(R: Array, arm: Array, R_FW: Array | None = None) -> Array:
    """Matrices that take twists, rows along the axes of F (or W), to the frames R ``arm`` away, shape (..., 6, 6)."""
    matrix = np.zeros((*R.shape[:-2], 6, 6))
    turned, lever = R, cross_matrix(arm) @ R
    if R_FW is not None:
        turned, lever = R_FW @ R, R_FW @ lever
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = turned
    matrix[..., 3:, :3] = lever
    return matrix
