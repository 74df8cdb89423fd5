"""Depth of the deepest point of a surface in a solid: closed forms, and every point of a surface by rays of its own."""

import numpy as np
import pytest
from builders.touching_boxes import as_one, assembly

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Capsule, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array, rotation_exp
from cellplan.scene.collision.bodies import prepare
from cellplan.scene.collision.overlap.sunk_points import SUNK_TOL, SurfaceTree, deepest_point

BLOCK = 0.2  # [m] edge of a cube whose faces are finely cut


def block(pieces: int = 12) -> Mesh:
    """A closed mesh of a cube of many triangles."""
    box = tessellate(Box((BLOCK, BLOCK, BLOCK)))
    corners = box.vertices[box.faces]
    for _ in range(pieces // 2):
        corners = np.concatenate([_cut(corners, side) for side in range(2)])
    return make_mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), source="block")


def _cut(corners: Array, side: int) -> Array:
    """One half of each triangle, cut through the middle of its longest side, which neighbours share."""
    lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    first, row = np.argmax(lengths, axis=1), np.arange(len(corners))
    a, b, c = (corners[row, (first + k) % 3] for k in range(3))
    middle = 0.5 * (a + b)
    return np.stack([a, middle, c] if side == 0 else [middle, b, c], axis=1)


@pytest.mark.parametrize("guest", [Capsule(0.008, 0.12), Sphere(0.03), Box((0.03, 0.05, 0.1)), Sphere(1e-5)])
def test_points_of_a_solid_are_as_deep_in_a_cube_of_triangles_as_the_closed_form_says(guest: Solid) -> None:
    host, body, rng = prepare("block", block()), prepare("guest", guest), np.random.default_rng(5)
    surface = tessellate(guest, 96) if isinstance(guest, Capsule | Sphere) else tessellate(guest)
    triangles = surface.vertices[surface.faces]
    share = rng.dirichlet([1.0, 1.0, 1.0], size=(len(triangles), max(1, 20000 // len(triangles))))
    points = np.einsum("fkc,fci->fki", share, triangles).reshape(-1, 3)
    deep = 0
    for _ in range(4):
        R, p = rotation_exp(rng.normal(size=3)), rng.uniform(-0.6 * BLOCK, 0.6 * BLOCK, 3)

        deepest = deepest_point(body, host, R, p)

        truth = float((0.5 * BLOCK - np.abs(points @ R.T + p)).min(axis=1).max())
        deep += truth > SUNK_TOL
        assert deepest >= max(0.0, truth) - SUNK_TOL - 1e-5
        assert deepest <= max(0.0, truth) + 2e-3  # so far may random points be from the deepest one
    assert deep


def test_a_long_tool_that_passes_a_mesh_by_a_small_part_is_as_deep_as_that_part() -> None:
    """Most of its surface is far from the mesh, and nearer to the middle of the mesh's ball than what is inside."""
    host, tool = prepare("block", block()), prepare("tool", Capsule(0.008, 0.4))

    for deep in (0.02, 0.004):
        p = np.array([0.0, 0.0, 0.5 * BLOCK + 0.2 + 0.008 - deep])
        assert deepest_point(tool, host, np.eye(3), p) == pytest.approx(deep, abs=SUNK_TOL + 5e-5)


def test_the_patches_of_a_surface_hold_what_their_halves_hold() -> None:
    rng = np.random.default_rng(2)
    triangles = rng.normal(size=(37, 3, 3))
    tree = SurfaceTree.over(triangles)
    patches, covered = tree.root(), np.zeros(0)

    while len(patches.triangles) == 0:
        halves, whole = tree.parts(patches)
        nearest = np.linalg.norm(halves.centres - patches.centres[whole], axis=1)
        assert np.all(nearest <= patches.radii[whole] + 1e-12)
        patches = halves
    covered = np.sort(patches.triangles.mean(axis=1), axis=0)

    assert len(patches) == len(triangles)  # repeated triangles are left out
    np.testing.assert_array_equal(covered, np.sort(triangles.mean(axis=1), axis=0))


@pytest.mark.slow
def test_a_tool_is_as_deep_in_bodies_that_touch_as_in_the_one_solid_they_make() -> None:
    rng, tool = np.random.default_rng(8), prepare("tool", Box((0.004, 0.004, 0.2)))
    hosts = [prepare("part", mesh) for mesh in (assembly(), as_one())]
    places = [
        np.array([0.07, 0.0, 0.16]),
        np.array([0.0, 0.0, 0.11]),
        *rng.uniform([-0.1, -0.1, 0], [0.1, 0.1, 0.2], (12, 3)),
    ]

    deep = 0
    for p in places:
        ours, truth = (deepest_point(tool, host, np.eye(3), p, tolerance=3e-4) for host in hosts)
        assert ours == pytest.approx(truth, abs=6e-4)
        deep += truth > 0.005
    assert deep > 2
