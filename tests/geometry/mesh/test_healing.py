"""What can be put right without moving a surface is; what has no inside is told."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.geometry.mesh.counts import ray_winding
from cellplan.geometry.mesh.healing import MAX_PIECES, require_few_pieces
from cellplan.geometry.mesh.load import require_enclosing, require_solid
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh, mesh_volume, winding_numbers
from cellplan.geometry.shapes import Box, Mesh, Sphere

BOX = tessellate(Box((1.0, 1.0, 1.0)))
BALL = tessellate(Sphere(0.5), 24)


def joined(*parts: Mesh | tuple[Mesh, float], inward: tuple[int, ...] = ()) -> Mesh:
    """One mesh of several, each moved along x by the number that goes with it."""
    vertices, faces, count = [], [], 0
    for place, part in enumerate(parts):
        mesh, shift = part if isinstance(part, tuple) else (part, 0.0)
        faces.append((mesh.faces[:, ::-1] if place in inward else mesh.faces) + count)
        vertices.append(mesh.vertices + np.array([shift, 0.0, 0.0]))
        count += len(mesh.vertices)
    return make_mesh(np.concatenate(vertices), np.concatenate(faces), source="part.stl")


def scaled(mesh: Mesh, factor: float) -> Mesh:
    return Mesh(vertices=factor * mesh.vertices, faces=mesh.faces, source="", is_closed=True)


def winding(mesh: Mesh, *point: float) -> float:
    return float(winding_numbers(mesh.vertices[mesh.faces], np.array([point]))[0])


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 1.0))
def test_triangles_that_face_any_way_are_turned_outward(seed: int, share: float) -> None:
    flipped = np.random.default_rng(seed).random(len(BALL.faces)) < share
    faces = np.where(flipped[:, None], BALL.faces[:, ::-1], BALL.faces)

    mesh = make_mesh(BALL.vertices, faces, source="ball.stl")

    require_solid(mesh)
    assert mesh_volume(mesh) == pytest.approx(mesh_volume(BALL))


def test_a_triangle_that_is_there_twice_is_taken_once() -> None:
    mesh = make_mesh(BOX.vertices, np.concatenate([BOX.faces, np.roll(BOX.faces[:3], 1, axis=1)]), source="box.stl")

    require_solid(mesh)
    assert len(mesh.faces) == len(BOX.faces)


@pytest.mark.parametrize(("shift", "inward"), [(1.0, ()), (1.0, (0, 1)), (0.5, ()), (0.5, (0,)), (0.5, (0, 1))])
def test_solids_side_by_side_have_an_inside_however_they_face(shift: float, inward: tuple[int, ...]) -> None:
    mesh = joined(BOX, (BOX, shift), inward=inward)

    require_enclosing(mesh)
    assert winding(mesh, -0.3, 0.1, 0.0) > 0.5
    assert winding(mesh, shift + 0.3, 0.1, 0.0) > 0.5
    assert abs(winding(mesh, 3.0, 0.0, 0.0)) < 1e-9


def test_solids_that_contradict_each_other_at_a_common_face_are_refused() -> None:
    with pytest.raises(InputError, match="4 edges of more than two triangles"):
        require_enclosing(joined(BOX, (BOX, 1.0), inward=(1,)))


def test_the_wall_of_a_cavity_stays_a_wall() -> None:
    for inward in ((1,), (0,)):
        hollow = joined(BOX, scaled(BOX, 0.5), inward=inward)
        assert abs(winding(hollow, 0.1, 0.0, 0.0)) < 1e-9
        assert winding(hollow, 0.4, 0.0, 0.0) == pytest.approx(1.0)


def test_a_box_with_a_missing_triangle_has_no_inside_nor_has_one_with_both_sides_of_each() -> None:
    torn = BOX.faces[1:]
    for faces in (torn, np.concatenate([torn, torn[:, ::-1]]), np.concatenate([BOX.faces, BOX.faces[:, ::-1]])):
        with pytest.raises(InputError, match=r"expected a closed surface, .*: repair the mesh, or set open: true"):
            require_enclosing(make_mesh(BOX.vertices, faces, source="box.stl"))


def test_a_sheet_inside_a_box_takes_nothing_from_its_inside() -> None:
    sheet = np.concatenate([BOX.faces[:2], BOX.faces[:2, ::-1]])
    vertices = np.concatenate([BOX.vertices, 0.2 * BOX.vertices])

    mesh = make_mesh(vertices, np.concatenate([BOX.faces, sheet + len(BOX.vertices)]), source="box.stl")

    require_enclosing(mesh)
    assert winding(mesh, 0.4, 0.0, 0.0) == pytest.approx(1.0)


def test_vertices_that_differ_by_rounding_are_joined_wherever_the_grid_lies() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        corners = BOX.vertices[BOX.faces].reshape(-1, 3) + rng.uniform(-1.0, 1.0, 3)
        noisy = corners + rng.choice([-1e-9, 1e-9], size=corners.shape)
        assert make_mesh(noisy, np.arange(len(noisy)).reshape(-1, 3), source="box.stl").is_closed


def test_a_heap_of_loose_triangles_is_refused() -> None:
    count = MAX_PIECES + 1
    require_few_pieces(np.arange(3 * MAX_PIECES).reshape(-1, 3), source="heap.stl")
    with pytest.raises(InputError, match=f"expected a surface of at most 5000 connected components, got {count}"):
        require_few_pieces(np.arange(3 * count).reshape(-1, 3), source="heap.stl")


def test_crossings_of_a_ray_agree_with_the_solid_angle_also_through_edges_and_vertices() -> None:
    rng = np.random.default_rng(2)
    ring = trimesh.creation.torus(1.0, 0.4, major_sections=12, minor_sections=8)
    for other in (trimesh.creation.icosphere(subdivisions=1), ring, trimesh.creation.box()):
        triangles = np.asarray(other.triangles)
        points = rng.uniform(-1.5, 1.5, (100, 3))
        points[:40, 1:] = np.asarray(other.vertices)[rng.integers(len(other.vertices), size=40), 1:]
        points[40:60, 1:] = triangles[rng.integers(len(triangles), size=20), :2].mean(axis=1)[:, 1:]
        points[:60, 0] *= 3.0 / np.abs(points[:60, 0])  # these lie outside: their rays graze vertices and edges
        np.testing.assert_array_equal(ray_winding(triangles, points), np.rint(winding_numbers(triangles, points)))
        turned = triangles[:, ::-1]
        np.testing.assert_array_equal(ray_winding(turned, points), np.rint(winding_numbers(turned, points)))
