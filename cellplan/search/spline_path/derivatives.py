r"""Exact derivatives of a motion along a spline, by its coefficients and by the layout.

Each operator has as many joints as its task has components. Tools that stay on their paths move their joints by

.. math:: A_i \, dq_i = -C_i \, dq_c - (\beta_i + \tau_i), \qquad
          A_i \, d\dot q_i = -C_i \, d\dot q_c - dJ_i \, \dot q

with the displacements of bases and tools :math:`\beta, \tau`, and ``dJ`` a sum of Lie brackets of screws as in the
kernel. What the spline does to the positioner is linear in its coefficients.
"""

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.kernel.jacobian_changes import JacobianChanges
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions, TaskScrews
from cellplan.search.programs.problem import PointDerivatives
from cellplan.search.spline_path.nodes import PathNodes


def path_derivatives(
    nodes: PathNodes, layout: Layouts, q: Array, qd: Array, directions: Directions, *, is_accelerating: bool
) -> PointDerivatives:
    """Derivatives of the motion at all nodes: by all coefficients, one after the other, then by the directions.

    Args:
        nodes: The job at its nodes.
        layout: The layout, a batch of one.
        q: Joint positions at the nodes in [rad] or [m], shape (N, nq).
        qd: Their speeds, shape (N, nq).
        directions: The directions of the layout.
        is_accelerating: Whether accelerations are asked for.
    """
    job, c = nodes.job, nodes.columns
    screws = TaskScrews.of(job, layout, q, directions)
    changes = JacobianChanges.of(job, screws, qd)
    J, nq = changes.jacobian.reshape(len(q), -1, q.shape[1]), q.shape[1]
    blocks = J.reshape(len(q), -1, 6, nq)
    local = [blocks[:, task][..., columns] for task, columns in enumerate(nodes.operators)]
    inverses = np.linalg.inv(np.stack(local, axis=1)) if local else np.zeros((len(q), 0, 6, 6))
    moved = changes.in_rows(np.swapaxes(screws.based + screws.tooled, -1, -2))
    driven, twists = -moved.reshape(len(q), J.shape[1], directions.count), changes.twists()
    coefficients = nodes.count * (c.stop - c.start)
    derivatives = np.zeros((3 if is_accelerating else 2, len(q), nq, coefficients + directions.count))
    for order, shares in enumerate(nodes.shares[: len(derivatives)]):
        _by_spline(derivatives[order], shares, c)
    _add(derivatives[0], nodes, inverses, np.concatenate([-_times(J[..., c], nodes.shares[0]), driven], axis=2))
    turned = twists[..., :nq] @ derivatives[0]
    turned[..., coefficients:] += twists[..., nq:]
    turned[..., :coefficients] += _times(J[..., c], nodes.shares[1])
    _add(derivatives[1], nodes, inverses, -turned)
    if not is_accelerating:
        return PointDerivatives(q=derivatives[0], qd=derivatives[1], qdd=None)
    others = np.ones(nq, dtype=bool)
    others[c] = False
    derivatives[2][:, others] = np.tensordot(nodes.rates, derivatives[1][:, others], axes=1)
    return PointDerivatives(q=derivatives[0], qd=derivatives[1], qdd=derivatives[2])


def _by_spline(derivatives: Array, shares: Array, columns: slice) -> None:
    """Fill in what the coefficients, one configuration after the other, do to the joints of the positioner."""
    count = columns.stop - columns.start
    for joint in range(count):
        derivatives[:, columns.start + joint, joint : shares.shape[1] * count : count] = shares


def _times(C: Array, shares: Array) -> Array:
    """``C dq_c`` for all coefficients of shares (N, count): (N, rows, n) to (N, rows, count n)."""
    return (C[:, :, None, :] * shares[:, None, :, None]).reshape(*C.shape[:2], -1)


def _add(derivatives: Array, nodes: PathNodes, inverses: Array, twists: Array) -> None:
    """Fill in what twists of the tools, shape (N, 6 T, p), ask of the joints of the operators."""
    solved = inverses @ twists.reshape(len(twists), -1, 6, twists.shape[2])
    for task, columns in enumerate(nodes.operators):
        derivatives[:, columns] = solved[:, task]
