"""Rays hit what they should, also along edges and through vertices."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from cellplan.geometry.mesh.load import (
    make_mesh,
    ray_hits,
    tessellate,
)
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh
from cellplan.geometry.transforms import rotation_from_rpy

BOX = tessellate(Box((0.2, 0.4, 0.6)))
TURN = rotation_from_rpy([0.3, -0.7, 1.1])


def turned_mesh(mesh: Mesh, R: np.ndarray) -> Mesh:
    return Mesh(vertices=mesh.vertices @ R.T, faces=mesh.faces, source=mesh.source, is_closed=True)


@pytest.mark.parametrize("R", [np.eye(3), TURN], ids=["along the axes", "turned"])
def test_rays_through_edges_and_vertices_of_a_box_are_not_lost(R: np.ndarray) -> None:
    grid = tessellate(Box((1.0, 1.0, 1.0)))
    for _ in range(4):  # 3072 triangles whose edges lie exactly under the rays
        grid = make_mesh(*trimesh.remesh.subdivide(grid.vertices, grid.faces), source="grid")
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 33), np.linspace(-0.5, 0.5, 33))
    inside = np.stack([x.ravel(), y.ravel(), np.full(x.size, 2.0)], axis=1)

    hits = ray_hits(turned_mesh(grid, R), inside @ R.T, R @ [0.0, 0.0, -2.0])

    assert hits.is_hit.all()  # rays that run down along a wall hit its upper edge
    assert np.abs(hits.points @ R - (inside * [1, 1, 0] + [0, 0, 0.5])).max() < 1e-14  # rounding of the turn
    assert hits.distance == pytest.approx(1.5, abs=1e-14)


def test_rays_through_edges_and_vertices_of_a_cylinder_are_not_lost() -> None:
    mesh = tessellate(Cylinder(0.25, 0.5), 24)
    wall = mesh.vertices[np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) > 0.1]
    height = np.linspace(-0.25, 0.25, 11)
    feet = np.unique(np.round(np.arctan2(wall[:, 1], wall[:, 0]), 12))
    origins = np.array([[np.cos(a), np.sin(a), z] for a in feet for z in height])

    hits = ray_hits(mesh, origins, -origins * [1, 1, 0])

    assert hits.is_hit.all()
    assert np.hypot(hits.points[:, 0], hits.points[:, 1]) == pytest.approx(0.25 / np.cos(np.pi / 24), abs=1e-12)
    through_caps = ray_hits(mesh, wall * [0.999999, 0.999999, 0] + [0, 0, 1.0], np.array([0.0, 0, -1.0]))
    assert through_caps.is_hit.all()
    assert through_caps.points[:, 2] == pytest.approx(0.25, abs=1e-15)


@given(seed=st.integers(0, 2**32 - 1))
def test_rays_lie_on_the_plane_of_the_triangle_they_hit_and_nothing_lies_before(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = turned_mesh(tessellate(Capsule(0.2, 0.5), 16), rotation_from_rpy(rng.uniform(-3, 3, 3)))
    origins = rng.uniform(-1, 1, (200, 3))
    directions = rng.normal(size=(200, 3))

    hits = ray_hits(mesh, origins, directions)

    corner = mesh.vertices[mesh.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    hit = hits.is_hit
    off_plane = np.sum((hits.points[hit] - corner[hits.faces[hit], 0]) * normals[hits.faces[hit]], axis=1)
    assert np.abs(off_plane).max(initial=0.0) < 1e-12
    with np.errstate(divide="ignore", invalid="ignore"):  # convex and closed: clip the line by all planes
        steep = unit @ normals.T
        distance = np.sum(corner[:, 0] * normals, axis=1) - origins @ normals.T
        enter = np.where(steep < 0, distance / steep, -np.inf).max(axis=1)
        leave = np.where(steep > 0, distance / steep, np.inf).min(axis=1)
    truth = np.where(enter > leave, np.inf, np.where(enter >= 0, enter, np.where(leave >= 0, leave, np.inf)))
    assert np.array_equal(np.isfinite(truth), hit)
    assert hits.distance[hit] == pytest.approx(truth[hit], abs=1e-12)
    assert np.isnan(hits.points[~hit]).all()
    assert np.isinf(hits.distance[~hit]).all()
    assert (hits.faces[~hit] == -1).all()


def test_rays_without_direction_are_a_mistake_of_the_caller() -> None:
    with pytest.raises(ValueError, match="non-zero finite directions"):
        ray_hits(BOX, np.zeros((1, 3)), np.zeros(3))
    with pytest.raises(ValueError, match="finite origins"):
        ray_hits(BOX, np.full((1, 3), np.nan), np.array([0.0, 0, 1]))
    assert ray_hits(BOX, np.empty((0, 3)), np.array([0.0, 0, 1])).points.shape == (0, 3)
