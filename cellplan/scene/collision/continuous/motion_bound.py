r"""Bounds on the distance of moving bodies: a distance at one sample bounds those at other times by the motion between.

Between two samples all joints move linearly; the unit of time is that step. Let x(s) be a point of B seen from A and
:math:`|\ddot x| \le M` for every such point (``Bends``). Then, for s in [0, 1]:

- Taylor's theorem, a point strays from the chord of its step by no more than
  :math:`|x(s) - (1-s)\,x(0) - s\,x(1)| \le M s (1-s) / 2 \le M / 8`. The distance of a point of the chord from any
  fixed point is largest at one of its ends. So a distance d(m), proved at a sample m, proves
  :math:`d(s) \ge d(m) - \max(\delta(0), \delta(1)) - M/8`, where :math:`\delta(k)` is the farthest that a point moved
  between m and the sample k: :math:`|c(k) - c(m)| + \rho\,|R(k) - R(m)|_2` with a sphere :math:`(c, \rho)` round B.
  With a line from a to b and a radius r round it that hold B, it is also
  :math:`\max(|a(k) - a(m)|, |b(k) - b(m)|) + r\,|R(k) - R(m)|_2`, which is less for a slender body.
- For a direction n fixed in A, ``n.x`` less what A reaches along n bounds the distance, for the point x of B that
  comes lowest; a minimum over points of functions that stay within M/8 of their chords does so from below:
  :math:`d(s) \ge \min(g(0), g(1)) - M/8`.
- :math:`\dot x(s) - (x(1) - x(0)) = \int_0^1 (\dot x(s) - \dot x(u))\,du` is no longer than
  :math:`M (s^2 + (1-s)^2)/2`, of which the integral over the step is M/3. So no point travels farther in a step than
  :math:`D = |\Delta c| + \rho\,|\Delta R|_2 + M/3` (or as much with the line in place of the sphere), and
  :math:`d(s) \ge (d(0) + d(1) - D)/2`.

All of it holds for A seen from B as well; the better one counts. D is also no more than the sum of each joint's turn
times its longest lever arm (``Bends.reach``), however long the step is.
"""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import rotated, rotated_back
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.distance import Reading
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.separation import supports

Pair = tuple[int, int]

SUPPORT_WORK: Final = 200_000  # [-] products of a direction and a vertex worth spending on one reading: about 0.5 ms
ROUNDING_TOL: Final = 1e-9  # [m] taken off what is carried over, so that rounding never lifts a bound above the truth


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bends:
    """How much the paths of points of two bodies may bend in each of the steps of a motion; time counts in steps."""

    second: Array  # largest second derivative of a point of the second body seen from the first in [m], shape (n - 1,)
    first: Array  # likewise of the first seen from the second
    reach: Array  # no point of the one travels farther than this seen from the other, in [m], shape (n - 1,)


class BodyMotion(Protocol):
    """Bodies that move through n samples, joints moving linearly from each to the next."""

    @property
    def poses(self) -> BodyPoses:
        """Where the bodies are at the samples."""

    def bends(self, pair: Pair) -> Bends:
        """How much the paths of two bodies bend in each step."""

    def relative(self, pair: Pair) -> tuple[Array, Array]:
        """Rotations, shape (n, 3, 3), and positions in [m], shape (n, 3), of the second body seen from the first."""

    def sphere_bounds(self, pair: Pair) -> Array:
        """Lower bound of the distance of two bounding spheres in each step in [m], shape (n - 1,)."""

    def finer(self, pair: Pair, step: int, *, parts: int) -> "BodyMotion":
        """One step cut into equal parts; where other bodies than the pair are remains unsaid."""


class PairMotion:
    """Two bodies over all samples, each seen from the other."""

    def __init__(self, engine: Engine, pair: Pair, motion: BodyMotion) -> None:
        """Work out the pose of the second body seen from the first at each sample."""
        first, second = pair
        self._a, self._b = engine.bodies[first], engine.bodies[second]
        self._R_WA = motion.poses.R[first]
        self._R_AB, self._p_AB = motion.relative(pair)
        R_BA = np.ascontiguousarray(np.swapaxes(self._R_AB, 1, 2))
        p_BA = -np.einsum("nij,ni->nj", self._R_AB, self._p_AB)
        self._b_in_A, self._a_in_B = _Carried(self._b, self._R_AB, self._p_AB), _Carried(self._a, R_BA, p_BA)
        self._work = sum(len(body.hull.vertices) for body in (self._a, self._b) if isinstance(body.hull, Mesh))
        self._bends = motion.bends(pair)
        self._strays_b, self._strays_a = self._bends.second / 8.0, self._bends.first / 8.0

    def step_travel(self, step: int) -> float:
        """Upper bound of the distance that any point of either body travels in a step, seen from the other, in [m]."""
        along_b, along_a = (float(moved[0]) for moved in self.displacement(step, slice(step + 1, step + 2)))
        along_b += float(self._bends.second[step]) / 3.0
        along_a += float(self._bends.first[step]) / 3.0
        return min(along_a, along_b, float(self._bends.reach[step])) + ROUNDING_TOL

    def displacement(self, sample: int, others: slice | Indices) -> tuple[Array, Array]:
        """Farthest that a point of either body moved, seen from the other, between a sample and m others.

        Of the second body, then of the first, in [m], shape (m,) each.
        """
        turn = _turns(self._R_AB[others] - self._R_AB[sample])
        return self._b_in_A.displacement(sample, others, turn), self._a_in_B.displacement(sample, others, turn)

    def carry(self, reading: Reading, sample: int, *, first: int, last: int, low: Array) -> None:
        """Raise the lower bounds of the steps from one sample to a later one by what a reading proves there.

        The reading is at ``sample``, no earlier than ``first`` and no later than ``last``, between which the steps lie;
        bounds are those of all steps in [m], shape (n - 1,).
        """
        if last <= first:
            return
        if reading.bound > 0.0:
            moved_b, moved_a = self.displacement(sample, slice(first, last + 1))
            strayed_b = np.maximum(moved_b[1:], moved_b[:-1]) + self._strays_b[first:last]
            strayed_a = np.maximum(moved_a[1:], moved_a[:-1]) + self._strays_a[first:last]
            proved = reading.bound - np.minimum(strayed_a, strayed_b) - ROUNDING_TOL
            np.maximum(low[first:last], proved, out=low[first:last])
        if reading.direction is not None:
            first, last = self._affordable(sample, first, last)
            proved = self._carried_direction(reading.direction, sample, first, last)
            np.maximum(low[first:last], proved - ROUNDING_TOL, out=low[first:last])

    def _affordable(self, sample: int, first: int, last: int) -> tuple[int, int]:
        """As much of a stretch round the sample as support functions are not too much work for."""
        if not self._work:
            return first, last
        half = max(8, SUPPORT_WORK // (2 * self._work))
        return max(first, sample - half), min(last, sample + half)

    def _carried_direction(self, n: Array, sample: int, first: int, last: int) -> Array:
        """Distance in [m] that a direction, held fast in A or in B, proves between the hulls in each step."""
        n_A = n @ self._R_WA[sample]
        n_A = n_A / np.linalg.norm(n_A)
        n_B = n_A @ self._R_AB[sample]
        R, p = self._R_AB[first : last + 1], self._p_AB[first : last + 1]
        a, b = self._a.hull, self._b.hull
        in_A = p @ n_A - supports(a, n_A[None])[0] - supports(b, -rotated_back(R, n_A))
        turning = rotated(R, n_B)
        in_B = np.einsum("ij,ij->i", turning, p) - supports(a, turning) - supports(b, -n_B[None])[0]
        by_A = np.minimum(in_A[1:], in_A[:-1]) - self._strays_b[first:last]
        by_B = np.minimum(in_B[1:], in_B[:-1]) - self._strays_a[first:last]
        return np.maximum(by_A, by_B) - self._a.looseness - self._b.looseness


class _Carried:
    """What holds one body, seen from the other at all samples: a line and a radius round it, or a sphere."""

    def __init__(self, body: CollisionBody, R: Array, p: Array) -> None:
        """Carry both ends of the line along, or the centre; poses seen from the other, shapes (n, 3, 3) and (n, 3)."""
        is_slender = float(np.linalg.norm(body.ends[1] - body.ends[0])) > 2.0 * body.girth
        points, self._radius = (body.ends, body.girth) if is_slender else (body.centre[None], body.radius)
        self._points = [rotated(R, point) + p for point in points]

    def displacement(self, sample: int, others: slice | Indices, turn: Array) -> Array:
        """Farthest that a point of the body moved between a sample and m others, which turned it so far, shape (m,)."""
        farthest: Array = self._radius * turn
        squares = [np.einsum("ij,ij->i", moved, moved) for moved in (p[others] - p[sample] for p in self._points)]
        farthest += np.sqrt(squares[0] if len(squares) == 1 else np.maximum(*squares))
        return farthest


def _turns(change: Array) -> Array:
    """Spectral norms of differences of rotations, shape (n, 3, 3): ``|R' - R|_F = sqrt(2) |R' - R|_2``."""
    flat = change.reshape(-1, 9)
    return np.sqrt(0.5 * np.einsum("ij,ij->i", flat, flat))
