"""Convex hulls hold their meshes."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import (
    mesh_volume,
    read_mesh,
    tessellate,
)
from cellplan.geometry.shapes import Mesh, Sphere, support
from cellplan.geometry.transforms import rotation_from_rpy
from cellplan.scene.collision.hull_cache import convex_hull

TURN = rotation_from_rpy([0.3, -0.7, 1.1])


def cloud_of(points: np.ndarray) -> Mesh:
    return Mesh(vertices=points, faces=np.zeros((0, 3), dtype=np.int64), source="cloud", is_closed=False)


def test_a_hull_holds_its_mesh_and_reaches_no_farther(shared_robots: Path) -> None:
    for path in sorted(shared_robots.glob("*/meshes/collision/*.stl"))[::4]:
        mesh = read_mesh(path)

        hull = convex_hull(mesh)

        directions = np.random.default_rng(0).normal(size=(500, 3))
        assert hull.is_closed
        # vertices are rounded to a billionth of the extent, which is below 2 m
        assert support(hull, directions) == pytest.approx(support(mesh, directions), rel=0, abs=1e-8)


def test_the_hull_of_a_mesh_of_known_hull_has_its_volume() -> None:
    star = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0.1, 0.2, 0.3]])

    hull = convex_hull(cloud_of(star @ TURN))

    assert (hull.vertices.shape, hull.faces.shape) == ((6, 3), (8, 3))
    assert mesh_volume(hull) == pytest.approx(4.0 / 3.0, rel=1e-8)  # an octahedron; rounding as above


@pytest.mark.parametrize("tip", [np.zeros((0, 3)), np.array([[0.0, 0.0, 0.7]])], ids=["drum", "drum with a tip"])
def test_a_round_plate_of_many_corners_has_a_hull(tip: np.ndarray) -> None:
    """A corner of a triangulated disc, or the tip of a cone, has more neighbours than coal can keep."""
    angle = np.linspace(0.0, 2.0 * np.pi, 600, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(600)], axis=1)
    cloud = cloud_of(np.concatenate([ring, ring + np.array([0.0, 0.0, 0.5]), tip]))

    hull = convex_hull(cloud)

    directions = np.random.default_rng(0).normal(size=(2000, 3))
    ratio = support(hull, directions) / support(cloud, directions)
    assert hull.is_closed
    assert ratio.min() >= 1 - 1e-8  # rounding to a billionth of the extent
    assert ratio.max() < 1.02


@pytest.mark.parametrize("thickness", [0.0, 1e-12, 1e-9, 1e-8, 1e-7])
def test_thin_clouds_are_refused_and_do_not_end_the_process(thickness: float) -> None:
    points = np.random.default_rng(0).normal(size=(50, 3)) * [1.0, 1.0, thickness]

    with pytest.raises(InputError, match="cloud: expected a body with a volume, got a flat one"):
        convex_hull(cloud_of(points @ TURN + 3.0))


@given(st.integers(0, 2**32 - 1), st.floats(-17.0, -5.0))
def test_heaps_of_almost_equal_points_have_a_hull(seed: int, closeness: float) -> None:
    rng = np.random.default_rng(seed)
    heaps = np.repeat(rng.normal(size=(6, 3)), 10, axis=0)
    cloud = cloud_of(heaps + 10.0**closeness * rng.normal(size=heaps.shape))

    hull = convex_hull(cloud)

    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    tolerance = 1e-7 * np.ptp(cloud.vertices, axis=0).max()  # what a hull may be short of
    assert np.all(support(hull, directions) >= support(cloud, directions) - tolerance)


@given(st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=4, max_size=30), st.booleans())
def test_hulls_of_points_on_a_lattice_hold_them(corners: list[tuple[int, int, int]], is_turned: bool) -> None:
    points = np.array(corners, dtype=float) @ (TURN if is_turned else np.eye(3))
    cloud = cloud_of(points)
    if np.linalg.matrix_rank(points - points[0], tol=1e-9) < 3:
        with pytest.raises(InputError, match="cloud: expected a body with a volume, got a flat one"):
            convex_hull(cloud)
        return

    hull = convex_hull(cloud)

    directions = np.random.default_rng(0).normal(size=(200, 3))
    assert hull.is_closed
    assert support(hull, directions) == pytest.approx(support(cloud, directions), abs=3e-8)  # rounding


def test_the_hull_of_a_very_fine_sphere_is_bounded_work_and_still_holds_it() -> None:
    fine = tessellate(Sphere(0.3), 120)
    hull = convex_hull(fine)

    directions = np.random.default_rng(0).normal(size=(2000, 3))
    ratio = support(hull, directions) / support(fine, directions)
    assert len(hull.vertices) <= 2000 < len(fine.vertices)
    assert ratio.min() >= 1 - 1e-8
    assert ratio.max() < 1.01
