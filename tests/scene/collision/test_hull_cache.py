"""A hull that was kept is the hull that was found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.cache import key_of
from cellplan.cache.store import forget
from cellplan.errors import InputError
from cellplan.geometry.mesh.load import keep_mesh
from cellplan.geometry.shapes import Mesh
from cellplan.scene.collision.hull_cache import convex_hull, hull_of, keep_hulls, without_hull

pytestmark = pytest.mark.usefixtures("cache_folder")


def cloud(points: np.ndarray, source: str = "cloud") -> Mesh:
    return Mesh(vertices=points, faces=np.zeros((0, 3), dtype=np.int64), source=source, is_closed=False)


POINTS = np.random.default_rng(3).normal(size=(400, 3))


def assert_same(one: Mesh, other: Mesh) -> None:
    for first, second in ((one.vertices, other.vertices), (one.faces, other.faces)):
        assert first.tobytes() == second.tobytes()
        assert (first.dtype, first.shape, first.strides) == (second.dtype, second.shape, second.strides)


def test_a_kept_hull_is_the_one_that_was_found(cache_folder: Path) -> None:
    hull = hull_of(cloud(POINTS))
    forget()
    again = hull_of(cloud(POINTS, "another name"))

    assert len(list(cache_folder.iterdir())) == 1
    assert again.source == "another name"
    assert_same(hull, again)
    assert_same(hull, convex_hull(cloud(POINTS)))


def test_a_kept_surface_that_is_open_is_no_hull() -> None:
    hull = convex_hull(cloud(POINTS))
    keep_mesh(key_of("hull", POINTS.tobytes()), replace(hull, is_closed=False))

    assert_same(hull_of(cloud(POINTS)), hull)


def test_other_points_have_another_hull() -> None:
    assert hull_of(cloud(POINTS)).vertices.tobytes() != hull_of(cloud(2.0 * POINTS)).vertices.tobytes()
    assert_same(hull_of(cloud(2.0 * POINTS)), convex_hull(cloud(2.0 * POINTS)))


def test_a_flat_mesh_is_refused_each_time(cache_folder: Path) -> None:
    flat = POINTS * np.array([1.0, 1.0, 0.0])

    for _ in range(2):
        with pytest.raises(InputError, match="expected a body with a volume, got a flat one"):
            hull_of(cloud(flat))
    assert not cache_folder.exists() or not list(cache_folder.iterdir())


@pytest.mark.parametrize("move", [0.0, 0.5], ids=["too small", "moved"])
def test_a_kept_hull_that_does_not_hold_the_points_is_found_anew(move: float) -> None:
    hull = convex_hull(cloud(POINTS))
    keep_mesh(
        key_of("hull", POINTS.tobytes()), replace(hull, vertices=(0.9 if not move else 1.0) * hull.vertices + move)
    )

    assert_same(hull_of(cloud(POINTS)), hull)


def test_a_kept_surface_with_a_dent_is_no_hull() -> None:
    hull = convex_hull(cloud(POINTS))
    dented = 2.0 * hull.vertices
    dented[0] *= 0.6
    keep_mesh(key_of("hull", POINTS.tobytes()), replace(hull, vertices=dented))

    assert_same(hull_of(cloud(POINTS)), hull)


def test_a_hull_that_a_helper_has_kept_is_the_same(cache_folder: Path) -> None:
    mesh = cloud(POINTS)
    missing = without_hull([mesh])
    keep_hulls(missing)
    forget()

    assert missing == [mesh]
    assert without_hull([mesh]) == []
    assert len(list(cache_folder.iterdir())) == 1
    assert_same(hull_of(mesh), convex_hull(mesh))
