r"""The smoothest points within a tube round given ones: a convex problem, solved with a bound of its optimum.

The roughness of points x at arc lengths s is the root mean square of their second derivative, by divided differences D:

.. math:: \min_e \tfrac12 |D (x + e)|^2, \quad k_i - 2 m_i \cdot e_i - |e_i|^2 \ge 0, \quad h_i + w_i \cdot e_i \ge 0

Each deviation e lies in a ball and in a half space. Positions have a ball of the tube's radius about 0 and a plane
across the tool's axis. Unit axes a within a cone about given ones lie in a cap of the unit ball, which is convex:
:math:`|a| \le 1, n \cdot a \ge \cos\delta`. Vectors of the cap stay in the cone when they are normalised, the
objective does not stay the same; the bound holds for all unit axes of the cone, as the cap contains them.

The method is that of logarithmic barriers ([Boyd2004]_ Ch. 11). Multipliers :math:`1 / (t s)` of slacks s are feasible
for the dual problem; the minimum of their Lagrangian, a quadratic of the same band, is a lower bound whatever their
accuracy.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices

BLOCK: Final = 16  # points of a block of the matrix; differences of a closed chain couple points up to 4 apart
SAME: Final = 1e-6  # [-] of the objective: a gap to its bound below this ends the search
NO_ROUGHNESS: Final = 1e-12  # [-] of the objective of the given points: smaller is rounding
GROWTH: Final = 10.0  # [-] by which the weight of the objective grows from one centre to the next
MOST_CENTRES: Final = 30
MOST_STEPS: Final = 40  # steps of Newton to one centre
CENTRED: Final = 1e-6  # [-] square of Newton's decrement at a centre
ARMIJO: Final = 0.1  # [-] of the decrease that a step promises
SHORTEST_STEP: Final = 1e-10  # [-] of a step of Newton: a shorter one is rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tube:
    """Where deviations e may be: ``k - 2 m·e - |e|^2 >= 0`` and ``h + w·e >= 0``, with a point inside."""

    k: Array  # shape (N,)
    m: Array  # shape (N, 3)
    h: Array  # shape (N,)
    w: Array  # shape (N, 3)
    inside: Array  # deviations with positive slacks, shape (N, 3)

    @classmethod
    def of_positions(cls, normals: Array | None, count: int, *, radius: float, into: float) -> Self:
        """Deviations up to a radius, and along unit normals, shape (N, 3), up to ``into``, above minus the radius."""
        zero = np.zeros((count, 3))
        w = zero if normals is None else -normals
        height = 1.0 if normals is None else into
        start = 0.5 * (min(into, 0.0) - radius) if into < radius else 0.0
        return cls(k=np.full(count, radius**2), m=zero, h=np.full(count, height), w=w, inside=-start * w)

    @classmethod
    def of_axes(cls, axes: Array, *, angle: float) -> Self:
        """Unit axes, shape (N, 3), up to an angle in [rad] below a right one away from given ones, or shorter ones."""
        height = 2.0 * np.sin(0.5 * angle) ** 2
        return cls(k=np.zeros(len(axes)), m=axes, h=np.full(len(axes), height), w=axes, inside=-0.5 * height * axes)

    def slacks(self, e: Array) -> tuple[Array, Array]:
        """How much is left of both bounds at deviations, shape (N,) each."""
        return self.k - 2.0 * np.sum(self.m * e, axis=1) - np.sum(e**2, axis=1), self.h + np.sum(self.w * e, axis=1)


class Smoothest(NamedTuple):
    """Smoothed values, and how rough they are."""

    values: Array  # shape (N, 3)
    bound: float  # no values in the tube have a smaller roughness


class Differences:
    """Second derivatives of values at parameters, by divided differences, weighted by the parameter."""

    def __init__(self, knots: Array, *, kinks: Flags, is_closed: bool) -> None:
        """Differences about every point but kinks, and the ends of an open chain.

        Args:
            knots: Increasing parameters, shape (N,), of a closed chain with that of the return to its start.
            kinks: Points at which the direction may change at once, shape (N,), of a closed chain without the return.
        """
        self.length = float(knots[-1] - knots[0])
        count = len(knots) - is_closed
        centre = np.flatnonzero(~kinks) if is_closed else np.flatnonzero(~kinks[1:-1]) + 1
        width = np.diff(knots)
        before, after = width[centre - 1], width[centre % len(width)]
        mean = 0.5 * (before + after)
        weights = np.stack([1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after], axis=1)
        self.count = count
        self.points: Indices = np.stack([(centre - 1) % count, centre, (centre + 1) % count], axis=1)
        self.weights = weights / np.sqrt(mean)[:, None]

    def of(self, values: Array) -> Array:
        """Weighted second derivatives of values of shape (N, 3), shape (M, 3)."""
        return np.einsum("rj,rjc->rc", self.weights, values[self.points])

    def roughness(self, values: Array) -> float:
        """Root mean square of the second derivative of values of shape (N, 3), in their unit by that of knots^2."""
        return float(np.sqrt(np.sum(self.of(values) ** 2) / self.length))


def smoothest(values: Array, differences: Differences, tube: Tube, *, fixed: Flags) -> Smoothest:
    """The least rough values within a tube about given ones.

    Args:
        values: Given values, shape (N, 3).
        fixed: Which of them stay as they are, shape (N,).
    """
    scale = float(np.linalg.norm(differences.of(values)))
    if fixed.all() or scale <= np.sqrt(np.finfo(float).tiny):
        return Smoothest(values, differences.roughness(values))
    problem = _Problem(values, differences, tube, fixed=fixed, scale=scale)
    e, bound = problem.solved()
    return Smoothest(values + e, scale * float(np.sqrt(2.0 * bound / differences.length)))


class _Problem:
    """Smoothing with the objective 1/2 at the given values."""

    def __init__(self, values: Array, differences: Differences, tube: Tube, *, fixed: Flags, scale: float) -> None:
        """Store the problem, with the band of its objective in blocks."""
        self._rough, self._tube, self._is_free = differences.of(values) / scale, tube, ~fixed
        self._points = differences.points
        self._weights = differences.weights / scale * self._is_free[self._points]
        self._order = _folded(differences.count)
        self._diagonal, self._upper = _blocks(self._order[self._points], self._weights, differences.count)

    def solved(self) -> tuple[Array, float]:
        """Deviations, shape (N, 3), and a lower bound of the objective."""
        free = self._is_free
        e, t, bound = self._tube.inside * free[:, None], 2.0 * np.count_nonzero(free), 0.0
        for _ in range(MOST_CENTRES):
            e = self._centred(e, t)
            bound = max(bound, self._dual_value(e, t))
            value = self._value(e)
            if value - bound <= max(SAME * value, NO_ROUGHNESS):
                break
            t *= GROWTH
        return e, bound

    def _value(self, e: Array) -> float:
        """The objective."""
        return 0.5 * float(np.sum(self._residual(e) ** 2))

    def _residual(self, e: Array) -> Array:
        return self._rough + np.einsum("rj,rjc->rc", self._weights, e[self._points])

    def _gradient(self, e: Array) -> Array:
        """Derivative of the objective, shape (N, 3)."""
        gradient, residual = np.zeros_like(e), self._residual(e)
        for j in range(3):
            np.add.at(gradient, self._points[:, j], self._weights[:, j, None] * residual)
        return gradient

    def _barrier(self, e: Array, t: float) -> float:
        """Weighted objective with the barriers of free points; inf outside the tube."""
        ball, plane = (slack[self._is_free] for slack in self._tube.slacks(e))
        if min(ball.min(), plane.min()) <= 0.0:
            return np.inf
        return t * self._value(e) - float(np.log(ball).sum() + np.log(plane).sum())

    def _centred(self, e: Array, t: float) -> Array:
        """The minimum of the barrier function with a weight of the objective, by Newton's method."""
        free = self._is_free[:, None]
        level = self._barrier(e, t)
        for _ in range(MOST_STEPS):
            ball, plane = (np.where(self._is_free, slack, 1.0)[:, None] for slack in self._tube.slacks(e))
            of_ball, of_plane = 2.0 * (self._tube.m + e) / ball * free, -self._tube.w / plane * free
            gradient = t * self._gradient(e) + of_ball + of_plane
            curvature = 2.0 * np.eye(3) / ball[:, :, None]
            for normal in (of_ball, of_plane):
                curvature = curvature + normal[:, :, None] * normal[:, None, :]
            step = -self._solve(t, curvature, gradient)
            promised = -float(np.sum(gradient * step))
            if not promised > CENTRED:
                break
            share = 1.0
            while (lower := self._barrier(e + share * step, t)) > level - ARMIJO * share * promised:
                share *= 0.5
                if share < SHORTEST_STEP:
                    return e
            e, level = e + share * step, lower
        return e

    def _dual_value(self, e: Array, t: float) -> float:
        """The minimum of the Lagrangian with the multipliers of a centre: no feasible objective is less."""
        free = self._is_free[:, None]
        slacks = (np.where(self._is_free, slack, np.inf)[:, None] for slack in self._tube.slacks(e))
        ball, plane = (1.0 / (t * slack) for slack in slacks)
        curvature = 2.0 * ball[:, :, None] * np.eye(3)
        for _ in range(2):  # the second removes the rounding of the first
            gradient = self._gradient(e) + 2.0 * ball * (self._tube.m + e) * free - plane * self._tube.w
            e = e - self._solve(1.0, curvature, gradient)
        of_ball, of_plane = self._tube.slacks(e)
        return self._value(e) - float(ball[:, 0] @ of_ball + plane[:, 0] @ of_plane)

    def _solve(self, t: float, curvature: Array, right: Array) -> Array:
        """Solution with the matrix ``t DᵀD`` plus blocks of shape (N, 3, 3); fixed points stay 0; shape (N, 3)."""
        blocks = len(self._diagonal)
        local = np.broadcast_to(np.eye(3), (blocks * BLOCK, 3, 3)).copy()
        local[self._order] = np.where(self._is_free[:, None, None], curvature, np.eye(3))
        ordered = np.zeros((blocks * BLOCK, 3))
        ordered[self._order] = np.where(self._is_free[:, None], right, 0.0)
        matrix = t * _for_components(self._diagonal)
        at = np.arange(BLOCK)
        matrix.reshape(blocks, BLOCK, 3, BLOCK, 3)[:, at, :, at] += np.moveaxis(
            local.reshape(blocks, BLOCK, 3, 3), 1, 0
        )
        x = _solve_blocks(matrix, t * _for_components(self._upper), ordered.reshape(blocks, 3 * BLOCK))
        return x.reshape(-1, 3)[self._order]


def _folded(count: int) -> Indices:
    """Places of the points of a chain, folded in the middle: its ends, joined where it is closed, are neighbours."""
    k = np.arange(count)
    return np.where(2 * k < count, 2 * k, 2 * (count - 1 - k) + 1)


def _blocks(points: Indices, weights: Array, count: int) -> tuple[Array, Array]:
    """Blocks of ``DᵀD`` on and right of the diagonal, shapes (K, BLOCK, BLOCK) and (K - 1, BLOCK, BLOCK)."""
    blocks = -(-count // BLOCK)
    diagonal, upper = np.zeros((blocks, BLOCK, BLOCK)), np.zeros((blocks - 1, BLOCK, BLOCK))
    for i in range(3):
        for j in range(3):
            block, of_other = points[:, i] // BLOCK, points[:, j] // BLOCK
            for target, is_there in ((diagonal, of_other == block), (upper, of_other == block + 1)):
                at = block[is_there], points[is_there, i] % BLOCK, points[is_there, j] % BLOCK
                np.add.at(target, at, (weights[:, i] * weights[:, j])[is_there])
    return diagonal, upper


def _for_components(blocks: Array) -> Array:
    """Blocks with one equal entry for each of three components."""
    size = 3 * BLOCK
    return np.einsum("kij,cd->kicjd", blocks, np.eye(3)).reshape(len(blocks), size, size)


def _solve_blocks(diagonal: Array, upper: Array, right: Array) -> Array:
    """Solution of a symmetric system of tridiagonal blocks by elimination, shape (K, n) like the right-hand side."""
    last, couplings, x = len(diagonal) - 1, [], np.empty_like(right)
    pivot, rest = diagonal[0], right[0]
    for k in range(last):
        solved = np.linalg.solve(pivot, np.column_stack([upper[k], rest]))
        couplings.append(solved[:, :-1])
        x[k] = solved[:, -1]
        pivot, rest = diagonal[k + 1] - upper[k].T @ couplings[k], right[k + 1] - upper[k].T @ x[k]
    x[last] = np.linalg.solve(pivot, rest)
    for k in range(last - 1, -1, -1):
        x[k] -= couplings[k] @ x[k + 1]
    return x
