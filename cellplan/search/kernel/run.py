r"""Run: the motions of many layouts on the nodes of their job, all candidates side by side.

From node to node the joints follow :math:`\dot q = J^\# \dot x_d + (I - J^\# J) u`, the weighted pseudo-inverse of the
cooperation Jacobian ([Ribeiro2010]_ Eq. D.28) and what the cell adds in its null space: a multistep rule predicts the
next configuration, one step of Newton's method with the same inverse brings the tools back to their paths. So every
node takes one linearisation of all candidates. This is the motion of the accurate mode up to what lies between two
nodes; nothing is certified here.
"""

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.planning.collocation.batch_tasks import Desired
from cellplan.planning.collocation.solver import repeated
from cellplan.planning.collocation.start_offset import settled
from cellplan.scene.kinematics.batched import Placement
from cellplan.search.kernel.job import Job, Layouts

CACHE_BYTES: Final = (
    24_000_000  # more than all arrays of one call, less than the 32 MB beyond which glibc learns nothing
)
AT_ONCE: Final = 256  # candidates side by side: enough for NumPy, and the arrays of one node stay in the cache
START_TOL: Final = 1e-6  # [m] and [rad] up to which a tool counts as at the start of its path
LOST: Final = 0.05  # [m] or [rad] beside its path a predicted tool has lost it: Newton's step is no small one any more
MOST_PASSES: Final = 20  # over all nodes
PASSED: Final = 1e-7  # [rad] and [m] that the last pass may still change


@cache
def keep_freed_memory() -> None:
    """Teach the allocator of glibc to keep what is freed: pages that are given back cost more than the arithmetic.

    The largest block that was freed decides up to which size it takes blocks from its heap, and how much of that it
    keeps. Nothing is touched, so nothing is used; other allocators do as they always do.
    """
    np.empty(CACHE_BYTES, dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motions:
    """The motions of K layouts; what comes after a candidate has lost a path is not valid."""

    q: Array  # stacked joint positions at the nodes in [rad] or [m], shape (K, N, nq)
    qd: Array  # their speeds in [rad/s] or [m/s], shape (K, N, nq)
    lost_at: Array  # when a tool was lost in [s], shape (K,); -inf before its path, inf where the job is done

    @property
    def is_followed(self) -> Flags:
        """Which candidates did the whole job, shape (K,)."""
        return np.isposinf(self.lost_at)


def run(job: Job, layouts: Layouts) -> Motions:
    """The motions of all candidates."""
    if layouts.X_WB.shape[1] != len(job.cell.robots) or layouts.start.shape[1] != job.cell.joint_count:
        raise ValueError(
            f"layouts: expected {len(job.cell.robots)} robots with {job.cell.joint_count} joints in all, got "
            f"{layouts.X_WB.shape[1]} with {layouts.start.shape[1]}"
        )
    keep_freed_memory()
    count, nodes = len(layouts), len(job.times)
    q, qd = (np.empty((nodes, job.cell.joint_count, count)) for _ in range(2))
    lost_at = np.empty(count)
    with np.errstate(all="ignore"):  # what is not a number has lost its path
        for first in range(0, count, AT_ONCE):
            group = slice(first, first + AT_ONCE)
            lost_at[group] = _March(job, layouts.of_places(group)).into(q[..., group], qd[..., group])
    return Motions(q=np.moveaxis(q, 2, 0), qd=np.moveaxis(qd, 2, 0), lost_at=lost_at)


class _March:
    """A group of candidates on its way from node to node."""

    def __init__(self, job: Job, layouts: Layouts) -> None:
        """Bring the tools to the starts of their paths."""
        self._job, self._placement = job, layouts.placement(job)
        self._weights, self._mobile = np.ascontiguousarray(layouts.weights.T), np.ones(layouts.start.shape[1])
        self._count = len(layouts)
        self._start, self._arrived = settled(
            job.tasks,
            self._desired(0),
            self._placement,
            np.ascontiguousarray(layouts.start.T),
            mobile=job.settling,
            accuracy=START_TOL,
        )

    def into(self, q: Array, qd: Array) -> Array:
        """Fill in joints and speeds, shape (N, nq, K), and return the times at which candidates lost a path, (K,)."""
        job, times, at = self._job, self._job.times, self._start
        lost_at = np.where(self._arrived, np.inf, -np.inf)
        for node in range(len(times)):
            q[node], qd[node], errors = self._corrected(node, at)
            if node and job.is_begin[node - 1]:  # the first step of a stretch looks back on nothing: once more
                at = q[node - 1] + 0.5 * (times[node] - times[node - 1]) * (qd[node - 1] + qd[node])
                q[node], qd[node], errors = self._corrected(node, at)
            is_on_path = (errors <= LOST) & np.isfinite(q[node] + qd[node]).all(axis=0)
            lost_at[~is_on_path & np.isposinf(lost_at)] = times[node]
            if not np.isposinf(lost_at).any():
                q[node + 1 :], qd[node + 1 :] = np.nan, np.nan
                break
            if node + 1 < len(times):
                at = q[node] + sum(
                    weight * qd[node - back] for back, weight in enumerate(job.steps[node].tolist()) if weight
                )
        return lost_at

    def _corrected(self, node: int, at: Array) -> tuple[Array, Array, Array]:
        """Configurations near given ones with the tools on their paths, speeds there, and errors before, (K,)."""
        job = self._job
        linear = job.tasks.linearise(
            at, self._desired(node), self._placement, mobile=self._mobile, weights=self._weights
        )
        errors = np.abs(linear.errors).max(axis=(0, 1))
        drift = None if job.drift is None else job.drift[node]
        return at + linear.correction(np.zeros_like(at)), linear.velocities(drift), errors

    def _desired(self, node: int) -> Desired:
        """The desired motion at a node, the same for all."""
        return repeated((self._job.X[..., node : node + 1], self._job.V[..., node : node + 1]), self._count)


def run_near(job: Job, layouts: Layouts, q: Array, rates: Array | None = None, *, accuracy: float = PASSED) -> Motions:
    """The motions of a few candidates that are known to be near given ones: all nodes at once.

    Picard's iteration finds the integral of the speeds, Newton's method the paths, both in one pass over all nodes; the
    integral is that of the parabolas through neighbouring nodes. It takes a few passes where ``run`` takes as many
    linearisations as there are nodes. Candidates that passes do not settle are run from node to node.

    Args:
        q: Joint positions at the nodes that are nearly right in [rad] or [m], shape (K, N, nq).
        rates: How the joint speeds change with the joints near them, see ``MotionDerivatives``, shape (N, nq, nq); a
            few passes less are needed with them.
        accuracy: Change of the joints in [rad] and [m] below which a pass is the last one.
    """
    keep_freed_memory()
    count, nodes, _ = q.shape
    start, at = layouts.start.T, np.ascontiguousarray(np.moveaxis(q, 2, 0))
    with np.errstate(all="ignore"):
        first = repeated((job.X[..., :1], job.V[..., :1]), count)
        placement = layouts.placement(job)
        start, arrived = settled(job.tasks, first, placement, start, mobile=job.settling, accuracy=START_TOL)
        passes = _Passes(
            job=job,
            start=start[:, :, None],
            placement=placement.repeated(nodes),
            desired=repeated((job.X, job.V), count),
            weights=np.repeat(layouts.weights.T, nodes, axis=1),
            rates=rates,
        )
        for _ in range(MOST_PASSES):
            change, velocities, errors = passes.once(at)
            at = at + change
            is_settled = np.abs(change).max(axis=(0, 2)) <= accuracy
            if is_settled.all():
                break
    return _completed(job, layouts, at, velocities, is_settled=is_settled & arrived & (errors <= LOST))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Passes:
    """What passes over all nodes of some candidates have in common; see ``run_near``."""

    job: Job  # the tasks at their nodes
    start: Array  # start postures, shape (nq, K, 1)
    placement: Placement  # where the robots stand
    desired: Desired  # the desired motion
    weights: Array  # joint weights, shape (nq, K N)
    rates: Array | None  # how speeds change with the joints, shape (N, nq, nq); None where that is not known

    def once(self, at: Array) -> tuple[Array, Array, Array]:
        """Corrections and speeds at joints, shape (nq, K, N) all three, and tool errors before them, shape (K,)."""
        nq, count, nodes = at.shape
        linear = self.job.tasks.linearise(
            at.reshape(nq, -1), self.desired, self.placement, mobile=np.ones(nq), weights=self.weights
        )
        drift = None if self.job.drift is None else np.tile(self.job.drift.T, count)
        velocities = linear.velocities(drift).reshape(at.shape)
        picard = (self.start + velocities @ self.job.integral.T - at).reshape(nq, -1)
        change = picard + linear.correction(picard)
        if self.rates is not None:
            change = _with_consequences(self.job, change.reshape(at.shape), self.rates).reshape(nq, -1)
            change += linear.correction(change)
        return (
            change.reshape(at.shape),
            velocities,
            np.abs(linear.errors).max(axis=(0, 1)).reshape(count, nodes).max(axis=1),
        )


def _with_consequences(job: Job, change: Array, rates: Array) -> Array:
    """Changes of the joints, shape (nq, K, N), and what the other speeds there add to them later, by Heun's rule."""
    changed = np.ascontiguousarray(np.moveaxis(change, 2, 0))
    added, speed = np.zeros_like(changed[0]), rates[0] @ changed[0]
    for node, step in enumerate(np.diff(job.times).tolist(), start=1):
        at, rate = changed[node], rates[node]
        at += added
        ahead = rate @ (at + step * speed)
        speed += ahead
        speed *= 0.5 * step
        added += speed
        at += speed
        speed = rate @ at
    return np.moveaxis(changed, 0, 2)


def _completed(job: Job, layouts: Layouts, at: Array, velocities: Array, *, is_settled: Flags) -> Motions:
    """The motions that passes settled, shape (nq, K, N), and the others run from node to node."""
    q, qd, lost_at = np.moveaxis(at, 0, 2).copy(), np.moveaxis(velocities, 0, 2).copy(), np.full(len(layouts), np.inf)
    others = np.flatnonzero(~is_settled)
    if others.size:
        again = run(job, layouts.of_places(others))
        q[others], qd[others], lost_at[others] = again.q, again.qd, again.lost_at
    return Motions(q=q, qd=qd, lost_at=lost_at)
