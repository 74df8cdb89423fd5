"""Redundancy: secondary goals and joint weights that change along the motion, at all nodes of a window at once."""

from collections.abc import Callable

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired, Linearisation
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian
from cellplan.planning.tracking.joint_weights import HEADING_DAMPING, JointWeights
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.secondary_goals import SecondaryGoals, Stance, rests_of, share_within
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows
from cellplan.scene.kinematics.batched import Placement
from cellplan.scene.kinematics.link_forest import LinkForest
from cellplan.scene.kinematics.pinocchio_model import CellState, CombinedModel

Screws = Callable[[], Array]  # of all axes, shape (K, 6, axes)


class Redundancy:
    r"""Joint velocities with goals in the null space of the tasks and with weights of the configuration.

    .. math:: f(t, q) = J^\# \dot x_d + s \, (I - J^\# J) \, \dot q_0, \qquad 0 \le s \le 1

    in the metric of ``W(t, q)``: what Euler's steps integrate with the same goals, weights and bounds as they become
    finer, without feedback, as the tools stay on their tasks anyway ([Ribeiro2010]_ Eqs. D.43, D.44).

    Attributes:
        breaks: Times in [s] at which the goals set in or leave off, where higher derivatives of the motion jump.
    """

    def __init__(self, motion: MotionTask, tasks: BatchTasks) -> None:
        """Make ready what each goal and each weight needs."""
        cell, relations = motion.cell, motion.relations
        model = CombinedModel(cell)
        constraints = TaskConstraints.of(cell, relations, motion.moving)
        self._tasks, self._model, self._cell, self._constraints = tasks, model, cell, constraints
        self._forest, self._X_WB = LinkForest(cell.robots), np.array([robot.X_WB for robot in cell.robots])
        self._signs = constraints.column_signs(model.carries_flange) * (1.0 - constraints.follows_path)
        self._weights = JointWeights(cell, model)
        rests = rests_of(cell, motion.schedule)
        self._goals = SecondaryGoals(cell, model, tasks=relations, start=motion.start, rests=rests)
        self.breaks = self._goals.breaks if cell.solver.secondary.goals else np.zeros(0)

    def velocities(
        self, times: Array, q: Array, desired: Desired, *, placement: Placement, mobile: Array, drift: Array | None
    ) -> tuple[Linearisation, Array]:
        """The tasks to first order, and the joint velocities, shape (nq, batch).

        Args:
            times: Times in [s], shape (batch,).
            q: Stacked joint vectors, shape (nq, batch).
            mobile: 1 for joints that are not locked, shape (nq,).
            drift: Joint velocities that are added in the null space besides, shape (nq, batch); None for none.
        """
        known = np.where(np.isfinite(q), q, 0.0)  # of what is not a number the tasks make none either
        state, screws = self._state(known.T)
        weights = self._weights.constant[:, None]
        if self._weights.varies:
            damped = self._tasks.linearise(q, desired, placement, mobile=mobile, damping=HEADING_DAMPING)
            weights = self._weights.along(state, known.T, heading=damped.velocities(drift).T).T
        linear = self._tasks.linearise(q, desired, placement, mobile=mobile, weights=weights)
        velocities = linear.velocities(drift)
        if not self._cell.solver.secondary.goals:
            return linear, velocities
        stance = self._stance(known.T, state, screws, X=desired[0], signs=self._signs * mobile, weights=weights.T)
        extra = linear.null_space_projection(self._goals.velocities(times, stance, step=0.0).T)
        lowest, highest = self._goals.bounds(known.T)
        return linear, velocities + share_within(velocities.T, extra.T, lowest=lowest, highest=highest) * extra

    def _state(self, q: Array) -> tuple[CellState, Screws]:
        """Kinematics at stacked joint vectors, shape (K, nq), with the batch as first axis."""
        cell, forest = self._cell, self._forest
        D = forest.displacements(q, self._X_WB)
        screws = np.moveaxis(forest.screws(D), 0, -1)
        flanges = [forest.place(robot.name, robot.model.flange_link) for robot in cell.robots]
        X_BT = np.array([robot.model.X_BF @ robot.tool.X_FT for robot in cell.robots])
        X_WT = np.swapaxes(D[flanges], 0, 1) @ X_BT
        X_CP = cell.part.X_CP
        X_WP = np.broadcast_to(X_CP, (len(q), 4, 4)) if cell.carrier is None else X_WT[:, cell.carrier] @ X_CP
        return CellState(self._model.by_flange(screws), X_WT, X_WP), lambda: screws

    def _stance(self, q: Array, state: CellState, screws: Screws, *, X: Array, signs: Array, weights: Array) -> Stance:
        """The cell as the goals evaluate it, with the batch as first axis."""
        constraints = self._constraints
        X_WT = state.X_WT[:, constraints.operators]
        X_WR = constraints.reference_frames(state.X_WP[:, None])
        J = cooperation_jacobian(state, X_WT[..., :3, 3], signs, X_WR=X_WR)
        desired = np.moveaxis(X, (2, 3), (0, 1))
        picks = [constraint_rows(task, X_RT) for task, X_RT in zip(constraints.tasks, desired, strict=True)]
        return Stance(
            q=q,
            state=state,
            screws_W=screws,
            J=np.concatenate([pick @ J[:, index] for index, pick in enumerate(picks)], axis=1),
            picks=picks,
            signs=signs,
            mobility=np.any(signs != 0.0, axis=0) / weights,
        )


def redundancy(motion: MotionTask, tasks: BatchTasks) -> Redundancy | None:
    """Goals and changing weights of a cell; None where it asks for the smallest weighted velocities alone."""
    return Redundancy(motion, tasks) if motion.cell.solver.is_varied else None
