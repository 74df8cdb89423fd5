"""Distances of paths in closed form, and which of them warm one another."""

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.measures.weld_position import distances, resting_pairs


def line(begin: tuple[float, float], end: tuple[float, float], count: int = 30) -> Array:
    """Points along a straight path at z = 0."""
    return np.pad(np.linspace(begin, end, count), ((0, 0), (0, 1)))


def test_points_are_as_far_from_a_side_as_from_its_nearest_point() -> None:
    points = np.array([[0.5, 0.3, 0.0], [-0.3, 0.4, 0.0], [1.0, 0.0, 0.2], [0.25, 0.0, 0.0]])

    assert distances(points, line((0.0, 0.0), (1.0, 0.0), 2)).tolist() == pytest.approx([0.3, 0.5, 0.2, 0.0])


def test_passes_lie_beside_each_other_and_others_only_come_near() -> None:
    """A short pass on a long seam, a corner with it, a parallel seam 50 mm away, and a point path."""
    paths = {
        "seam": line((0.0, 0.0), (0.3, 0.0)),
        "pass": line((0.1, 0.004), (0.2, 0.004)),
        "corner": line((0.3, 0.0), (0.3, 0.2)),
        "parallel": line((0.3, -0.05), (0.0, -0.05), 500),
        "point": line((0.0, 0.009), (0.0, 0.009), 1).repeat(2, axis=0),
    }

    assert list(resting_pairs(paths, 0.0)) == [("seam", "pass"), ("seam", "point")]
    near = set(resting_pairs(paths, 0.051))
    assert near - set(resting_pairs(paths, 0.049)) == {("seam", "parallel"), ("corner", "parallel")}
    assert ("seam", "corner") in near
    assert ("pass", "parallel") not in near
