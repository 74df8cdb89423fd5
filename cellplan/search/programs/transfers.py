r"""Transfers: an estimate of the time between the motions of a program, each transfer straight from rest to rest.

All joints of a transfer share one law, whose bounds of speed, acceleration and jerk are the least of all joints; see
``planning.transfer.straight_time``. Here the least is that of a p-norm, :math:`1/v = \|\Delta q_i / V_i\|_p`, so that
the time has derivatives where two joints are as slow as each other; it is a little longer than the true one. Limits of
points in the world count as in the given layout. A transfer over via points rests in each of them: it has several legs.

A transfer that is not free straight has to go round what is in its way. With :math:`\delta` the p-norm of what bodies
miss of their demanded distances at some configurations along it, and a little more, it is taken to last
:math:`1 + \kappa \delta / (\delta + D)` times as long. The detour :math:`\kappa` of each transfer is 1 until a planned
program shows what it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.straight_time import box_widths
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.variables.phase_variables import ProgramVariables, in_place_of

NORM: Final = 24.0  # [-] p: six joints as slow as each other take 8 % more
SHORTEST: Final = 1e-9  # [rad] or [m] of a move: what is shorter stands still
STEP: Final = 1e-6  # [rad] or [m] to either side, by which the time is differentiated
SAMPLES: Final = 15  # [-] configurations along a transfer at which distances are asked
DEPTH_NORM: Final = 4.0  # [-] p of depths: nearly the deepest
DEEP: Final = 0.05  # [m] D: depth with which a transfer takes half of its detour
RESERVE: Final = 0.005  # [m] beyond the demanded distances: bodies come nearer between the configurations
DETOURS: Final = (0.2, 5.0)  # [-] smallest and largest detour that is learned
HOME: Final = -1  # in place of a node


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Transfers:
    """The motions of a program, and the R transfers between them with T straight legs in all."""

    parts: tuple[slice, ...]  # nodes of the motions
    ends: Indices  # nodes that each joint of a leg moves from and to, or ``HOME``, shape (2, T, nq)
    home: Array  # where joints stand at ``HOME`` in [rad] or [m]: homes and via points, shape (2, T, nq)
    of: Indices  # the transfer that each leg belongs to, shape (T,)
    bounds: JointLimitsInTime  # limits of the joints
    step: float  # time between two rows in [s]
    stays: Array  # time in [s] for which all robots stand in each transfer, shape (R,)
    bodies: tuple[CellDistances, ...]  # the bodies during each leg
    detours: Array  # by how many times longer each transfer takes where bodies are deep in each other, shape (R,)
    window: float = 0.0  # time in [s] that limits of jerk add to a retimed stretch of a motion, from rest to rest

    @classmethod
    def none(cls, joints: int, *, nodes: int) -> "Transfers":
        """Those of a single motion."""
        nothing, none = np.zeros(joints), np.zeros(0)
        return cls(
            parts=(slice(0, nodes),),
            ends=np.zeros((2, 0, joints), dtype=np.intp),
            home=nothing,
            of=none.astype(np.intp),
            bounds=JointLimitsInTime(velocity=nothing, acceleration=nothing, jerk=nothing),
            step=1.0,
            stays=none,
            bodies=(),
            detours=none,
        )

    def repeated(self, count: int) -> Self:
        """The same with the nodes of each motion so many times one after the other, of which the first ones count."""
        parts, ends = [], self.ends.copy()
        for part in self.parts:
            parts.append(slice(count * part.start, count * part.stop))
            ends[(self.ends >= part.start) & (self.ends < part.stop)] += (count - 1) * part.start
        return replace(self, parts=tuple(parts), ends=ends)

    def of_variables(self, variables: ProgramVariables) -> Self:
        """The same for other variables of the program; see ``CellDistances``."""
        bodies = [one.of_variables(in_place_of(one.variables, variables)) for one in self.bodies]
        return replace(self, bodies=tuple(bodies))

    def seconds(self, x: Array, q: Array) -> float:
        """Time of them all in [s], for variables of shape (n,) and joint positions at the nodes, shape (N, nq)."""
        times, shares = self._straight(x, q)
        return float(times @ (1.0 + self.detours[self.of] * shares) + self.stays.sum())

    def learned(self, x: Array, q: Array, seconds: Sequence[float]) -> Self:
        """The same with the detours of a planned program, whose transfers take so many seconds, shape (R,)."""
        times, shares = self._straight(x, q)
        straight, blocked = (np.bincount(self.of, legs, len(self.detours)) for legs in (times, times * shares))
        shown = (np.array(seconds) - self.stays - straight) / np.maximum(blocked, SHORTEST)
        return replace(self, detours=np.where(blocked > 0.0, np.clip(shown, *DETOURS), self.detours))

    def _straight(self, x: Array, q: Array) -> tuple[Array, Array]:
        """Times of straight moves in [s] and shares of their detours, shape (T,) each."""
        begin, end = self._ends(q, self.home)
        depths = np.array([depth_along(bodies, x, *at)[0] for bodies, *at in zip(self.bodies, begin, end, strict=True)])
        return self._times(begin, end), depths / (depths + DEEP)

    def derivatives(self, x: Array, q: Array, dq: Array) -> Array:
        """Derivatives of this time by the variables, shape (n,), from those of the joints, shape (N, nq, n)."""
        total, (begin, end) = np.zeros(len(x)), self._ends(q, self.home)
        changes = self._ends(dq, np.zeros(dq.shape[1:]))
        times, detours, sides = self._times(begin, end), self.detours[self.of], STEP * np.eye(q.shape[1])
        for place, bodies in enumerate(self.bodies):
            a, b = begin[place], end[place]
            by_begin = (self._times(a + sides, b) - self._times(a - sides, b)) / (2.0 * STEP)
            by_end = (self._times(a, b + sides) - self._times(a, b - sides)) / (2.0 * STEP)
            depth, by_depth = depth_along(bodies, x, a, b, changes[:, place])
            slopes = by_begin @ changes[0, place] + by_end @ changes[1, place]
            total += (1.0 + detours[place] * depth / (depth + DEEP)) * slopes
            total += times[place] * detours[place] * DEEP / (depth + DEEP) ** 2 * by_depth
        return total

    def _ends(self, of_nodes: Array, at_home: Array) -> Array:
        """Values at both ends of each leg, shape (2, T, nq, ...), from those of the nodes, (N, nq, ...)."""
        is_home = (self.ends == HOME).reshape(*self.ends.shape, *(1,) * (of_nodes.ndim - 2))
        return np.where(is_home, at_home, of_nodes[self.ends, np.arange(of_nodes.shape[1])])

    def _times(self, begin: Array, end: Array) -> Array:
        """Times of straight moves in [s], shape (..., nq) each to (...)."""
        length, bounds = np.abs(end - begin), self.bounds
        v, a, j = (
            1.0 / np.maximum(np.linalg.norm(length / limit, ord=NORM, axis=-1), SHORTEST)[..., None]
            for limit in (bounds.velocity, bounds.acceleration, bounds.jerk)
        )
        shared = JointLimitsInTime(velocity=v, acceleration=a, jerk=j)
        highest = [np.full(length.shape[:-1], np.inf)]
        highest += [points.straight_rate(begin, end, self.step) for points in bounds.points]
        widths = box_widths(np.ones_like(v), shared, least=self.step, highest=np.min(highest, axis=0))
        times: Array = widths.sum(axis=-1)
        return np.where(length.max(axis=-1, initial=0.0) > SHORTEST, times, 0.0)


def depth_along(
    bodies: CellDistances, x: Array, begin: Array, end: Array, changes: Array | None = None
) -> tuple[float, Array]:
    """The p-norm of what bodies miss of their distances along a straight move in [m], and its derivatives, shape (n,).

    Args:
        x: The variables, shape (n,).
        begin: Joint positions in [rad] or [m], shape (nq,).
        end: Likewise.
        changes: Derivatives of both by the variables, shape (2, nq, n); None where those of the depth are not needed.
    """
    share = np.linspace(0.0, 1.0, SAMPLES + 2)[1:-1, None]
    near = bodies.near(x, begin + share * (end - begin), bodies.most_demanded + RESERVE)
    demands = bodies.demands[near.rows]
    missed = np.maximum(demands + np.where(demands > 0.0, RESERVE, 0.0) - near.distances, 0.0)
    depth = float(np.linalg.norm(missed, ord=DEPTH_NORM)) if len(missed) else 0.0
    if changes is None or depth <= 0.0:
        return depth, np.zeros(len(x))
    dq = changes[0] + share[..., None] * (changes[1] - changes[0])
    return depth, -((missed / depth) ** (DEPTH_NORM - 1.0)) @ bodies.derivatives(near, x, dq)
