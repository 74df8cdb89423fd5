"""Squares that outlines cover, and the contours round them."""

from itertools import pairwise

import numpy as np
import pytest

from cellplan.geometry.raster import contours, covered, stretches


def squares(outlines: np.ndarray) -> set[tuple[int, int]]:
    """Row and column of each covered square; no stretch touches another."""
    result = [tuple(entry) for entry in stretches(covered(outlines)).tolist()]
    assert result == sorted(result)
    assert all(one[0] < other[0] or one[2] + 1 < other[1] for one, other in pairwise(result))
    return {(row, column) for row, first, last in result for column in range(first, last + 1)}


@pytest.mark.parametrize("seed", range(5))
def test_covered_squares_are_those_whose_middles_lie_in_an_outline(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, (4, 16)), axis=1)
    sizes = rng.uniform(0.5, 6.0, (4, 1, 2))
    outlines = rng.uniform(-12.0, 12.0, (4, 1, 2)) + sizes * np.stack([np.cos(angles), np.sin(angles)], axis=-1)

    result = squares(outlines)

    span = np.arange(-40, 41)
    inside = set[tuple[int, int]]()
    for corners in outlines:
        sides = np.roll(corners, -1, axis=0) - corners
        for row in span:
            for column in span:
                apart = np.array([column, row]) - corners
                if (sides[:, 0] * apart[:, 1] - sides[:, 1] * apart[:, 0] >= 0.0).all():
                    inside.add((int(row), int(column)))
    assert result == inside


def test_an_outline_along_the_rows_keeps_its_corners() -> None:
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])

    assert squares(corners[None]) == {(row, column) for row in (0, 1) for column in (0, 1, 2)}


def enclosed(line: np.ndarray) -> float:
    """Area within a closed line, positive where it goes round counter-clockwise."""
    x, y = line.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_a_ring_has_a_contour_on_either_side_and_the_area_of_its_squares() -> None:
    span = np.arange(-20, 21)
    ring = np.array([(y + 3, x - 7, x - 7) for y in span for x in span if 8.0 <= np.hypot(x, y) <= 18.0])

    outer, inner = contours(stretches(ring))

    assert enclosed(outer) > 0.0 > enclosed(inner)
    assert enclosed(outer) + enclosed(inner) == pytest.approx(len(ring), rel=0.02)  # corners are cut by half a square
    for line, radius in ((outer, 18.0), (inner, 8.0)):
        assert np.abs(np.hypot(*(line - (-7.0, 3.0)).T) - radius).max() < 1.2  # half a square and what is smoothed


def test_squares_that_touch_at_a_corner_keep_all_their_area() -> None:
    lines = contours(np.array([[0, 0, 0], [1, 1, 1], [5, 5, 5]]))

    assert sum(map(enclosed, lines)) == pytest.approx(3 * 0.5)  # a square alone is drawn through its middles
