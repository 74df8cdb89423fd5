r"""Exact derivatives of a motion by its variational equations.

With :math:`J \dot q = \dot x_d` and :math:`W \dot q = J^T \lambda` a change of joints and layout changes the speeds by

.. math:: d\dot q = J^\# \left( -dJ \, \dot q - J k \right) + k, \qquad k = W^{-1} (dJ^T \lambda - dW \, \dot q)

Both :math:`dJ \, \dot q` and :math:`dJ^T \lambda` are sums of Lie brackets of screws, so that no second derivative of
any pose is needed. Tools stay on their paths: :math:`J \, dq = -(\beta + \tau)` for displacements of bases and tools.
What remains is a linear differential equation along the motion, integrated by the multistep rule of ``run``; so these
are derivatives of what ``run`` gives, not of its limit.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.jacobian_changes import JacobianChanges
from cellplan.search.kernel.screws import Directions, TaskScrews

REGULAR: Final = 1e-12  # [-] of the largest entry that keeps a matrix invertible where its rank is lost


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionDerivatives:
    """Derivatives of one motion in p directions.

    Attributes:
        q: Of the joint positions at the nodes, shape (N, nq, p).
        qd: Of their speeds, shape (N, nq, p).
    """

    q: Array
    qd: Array


def differentiate(job: Job, layout: Layouts, q: Array, qd: Array, directions: Directions) -> MotionDerivatives:
    """Derivatives of the motion of one layout at all nodes.

    Args:
        job: The tasks at their nodes.
        layout: The layout, a batch of one.
        q: Joint positions at the nodes in [rad] or [m], shape (N, nq), as ``run`` gives them.
        qd: Their speeds, shape (N, nq).
        directions: The directions.
    """
    rates = _Rates(job, layout, q, qd, directions)
    nodes, nq, count = len(job.times), q.shape[1], directions.count
    dq, dqd = np.empty((nodes, nq, count)), np.empty((nodes, nq, count))
    P, closed, F, forced = rates.projector, rates.closed, rates.by_joints, rates.by_layout
    steps, h, begins = job.steps.tolist(), np.diff(job.times).tolist(), job.is_begin.tolist()
    at = rates.start(directions.start)
    for node in range(nodes):
        dq[node] = at if node == 0 else P[node] @ at + closed[node]
        dqd[node] = F[node] @ dq[node] + forced[node]
        if node and begins[node - 1]:
            at = dq[node - 1] + 0.5 * h[node - 1] * (dqd[node - 1] + dqd[node])
            dq[node] = P[node] @ at + closed[node]
            dqd[node] = F[node] @ dq[node] + forced[node]
        if node + 1 < nodes:
            at = dq[node] + steps[node][0] * dqd[node]
            for back, weight in enumerate(steps[node][1:], start=1):
                if weight:
                    at += weight * dqd[node - back]
    return MotionDerivatives(q=dq, qd=dqd)


class _Rates:
    """The variational equations at all nodes.

    Attributes:
        projector: Projection of a change of the joints on those that keep the tools where they are, (N, nq, nq).
        closed: Smallest change of the joints that keeps the tools on their paths, shape (N, nq, p).
        by_joints: Derivative of the speeds by the joints, shape (N, nq, nq).
        by_layout: Derivative of the speeds in the directions with the joints held, shape (N, nq, p).
    """

    def __init__(self, job: Job, layout: Layouts, q: Array, qd: Array, directions: Directions) -> None:
        """Work out the Jacobian, its change and the weighted pseudo-inverse."""
        nq, weights = q.shape[1], layout.weights[0]
        screws = TaskScrews.of(job, layout, q, directions)
        changes = JacobianChanges(job, screws, qd)
        J, self._idle = changes.jacobian, changes.idle
        self._J, self._weights, self._settling = J[0], weights, job.settling * job.constraints.may_move
        mobility = job.constraints.may_move / weights
        inverse = self._inverse(J, mobility)
        forces = np.swapaxes(inverse, 1, 2) @ (weights * qd)[:, :, None]  # the multipliers, as W qd = J^T lambda
        bent = mobility[:, None] * changes.forces(forces[..., 0])
        bent[:, :, nq:] -= (directions.weights / weights[:, None]) * qd[:, :, None]
        rates = bent - inverse @ (changes.twists() + J @ bent)
        beside = -changes.rows @ (screws.based + screws.tooled).swapaxes(-1, -2)
        self._beside = beside.reshape(len(q), -1, directions.count)
        self.projector, self.closed = np.eye(nq) - inverse @ J, inverse @ self._beside
        self.by_joints, self.by_layout = rates[:, :, :nq].copy(), rates[:, :, nq:].copy()

    def start(self, start: Array) -> Array:
        """Change of the start posture, shape (nq, p), once the tools are back at the starts of their paths."""
        inverse = self._inverse(self._J[None], self._settling / self._weights)[0]
        return start + inverse @ (self._beside[0] - self._J @ start)

    def _inverse(self, J: Array, mobility: Array) -> Array:
        """Weighted pseudo-inverse ``W^-1 J^T (J W^-1 J^T)^-1``, shape (N, nq, rows)."""
        D = (J * mobility) @ np.swapaxes(J, 1, 2)
        diagonal = np.einsum("nii->ni", D)
        diagonal += REGULAR * diagonal.max(axis=1, keepdims=True) + self._idle
        return mobility[:, None] * np.swapaxes(np.linalg.solve(D, J), 1, 2)
