"""Search cost: how far all tools are from where they are to be, and what each joint can do about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, rotation_about, skew
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.planning.tracking.problem import TrackingProblem

PARALLEL: Final = 1e-9  # sine of the angle below which two axes count as parallel: rounding of axis tables
NO_EFFECT: Final = 1e-24  # share of the largest k0 below which a joint does not move any tool: rounding, squared
COMPONENTS: Final = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, slots=True, eq=False)
class Expansion:
    r"""The cost at one configuration, and the circle on which each joint moves the tools seen from the part.

    The cost ``h = e^T e`` is a sum of squared distances: of each tool tip from its desired place, and of each
    constrained axis of the tool from its desired direction, the latter times ``gamma`` ([Nicolato2007]_ Eq. 3.1, as
    ``tr((R_d - R)^T (R_d - R))`` is the sum over the columns of R). With joint i alone at ``q_i + theta`` it is

    .. math:: h_i = |e - \sin\theta \, a_i - (1 - \cos\theta) \, n_i|^2
    """

    q: Array  # stacked joint vector, shape (nq,)
    e: Array  # reference minus actual, all entries, shape (m,)
    a: Array  # first derivative of the actual by each joint, shape (m, nq)
    # whether a joint moves the tools on circles; False also for one that drives others through a linkage, whose way has
    # no simple form, shape (nq,)
    turns: NDArray[np.bool_]
    # what the second derivative is made of: about which axis and by how much each joint turns each point or direction,
    # and its first derivative without weights, shape (m / 3, 3, nq) each; the weights, shape (m, 1)
    bends: tuple[Array, Array, Array]

    @property
    def n(self) -> Array:
        """Second derivative of the actual by each joint, shape (m, nq); zero for those that turn on no circle."""
        axes, derivatives, weights = self.bends
        return weights * (_cross(axes, derivatives) * self.turns).reshape(self.a.shape)

    @property
    def cost(self) -> float:
        """The cost h in [m^2]."""
        return float(self.e @ self.e)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Geometry:
    """What of an expansion does not depend on the goal: a step of a search begins where the one before it ended."""

    q: Array  # stacked joint vector, shape (nq,)
    signs: Array  # signs of the joints in the tasks
    x: Array  # points and directions that count, in the frames of their tasks, shape (m / 3, 3)
    a: Array  # see ``Expansion``
    bends: tuple[Array, Array, Array]  # likewise


class SearchCost:
    r"""The sum over all tasks of the squared errors of tool places and tool directions, seen from the part.

    **One joint.** Seen from the part, a turn of joint i by ``theta`` turns a tool by ``sigma theta`` about the joint's
    axis ``s`` through ``s0``, both expressed in P: ``sigma`` is +1 where the joint moves the tool, -1 where it moves
    the part (the tool then turns the other way about the same axis) and 0 elsewhere. By Rodrigues' formula a point x of
    the tool goes to

    .. math:: x(\theta) = x + \sin\theta \, a + (1 - \cos\theta) \, n, \quad
              a = \sigma \, s \times (x - s_0), \quad n = \sigma \, s \times a

    and a direction of the tool likewise without ``s0``; a slide by ``theta`` takes a point to ``x + sigma theta s`` and
    leaves directions alone. The sum of ``|d - x(theta)|^2`` over points and directions is
    ``k0 + k1 sin(theta) + k2 cos(theta)`` (Eq. 3.13) or a parabola (Eq. 3.21); see `joint_lines`.

    **What counts.** Places: the axes of P that the task constrains. Directions: all three of the tool when all three
    rotations are constrained; the tool's z axis when its spin is free; none when no rotation is constrained. Of any
    other set of rotations only a single one is taken, about an axis that all movable joints of the task are parallel
    to, as in a planar cell: then the joints cannot touch the other two, and what the desired turn about that axis makes
    of the present directions is what is aimed at.
    """

    def __init__(self, problem: TrackingProblem) -> None:
        """List the points and directions that count; the joints are checked when the first configuration is known."""
        self._problem = problem
        self._signs = problem.signs
        self._turns = turning_joints(problem.cell)
        self._kinds = [_kind(task) for task in problem.tasks]
        self._is_examined = False
        self._here: _Geometry | None = None
        gamma = problem.cell.solver.search.orientation_weight_m2
        owners: list[int] = []
        columns: list[int] = []  # column of the tool's pose: 3 is the tip, 0 to 2 its axes
        weights: list[list[float]] = []
        for index, (task, kind) in enumerate(zip(problem.tasks, self._kinds, strict=True)):
            of_kind = {"none": (), "axis": (2,)}.get(kind, (0, 1, 2))
            owners += [index] * (1 + len(of_kind))
            columns += [3, *of_kind]
            weights.append([float(axis in task.axes) for axis in range(3)])
            weights += [[float(np.sqrt(gamma))] * 3 for _ in of_kind]
        self._owners, self._columns = np.array(owners), np.array(columns)
        self._weights = np.array(weights)
        self._is_tip = (self._columns == 3).astype(float)[:, None, None]

    def aim(self, k: int, q: Array) -> None:
        """Take the desired poses at sample k as the goal, and the joints that may move on the way there from q."""
        problem = self._problem
        signs = problem.signs * problem.mobile(k - 1)
        if not np.array_equal(signs, self._signs):
            self._signs = signs
        desired = problem.desired[k]
        if "turn" in self._kinds:
            self._require_parallel_axes(q)
            desired = self._with_reachable_turns(desired, q)
        self._goal = desired[self._owners, :3, self._columns]

    def expand(self, q: Array) -> Expansion:
        """The cost at a configuration, and what each joint does to it."""
        here = self._here
        if here is None or here.signs is not self._signs or not np.array_equal(q, here.q):
            here = self._here = self._geometry(q.copy())
        e = (self._weights * (self._goal - here.x)).ravel()
        return Expansion(q=here.q, e=e, a=here.a, turns=self._turns, bends=here.bends)

    def _geometry(self, q: Array) -> "_Geometry":
        """All points and directions at a configuration, and how the joints move them."""
        state = self._problem.state(q)
        X_WR = self._problem.constraints.reference_frames(state.X_WP)
        R, p = np.swapaxes(X_WR[:, :3, :3], 1, 2), X_WR[:, :3, 3]
        w = R @ state.screws_W[3:]
        v = R @ (state.screws_W[:3] - skew(p) @ state.screws_W[3:])  # of the point at the origin of P
        poses = R @ state.X_WT[self._problem.constraints.operators][:, :3, :]
        poses[:, :, 3] -= (R @ p[:, :, None])[:, :, 0]
        x = poses[self._owners, :, self._columns]
        turns = self._signs[self._owners][:, None, :] * w[self._owners]
        derivatives = self._signs[self._owners][:, None, :] * (self._is_tip * v[self._owners]) - skew(x) @ turns
        scale = self._weights.reshape(-1, 1)
        a = scale * derivatives.reshape(x.size, -1)
        return _Geometry(q=q, signs=self._signs, x=x, a=a, bends=(turns, derivatives, scale))

    def _require_parallel_axes(self, q: Array) -> None:
        """Refuse once and for all what a search cannot take apart."""
        if self._is_examined:
            return
        self._is_examined = True
        state = self._problem.state(q)
        X_WR = self._problem.constraints.reference_frames(state.X_WP)
        for task, kind, signs, frame in zip(self._problem.tasks, self._kinds, self._signs, X_WR, strict=True):
            if kind == "turn":
                axes_P = frame[:3, :3].T @ state.screws_W[3:]
                turning = axes_P[:, (signs != 0.0) & (np.abs(axes_P).max(axis=0) > PARALLEL)]
                rotations = [axis - 3 for axis in task.axes if axis >= 3]
                others = np.delete(turning, rotations, axis=0)
                if turning.size and (len(rotations) != 1 or np.abs(others).max() > PARALLEL):
                    raise InputError(_refusal(self._problem.cell, task))

    def _with_reachable_turns(self, desired: Array, q: Array) -> Array:
        r"""Reference poses whose tilt is the present one where a task asks for a turn about one axis u only.

        The turn left to do is the twist of ``E = R_d R^T`` about u: ``psi = atan2(u . vee(E), tr E - u^T E u)``.
        """
        desired = desired.copy()
        state = self._problem.state(q)
        X_WR = self._problem.constraints.reference_frames(state.X_WP)
        for index, (task, kind) in enumerate(zip(self._problem.tasks, self._kinds, strict=True)):
            if kind == "turn":
                rotations = [axis - 3 for axis in task.axes if axis >= 3]
                R = X_WR[index, :3, :3].T @ state.X_WT[self._problem.constraints.operators[index], :3, :3]
                desired[index, :3, :3] = _twist(desired[index, :3, :3] @ R.T, rotations) @ R
        return desired


def turning_joints(cell: Cell) -> NDArray[np.bool_]:
    """Whether a joint turns and drives no other joint on the way to its robot's flange, shape (nq,)."""
    turning = cell.joint_limits.is_revolute.copy()
    for robot in cell.robots:
        turning[cell.columns(robot.name).start + np.array(_leaders(robot), dtype=int)] = False
    return turning


def _leaders(robot: Robot) -> list[int]:
    """Joints of a robot that drive others between base and flange."""
    model = robot.model
    return [model.drive(link).joint for link in model.links_to_flange if link >= len(model.joints)]


def _kind(task: Relation) -> str:
    """Which directions of the tool count: all, its axis, those about one axis, or none."""
    if task.is_spin_free:
        return "axis"
    return {0: "none", 3: "all"}.get(sum(axis >= 3 for axis in task.axes), "turn")


def _twist(E: Array, rotations: Sequence[int]) -> Array:
    """The share of a rotation that turns about one axis of P; none when no single one is asked for."""
    if len(rotations) != 1:
        return np.eye(3)
    u = rotations[0]
    i, j = (u + 1) % 3, (u + 2) % 3
    angle = np.arctan2(E[j, i] - E[i, j], E[i, i] + E[j, j])
    return rotation_about(np.eye(3)[u], angle)


def _cross(u: Array, v: Array) -> Array:
    """Cross products along the second axis, shape (m, 3, n)."""
    w = np.empty_like(v)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        w[:, i] = u[:, j] * v[:, k] - u[:, k] * v[:, j]
    return w


def _refusal(cell: Cell, task: Relation) -> str:
    """Why a task's set of rotations cannot be searched for, and what could."""
    components = ", ".join(COMPONENTS[axis] for axis in task.axes)
    where = cell.origin.at("part.held_by") if isinstance(task, Grasp) else task.where("axes")
    return (
        f"{where}: method '{cell.solver.method}' expected all of rx, ry, rz, none "
        "of them, free: [spin], or the one about which all joints turn (planar cells), "
        f"got {components}; another method can take it"
    )
