"""Closed bodies that touch are several solids of one part: their insides, surfaces and rays are those of the union."""

import numpy as np
import pytest
from builders.concave_shapes import tube
from builders.touching_boxes import FRAME, PLATE, RIB, as_one, assembly, box_of

from cellplan.geometry.mesh.load import contains, corner_normals, make_mesh, mesh_volume, ray_hits, require_solid
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import count_edges
from cellplan.geometry.mesh.touching import outer_surface
from cellplan.geometry.shapes import Cylinder, Mesh
from cellplan.geometry.transforms import rotation_from_rpy

RNG = np.random.default_rng(4)


def area(mesh: Mesh) -> float:
    corner = mesh.vertices[mesh.faces]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return float(0.5 * np.linalg.norm(across, axis=1).sum())


def union(*meshes: Mesh) -> Mesh:
    corners = np.concatenate([mesh.vertices[mesh.faces].reshape(-1, 3) for mesh in meshes])
    return make_mesh(corners, np.arange(len(corners)).reshape(-1, 3), source="union.stl")


@pytest.mark.parametrize("inward", [(), (1,), (0, 2)])
def test_bodies_that_share_an_edge_are_a_solid_however_they_face(inward: tuple[int, ...]) -> None:
    mesh = assembly(inward=inward)

    require_solid(mesh)
    assert count_edges(mesh.faces).crowded > 0
    assert mesh_volume(mesh) == pytest.approx(mesh_volume(as_one()), rel=1e-6)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.3, -0.7, 1.1)])
def test_the_outer_surface_has_the_area_of_the_union(rpy: tuple[float, float, float]) -> None:
    R = rotation_from_rpy(rpy)

    outer = outer_surface(assembly(R=R))

    assert area(outer) == pytest.approx(area(as_one()), rel=1e-5)
    assert mesh_volume(outer) == pytest.approx(mesh_volume(as_one()), rel=1e-5)


def test_equal_triangles_of_two_bodies_are_both_left_out() -> None:
    mesh = assembly((((0, 0, 0), (0.1, 0.1, 0.1)), ((0.1, 0, 0), (0.2, 0.1, 0.1))))

    assert area(outer_surface(mesh)) == pytest.approx(0.1, rel=1e-6)


def test_a_pin_in_its_hole_has_no_surface_inside() -> None:
    outside = tube(0.02, 0.05, 0.1)
    pin = tube(0.005, 0.02, 0.1)

    outer = outer_surface(union(outside, pin))

    ring = area(tube(0.005, 0.05, 0.1))
    assert area(outer) == pytest.approx(ring, rel=1e-6)


def test_one_solid_and_solids_apart_are_left_as_they_are() -> None:
    apart = assembly((PLATE, ((-0.06, -0.01, 0.0201), (0.07, 0.015, 0.1))))
    for mesh in (as_one(), apart, tessellate(Cylinder(0.1, 0.2))):
        assert outer_surface(mesh) is mesh


def test_points_are_inside_where_they_are_inside_the_union_also_between_the_bodies() -> None:
    points = RNG.uniform([-0.11, -0.09, -0.01], [0.11, 0.09, 0.11], (600, 3))
    between = np.array([[0.0, 0.0, 0.02], [0.07, 0.0, 0.05], [0.08, -0.05, 0.02], [0.069999999, 0.01, 0.06]])

    inside = contains(assembly(), points)

    assert np.array_equal(inside, np.any([np.all((points > a) & (points < b), axis=1) for a, b in FRAME], axis=0))
    assert contains(assembly(), between).all()


def test_rays_from_outside_meet_the_union() -> None:
    starts = RNG.uniform([-0.1, -0.08, 0.2], [0.1, 0.08, 0.3], (300, 3))
    starts[:30, 0], starts[:30, 1] = 0.07, RNG.uniform(-0.009, 0.014, 30)  # along the plane in which two bodies touch
    down = np.array([0.0, 0.0, -1.0])

    ours, theirs = (ray_hits(mesh, starts, down) for mesh in (assembly(), as_one()))

    assert np.allclose(ours.distance, theirs.distance, atol=1e-7)


def test_normals_run_on_over_the_seam_of_two_halves() -> None:
    count = 40
    angles = np.linspace(0.0, np.pi, count + 1)
    rim = np.round(np.column_stack([np.cos(angles), np.sin(angles)]), 12)

    def half(sign: float) -> Mesh:
        outline = rim * [1.0, sign]
        vertices = np.concatenate([np.column_stack([outline, np.full(count + 1, z)]) for z in (-0.5, 0.5)])
        k = np.arange(count)
        up = count + 1
        sides = np.concatenate([np.column_stack([k, k + 1, k + 1 + up]), np.column_stack([k, k + 1 + up, k + up])])
        seam = np.array([[count, 0, up], [count, up, count + up]])
        caps = np.array([[0, j + 1, j] for j in range(1, count)])
        faces = np.concatenate([sides, seam, caps, caps[:, ::-1] + up])
        return make_mesh(vertices, faces, source="half")

    mesh = union(half(1.0), half(-1.0))

    require_solid(mesh)
    normals = corner_normals(mesh)
    corner = mesh.vertices[mesh.faces]
    on_seam = np.isclose(corner[..., 1], 0.0) & np.isclose(np.abs(corner[..., 0]), 1.0)
    is_wall = np.abs(normals[..., 2]) < 0.1
    facing = normals[on_seam & is_wall & (np.abs(normals[..., 0]) > 0.5)]
    assert len(facing)
    assert np.allclose(np.abs(facing[:, 0]), 1.0, atol=1e-9)


def test_a_thousand_triangles_of_each_body_are_cut_out() -> None:
    def fine(span: tuple) -> Mesh:
        triangles = box_of(span).vertices[box_of(span).faces]
        for _ in range(3):
            a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
            ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
            parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
            triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
        return make_mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), source="fine")

    assert area(outer_surface(union(fine(PLATE), fine(RIB)))) == pytest.approx(area(as_one((PLATE, RIB))), rel=1e-6)
