"""Convex hulls hold their meshes."""

from pathlib import Path

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.geometry.meshes import (
    convex_hull,
    mesh_volume,
    read_mesh,
    tessellate,
)
from cellplan.geometry.shapes import Mesh, Sphere, support
from cellplan.geometry.transforms import rotation_from_rpy

TURN = rotation_from_rpy([0.3, -0.7, 1.1])


def test_a_hull_holds_its_mesh_and_agrees_with_qhull(shared_robots: Path) -> None:
    for path in sorted(shared_robots.glob("*/meshes/collision/*.stl"))[::4]:
        mesh = read_mesh(path)

        hull = convex_hull(mesh)

        points = coal.StdVec_Vec3s()
        points.extend(list(mesh.vertices))
        qhull = coal.Convex.convexHull(points, True, "Qt")
        assert hull.is_closed
        assert mesh_volume(hull) == pytest.approx(qhull.computeVolume(), rel=1e-6), path
        directions = np.random.default_rng(0).normal(size=(500, 3))
        assert support(hull, directions) == pytest.approx(support(mesh, directions), rel=1e-6, abs=1e-7)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=4, max_size=30), st.booleans())
def test_hulls_of_points_on_a_lattice_hold_them(corners: list[tuple[int, int, int]], is_turned: bool) -> None:
    points = np.array(corners, dtype=float) @ (TURN if is_turned else np.eye(3))
    cloud = Mesh(vertices=points, faces=np.zeros((0, 3), dtype=np.int64), source="cloud", is_closed=False)
    if np.linalg.matrix_rank(points - points[0], tol=1e-9) < 3:
        with pytest.raises(InputError, match="cloud: expected a body with a volume, got a flat one"):
            convex_hull(cloud)
        return

    hull = convex_hull(cloud)

    directions = np.random.default_rng(0).normal(size=(200, 3))
    assert hull.is_closed
    assert support(hull, directions) == pytest.approx(support(cloud, directions), abs=1e-9)


def test_the_hull_of_a_very_fine_sphere_is_bounded_work_and_still_holds_it() -> None:
    fine = tessellate(Sphere(0.3), 120)
    hull = convex_hull(fine)

    directions = np.random.default_rng(0).normal(size=(2000, 3))
    ratio = support(hull, directions) / support(fine, directions)
    assert len(hull.vertices) <= 2000 < len(fine.vertices)
    assert ratio.min() >= 1 - 1e-12
    assert ratio.max() < 1.01
