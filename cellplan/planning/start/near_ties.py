"""Near ties: an order of candidates that rounding cannot turn over, as near-equal figures count as equal."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices

Rows = Indices

ALIKE: Final = 1e-9  # figures nearer than this, as a share of themselves or of 1, are equal: far above rounding
UNBOUNDED: Final = 1e9  # stands for infinite figures


def best_first(figures: Array) -> list[int]:
    """Order of candidates, the one with the largest figures first.

    The first figure decides; where it is near-equal, the second does, and so on. Near-equal are figures that a chain of
    neighbours nearer than ``ALIKE`` joins, so that the order does not depend on which are compared first.

    Args:
        figures: Figures of each candidate, shape (K, n).

    Returns:
        Indices of the candidates, best first; those that no figure tells apart stay in their order.
    """
    groups: list[Rows] = [np.arange(len(figures))]
    for column in np.clip(figures, -UNBOUNDED, UNBOUNDED).T:
        groups = [part for group in groups for part in _parted(group, column[group])]
        if len(groups) == len(figures):
            break
    return [int(row) for group in groups for row in group]


def levels(scores: Sequence[float]) -> list[float]:
    """Scores with near-equal ones made equal: each gets the largest score of those that it is near-equal to."""
    values = np.array(scores, dtype=float)
    levelled = values.copy()
    for group in _parted(np.arange(len(values)), np.clip(values, -UNBOUNDED, UNBOUNDED)):
        levelled[group] = values[group].max(initial=-np.inf)
    return [float(value) for value in levelled]


def _parted(rows: Rows, values: Array) -> list[Rows]:
    """Rows parted into groups of near-equal values, largest first."""
    if len(rows) < 2:
        return [rows]
    order = np.argsort(-values, kind="stable")
    falling = values[order]
    is_gap = falling[:-1] - falling[1:] > ALIKE * np.maximum(1.0, np.abs(falling[:-1]))
    return [np.sort(part) for part in np.split(rows[order], np.flatnonzero(is_gap) + 1)]
