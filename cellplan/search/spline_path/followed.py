"""Operators that follow their tasks while the positioner goes along a given spline: all nodes at once."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.kinematics.batched import Placement
from cellplan.search.spline_path.nodes import PathNodes

MOST_STEPS: Final = 12  # of Newton's method: four from a motion nearby
CONVERGED: Final = 1e-10  # [rad] and [m]: a step below this changes nothing any more
LONGEST: Final = 1.0  # [rad] or [m] of a step: beyond it another solution may be nearer
TORN: Final = 0.1  # [rad] or [m] by which joints may leave their own speeds from node to node
START_STEPS: Final = 30  # of Newton's method to bring the tools to the starts of their paths


def followed(nodes: PathNodes, placement: Placement, coefficients: Array, q: Array) -> tuple[Array, Array] | None:
    """Joints and speeds at the nodes, of the solution near a given motion.

    Args:
        nodes: The job at its nodes.
        placement: Where the robots stand, a batch of one.
        coefficients: Of the spline, shape (count, n).
        q: Joint positions that are nearly right in [rad] or [m], shape (N, nq).

    Returns:
        Positions and speeds, shape (N, nq) each; None where a tool cannot follow.
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
        nodes: The job at its nodes.
        placement: Where the robots stand, a batch of one.
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
