r"""Least singular values of the arms along a motion, and their derivatives.

Near a singular configuration an arm moves fast where its tool moves slowly: its joint speeds grow with :math:`1/\sigma`
of the least singular value of its Jacobian, and rise and fall within a step of the nodes. With the unit singular
vectors of :math:`\sigma = u^T J v` the derivative is :math:`u^T \, dJ \, v`: the change of the twist that the joint
speeds v give the tool, as in the derivatives of motions.

A Jacobian has the rows that a task or grasp constrains, at the tool tip, and the joints of its own robot, in [m] and
[rad] without weights, as in ``checks.tools.conditioning``. The least of ``min(m, n)`` values counts: with fewer joints
than rows it says whether some of the joints do the same.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.search.kernel.jacobian_changes import JacobianChanges, constrained_rows, flange_axes
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.screws import Directions, TaskScrews, unit_screws

SAMPLES: Final = 256  # [-] configurations of which the usual value is the median


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SingularValues:
    """Least singular values of A arms at N nodes: of the relations whose own robot moves."""

    job: Job  # the tasks
    layout: Layouts  # the layout, a batch of one
    q: Array  # joint positions at the nodes in [rad] or [m], shape (N, nq)
    directions: Callable[[], Directions]  # the p directions of the layout, the last ones of all derivatives
    values: Array  # the values in mixed units of [m] and [rad], shape (N, A)

    @classmethod
    def of(cls, job: Job, layout: Layouts, q: Array, directions: Callable[[], Directions]) -> "SingularValues":
        """Those of one layout at joint positions in [rad] or [m], shape (N, nq)."""
        screws = TaskScrews.of(job, layout, q, Directions.none(job, 0))
        least = [_least(J, is_constrained) for J, is_constrained in _jacobians(job, screws)]
        values = np.stack([*least, np.zeros(len(q))], axis=1)[:, :-1]
        return cls(job=job, layout=layout, q=q, directions=directions, values=values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the robots."""
        return tuple(self.job.relations[place].robot for place in arms(self.job))

    def derivatives(self, nodes: Indices, subjects: Indices, by: Array) -> Array:
        """Derivatives of some singular values, shape (M, n), from those of the joints.

        Args:
            nodes: Their nodes, shape (M,).
            subjects: Which arm each is of, shape (M,).
            by: Derivatives of the joints, shape (N, nq, n).
        """
        used, place = np.unique(nodes, return_inverse=True)
        by_joints, by_layout = self._partial(used.astype(np.intp))
        derivatives: Array = (by_joints[place, subjects][:, None] @ by[nodes])[:, 0]
        derivatives[:, by.shape[2] - by_layout.shape[2] :] += by_layout[place, subjects]
        return derivatives

    def _partial(self, nodes: Indices) -> tuple[Array, Array]:
        """Derivatives by the joints, shape (U, A, nq), and by the directions at given joints, shape (U, A, p)."""
        directions, nq = self.directions(), self.q.shape[1]
        job = replace(self.job, X=self.job.X[..., nodes])
        screws = TaskScrews.of(job, self.layout, self.q[nodes], directions)
        local, _ = flange_axes(job)
        left, rates = np.zeros((*screws.tip.shape[:2], 6)), np.zeros(screws.operators.shape[:3])
        for place, (J, is_constrained) in zip(arms(job), _jacobians(job, screws), strict=True):
            last = min(int(is_constrained.sum()), J.shape[2]) - 1
            u, _, v = np.linalg.svd(J)
            left[:, place], rates[:, place] = u[:, :, last], v[:, last] @ local[place].to_joints.T
        changes = JacobianChanges(job, screws, rates, np.zeros(screws.shared.shape[:2]), at_tips=True)
        twists = changes.twists().reshape(*left.shape, -1)[:, list(arms(job))]
        partial = (left[:, list(arms(job)), None] @ twists)[:, :, 0]
        return partial[..., :nq], partial[..., nq:]


def arms(job: Job) -> tuple[int, ...]:
    """Places of the relations whose own robot moves."""
    names = {robot.name for robot in job.cell.robots if robot.name in job.moving and robot.model.joints}
    return tuple(place for place, relation in enumerate(job.relations) if relation.robot in names)


def usual_values(job: Job) -> Array:
    """What is usual of the arms of a cell, shape (A,): the median over configurations within the limits of the joints.

    Seen from the tools, whose axes stand for those of the frames of the tasks.
    """
    chains, cell = job.tasks.chains, job.cell
    limits = [finite_limits(robot.model) for robot in cell.robots]
    lower, upper = (np.concatenate(side) for side in zip(*limits, strict=True))
    q = np.random.default_rng(0).uniform(lower, upper, (SAMPLES, cell.joint_count))
    state = chains.state(np.ascontiguousarray(q.T), Layouts.of([cell], np.zeros((1, cell.joint_count))).placement(job))
    axes, points, tips = (np.ascontiguousarray(part.T) for part in (state.axes, state.points, state.p_WT))
    R_WT, turning = np.swapaxes(state.R_WT.T, -1, -2), chains.is_turning.T[:, :, None]
    local, _ = flange_axes(job)
    values = []
    for place in arms(job):
        robot = int(job.constraints.operators[place])
        J = unit_screws(axes[:, robot], points[:, robot], turning[robot], R_WT[:, robot], tips[:, robot])
        values.append(
            np.median(_least(np.swapaxes(J, 1, 2) @ local[place].to_joints, job.constraints.constrained[place]))
        )
    return np.array(values)


def _jacobians(job: Job, screws: TaskScrews) -> list[tuple[Array, Flags]]:
    """The Jacobian of each arm, the rows that are left open 0, shape (N, 6, n), and which rows are constrained."""
    rows, (local, _) = constrained_rows(job, screws.tip), flange_axes(job)
    return [
        (
            rows[:, place] @ (np.swapaxes(screws.operators[:, place], 1, 2) @ local[place].to_joints),
            job.constraints.constrained[place],
        )
        for place in arms(job)
    ]


def _least(J: Array, is_constrained: Flags) -> Array:
    """Least of the ``min(m, n)`` singular values of matrices (N, 6, n), m of whose rows count, shape (N,)."""
    rows = J[:, is_constrained]
    turned = np.swapaxes(rows, 1, 2)
    square = rows @ turned if rows.shape[1] <= rows.shape[2] else turned @ rows
    return np.sqrt(np.maximum(np.linalg.eigvalsh(square)[:, 0], 0.0)).astype(np.float64)
