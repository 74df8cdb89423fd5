"""Polygons of any shape are covered once by their triangles, or refused."""

import numpy as np
import pytest
import trimesh

from cellplan.errors import InputError
from cellplan.geometry.mesh.formats.polygons import cut_polygons

RNG = np.random.default_rng(5)


def cut(flat: np.ndarray) -> np.ndarray:
    """Corner points of the triangles of one polygon, given in a plane and cut in a tilted one, shape (M, 3, 2)."""
    turn = trimesh.transformations.random_rotation_matrix(rand=np.array([0.3, 0.7, 0.1]))[:3, :3]
    vertices = np.column_stack([flat, np.zeros(len(flat))]) @ turn.T + 0.5
    faces = cut_polygons(vertices, np.arange(len(flat)), np.array([len(flat)]), "m")
    assert faces.shape == (len(flat) - 2, 3)
    assert set(faces.ravel()) == set(range(len(flat)))  # no corner is lost, so that neighbours still fit
    return flat[faces]


def areas(triangles: np.ndarray) -> np.ndarray:
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def area(flat: np.ndarray) -> float:
    x, y = flat.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def crossings(flat: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How often a polygon winds round points, by the angles under which its sides are seen."""
    sides = flat[None] - points[:, None]
    angle = np.arctan2(sides[..., 1], sides[..., 0])
    steps = np.mod(np.roll(angle, -1, axis=1) - angle + np.pi, 2 * np.pi) - np.pi
    return np.rint(steps.sum(axis=1) / (2 * np.pi))


def comb(teeth: int) -> np.ndarray:
    upper = [(k, 3.0 if k % 2 else 0.2) for k in range(teeth, -1, -1)]
    return np.array([(0.0, -1.0), (float(teeth), -1.0), *upper])


KEYHOLE = np.array(
    [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], dtype=float
)  # a square with a square hole, both joined by a cut


@pytest.mark.parametrize(
    "flat",
    [
        np.array([(0, 0), (2, 0), (0.1, 0.1), (0, 2)], dtype=float),
        np.array([(0.1, 0.1), (0, 2), (0, 0), (2, 0)], dtype=float),
        np.array([(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2), (0, 1), (0, 1)], dtype=float),
        comb(15),
        KEYHOLE,
        *(
            np.stack([np.cos(turn), np.sin(turn)], 1) * RNG.uniform(0.1, 1.0, (40, 1))
            for turn in np.sort(RNG.uniform(0, 2 * np.pi, (6, 40)))
        ),
    ],
)
def test_a_polygon_is_covered_once(flat: np.ndarray) -> None:
    triangles = cut(flat)

    assert np.all(areas(triangles) > -1e-12)
    assert areas(triangles).sum() == pytest.approx(area(flat), rel=1e-12)
    points = RNG.uniform(flat.min(axis=0), flat.max(axis=0), (400, 2))
    covered = sum(crossings(triangle, points) for triangle in triangles)
    np.testing.assert_array_equal(covered, crossings(flat, points))


def test_a_polygon_without_area_and_one_that_is_nearly_plane_are_cut() -> None:
    line = np.array([(0, 0), (1, 0), (2, 0), (1, 0)], dtype=float)
    assert areas(cut(line)) == pytest.approx([0.0, 0.0], abs=1e-12)

    bent = np.array([(0, 0, 0), (2, 0, 0.01), (2, 2, 0), (1, 0.5, 0.01), (0, 2, 0)], dtype=float)
    faces = cut_polygons(bent, np.arange(5), np.array([5]), "m")
    corner = bent[faces]
    assert np.all(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 2] > 0.0)
    edge = cut_polygons(bent, np.array([0, 1, 0, 1, 2]), np.array([2, 3]), "m")
    np.testing.assert_array_equal(edge, [[0, 1, 2]])


def test_a_polygon_that_crosses_itself_is_refused() -> None:
    bow = np.array([(0, 0), (2, 0), (0, 1), (2, 3)], dtype=float)
    with pytest.raises(InputError) as caught:
        cut(bow)
    assert str(caught.value) == (
        "m: expected faces that do not cross themselves, of at most 3000 corners where not convex, got one of 4 "
        "corners, vertices 1, 2, 3, 4, …: triangulate the mesh before export"
    )
