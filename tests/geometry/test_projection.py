"""Contours on solids: closed forms on spheres, cylinders and planes, on their meshes; edges are refused."""

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.geometry.curves.flat_curves import Contour, FlatArc, FlatLine, begun_near, bulged
from cellplan.geometry.curves.placed_contours import AXIS_STEP, SURFACE, Ground, drawing_pose, place_contours
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.projection import projection_onto
from cellplan.geometry.shapes import Box, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import pose

UP = np.array([0.0, 0.0, 1.0])
CHORD = 1e-5


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> Contour:
    axes = radius * np.eye(2)
    return Contour((FlatArc(centre=np.array(centre), first=axes[0], second=axes[1], span=(0.0, 2.0 * np.pi)),), True)


def polygon(*corners: tuple[float, float]) -> Contour:
    points = np.array(corners)
    return Contour(tuple(FlatLine(first=a, last=b) for a, b in zip(points, np.roll(points, -1, 0), strict=True)), True)


def placed(contour: Contour, shape: Solid, direction: np.ndarray = UP, X_FD: np.ndarray | None = None) -> SeamLine:
    X_PD = drawing_pose(direction, 0.0, np.eye(4) if X_FD is None else X_FD)
    project = projection_onto(shape, np.eye(4), direction)
    ground = Ground(project=project, X_PD=X_PD, is_plane=False, name="the part")
    (line,) = place_contours([contour], ground, CHORD, "logo.dxf")
    return line


def deviation(line: SeamLine, curve) -> float:
    """Greatest distance of a closed form from the sides of a line, near whose points it is asked for."""
    shares = np.linspace(0.0, 1.0, 9)[:, None, None]
    chords = line.points[:-1] + shares * np.diff(line.points, axis=0)
    return float(np.linalg.norm(chords - curve(chords), axis=2).max())


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.03, -0.02)])
def test_a_circle_on_a_sphere_is_within_the_chord_and_has_its_normals(centre: tuple[float, float]) -> None:
    line = placed(circle(0.03, centre), Sphere(0.1))

    np.testing.assert_allclose(np.linalg.norm(line.points, axis=1), 0.1, rtol=1e-12)
    np.testing.assert_allclose(line.walls[SURFACE], line.points / 0.1, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(line.points[:, :2] - centre, axis=1), 0.03, rtol=1e-12)
    np.testing.assert_allclose(np.sum(line.tangents * line.walls[SURFACE], axis=1), 0.0, atol=1e-12)
    np.testing.assert_array_equal(line.points[0], line.points[-1])

    def nearby(p: np.ndarray) -> np.ndarray:
        """The point of the projected circle at the same angle about its axis."""
        flat = p[..., :2] - centre
        flat = centre + 0.03 * flat / np.linalg.norm(flat, axis=-1, keepdims=True)
        return np.concatenate([flat, np.sqrt(0.01 - np.sum(flat**2, axis=-1, keepdims=True))], axis=-1)

    assert deviation(line, nearby) <= 1.1 * CHORD  # the greatest one is near the middle, where it is measured
    turn = np.linalg.norm(np.diff(line.walls[SURFACE], axis=0), axis=1)
    assert turn.max() <= AXIS_STEP * (1.0 + 1e-9)


def test_a_line_across_a_cylinder_is_an_ellipse_of_its_section() -> None:
    contour = Contour((FlatLine(first=np.array([-0.03, -0.03]), last=np.array([0.03, 0.03])),), False)
    X_FD = pose((0.0, 0.0, 0.0), (0.0, 0.0, np.deg2rad(15.0)))

    line = placed(contour, Cylinder(0.05, 0.2), np.array([1.0, 0.0, 0.0]), X_FD)  # seen along x: the x axis is +y

    _, y, z = line.points.T
    np.testing.assert_allclose(z, np.tan(np.deg2rad(60.0)) * y, atol=1e-12)
    np.testing.assert_allclose(np.hypot(line.points[:, 0], y), 0.05, rtol=1e-12)
    assert np.all(line.points[:, 0] > 0.0)
    expected = line.points * [1.0, 1.0, 0.0] / 0.05
    np.testing.assert_allclose(line.walls[SURFACE], expected, atol=1e-12)


def test_a_mesh_gives_what_its_solid_gives_within_its_facets() -> None:
    exact, meshed = (placed(circle(0.03), shape) for shape in (Sphere(0.1), tessellate(Sphere(0.1), 96)))

    height = np.sqrt(0.1**2 - 0.03**2)
    np.testing.assert_allclose(exact.points[:, 2], height, rtol=1e-12)
    np.testing.assert_allclose(meshed.points[:, 2], height, atol=3e-4)
    radial = meshed.points / np.linalg.norm(meshed.points, axis=1, keepdims=True)
    assert np.sum(radial * meshed.walls[SURFACE], axis=1).min() >= np.cos(np.deg2rad(1.0))


def test_straight_sides_on_a_box_keep_their_corners_twice() -> None:
    line = placed(polygon((-0.02, -0.02), (0.02, -0.02), (0.02, 0.02)), Box((0.1, 0.1, 0.04)))

    corners = np.flatnonzero(np.diff(line.behind) == 0.0)
    np.testing.assert_allclose(line.points[corners], [[0.02, -0.02, 0.02], [0.02, 0.02, 0.02]])
    assert line.is_closed
    np.testing.assert_allclose(line.points[:, 2], 0.02)


def test_a_smooth_junction_is_no_corner() -> None:
    half = bulged(np.array([0.02, -0.01]), np.array([0.02, 0.01]), 1.0)
    contour = Contour((FlatLine(first=np.array([-0.02, -0.01]), last=np.array([0.02, -0.01])), half), False)

    assert not np.any(np.diff(placed(contour, Box((0.1, 0.1, 0.04))).behind) == 0.0)


def test_from_below_a_drawing_is_seen_the_right_way_round() -> None:
    line = placed(circle(0.02), Box((0.1, 0.1, 0.04)), -UP)

    np.testing.assert_allclose(line.points[0], [0.02, 0.0, -0.02])
    left = np.cross(line.walls[SURFACE], line.tangents)
    assert np.all(np.sum(left * line.points * [1.0, 1.0, 0.0], axis=1) < 0.0)  # counterclockwise, seen from outside


@pytest.mark.parametrize(
    ("contour", "shape", "words"),
    [
        (
            circle(0.03, (0.04, 0.0)),
            Box((0.1, 0.1, 0.04)),
            "expected an outline on the part, but it leaves it at x 70.000",
        ),
        (circle(0.09999), Sphere(0.1), "mm of the drawing it is seen at 0.81 deg only; project from another side"),
        (circle(0.2), Sphere(0.1), "but it leaves it at x 200.000, y 0.000 mm of the drawing"),
    ],
)
def test_what_leaves_the_part_is_refused_with_its_place(contour: Contour, shape: Solid, words: str) -> None:
    with pytest.raises(InputError) as refused:
        placed(contour, shape)
    assert words in str(refused.value)


def test_a_contour_over_an_edge_is_refused_near_the_edge() -> None:
    contour = Contour((FlatLine(first=np.array([-0.03, 0.0]), last=np.array([0.03, 0.0])),), False)
    tilted = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)  # a box seen over its edge

    with pytest.raises(InputError, match=r"over an edge of the part"):
        placed(contour, Box((0.1, 0.1, 0.1)), tilted)


def test_a_closed_contour_begins_where_it_is_nearest_to_a_point() -> None:
    begun = begun_near(circle(0.02), np.array([0.0, 5.0]))
    square = polygon((0.0, 0.0), (0.02, 0.0), (0.02, 0.02), (0.0, 0.02))
    on_side, at_corner = (begun_near(square, np.array(point)) for point in ((0.005, -1.0), (1.0, 1.0)))

    np.testing.assert_allclose(begun.ends, [[0.0, 0.02]] * 2, atol=1e-6)  # distances are flat there
    np.testing.assert_allclose(on_side.ends, [[0.005, 0.0]] * 2, atol=1e-6)
    np.testing.assert_allclose(at_corner.ends, [[0.02, 0.02]] * 2, atol=1e-15)
    assert len(at_corner.curves) == 4
