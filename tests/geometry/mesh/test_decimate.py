"""Meshes with fewer triangles: how many, and how far they lie from the mesh that they were made of."""

import numpy as np
import pytest
import trimesh

from cellplan.geometry.mesh.decimate import decimated
from cellplan.geometry.shapes import Mesh


def mesh_of(solid: trimesh.Trimesh) -> Mesh:
    return Mesh(
        vertices=np.array(solid.vertices), faces=np.array(solid.faces, dtype=np.int64), source="test", is_closed=True
    )


BALL = mesh_of(trimesh.creation.icosphere(subdivisions=4, radius=0.2))


def test_a_mesh_that_is_small_enough_stays_as_it_is() -> None:
    reduced = decimated(BALL, len(BALL.faces))

    assert reduced.deviation == 0.0
    assert np.array_equal(reduced.points[reduced.triangles], BALL.vertices[BALL.faces])


@pytest.mark.parametrize("limit", [2000, 500, 200])
def test_no_point_of_a_ball_is_farther_from_it_than_the_deviation(limit: int) -> None:
    reduced = decimated(BALL, limit)
    inside = trimesh.Trimesh(reduced.points, reduced.triangles, process=False).sample(2000, seed=1)
    sunk = 0.2 - float(np.linalg.norm(BALL.vertices[BALL.faces].mean(axis=1), axis=1).min())  # of the facets themselves

    assert len(reduced.triangles) <= limit
    assert np.abs(np.linalg.norm(inside, axis=1) - 0.2).max() <= reduced.deviation + sunk
    assert reduced.deviation < 0.2


def test_points_that_no_triangle_uses_are_left_out() -> None:
    lone = Mesh(vertices=np.vstack([BALL.vertices, [[9.0, 9.0, 9.0]]]), faces=BALL.faces, source="test", is_closed=True)

    assert decimated(lone, 100_000).points.max() < 1.0
