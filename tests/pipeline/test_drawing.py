"""Squares that outlines from above cover."""

from itertools import pairwise

import numpy as np
import pytest

from cellplan.model.units import MM
from cellplan.pipeline.drawing import SQUARE, _squares, _stretches


def squares(outlines: np.ndarray) -> set[tuple[int, int]]:
    """Row and column of each covered square; no stretch touches another."""
    stretches = [tuple(each) for each in _stretches(_squares(outlines)).tolist()]
    assert stretches == sorted(stretches)
    assert all(one[0] < other[0] or one[2] + 1 < other[1] for one, other in pairwise(stretches))
    return {(row, column) for row, first, last in stretches for column in range(first, last + 1)}


@pytest.mark.parametrize("seed", range(5))
def test_covered_squares_are_those_whose_middles_lie_in_an_outline(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, (4, 16)), axis=1)
    sizes = rng.uniform(0.5, 6.0, (4, 1, 2)) * SQUARE / MM
    outlines = rng.uniform(-0.5, 0.5, (4, 1, 2)) + sizes * np.stack([np.cos(angles), np.sin(angles)], axis=-1)

    found = squares(outlines)

    span = np.arange(-40, 41)
    inside = set[tuple[int, int]]()
    for corners in outlines * MM / SQUARE:
        sides = np.roll(corners, -1, axis=0) - corners
        for row in span:
            for column in span:
                apart = np.array([column, row]) - corners
                if (sides[:, 0] * apart[:, 1] - sides[:, 1] * apart[:, 0] >= 0.0).all():
                    inside.add((int(row), int(column)))
    assert found == inside


def test_an_outline_along_the_rows_keeps_its_corners() -> None:
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]) * SQUARE / MM

    assert squares(corners[None]) == {(row, column) for row in (0, 1) for column in (0, 1, 2)}
