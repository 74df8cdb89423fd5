r"""The path problem: the spline of a positioner and, besides, what a layout may vary; operators follow their tasks.

Each operator has as many joints as its task has components. Tools that stay on their paths move their joints by

.. math:: A_i \, dq_i = -C_i \, dq_c - (\beta_i + \tau_i), \qquad
          A_i \, d\dot q_i = -C_i \, d\dot q_c - dJ_i \, \dot q

with the displacements of bases and tools :math:`\beta, \tau`, and ``dJ`` a sum of Lie brackets of screws as in the
kernel. What the spline does to the positioner is linear in its coefficients.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.scene.kinematics.batched import Placement
from cellplan.search.kernel.jacobian_changes import JacobianChanges
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions, TaskScrews
from cellplan.search.programs.problem import Point, PointDerivatives
from cellplan.search.spline_path.nodes import PathNodes
from cellplan.search.spline_path.spline_problem import SplineProblem

MOST_STEPS: Final = 12  # of Newton's method: four from a motion nearby
CONVERGED: Final = 1e-10  # [rad] and [m]: a step below this changes nothing any more
LONGEST: Final = 1.0  # [rad] or [m] of a step: beyond it another solution may be nearer
TORN: Final = 0.1  # [rad] or [m] by which joints may leave their own speeds from node to node
START_STEPS: Final = 30  # of Newton's method to bring the tools to the starts of their paths


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathProblem(SplineProblem):
    """See ``Problem``: operators follow a spline of the positioner."""

    nodes: PathNodes  # the job at its nodes
    is_dense: bool = field(init=False, default=True)  # its nodes are cheap; wrists near a singularity make peaks narrow

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        spline, others = self.split(x)
        coefficients = self.path.spline(spline).coefficients
        placement = self.layout.layouts(others[None], start[None]).placement(self.nodes.job)
        q = continued(self.nodes, placement, coefficients, start) if near is None else near.q
        motion = None if q is None else followed(self.nodes, placement, coefficients, q)
        if motion is None:
            return None
        q, qd = motion
        qdd = self.nodes.rates @ qd
        qdd[:, self.nodes.columns] = self.nodes.shares[2] @ coefficients
        return Point(x=x, start=q[0], q=q, qd=qd, qdd=qdd)

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        _, others = self.split(point.x)
        return path_derivatives(
            self.nodes,
            self.layout_at(point),
            point.q,
            point.qd,
            self.layout.directions(others),
            is_accelerating=bool(np.isfinite(self.acceleration).any()),
        )

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address: the path in place of the start posture of its robot."""
        (robot,) = self.path.robots
        return SplineProblem.values(self, x, start) | {f"robots.{robot}.{key}": None for key in ("start", "start_deg")}


def path_derivatives(
    nodes: PathNodes, layout: Layouts, q: Array, qd: Array, directions: Directions, *, is_accelerating: bool
) -> PointDerivatives:
    """Derivatives of the motion at all nodes: by all coefficients, one after the other, then by the directions.

    Args:
        q: Joint positions at the nodes in [rad] or [m], shape (N, nq).
        qd: Their speeds, shape (N, nq).
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


def followed(nodes: PathNodes, placement: Placement, coefficients: Array, q: Array) -> tuple[Array, Array] | None:
    """Joints and speeds at the nodes, (N, nq) each, near a given motion; None where a tool cannot follow.

    Args:
        coefficients: Of the spline, shape (count, n).
        q: Joint positions that are nearly right in [rad] or [m], shape (N, nq).
    """
    job = nodes.job
    at = np.ascontiguousarray(q.T)
    at[nodes.columns] = (nodes.shares[0] @ coefficients).T
    drift, still, every = np.zeros_like(at), np.zeros_like(at), np.ones(len(at))
    drift[nodes.columns] = (nodes.shares[1] @ coefficients).T
    with np.errstate(all="ignore"):  # what is not a number has not settled
        for _ in range(MOST_STEPS):
            linear = job.tasks.linearise(at, (job.X, job.V), placement, mobile=every)
            step = linear.correction(still)
            longest = float(np.abs(step).max(initial=0.0))
            if not longest <= LONGEST:
                return None
            at = at + step
            if longest <= CONVERGED:
                break
        else:
            return None
        qd = linear.velocities(drift)
    positions, velocities = np.ascontiguousarray(at.T), np.ascontiguousarray(qd.T)
    return (positions, velocities) if _is_one_motion(job.times, positions, velocities) else None


def continued(nodes: PathNodes, placement: Placement, coefficients: Array, start: Array) -> Array | None:
    """The motion from a start posture, node after node; see ``followed`` for the arguments.

    Args:
        coefficients: Of the spline, shape (count, n).
        start: A start posture near the right one, shape (nq,).

    Returns:
        Positions, shape (N, nq); None where a tool cannot follow.
    """
    job, times = nodes.job, nodes.job.times
    given, rates = (share @ coefficients for share in nodes.shares[:2])
    positions, every = np.empty((len(times), len(start))), np.ones(len(start))
    at, drift = start[:, None].copy(), np.zeros((len(start), 1))
    still = np.zeros_like(at)
    with np.errstate(all="ignore"):
        for node in range(len(times)):
            at[nodes.columns, 0] = given[node]
            drift[nodes.columns, 0] = rates[node]
            desired = job.X[..., node : node + 1], job.V[..., node : node + 1]
            for _ in range(MOST_STEPS if node else START_STEPS):
                linear = job.tasks.linearise(at, desired, placement, mobile=every)
                step = linear.correction(still)
                longest = float(np.abs(step).max(initial=0.0))
                at = at + step * min(1.0, LONGEST / max(longest, LONGEST))
                if longest <= CONVERGED:
                    break
            if not longest <= CONVERGED:
                return None
            positions[node] = at[:, 0]
            if node + 1 < len(times):
                at = at + (times[node + 1] - times[node]) * linear.velocities(drift)
    return positions


def _is_one_motion(times: Array, q: Array, qd: Array) -> bool:
    """Whether neighbouring nodes belong together: no joint leaves what its own speeds lead to."""
    step = np.diff(times)[:, None]
    return bool(np.abs(np.diff(q, axis=0) - 0.5 * step * (qd[1:] + qd[:-1])).max(initial=0.0) <= TORN)
