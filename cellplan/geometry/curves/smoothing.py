r"""The smoothest points within a tube round given ones: a convex problem, solved with a bound of its optimum.

The roughness of points x at arc lengths s is the root mean square of their second derivative, by divided differences D:

.. math:: \min_e \tfrac12 |D (x + e)|^2, \quad k_i - 2 m_i \cdot e_i - |e_i|^2 \ge 0, \quad h_i + w_i \cdot e_i \ge 0

Each deviation e lies in a ball and in a half space. Positions have a ball of the tube's radius about 0 and a plane
across the tool's axis. Unit axes a within a cone about given ones lie in a cap of the unit ball, which is convex:
:math:`|a| \le 1, n \cdot a \ge \cos\delta`. Vectors of the cap stay in the cone when they are normalised, the
objective does not stay the same; the bound holds for all unit axes of the cone, as the cap contains them.

The method is a primal-dual one of interior points ([Boyd2004]_ 11.7). Its positive multipliers are feasible for the
dual problem; the minimum of their Lagrangian, a quadratic of the same band, is a lower bound whatever their accuracy.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices

BLOCK: Final = 16  # points of a block of the matrix; differences of a closed chain couple points up to 4 apart
SAME: Final = 1e-6  # [-] of the objective: a gap to its bound below this ends the search
NO_ROUGHNESS: Final = 1e-12  # [-] of the objective of the given points: smaller is rounding
ROUNDED: Final = 1e-3  # [-] of that gap, by the multipliers: smaller is rounding, whatever the bound
MOST_STEPS: Final = 100  # of Newton; thirty are usual
INSIDE: Final = 0.99  # [-] of each slack and multiplier that a step uses at most
CENTRED: Final = 1e-3  # [-] of the mean of products of slacks and multipliers: none is less
SHORTER: Final = 0.8  # [-] of a step that leaves a lesser one
SHORTEST_STEP: Final = 1e-8  # [-] of a step of Newton: a shorter one is rounding
LONG_STEP: Final = 0.5  # [-] of a step of Newton: after a longer one …
CENTRING: Final = (0.1, 0.5)  # [-] … products of slacks and multipliers become this share of their mean, else that one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tube:
    """Where deviations e may be: ``k - 2 m·e - |e|^2 >= 0`` and ``h + w·e >= 0``, with a point inside."""

    k: Array  # shape (N,)
    m: Array  # shape (N, 3)
    h: Array  # shape (N,)
    w: Array  # shape (N, 3)
    inside: Array  # deviations with positive slacks, shape (N, 3)

    @classmethod
    def of_positions(cls, normals: Array | None, radius: Array, *, into: Array) -> Self:
        """Deviations up to radii, shape (N,), along unit normals, shape (N, 3), up to ``into``, above minus them."""
        zero = np.zeros((len(radius), 3))
        w = zero if normals is None else -normals
        height = np.ones(len(radius)) if normals is None else into
        start = np.where(into < radius, 0.5 * (np.minimum(into, 0.0) - radius), 0.0)
        return cls(k=radius**2, m=zero, h=height, w=w, inside=-start[:, None] * w)

    @classmethod
    def of_axes(cls, axes: Array, angle: Array) -> Self:
        """Unit axes, shape (N, 3), or shorter ones, up to angles in [rad], shape (N,), below right ones away."""
        height = 2.0 * np.sin(0.5 * angle) ** 2
        return cls(k=np.zeros(len(axes)), m=axes, h=height, w=axes, inside=-0.5 * height[:, None] * axes)

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
        e, bound = self._tube.inside * self._is_free[:, None], 0.0
        slacks = self._slacks(e)
        multipliers = self._value(e) / (slacks.size * slacks)
        centring = CENTRING[0]
        for _ in range(MOST_STEPS):
            value, gap = self._value(e), float(np.sum(multipliers * slacks))
            negligible = max(SAME * value, NO_ROUGHNESS)
            if gap <= negligible:
                bound = max(bound, self._dual_value(e, multipliers))
            if value - bound <= negligible or gap <= ROUNDED * negligible:
                return e, bound
            step, change = self._newton(e, multipliers, slacks, mean=centring * gap / slacks.size)
            length = self._length(e, step, change, multipliers=multipliers, slacks=slacks)
            while not _is_centred(self._slacks(e + length * step), multipliers + length * change):
                length *= SHORTER
                if length < SHORTEST_STEP:  # rounding: what is reached has a bound too
                    return e, max(bound, self._dual_value(e, multipliers))
            e, multipliers = e + length * step, multipliers + length * change
            slacks = self._slacks(e)
            centring = CENTRING[0] if length > LONG_STEP else CENTRING[1]
        return e, max(bound, self._dual_value(e, multipliers))

    def _slacks(self, e: Array) -> Array:
        """What is left of both bounds at the free points, shape (2, F)."""
        return np.stack(self._tube.slacks(e))[:, self._is_free]

    def _outward(self, e: Array) -> tuple[Array, Array]:
        """Gradients of both slacks at the free points, away from the inside, shape (F, 3) each."""
        return 2.0 * (self._tube.m + e)[self._is_free], -self._tube.w[self._is_free]

    def _value(self, e: Array) -> float:
        """The objective."""
        return 0.5 * float(np.sum(self._residual(e) ** 2))

    def _residual(self, e: Array) -> Array:
        return self._rough + np.einsum("rj,rjc->rc", self._weights, e[self._points])

    def _gradient(self, e: Array) -> Array:
        """Derivative of the objective at the free points, shape (F, 3)."""
        gradient, residual = np.zeros_like(e), self._residual(e)
        for j in range(3):
            np.add.at(gradient, self._points[:, j], self._weights[:, j, None] * residual)
        return gradient[self._is_free]

    def _newton(self, e: Array, multipliers: Array, slacks: Array, *, mean: float) -> tuple[Array, Array]:
        """Newton's step of deviations and multipliers to products of slacks and multipliers that are all ``mean``."""
        outward = self._outward(e)
        curvature = 2.0 * multipliers[0][:, None, None] * np.eye(3)
        right = -self._gradient(e)
        for normal, multiplier, slack in zip(outward, multipliers, slacks, strict=True):
            curvature = curvature + (multiplier / slack)[:, None, None] * normal[:, :, None] * normal[:, None, :]
            right = right - (mean / slack)[:, None] * normal
        step = self._solve(curvature, right)
        inner = step[self._is_free]
        moved = np.stack([np.sum(normal * inner, axis=1) for normal in outward])
        return step, (mean + multipliers * moved) / slacks - multipliers

    def _length(self, e: Array, step: Array, change: Array, *, multipliers: Array, slacks: Array) -> float:
        """The share of a step, at most 1, that leaves a part of every slack and multiplier."""
        inner, most = step[self._is_free], INSIDE * slacks
        falls = np.stack([np.sum(normal * inner, axis=1) for normal in self._outward(e)])
        bends = np.outer([1.0, 0.0], np.sum(inner**2, axis=1))  # a slack falls by falls x + bends x^2 at a share x
        shares = 2.0 * most / np.maximum(falls + np.sqrt(falls**2 + 4.0 * bends * most), 2.0 * most)
        of_multipliers = INSIDE * multipliers / np.maximum(-change, INSIDE * multipliers)
        return float(min(shares.min(), of_multipliers.min()))

    def _dual_value(self, e: Array, multipliers: Array) -> float:
        """A lower bound of the Lagrangian with some multipliers, from near its minimum: no feasible objective is less.

        Its second derivative is at least twice the multipliers of the balls, so a rest of its gradient is allowed for.
        """
        curvature = 2.0 * multipliers[0][:, None, None] * np.eye(3)
        for _ in range(2):  # the second removes the rounding of the first
            e = e - self._solve(curvature, self._of_lagrangian(e, multipliers))
        rest = float(np.sum(np.sum(self._of_lagrangian(e, multipliers) ** 2, axis=1) / (4.0 * multipliers[0])))
        return self._value(e) - float(np.sum(multipliers * self._slacks(e))) - rest

    def _of_lagrangian(self, e: Array, multipliers: Array) -> Array:
        """Derivative of the Lagrangian at the free points, shape (F, 3)."""
        return self._gradient(e) + np.einsum("kf,kfc->fc", multipliers, np.stack(self._outward(e)))

    def _solve(self, curvature: Array, right: Array) -> Array:
        """Solution with the matrix ``DᵀD`` plus blocks of free points, shape (F, 3, 3); others stay 0; shape (N, 3)."""
        blocks, at = len(self._diagonal), np.arange(BLOCK)
        local = np.broadcast_to(np.eye(3), (blocks * BLOCK, 3, 3)).copy()
        ordered, free = np.zeros((blocks * BLOCK, 3)), self._order[self._is_free]
        local[free], ordered[free] = curvature, right
        matrix = _for_components(self._diagonal)
        matrix.reshape(blocks, BLOCK, 3, BLOCK, 3)[:, at, :, at] += np.moveaxis(
            local.reshape(blocks, BLOCK, 3, 3), 1, 0
        )
        x = _solve_blocks(matrix, _for_components(self._upper), ordered.reshape(blocks, 3 * BLOCK))
        return x.reshape(-1, 3)[self._order]


def _is_centred(slacks: Array, multipliers: Array) -> bool:
    """Whether slacks are positive, and no product of one and its multiplier is far less than their mean."""
    products = slacks * multipliers
    return bool(slacks.min() > 0.0 and products.min() >= CENTRED * products.mean())


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
