"""Tracking problem: reference poses and twists of all tasks, linearised at any sample and configuration."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from cellplan.errors import DivergedError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Grasp, Relation
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian, pose_errors
from cellplan.planning.tracking.given_path import GivenRows, GivenVelocities
from cellplan.planning.tracking.joint_weights import JointWeights
from cellplan.planning.tracking.motion_task import MotionTask, locked_since
from cellplan.planning.tracking.secondary_goals import SecondaryGoals, Stance, rests_of, share_within
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows, tilt_rows
from cellplan.scene.kinematics.pinocchio_model import CellState, CombinedModel

Drift = Callable[[int, Array], Array]

LOST_DISTANCE: Final = 0.5  # [m] a tool this far from its path has left it: the configuration means nothing any more


@dataclass(frozen=True, slots=True, eq=False)
class FirstOrder:
    """All tasks at one sample and configuration, to first order; only the components that they constrain."""

    J: Array  # rows of the cooperation Jacobian, shape (m, nq); zero columns for joints that may not move
    twist: Array  # reference tool twists relative to the part, shape (m,)
    error: Array  # pose errors, desired minus actual, shape (m,)
    weights: Array  # joint weights, the diagonal of W, shape (nq,)
    secondary: Array | None  # joint velocities that the secondary goals ask for, shape (nq,); None when there are none
    bounds: tuple[Array, Array] | None = None  # lowest and highest speeds of goals, shape (nq,) each; None without any

    def bounded(self, null_space_projection: Array, *, velocities: Array) -> Array:
        """Share of null-space velocities that may be added to the velocities that the tasks need, shape (nq,).

        They are scaled together, so they still move no tool.

        Args:
            null_space_projection: What the tasks leave of the secondary goals, shape (nq,).
            velocities: Joint velocities that the tasks need, shape (nq,).
        """
        if self.bounds is None:
            return null_space_projection
        lowest, highest = self.bounds
        return share_within(velocities, null_space_projection, lowest=lowest, highest=highest) * null_space_projection


@dataclass(frozen=True, slots=True, eq=False)
class StepResult:
    """One step of a resolution method."""

    q: Array  # stacked joint vector at the next sample, shape (nq,)
    iterations: int = 1  # number of evaluations of the tasks
    slack: float = 0.0  # norm of the twist that was given up (task slack), in mixed units of m/s and rad/s


class TrackingProblem:
    """All tasks of one run on the common clock, and the joints that may move for them.

    Attributes:
        times: Samples of the clock in [s], shape (N,).
        tasks: The tasks, then the grasps of further holders, one block row each.
        constraints: What they constrain, in which frames and by which joints.
        desired: Reference tool poses X_PT, shape (N, tasks, 4, 4); those of a feedback where there is one.
        twists: Reference tool twists in P, linear first, shape (N, tasks, 6).
        signs: +1 where a joint moves a task's tool, -1 where it moves the part, 0 elsewhere, shape (tasks, nq).
        tilt_rows: Rows of tool axes that may lean, among those of all tasks.
        gain: Error feedback gain in [1/s].
        damping: Largest damping factor; None leaves it to the method.
        given: Joints whose motion the cell gives, at the samples.
        drift: Joint velocities that are added at sample k and configuration q besides the tasks, shape (nq,): what
            closes a cycle, or what the cell states.
    """

    def __init__(self, motion: MotionTask, drift: Drift | None = None, references: Array | None = None) -> None:
        """Gather what stays the same from step to step.

        Args:
            drift: Joint velocities in the null space of the tasks that close a cycle; None for none.
            references: Poses that replace the desired ones, shape (N, tasks, 4, 4): a feedback corrects those of each
                step before it; None to use the desired ones.
        """
        cell, schedule = motion.cell, motion.schedule
        tasks, (desired, self.twists) = motion.relations, motion.references()
        self._model = CombinedModel(cell)
        self._rows = [constraint_rows(task, X_RT) for task, X_RT in zip(tasks, desired.swapaxes(0, 1), strict=True)]
        self.constraints = TaskConstraints.of(cell, tasks, motion.moving)
        self.desired = desired if references is None else references
        self.tilt_rows = tilt_rows(tasks)
        self._is_on_part = bool(self.constraints.is_on_part.all())
        self._lost = np.array([max(LOST_DISTANCE, 2.0 * _tolerance(cell, task)) for task in tasks])
        self._settled = np.array([_settled_from(task) for task in tasks])
        self._weights = JointWeights(cell, self._model)
        self.cell, self.times, self.tasks = cell, schedule.times, tasks
        self.given = GivenRows.of(cell, schedule, motion.moving)
        every = self.constraints.column_signs(self._model.carries_flange)
        self.signs = every * (1.0 - self.constraints.follows_path)
        self._given_signs = every * self.constraints.follows_path
        self.gain = cell.solver.gain
        self.damping = None if cell.solver.damping == "auto" else cell.solver.damping
        self.motion, self.drift = motion, drift or _stated_drift(motion)
        self._last: tuple[Array, CellState] | None = None
        goals = partial(SecondaryGoals, cell, self._model, tasks=self.tasks, start=motion.start)
        self._goals = goals(rests=rests_of(cell, schedule)) if cell.solver.secondary.goals else None
        self._goal_step = float(self.times[1] - self.times[0]) if len(self.times) > 1 else cell.motion.step
        self._locked_since = locked_since(cell)

    def step(self, k: int) -> float:
        """Time from sample k to the next in [s]."""
        return float(self.times[k + 1] - self.times[k])

    def state(self, q: Array) -> CellState:
        """Kinematics of the whole cell at a stacked joint vector, shape (nq,); not to be changed."""
        if self._last is None or not np.array_equal(q, self._last[0]):  # a search ends where its next step begins
            self._last = q.copy(), self._model.state(q)
        return self._last[1]

    def mobile(self, k: int) -> Array:
        """1 for joints that may move for the tasks at sample k, 0 for all others, shape (nq,)."""
        free = self.constraints.may_move - self.constraints.follows_path
        return free * (self.times[k] < self._locked_since)

    def rows(self, k: int, q: Array) -> list[Array]:
        """Rows of the cooperation Jacobian for each task at sample k and configuration q, shape (m, nq) each."""
        state = self.state(q)
        X_WT, X_WR = state.X_WT[self.constraints.operators], self.constraints.reference_frames(state.X_WP)
        J = cooperation_jacobian(state, X_WT[:, :3, 3], self.signs * self.mobile(k), X_WR=X_WR)
        return [rows[k] @ block for rows, block in zip(self._rows, J, strict=True)]

    def first_order(self, k: int, q: Array) -> FirstOrder:
        """The tasks at sample k and configuration q, to first order."""
        state = self.state(q)
        signs = self.signs * self.mobile(k)
        X_WT = state.X_WT[self.constraints.operators]
        X_WR = None if self._is_on_part else self.constraints.reference_frames(state.X_WP)
        J = cooperation_jacobian(state, X_WT[:, :3, 3], signs, X_WR=X_WR)
        X_RT = inverse(state.X_WP if X_WR is None else X_WR) @ X_WT
        error = pose_errors(self.desired[k], X_RT, self.constraints.is_spin_free)
        self._refuse_lost_path(k, error)
        twists = self.twists[k]
        if self._given_signs.any() and k + 1 < len(self.times):
            moved = self.given.placed(k + 1, q) - q
            carried = cooperation_jacobian(state, X_WT[:, :3, 3], self._given_signs, X_WR=X_WR)
            twists = twists - carried @ moved / self.step(k)
        rows, twist, errors = self._constrained(k, J, error, twists)
        drift = self._drift(k, q)
        weights = self._weights.at(state, q, J=rows, xdot=twist + self.gain * errors, secondary=drift)
        return self._with_goals(k, q, state, FirstOrder(rows, twist, errors, weights, drift), signs=signs)

    def weights(self, k: int, q: Array) -> Array:
        """Joint weights at sample k and configuration q, shape (nq,), for methods without a Jacobian."""
        if self._weights.varies:
            return self.first_order(k, q).weights
        state = self.state(q)
        X_WR, X_WT = self.constraints.reference_frames(state.X_WP), state.X_WT[self.constraints.operators]
        away = self.desired[k, :, :3, 3] - (inverse(X_WR) @ X_WT)[:, :3, 3]
        self._refuse_lost_path(k, away)
        return self._weights.constant

    def _constrained(self, k: int, J: Array, error: Array, twists: Array) -> tuple[Array, Array, Array]:
        """Rows, desired twists and errors of the components that the tasks and grasps constrain."""
        if self.constraints.is_whole:
            return J.reshape(-1, J.shape[2]), twists.reshape(-1), error.reshape(-1)
        picks = [rows[k] for rows in self._rows]
        return (
            np.concatenate([pick @ block for pick, block in zip(picks, J, strict=True)]),
            np.concatenate([pick @ twist for pick, twist in zip(picks, twists, strict=True)]),
            np.concatenate([pick @ part for pick, part in zip(picks, error, strict=True)]),
        )

    def with_drift(self, drift: Drift | None) -> "TrackingProblem":
        """The same problem with another drift."""
        other = copy(self)
        other.drift = drift
        return other

    def _drift(self, k: int, q: Array) -> Array | None:
        """Joint velocities that are added, of those joints that may move for the tasks."""
        return None if self.drift is None else self.drift(k, q) * self.mobile(k)

    def _with_goals(self, k: int, q: Array, state: CellState, first: FirstOrder, *, signs: Array) -> FirstOrder:
        """The tasks, with what the secondary goals ask for besides."""
        if self._goals is None:
            return first
        stance = Stance(
            q=q,
            state=state,
            screws_W=lambda: self._model.links(q).screws_W,
            J=first.J,
            picks=[rows[k] for rows in self._rows],
            signs=signs,
            mobility=np.any(signs != 0.0, axis=0) / first.weights,
        )
        secondary = self._goals.velocities(self.times[k], stance, step=self._goal_step)
        if first.secondary is not None:
            secondary = secondary + first.secondary
        return replace(first, secondary=secondary, bounds=self._goals.bounds(q))

    def _refuse_lost_path(self, k: int, error: Array) -> None:
        """Stop where going on would be meaningless; not a number counts as lost.

        A tool that is still on its way to the path is not lost. With a joint that fails the report is to say how far
        the others get.
        """
        distances = np.linalg.norm(error[:, :3] * self.constraints.constrained[:, :3], axis=1)
        is_lost = (distances >= self._lost) & (self.times[k] >= self._settled) & (not self.cell.motion.locked)
        if not is_lost.any() and np.isfinite(error.sum()):
            return
        worst = int(np.argmax(distances))
        task = self.tasks[worst]
        raise DivergedError(
            f"the tool of '{task.robot}' is {1e3 * distances[worst]:.0f} mm from {_place(task)}: "
            "the path cannot be followed from this start posture"
        )


def _stated_drift(motion: MotionTask) -> Drift | None:
    """Joint velocities at the samples that the cell states; None where it states none."""
    schedule = motion.schedule
    sigma = schedule.times if schedule.clock is None else schedule.clock.sigma
    stated = GivenVelocities.of(motion.cell, float(sigma[-1]), motion.moving)
    if stated is None:
        return None
    velocities = (stated.at(sigma) * np.gradient(sigma, schedule.times)).T
    return lambda k, _: velocities[k]


def _place(task: Relation) -> str:
    """Where a tool should be, for messages."""
    return "its grasp on the part" if isinstance(task, Grasp) else f"task '{task.name}'"


def _tolerance(cell: Cell, task: Relation) -> float:
    """Allowed distance of a tool from its path or its grasp in [m]."""
    return cell.checks.closure_mm.si if isinstance(task, Grasp) else task.tolerance.position_mm.si


def _settled_from(task: Relation) -> float:
    """Time in [s] until which a tool may come to its path; -inf when it is there from the start."""
    return task.start + task.settle if not isinstance(task, Grasp) and task.settle else -np.inf
