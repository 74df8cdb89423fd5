"""Places of a base: a grid that keeps height and tilt, and neighbours by their rows and columns."""

import numpy as np
import pytest

from cellplan.geometry.transforms import pose
from cellplan.search.base_map.places import Places

X, Y = np.array([500.0, 700.0, 900.0, 1100.0, 1300.0]), np.array([-300.0, 0.0, 300.0])
TILTED = pose((0.1, 0.2, 0.75), (0.4, -0.3, 2.0))


@pytest.mark.parametrize("turned", [{}, {"yaw": -1.2}, {"toward": np.array([0.6, 0.15, 3.0])}])
def test_places_keep_height_and_tilt_and_face_as_they_are_told(turned: dict[str, object]) -> None:
    places = Places.of(TILTED, X, Y, **turned)  # type: ignore[arg-type]

    np.testing.assert_allclose(places.X_WB[:, 2], np.tile(TILTED[2], (15, 1)), atol=1e-12)  # seen from the base
    np.testing.assert_allclose(1e3 * places.X_WB[:, :2, 3], [(x, y) for y in Y for x in X], atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(places.X_WB), 1.0, atol=1e-12)
    facing = np.arctan2(places.X_WB[:, 1, 0], places.X_WB[:, 0, 0])
    np.testing.assert_allclose(np.exp(1j * facing), np.exp(1j * places.yaw), atol=1e-12)
    if "toward" in turned:
        away = np.array([0.6, 0.15]) - places.X_WB[:, :2, 3]
        np.testing.assert_allclose(np.exp(1j * facing), (away @ [1.0, 1j]) / np.linalg.norm(away, axis=1), atol=1e-12)


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_neighbours_are_all_places_a_stride_away_in_rows_or_columns_or_both(stride: int) -> None:
    places = Places.of(TILTED, X, Y)
    at = [(k // len(X), k % len(X)) for k in range(len(places))]
    expected = {
        (a, b)
        for a, (row, column) in enumerate(at)
        for b, (other_row, other_column) in enumerate(at)
        if a != b and {abs(row - other_row), abs(column - other_column)} <= {0, stride}
    }

    pairs = [tuple(pair) for pair in places.neighbours(stride).tolist()]

    assert len(pairs) == len(set(pairs))
    assert set(pairs) == expected
    assert places.coarse(stride).tolist() == [k for k, (i, j) in enumerate(at) if i % stride == j % stride == 0]
