r"""Worst displacements to first order: what all bases together may take from each demand, and which corners do it.

A figure :math:`g` changes by :math:`\sum_k g_k d_k` with the exact derivatives :math:`g_k` by each displacement
:math:`|d_k| \le a_k`; at its worst by :math:`\sum_k |g_k| a_k`, in the corner :math:`d_k = \pm a_k` of the signs of
:math:`g_k`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.misplacement.guarded import Guarded, away_from_fold
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort
from cellplan.search.programs.problem import Point, PointDerivatives

MOST: Final = 8  # [-] corners of each kind of demand


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Worst:
    """What displacements may take from the demands of one layout."""

    margins: Array  # what they take from the margins at the nodes to first order, in [rad] or [m], shape (N, nq)
    speeds: Array  # likewise from the speeds as shares of their limits, shape (N, nq)
    accelerations: Array  # likewise from the accelerations, shape (N, nq)
    distances: Array  # likewise from each pair of bodies in [m], shape (pairs,)
    corners: Array  # the displacements that do it for what comes nearest to its limit, shape (K, m)


def worst(problem: Guarded, point: Point, demands: Demands, effort: Effort) -> Worst:
    """The worst displacements of a layout."""
    amounts, by = problem.upper, problem.derivatives(point)
    measures = Measures.of(problem, point, demands, effort)
    apart = problem.distance_derivatives(point, measures.distances, by)
    q, qd = (np.abs(part) @ amounts for part in (by.q, by.qd))
    qdd = np.zeros_like(qd) if by.qdd is None else np.abs(by.qdd) @ amounts
    rows = measures.distances
    taken = away_from_fold(problem, np.abs(apart) @ amounts, rows.values, rows.pairs)
    worst_case = Worst(
        margins=q,
        speeds=qd / problem.limits.velocity,
        accelerations=qdd / problem.acceleration,
        distances=_of_pairs(problem, measures, taken),
        corners=np.zeros((0, len(amounts))),
    )
    signs = [*_of_joints(problem, measures, by, worst_case), *_of_distances(measures, apart, taken)]
    corners = np.unique(np.array(signs).reshape(-1, len(amounts)), axis=0)
    return replace(worst_case, corners=corners * amounts)


def _of_pairs(problem: Guarded, measures: Measures, taken: Array) -> Array:
    """What is taken from each pair where that leaves least; from pairs that are not near the median of the others."""
    distances, rows = np.full(len(problem.is_arm), np.median(taken) if len(taken) else 0.0), measures.distances
    for row in np.argsort(measures.violations + taken, kind="stable").tolist():
        distances[rows.pairs[row]] = taken[row]
    return distances


def _of_joints(problem: Guarded, measures: Measures, by: PointDerivatives, worst_case: Worst) -> Iterator[Array]:
    """Signs of the displacements that take most from margins, speeds and accelerations."""
    point = measures.point
    units = np.where(problem.limits.is_revolute, np.radians(1.0), 0.01)
    sides = [(measures.lower.value, -1.0), (measures.upper.value, 1.0)]
    for value, sign in sides:
        yield from _leading((value + worst_case.margins) / units, by.q * sign)
    loads = [((measures.speeds.value + worst_case.speeds), by.qd * np.sign(point.qd)[..., None])]
    if by.qdd is not None:
        loads.append((measures.accelerations.value + worst_case.accelerations, by.qdd * np.sign(point.qdd)[..., None]))
    for value, gradients in loads:
        yield from _leading(value, gradients)


def _leading(value: Array, gradients: Array) -> Iterator[Array]:
    """Signs of gradients, shape (N, nq, m), of the joints with the highest values, each at its highest."""
    highest, columns = value.argmax(axis=0), np.argsort(-value.max(axis=0), kind="stable")
    for column in columns[:MOST].tolist():
        yield _signs(gradients[highest[column], column])


def _of_distances(measures: Measures, apart: Array, taken: Array) -> Iterator[Array]:
    """Signs of the displacements that bring bodies nearest, each pair once."""
    seen = set[int]()
    for row in np.argsort(-(measures.violations + taken), kind="stable").tolist():
        pair = int(measures.distances.pairs[row])
        if pair not in seen and len(seen) < MOST:
            seen.add(pair)
            yield _signs(-apart[row])


def _signs(gradient: Array) -> Array:
    """-1 or 1 for each component, 1 for those without effect."""
    return np.where(gradient < 0.0, -1.0, 1.0)
