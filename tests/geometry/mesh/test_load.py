"""Meshes know their outside, their holes, their normals and what lies inside."""

import re

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import (
    contains,
    corner_normals,
    is_flat,
    make_mesh,
    mesh_volume,
    require_solid,
    tessellate,
)
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import rotation_from_rpy

BOX = tessellate(Box((0.2, 0.4, 0.6)))
TURN = rotation_from_rpy([0.3, -0.7, 1.1])


def test_triangles_without_area_are_dropped_and_a_heap_of_them_is_refused() -> None:
    slivers = np.concatenate([BOX.faces, [[0, 0, 1], [2, 2, 2]]])
    mesh = make_mesh(BOX.vertices, slivers, source="part.stl")
    assert (len(mesh.faces), mesh.is_closed) == (12, True)

    with pytest.raises(
        InputError, match=re.escape("part.stl: expected triangles of non-zero area, got 13 of 25 degenerate")
    ):
        make_mesh(BOX.vertices, np.concatenate([BOX.faces, np.zeros((13, 3), int)]), source="part.stl")


def test_vertices_that_differ_by_single_precision_are_welded() -> None:
    loose = BOX.vertices[BOX.faces].reshape(-1, 3)
    shaken = loose + 1e-9 * np.random.default_rng(1).uniform(-1, 1, loose.shape)

    assert make_mesh(shaken, np.arange(36).reshape(-1, 3), source="part.stl").is_closed


@pytest.mark.parametrize("away", [0.0, 3.0])
def test_a_crack_of_one_float_step_is_closed_and_a_wider_one_is_named(away: float) -> None:
    corners = (BOX.vertices[BOX.faces].reshape(-1, 3) + away).astype(np.float32)
    faces = np.arange(36).reshape(-1, 3)
    for steps in (1, 2):
        cracked = corners.copy()
        for _ in range(steps):
            cracked[4] = np.nextafter(cracked[4], np.float32(10.0))
        require_solid(make_mesh(cracked.astype(float), faces, source="part.stl"))

    torn = corners.astype(float)
    torn[4] += 1e-4
    with pytest.raises(InputError, match=r"got 4 open edges, .* the longest open one from \(.*\) to \(.*\) mm: repair"):
        require_solid(make_mesh(torn, faces, source="part.stl"))


def test_points_of_a_closed_surface_stay_where_they_are_however_near() -> None:
    thin = BOX.vertices * [1e-6, 1.0, 1.0]
    assert len(make_mesh(thin, BOX.faces, source="foil.stl").vertices) == 8


def test_a_surface_turned_inside_out_is_turned_back_and_a_cavity_stays_one() -> None:
    inner = 0.5 * BOX.vertices
    assert mesh_volume(make_mesh(BOX.vertices, BOX.faces[:, ::-1], source="x")) == pytest.approx(0.048, rel=1e-12)

    both = np.concatenate([BOX.vertices, inner])
    hollow = np.concatenate([BOX.faces, BOX.faces[:, ::-1] + 8])
    for faces in (hollow, hollow[:, ::-1]):
        mesh = make_mesh(both, faces, source="x")
        assert mesh_volume(mesh) == pytest.approx(0.048 * (1 - 1 / 8), rel=1e-12)
        assert contains(mesh, np.array([[0.0, 0, 0], [0.08, 0, 0], [1, 0, 0]])).tolist() == [False, True, False]

    vertices = np.concatenate([BOX.vertices, inner + np.array([1.0, 0, 0])])
    mesh = make_mesh(vertices, hollow, source="x")
    assert mesh_volume(mesh) == pytest.approx(0.048 * (1 + 1 / 8), rel=1e-12)
    assert contains(mesh, np.array([[1.0, 0, 0], [0.5, 0, 0]])).tolist() == [True, False]


def test_an_open_crowded_or_flat_surface_is_no_solid() -> None:
    open_box = make_mesh(BOX.vertices, BOX.faces[1:], source="part.stl")
    with pytest.raises(InputError) as caught:
        require_solid(open_box)
    assert str(caught.value) == (
        "part.stl: expected a closed surface, got 3 open edges, 0 edges of more than two triangles and 0 edges whose "
        "triangles face opposite directions, the longest open one from (-100, -200, -300) to (-100, 200, 300) mm: "
        "repair the mesh"
    )
    crowded = make_mesh(BOX.vertices, np.concatenate([BOX.faces, BOX.faces[:1, ::-1]]), source="part.stl")
    with pytest.raises(InputError, match="3 edges of more than two triangles"):
        require_solid(crowded)
    sheet = Mesh(vertices=BOX.vertices * [1, 1, 0], faces=BOX.faces, source="part.stl", is_closed=True)
    assert is_flat(sheet)
    with pytest.raises(InputError, match="expected a solid, got a surface that encloses no volume"):
        require_solid(sheet)


@pytest.mark.parametrize("shape", [Cylinder(0.25, 0.5), Sphere(0.25)])
def test_corner_normals_follow_round_walls_and_break_at_creases(shape: Solid) -> None:
    mesh = tessellate(shape, 96)

    normals = corner_normals(mesh)

    corner = mesh.vertices[mesh.faces]
    faces = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    truth = np.where(np.abs(faces[:, None, 2:]) > 0.99, faces[:, None, :], corner * [1, 1, 0])
    if isinstance(shape, Sphere):
        truth = corner.copy()
    truth /= np.linalg.norm(truth, axis=2, keepdims=True)
    # a vertex of a latitude ring sees its neighbours unevenly: less than one facet of 3.75 deg
    tolerance = 1e-12 if isinstance(shape, Cylinder) else np.radians(3.75)
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(normals - truth).max() < tolerance


def turned_mesh(mesh: Mesh, R: np.ndarray) -> Mesh:
    return Mesh(vertices=mesh.vertices @ R.T, faces=mesh.faces, source=mesh.source, is_closed=True)


@pytest.mark.slow
def test_points_are_inside_where_the_solid_is() -> None:
    shape = Capsule(0.2, 0.5)
    mesh = turned_mesh(tessellate(shape, 64), TURN)
    points = np.random.default_rng(3).uniform(-0.6, 0.6, (2000, 3))
    local = points @ TURN
    depth = 0.2 - np.linalg.norm(local - np.clip(local * [0, 0, 1], -0.25, 0.25), axis=1)
    clear = np.abs(depth) > 2e-3  # the tessellated capsule is larger by up to 1.2 mm

    assert np.array_equal(contains(mesh, points)[clear], (depth > 0)[clear])
