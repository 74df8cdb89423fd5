r"""Exact derivatives of a motion by its variational equations.

With :math:`J \dot q = \dot x_d` and :math:`W (\dot q - u) = J^T \lambda`, where ``u`` is added in the null space, a
change of joints and layout changes the speeds by

.. math:: d\dot q = J^\# \left( -dJ \, \dot q - J k \right) + k, \qquad
          k = W^{-1} \left( dJ^T \lambda - dW \, (\dot q - u) \right) + du

Both :math:`dJ \, \dot q` and :math:`dJ^T \lambda` are sums of Lie brackets of screws, so that no second derivative of
any pose is needed. Tools stay on their paths: :math:`J \, dq = -(\beta + \tau)` for base (:math:`\beta`) and tool
(:math:`\tau`) displacement twists. What remains is a linear differential equation along the motion, integrated by the
multistep rule of ``run``; so these are derivatives of what ``run`` gives, not of its limit.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.kernel.jacobian_changes import JacobianChanges
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import keep_freed_memory
from cellplan.search.kernel.screws import Directions, TaskScrews

BACK: Final = 2  # [-] nodes before the present one whose speeds the multistep rule of ``run`` takes
REGULAR: Final = 1e-12  # [-] of the largest entry that keeps a matrix invertible where its rank is lost


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionDerivatives:
    """Derivatives of one motion in p directions."""

    q: Array  # of the joint positions at the nodes, shape (N, nq, p)
    qd: Array  # of their speeds, shape (N, nq, p)
    rates: Array  # of the speeds by the joints at the same node, where the tools stay on their paths, shape (N, nq, nq)


def differentiate(job: Job, layout: Layouts, q: Array, qd: Array, directions: Directions) -> MotionDerivatives:
    """Derivatives of the motion of one layout at all nodes.

    Args:
        q: Joint positions at the nodes in [rad] or [m], shape (N, nq), as ``run`` gives them.
        qd: Their speeds, shape (N, nq).
    """
    keep_freed_memory()
    rates = Rates(job, layout, q, qd, directions)
    nq, begins, last = q.shape[1], job.is_begin.tolist(), len(q) - 1
    before = np.zeros((BACK + len(q), 2 * nq, directions.count))  # nodes that there are not, then all nodes
    blocks, states, at = before.reshape(-1, nq * directions.count), before[BACK:], rates.start(directions.start)
    shares = _shares(job)
    for node, (taking, adding) in enumerate(zip(rates.by_joints, rates.by_layout, strict=True)):
        np.matmul(taking, at, out=states[node])
        states[node] += adding
        if node and begins[node - 1]:  # as in ``run``: trapezoidal (Heun) corrector
            at = states[node - 1, :nq] + 0.5 * (job.times[node] - job.times[node - 1]) * states[
                node - 1 : node + 1, nq:
            ].sum(axis=0)
            states[node] = taking @ at + adding
        if node < last:
            at = (shares[node] @ blocks[2 * node : 2 * (node + BACK + 1)]).reshape(nq, -1)
    return MotionDerivatives(q=states[:, :nq], qd=states[:, nq:], rates=np.ascontiguousarray(rates.by_joints[:, nq:]))


def _shares(job: Job) -> Array:
    """Shares of the joints and speeds at each node and those before it in the joints predicted after it, (N - 1, 6)."""
    weights = np.zeros((len(job.steps), BACK + 1, 2))
    weights[:, BACK, 0] = 1.0
    weights[:, :, 1] = job.steps[:, ::-1]
    return weights.reshape(len(job.steps), -1)


class Rates:
    """The variational equations at all nodes.

    Attributes:
        by_joints: Null-space projection of the predicted joint change, which keeps the tools where they are, and the
            change of the speeds by it, shape (N, 2 nq, nq).
        by_layout: Their change in the directions otherwise, shape (N, 2 nq, p).
    """

    def __init__(self, job: Job, layout: Layouts, q: Array, qd: Array, directions: Directions) -> None:
        """Work out the Jacobian, its change and the weighted pseudo-inverse."""
        nq, weights = q.shape[1], layout.weights[0]
        screws = TaskScrews.of(job, layout, q, directions)
        changes = JacobianChanges.of(job, screws, qd)
        J, self._idle = changes.jacobian, changes.idle
        at_rest = np.concatenate([robot.weights for robot in job.cell.robots])  # by which ``settled`` moves the tools
        self._J, self._settling = J[0], job.settling * job.constraints.may_move / at_rest
        mobility = job.constraints.may_move / weights
        inverse = self._inverse(J, mobility)
        relative = qd if job.drift is None else qd - job.constraints.may_move * job.drift
        forces = np.swapaxes(inverse, 1, 2) @ (weights * relative)[:, :, None]  # multipliers: W (qd - u) = J^T lambda
        bent = mobility[:, None] * changes.forces(forces[..., 0])
        bent[:, :, nq:] -= (directions.weights / weights[:, None]) * relative[:, :, None]
        if directions.drift is not None:
            bent[:, :, nq:] += job.constraints.may_move[:, None] * directions.drift
        twists = changes.twists()
        twists += J @ bent
        bent -= inverse @ twists
        driven = -changes.in_rows(np.swapaxes(screws.based + screws.tooled, -1, -2))
        self._driven = driven.reshape(len(q), -1, directions.count)
        by_joints = np.ascontiguousarray(bent[:, :, :nq])
        self.by_joints, self.by_layout = (np.empty((len(q), 2 * nq, width)) for width in (nq, directions.count))
        projection, closed = self.by_joints[:, :nq], self.by_layout[:, :nq]
        np.subtract(np.eye(nq), inverse @ J, out=projection)
        np.matmul(inverse, self._driven, out=closed)
        np.matmul(by_joints, projection, out=self.by_joints[:, nq:])
        np.add(by_joints @ closed, bent[:, :, nq:], out=self.by_layout[:, nq:])

    def start(self, start: Array) -> Array:
        """Change of the start posture, shape (nq, p), once the tools are back at the starts of their paths."""
        inverse = self._inverse(self._J[None], self._settling)[0]
        return start + inverse @ (self._driven[0] - self._J @ start)

    def _inverse(self, J: Array, mobility: Array) -> Array:
        """Weighted pseudo-inverse ``W^-1 J^T (J W^-1 J^T)^-1``, shape (N, nq, rows)."""
        half = J * np.sqrt(mobility)
        D = half @ np.swapaxes(half, 1, 2)
        diagonal = np.einsum("nii->ni", D)
        diagonal += REGULAR * diagonal.max(axis=1, keepdims=True) + self._idle
        factor = np.asarray(np.linalg.cholesky(D), dtype=np.float64)
        lower = _lower_inverse(factor)
        return mobility[:, None] * (np.swapaxes(lower @ J, 1, 2) @ lower)


def _lower_inverse(L: Array) -> Array:
    """Inverses of lower triangular matrices, shape (N, m, m), row by row."""
    inverse = np.zeros_like(L)
    for row in range(L.shape[1]):
        inverse[:, row, row] = 1.0
        inverse[:, row, :row] = -(L[:, row, None, :row] @ inverse[:, :row, :row])[:, 0]
        inverse[:, row] /= L[:, row, row, None]
    return inverse
