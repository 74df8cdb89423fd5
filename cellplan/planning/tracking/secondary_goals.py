r"""Secondary goals: the joint velocities that would serve them best, before the tasks are given their due.

A goal is a function ``w(q)`` that is to grow ([Ribeiro2010]_ Eq. D.44). Its pull is ``qdot_0 = k_0 W^{-1} grad w`` with
the joint weights W, and of it the tasks leave ``(I - J# J) qdot_0`` with ``J# = W^-1 J^T (J W^-1 J^T)^-1`` (Eq. D.43).
What is left moves no tool, and makes w grow or leaves it as it is: with ``A = J W^-1/2``, ``g = grad w`` and
``b = W^-1/2 g``

.. math:: g \cdot \dot q = k_0 \, b^T (I - A^T (A A^T)^{-1} A) \, b = k_0 \, |(I - A^+ A) \, b|^2 \ge 0

because ``I - A+ A`` is an orthogonal projection. This holds for ``W^-1 grad w``, not for ``grad w`` itself.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.motion.motion import Schedule
from cellplan.model.robot.robot import configuration_in_si
from cellplan.model.settings.solver import (
    ConfigurationGoalEntry,
    GoalEntry,
    JointLimitsGoalEntry,
    ManipulabilityGoalEntry,
    ObstacleGoalEntry,
)
from cellplan.model.task.task import Frame
from cellplan.planning.timing.schedule import common_cycles
from cellplan.planning.tracking.obstacle_distances import ClosestPairs
from cellplan.planning.tracking.weighted_inverse import ROUNDING
from cellplan.scene.kinematics.pinocchio_model import CellState, CombinedModel
from cellplan.scene.scene import Scene

SPEED_SHARE: Final = 0.9  # [-] of a joint's speed limit that goals may use up: the rest is room for the feedback
BRAKING: Final = 0.2  # [s] a goal takes no joint nearer to its position limit than its speed times this
FADE: Final = 0.2  # [s] in which the goals set in at the start of a motion, and leave off before its end
FADE_SHARE: Final = 0.25  # [-] of the whole motion that this may take at most


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stance:
    """The cell at one sample and configuration, or at several, as goals evaluate it.

    Of several, all arrays but ``signs`` have them as first axis.
    """

    q: Array  # stacked joint vector, shape (nq,), in [rad] or [m]
    state: CellState  # kinematics there
    screws_W: Callable[[], Array]  # gives the screws of all axes as ``LinkState`` has them, shape (6, axes)
    J: Array  # task rows, shape (m, nq)
    picks: Sequence[Array]  # rows that pick what each task constrains, shape (m_i, 6) each
    signs: Array  # sign of each joint in each task, 0 for joints that may not move, shape (tasks, nq)
    mobility: Array  # diagonal of ``W^-1``, 0 for joints that take no part in any task now, shape (nq,)


@dataclass(frozen=True, slots=True, eq=False)
class Slope:
    """A goal to second order, at one configuration or at several, which are the first axis then."""

    gradient: Array  # gradient of w, shape (nq,)
    curvature: Array  # about the largest curvature of ``-w``, in the metric of W, shape ()


Pull = Callable[[Stance], Slope]


class SecondaryGoals:
    """All secondary goals of a cell along one motion."""

    def __init__(
        self, cell: Cell, model: CombinedModel, *, tasks: Sequence[Relation], start: Array, rests: Array
    ) -> None:
        """Make ready what each goal needs.

        Args:
            start: Stacked configuration at the first time, shape (nq,).
            rests: Times in [s] at which the goals ask for nothing: the ends of the motion and of cycles to close.
        """
        goals = cell.solver.secondary.goals.values()
        self._pulls = [(goal.gain, _pull(goal, cell, model, tasks=tasks, start=start)) for goal in goals]
        limits = cell.joint_limits
        self._lower, self._upper, self._limits = limits.lower, limits.upper, SPEED_SHARE * limits.velocity
        self._rests = rests
        self._length = min(FADE, FADE_SHARE * float(np.diff(rests).max()))

    @property
    def breaks(self) -> Array:
        """Times in [s] at which the goals set in, are in full, begin to leave off and have left off."""
        return np.concatenate([self._rests - self._length, self._rests, self._rests + self._length])

    def velocities(self, t: Array, stance: Stance, *, step: float) -> Array:
        r"""Joint velocities that the goals ask for at times in [s], shape of ``stance.q``, in [rad/s] or [m/s].

        The gain of each goal is taken as in an implicit step of length ``h``, with the curvature ``c`` of ``-w``,

        .. math:: \dot q_0 = \frac{k_0}{1 + k_0 h c} W^{-1} \nabla w

        which is ``k_0`` for all gains that make sense, and does not overshoot for those that do not. No goal asks for
        more than a joint can do: its speeds are scaled together, so their direction stays. The goals set in and leave
        off smoothly, so that the cell starts and ends at rest.

        Args:
            t: Time in [s] of each configuration, shape ().
            step: Length ``h`` in [s]; 0 where no step is taken.
        """
        total = np.zeros_like(stance.q)
        for gain, pull in self._pulls:
            slope = pull(stance)
            implicit = gain / (1.0 + gain * step * slope.curvature)
            velocities = implicit[..., None] * slope.gradient * stance.mobility
            total += (
                velocities / np.maximum(1.0, np.max(np.abs(velocities) / self._limits, axis=-1, initial=0.0))[..., None]
            )
        return self._fade(t)[..., None] * total

    def _fade(self, t: Array) -> Array:
        """Share of the goals at times in [s]: 0 at every rest, 1 away from them, smooth in between."""
        away = np.min(np.abs(np.asarray(t)[..., None] - self._rests), axis=-1)
        x = np.clip(away / max(self._length, np.finfo(float).tiny), 0.0, 1.0)
        return x * x * (3.0 - 2.0 * x)

    def bounds(self, q: Array) -> tuple[Array, Array]:
        """Lowest and highest joint velocities that a goal may lead to at a configuration, shape (nq,) each."""
        return (
            np.maximum(-self._limits, (self._lower - q) / BRAKING),
            np.minimum(self._limits, (self._upper - q) / BRAKING),
        )


def rests_of(cell: Cell, schedule: Schedule) -> Array:
    """Times in [s] at which goals ask for nothing: the ends of the motion, and of each cycle that is to close."""
    bounds = common_cycles(schedule) if cell.motion.cyclic else None
    ends = schedule.times[[0, -1]]
    return ends if bounds is None else np.unique(np.concatenate([ends, bounds]))


def share_within(velocities: Array, extra: Array, *, lowest: Array, highest: Array) -> Array:
    """Largest share of extra joint velocities, at most 1, that takes no joint beyond its bounds.

    A joint that is beyond them already, on behalf of the tasks, is not taken farther.

    Args:
        velocities: Joint velocities that the tasks need, shape (..., nq).
        extra: Joint velocities to add, shape (..., nq).
        lowest: Lowest allowed speeds, shape (..., nq).
        highest: Highest allowed speeds, shape (..., nq).

    Returns:
        Shape (...).
    """
    moves = extra != 0.0
    margin = np.where(extra > 0.0, highest - velocities, lowest - velocities) / np.where(moves, extra, 1.0)
    return np.clip(np.min(np.where(moves, margin, 1.0), axis=-1, initial=1.0), 0.0, 1.0)


def _pull(goal: GoalEntry, cell: Cell, model: CombinedModel, *, tasks: Sequence[Relation], start: Array) -> Pull:
    """The function that gives the slope of one goal."""
    match goal:
        case ManipulabilityGoalEntry():
            return _manipulability(cell, model, tasks)
        case JointLimitsGoalEntry():
            return _joint_limits(cell)
        case ObstacleGoalEntry():
            return _obstacles(cell, goal.within_mm.si)
        case ConfigurationGoalEntry():
            return _configuration(cell, goal.at, start=start)


def _manipulability(cell: Cell, model: CombinedModel, tasks: Sequence[Relation]) -> Pull:
    """``w = log sqrt(det(J J^T))`` of all task rows together ([Ribeiro2010]_ Eq. D.45).

    The logarithm makes a sum over the robots of the product: the pull on a robot depends neither on how many others
    there are nor on the units of the rows. Its direction is that of the gradient of D.45. The curvature is that of
    ``log sin q``, to which the manipulability of an elbow or a wrist is proportional, one for each task.
    """
    operators = [cell.index(task.robot) for task in tasks]
    on_part = np.array([float(task.relative_to is Frame.PART) for task in tasks])
    gradients = ManipulabilityGradient(model, operators, cell.carrier, on_part=on_part)

    def pull(stance: Stance) -> Slope:
        gradient = gradients.at(stance.screws_W(), stance.state, J=stance.J, picks=stance.picks, signs=stance.signs)
        most = len(stance.signs) * np.max(stance.mobility, axis=-1, initial=0.0)
        return Slope(gradient, np.sum(stance.mobility * gradient**2, axis=-1) + most)

    return pull


def _joint_limits(cell: Cell) -> Pull:
    """``w = -1/(2n) sum ((q - middle) / range)^2`` over the n joints of a robot that have limits, robots added up.

    [Ribeiro2010]_ Eq. D.46, which is written for one robot. Joints that may turn without end take no part.
    """
    stiffness, middles = [], []
    for robot in cell.robots:
        lower, upper = robot.model.lower, robot.model.upper
        is_limited = np.isfinite(lower) & np.isfinite(upper)
        lower, upper = np.where(is_limited, lower, -np.inf), np.where(is_limited, upper, np.inf)
        stiffness.append(1.0 / (max(1, int(is_limited.sum())) * (upper - lower) ** 2))
        middles.append(0.5 * (np.where(is_limited, lower, 0.0) + np.where(is_limited, upper, 0.0)))
    return _springs(np.concatenate(stiffness), np.concatenate(middles))


def _configuration(cell: Cell, desired: Mapping[str, Mapping[str, float]], *, start: Array) -> Pull:
    """``w = -1/2 |q - q_desired|^2``; robots without a desired configuration are drawn back to where they start."""
    middle = start.copy()
    for robot, given in desired.items():
        middle[cell.columns(robot)] = configuration_in_si(cell.robot(robot).model, given)
    return _springs(np.ones(len(middle)), middle)


def _springs(stiffness: Array, middle: Array) -> Pull:
    """``w = -1/2 sum c_i (q_i - m_i)^2``."""

    def pull(stance: Stance) -> Slope:
        curvature = np.max(stiffness * stance.mobility, axis=-1, initial=0.0)
        return Slope(-stiffness * (stance.q - middle), curvature)

    return pull


def _obstacles(cell: Cell, within: float) -> Pull:
    """``w = -1/2 sum ((within - d) / within)^2`` over all distances d below ``within`` ([Ribeiro2010]_ Eq. D.47).

    The equation takes one distance, the smallest, whose pull jumps when another pair becomes the nearest. Here every
    pair pulls, from nothing at ``within`` on the stronger the nearer.
    """
    closest = _closest_pairs(cell)

    def pull(stance: Stance) -> Slope:
        q = stance.q.reshape(-1, stance.q.shape[-1])
        near = closest.near(q, within=within)
        pulls, squares = np.zeros_like(q), np.zeros_like(q)
        np.add.at(pulls, near.samples, (within - near.distances)[:, None] * near.by_joints)
        np.add.at(squares, near.samples, near.by_joints**2)
        curvature = np.sum(squares.reshape(stance.q.shape) * stance.mobility, axis=-1)
        return Slope(pulls.reshape(stance.q.shape) / within**2, curvature / within**2)

    return pull


@lru_cache(maxsize=1)
def _closest_pairs(cell: Cell) -> ClosestPairs:
    """Distances within a cell; built once for the many motions of a search."""
    return ClosestPairs(Scene.from_cell(cell))


class ManipulabilityGradient:
    """Gradient of the logarithm of the manipulability over the joints of one cell."""

    def __init__(
        self, model: CombinedModel, operators: Sequence[int], holder: int | None, *, on_part: Array | None = None
    ) -> None:
        """Note who carries what.

        Args:
            operators: Index of each task's robot.
            holder: Index of the robot that carries the part; None when it is fixed.
            on_part: 1 where a task's rows stand in the frame of the part, 0 where in the world, shape (tasks,); all 1
                when None.
        """
        self._model, self._operators = model, list(operators)
        carries = model.carries_flange.astype(float)
        self._moves_tool = carries[self._operators]
        self._on_part = np.ones(len(self._operators)) if on_part is None else on_part
        self._moves_part = np.zeros(carries.shape[1]) if holder is None else carries[holder]

    def at(self, screws_W: Array, state: CellState, *, J: Array, picks: Sequence[Array], signs: Array) -> Array:
        r"""Gradient of ``log w`` with ``w = sqrt(det(J J^T))`` ([Ribeiro2010]_ Eq. D.45), shape (..., nq), in [1/rad].

        .. math:: \partial \log w / \partial q_m = \mathrm{tr}(J^\# \, \partial J / \partial q_m)

        ``dJ`` has three parts: the screws move with the joints before them, by their Lie brackets; the tool tips move;
        the part, in whose frame the rows stand, turns. Where a row is lost, or there are more rows than joints, w is
        zero and has no gradient: the result is zero.

        Args:
            screws_W: Of all axes as ``LinkState`` has them, shape (..., 6, axes); the axes before are the batch.
            state: Kinematics there, each array with the same axes before.
            J: Task rows, shape (..., m, nq).
            picks: Rows that pick what each task constrains, shape (..., m_i, 6) each.
            signs: Sign of each joint in each task, 0 for joints that may not move, shape (tasks, nq).
        """
        s_squared, U = np.linalg.eigh(J @ np.swapaxes(J, -1, -2))
        is_regular = s_squared[..., 0] > ROUNDING * s_squared[..., -1]
        s_squared = np.where(is_regular[..., None], s_squared, 1.0)
        G = U @ ((np.swapaxes(U, -1, -2) @ J) / s_squared[..., None])  # derivative of log w by the entries of J
        parts = np.split(G, np.cumsum([pick.shape[-2] for pick in picks])[:-1], axis=-2)
        blocks = np.stack([np.swapaxes(pick, -1, -2) @ rows for pick, rows in zip(picks, parts, strict=True)], axis=-3)
        R = np.where(self._on_part[:, None, None] > 0.0, state.X_WP[..., None, :3, :3], np.eye(3))
        p = state.X_WT[..., self._operators, :, :][..., :3, 3, None]
        force, torque = R @ blocks[..., :3, :], R @ blocks[..., 3:, :]  # in W, at the tool tips, (..., tasks, 3, nq)
        linear, angular = state.screws_W[..., None, :3, :], state.screws_W[..., None, 3:, :]
        omega = angular * signs[:, None]
        at_tip = linear * signs[:, None] + np.cross(omega, p, axis=-2)
        turned = (np.cross(at_tip, force, axis=-2) + np.cross(omega, torque, axis=-2)).sum(axis=-1)
        turning = self._on_part @ turned
        shifting = np.cross(force, omega, axis=-2).sum(axis=-1)  # by the motion of each tool tip
        tips = linear + np.cross(angular, p, axis=-2)
        on_screws = np.concatenate([force, torque + np.cross(p, force, axis=-2)], axis=-2) * signs[:, None]
        by_tips = np.sum((shifting[..., None, :] @ tips)[..., 0, :] * self._moves_tool, axis=-2)
        by_part = self._moves_part * (turning[..., None, :] @ angular[..., 0, :, :])[..., 0, :]
        gradient = self._by_screws(screws_W, on_screws.sum(axis=-3)) + by_tips - by_part
        return np.where(is_regular[..., None], gradient, 0.0)

    def _by_screws(self, screws_W: Array, g: Array) -> Array:
        r"""What the motion of the screws adds: gradient of ``sum_j g_j . $_j`` for fixed ``g``, shape (..., nq).

        .. math:: \partial \$_a / \partial q_b = [\$_b, \$_a] = (\omega_b \times l_a + l_b \times \omega_a,
                  \; \omega_b \times \omega_a)

        for every axis b that carries the axis a.
        """
        linear, angular = screws_W[..., :3, :], screws_W[..., 3:, :]
        force, torque = np.split(self._model.to_flange(g), 2, axis=-2)
        by_turn = np.cross(linear, force, axis=-2) + np.cross(angular, torque, axis=-2)
        by_shift = np.cross(angular, force, axis=-2)
        carried = self._model.carries_link  # an axis carries itself too: its bracket with itself is zero
        change = np.sum(angular * (by_turn @ carried) + linear * (by_shift @ carried), axis=-2)
        return self._model.along_joints(change)
