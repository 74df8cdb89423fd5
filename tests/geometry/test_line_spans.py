"""Lines run inside solids where closed forms, sampling and meshes of the same solids say so."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.geometry.line_spans import Spans, line_spans
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array

SOLIDS = (Box((0.2, 0.3, 0.1)), Cylinder(0.1, 0.3), Capsule(0.08, 0.2), Sphere(0.12))
SAMPLES = np.linspace(-0.6, 0.6, 2401)


def contains(shape: Solid, points: Array) -> Array:
    """Whether points lie inside a solid, by its definition."""
    across, along = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    match shape:
        case Box(size):
            return np.all(np.abs(points) < 0.5 * np.array(size), axis=1)
        case Cylinder(radius, length):
            return (across < radius) & (along < 0.5 * length)
        case Capsule(radius, length):
            return np.hypot(across, np.maximum(along - 0.5 * length, 0.0)) < radius
        case Sphere(radius):
            return np.linalg.norm(points, axis=1) < radius
        case _:
            raise ValueError(shape)


def two_boxes(gap: float) -> Mesh:
    """Two boxes of 0.1 m in one mesh, one above the other; they overlap when the gap is negative."""
    one = tessellate(Box((0.1, 0.1, 0.1)))
    shift = np.array([0.0, 0.0, 0.1 + gap])
    vertices = np.concatenate([one.vertices, one.vertices + shift])
    return make_mesh(vertices, np.concatenate([one.faces, one.faces + len(one.vertices)]), source="two")


@given(st.sampled_from(SOLIDS), st.integers(0, 10_000))
def test_a_line_is_inside_where_its_points_are(shape: Solid, seed: int) -> None:
    rng = np.random.default_rng(seed)
    point, direction = rng.uniform(-0.1, 0.1, 3), rng.normal(size=3)
    direction /= np.linalg.norm(direction)

    spans = line_spans(shape, point[None], direction[None])

    inside = contains(shape, point + SAMPLES[:, None] * direction)
    is_inside = np.zeros(len(SAMPLES), dtype=bool)
    for enter, leave in zip(spans.enter, spans.leave, strict=True):
        is_inside |= (enter < SAMPLES) & (leave > SAMPLES)
    ends = np.concatenate([spans.enter, spans.leave])
    near_an_end = np.abs(SAMPLES[:, None] - ends).min(axis=1, initial=np.inf) < 1e-9
    assert np.all((inside == is_inside) | near_an_end)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("shape", SOLIDS)
def test_lines_along_an_axis_have_the_solid_s_length(shape: Solid, axis: int) -> None:
    spans = line_spans(shape, np.zeros((1, 3)), np.eye(3)[axis][None])

    full = {
        Box: (0.2, 0.3, 0.1),
        Cylinder: (0.2, 0.2, 0.3),
        Capsule: (0.16, 0.16, 0.36),
        Sphere: (0.24, 0.24, 0.24),
    }
    assert spans.leave - spans.enter == pytest.approx([full[type(shape)][axis]], rel=1e-14)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_a_mesh_of_a_box_is_the_box(seed: int) -> None:
    box = Box((0.2, 0.3, 0.1))
    rng = np.random.default_rng(seed)
    points, directions = rng.uniform(-0.2, 0.2, (20, 3)), rng.normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)

    exact, meshed = (line_spans(shape, points, directions) for shape in (box, tessellate(box)))

    assert exact.line.tolist() == meshed.line.tolist()
    assert np.allclose(exact.enter, meshed.enter, atol=1e-12)
    assert np.allclose(exact.leave, meshed.leave, atol=1e-12)


def along_z(mesh: Mesh, x: float, y: float) -> Spans:
    return line_spans(mesh, np.array([[x, y, 0.0]]), np.array([[0.0, 0.0, 1.0]]))


def test_a_mesh_of_two_pieces_has_two_spans_and_overlapping_pieces_one() -> None:
    apart, joined = along_z(two_boxes(0.05), 0.01, 0.02), along_z(two_boxes(-0.02), 0.01, 0.02)

    assert np.allclose([apart.enter, apart.leave], [[-0.05, 0.10], [0.05, 0.20]])
    assert np.allclose([joined.enter, joined.leave], [[-0.05], [0.13]])


def test_a_line_through_edges_and_corners_counts_them_once() -> None:
    cube = tessellate(Box((0.1, 0.1, 0.1)))
    diagonal = np.ones((1, 3)) / np.sqrt(3.0)

    through_corners = line_spans(cube, np.zeros((1, 3)), diagonal)
    through_diagonals = along_z(cube, 0.0, 0.0)

    assert np.allclose([through_corners.enter, through_corners.leave], [[-0.05 * 3**0.5], [0.05 * 3**0.5]])
    assert np.allclose([through_diagonals.enter, through_diagonals.leave], [[-0.05], [0.05]])


@pytest.mark.parametrize("shape", [*SOLIDS, tessellate(Box((0.2, 0.2, 0.2)))])
def test_a_line_that_passes_by_has_no_span(shape: Solid) -> None:
    assert not len(line_spans(shape, np.array([[0.5, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])).line)
