"""Toolpaths lie where the task says, know their own derivative, and name what makes no path."""

from dataclasses import replace

import numpy as np
import pytest
from builders.roller_paths import (
    ALONG_X,
    CYLINDER,
    EX,
    EY,
    EZ,
    ON_ROLLER,
    ROLLER,
    circle,
    part_of,
    residual_of_twists,
    sampled,
    task_on,
)

from cellplan.errors import InputError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Solid, Sphere
from cellplan.geometry.transforms import Array, pose, rotation_about, rotation_exp
from cellplan.model.task.task import PlaneName, PolygonPath, SpacePolylinePath, Task
from cellplan.planning.path.build import build_toolpath

ALONG_Y = ((0.3, 0.0, 0.0), (0.3, 0.2, 0.0))


def test_paths_of_the_four_robots_start_where_they_should() -> None:
    starts = {name: build_toolpath(task, ROLLER).X_PT_start for name, task in ON_ROLLER.items()}
    depth = np.sqrt(0.25**2 - 0.125**2)

    assert np.allclose(starts["circle"][:3, 3], [0.1, 0.0, 0.25], atol=1e-15)
    assert np.allclose(starts["circle"][:3, 2], -EZ, atol=1e-15)
    assert np.allclose(starts["rhombus"][:3, 3], [0.25, 0.175, 0.0], atol=1e-15)
    assert np.allclose(starts["rhombus"][:3, 2], -EX, atol=1e-15)
    assert np.allclose(starts["rectangle"][:3, 3], [0.175, -depth, 0.125], atol=1e-15)
    assert np.allclose(starts["rectangle"][:3, 2], [0.0, depth / 0.25, -0.5], atol=1e-15)


def test_circle_projected_onto_a_cylinder_lies_on_it_with_the_exact_normal() -> None:
    path = build_toolpath(ON_ROLLER["circle"], ROLLER)

    X = path.poses(np.linspace(0.0, path.length, 1001))
    x, y, z = X[:, :3, 3].T

    assert len(path.pieces) == 1
    assert np.allclose(np.hypot(y, z), 0.25, rtol=0.0, atol=1e-15 * 2)
    assert np.allclose(np.hypot(x, y), 0.1, rtol=0.0, atol=1e-15 * 2)
    assert np.allclose(X[:, :3, 2], -np.stack([0.0 * x, y, z], axis=1) / 0.25, atol=1e-14)
    assert np.all(X[:, 0, 0] > 0.9)  # tool x leans to +x


def test_length_on_the_surface_agrees_with_an_independent_quadrature() -> None:
    path = build_toolpath(ON_ROLLER["circle"], ROLLER)
    u = 2.0 * np.pi * np.arange(400) / 400  # the trapezoid rule converges geometrically on a periodic function
    y, dx, dy = 0.1 * np.sin(u), -0.1 * np.sin(u), 0.1 * np.cos(u)
    speed = np.sqrt(dx**2 + dy**2 + (y * dy) ** 2 / (0.25**2 - y**2))

    assert path.length == pytest.approx(2.0 * np.pi * float(speed.mean()), rel=1e-12)


def test_sides_on_a_cylinder_have_the_length_of_their_arcs() -> None:
    path = build_toolpath(ON_ROLLER["rectangle"], ROLLER)

    arc = 2.0 * 0.25 * np.arcsin(0.5)

    assert [piece.length for piece in path.pieces] == pytest.approx([0.35, arc, 0.35, arc], rel=1e-12)


@pytest.mark.parametrize("name", ON_ROLLER)
def test_equal_steps_along_the_path_are_equal_lengths(name: str) -> None:
    path = build_toolpath(ON_ROLLER[name], ROLLER)
    for piece in path.pieces:
        fine = piece.poses(np.linspace(0.0, piece.length, 200 * 40 + 1))[:, :3, 3]
        chords = np.linalg.norm(np.diff(fine, axis=0), axis=1).reshape(40, 200).sum(axis=1)
        assert np.ptp(chords) <= 1e-9 * piece.length  # chords fall short of arcs by ds^2 / 24 R^2


@pytest.mark.parametrize("name", ON_ROLLER)
def test_twists_are_the_derivative_of_poses_on_the_cylinder(name: str) -> None:
    task = replace(ON_ROLLER[name], turn=2.0)

    assert residual_of_twists(build_toolpath(task, ROLLER)) <= 1e-8  # differences: 6e-10


@pytest.mark.parametrize(
    ("shape", "X_PS"),
    [(Box((0.4, 0.5, 0.6)), None), (Sphere(0.3), None), (CYLINDER, ALONG_X), (Sphere(0.3), pose([0, 0.1, 0]))],
)
def test_twists_are_the_derivative_of_poses_seen_from_askew(shape: Solid, X_PS: Array | None) -> None:
    side = np.array([0.36, 0.48, 0.8])
    task = task_on(circle(0.04), project=side, tool_x=-EY, turn=-1.0)

    path = build_toolpath(task, part_of(shape, X_PS))

    assert residual_of_twists(path) <= 1e-8  # path of radius 0.04 m: h^2/6 times 1/r^3 with h = 3e-6 m
    assert np.allclose(
        np.linalg.norm(path.pieces[0].twists_per_length(np.linspace(0, path.length, 99))[:, :3], axis=1), 1.0
    )


def test_integrated_twists_return_after_a_full_turn() -> None:
    piece = build_toolpath(ON_ROLLER["circle"], ROLLER).pieces[0]
    n = 2000
    h = piece.length / n
    middle = piece.twists_per_length((np.arange(n) + 0.5) * h)
    X = piece.poses(np.zeros(1))[0]
    p, R = X[:3, 3].copy(), X[:3, :3].copy()
    for v in middle:
        p += h * v[:3]
        R = rotation_exp(h * v[3:]) @ R

    end = piece.poses(np.array([piece.length]))[0]
    assert np.allclose(p, end[:3, 3], atol=1e-6)  # midpoint rule: h^2
    assert np.allclose(R, end[:3, :3], atol=1e-5)
    assert np.allclose(end, X, atol=1e-14)


REFUSED = {
    "a circle beside the part": (
        replace(ON_ROLLER["circle"], path=circle(0.1, center=(0.2, 0.0))),
        "cell.yaml:14: tasks.ring.path: expected a path over the part, but the point (300, 0, 0) mm misses it seen "
        "from +z; it lies within x -250 to 250 mm and y -250 to 250 mm",
    ),
    "a circle over the rim": (
        replace(ON_ROLLER["circle"], path=circle(0.1), project=np.array([0.6, 0.0, 0.8])),
        "it runs over an edge at",
    ),
    "a circle that touches the outline": (
        replace(ON_ROLLER["circle"], path=circle(0.1, center=(0.0, 0.15))),
        "at (0, 250, 0) mm it is seen at 0 deg only; make the path smaller or project it from another side",
    ),
    "a side that lies in the plane": (
        replace(ON_ROLLER["circle"], project=EX),
        "tasks.ring.path.project: expected a side that faces the path's plane, got +x, which lies in it; project from "
        "+z or -z",
    ),
    "no radius": (
        replace(ON_ROLLER["circle"], path=circle(0.0)),
        "expected a circle with a radius above zero, got 0 mm",
    ),
    "one point": (task_on(sampled([[0, 0, 0]]), tool_axis=EZ), "expected at least 2 points for a path, got 1"),
    "a closed path of two points": (
        task_on(sampled([[0, 0, 0], [1, 0, 0]], is_closed=True), tool_axis=EZ),
        "expected at least 3 points for a closed path, got 2",
    ),
    "a point twice": (
        task_on(sampled([[0, 0, 0], [1, 0, 0], [1, 0, 0]]), tool_axis=EZ),
        "points 2 and 3 (weld.csv, lines 3 and 4) are both at (1000, 0, 0) mm; leave one out",
    ),
    "a start listed again": (
        task_on(sampled([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0]], is_closed=True), tool_axis=EZ),
        "the last point repeats the first at (0, 0, 0) mm; leave the last point out",
    ),
    "a coordinate that is not finite": (
        task_on(sampled([[0, 0, 0], [1, np.nan, 0]]), tool_axis=EZ),
        "expected finite coordinates, but point 2 has none",
    ),
    "a side along the projection": (
        task_on(
            SpacePolylinePath(points=((0.0, 0.0, 0.3), (0.0, 0.0, 0.4), (0.1, 0.0, 0.4)), is_closed=False), project=EZ
        ),
        "from +z, but the side from (0, 0, 300) mm to (0, 0, 400) mm runs along it",
    ),
    "a cusp": (
        task_on(sampled([[-0.1, 0, 0.3], [0, 0, 0.5], [0, 0.0, 0.6], [-0.1, 0, 0.8]], is_smooth=True), project=EZ),
        "expected a path with a direction everywhere, but it stands still near (",
    ),
    "orientation given twice": (
        task_on(sampled([[0, 0, 0], [1, 0, 0]], axes=np.array([-EZ, -EZ])), tool_axis=EZ),
        "tasks.ring.tool_axis: weld.csv gives the tool's orientation already; leave tool_axis out",
    ),
    "axes that turn over": (
        task_on(sampled([[0, 0, 0], [1, 0, 0]], axes=np.array([-EZ, EZ]))),
        "differ by at most 90 deg, got 180 deg between points 1 and 2 of weld.csv; add points between",
    ),
    "a twisted rotation": (
        task_on(sampled([[0, 0, 0], [1, 0, 0]], rotations=np.array([np.eye(3), 2.0 * np.eye(3)]))),
        "expected rotations that are orthogonal and right-handed in weld.csv",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_makes_no_path_is_refused_by_name(name: str) -> None:
    task, words = REFUSED[name]

    with pytest.raises(InputError) as caught:
        build_toolpath(task, ROLLER)

    assert words in str(caught.value)
    assert str(caught.value).startswith("cell.yaml:")
    assert "\n" not in str(caught.value)


def test_a_path_over_the_edge_of_a_box_is_refused_also_on_its_mesh() -> None:
    block, task = Box((0.4, 0.4, 0.4)), task_on(circle(0.15, center=(0.1, 0.0)), project=np.array([0.6, 0.0, 0.8]))
    for part in (part_of(block), part_of(tessellate(block))):
        with pytest.raises(InputError, match=r"runs over an edge at \(200, 141\."):
            build_toolpath(task, part)


def test_a_path_up_to_the_edge_of_a_box_is_allowed() -> None:
    path = build_toolpath(task_on(circle(0.2), project=EZ), part_of(Box((0.4, 0.4, 0.4))))

    assert path.length == pytest.approx(0.4 * np.pi, rel=1e-13)


def through(*points: tuple[float, float, float]) -> Task:
    path = SpacePolylinePath(points=points, is_closed=False)
    return replace(
        ON_ROLLER["circle"], path=path, project=None, tool_axis=ROLLER.X_PS[:3, 0], tool_x=ROLLER.X_PS[:3, 1]
    )


@pytest.mark.parametrize("radius", [0.000003, 0.00001])
def test_a_path_of_a_few_hundredths_of_a_millimetre_is_refused(radius: float) -> None:
    with pytest.raises(InputError, match=r"tasks\.ring\.path: expected a path of at least 0\.1 mm, got 0\.0\d+ mm"):
        build_toolpath(replace(ON_ROLLER["circle"], path=circle(radius)), ROLLER)


def test_a_short_path_passes() -> None:
    assert build_toolpath(replace(ON_ROLLER["circle"], path=circle(0.00003)), ROLLER).length > 1e-4


def test_a_point_far_from_the_part_is_refused_and_one_beside_it_passes() -> None:
    assert build_toolpath(through(*ALONG_Y, (9.0, 0.0, 0.0)), ROLLER).length > 8.0
    with pytest.raises(InputError) as caught:
        build_toolpath(through(*ALONG_Y, (0.3, 50.0, 0.0)), ROLLER)
    assert str(caught.value).endswith(
        "tasks.ring.path: expected a path within 10 m of the part, got the point (300, 50000, 0) mm, 49.8 m from it; "
        "is the unit right?"
    )


def test_the_tool_turns_evenly_about_its_own_axis() -> None:
    task = ON_ROLLER["rhombus"]
    plain, turned = build_toolpath(task, ROLLER), build_toolpath(replace(task, turn=3.0), ROLLER)
    shares = np.linspace(0.0, 1.0, 41)

    between = np.swapaxes(plain.poses(shares * plain.length), 1, 2) @ turned.poses(shares * plain.length)

    assert np.allclose(between[:, :3, :3], rotation_about(EZ, 3.0 * shares), atol=1e-13)


def test_a_direction_as_tool_axis_stays_on_a_curved_surface() -> None:
    path = build_toolpath(replace(ON_ROLLER["circle"], tool_axis=-EZ), ROLLER)

    X = path.poses(np.linspace(0.0, path.length, 33))

    assert np.allclose(X[:, :3, :3], np.diag([1.0, -1.0, -1.0]), atol=1e-15)


def test_tool_x_along_the_tool_axis_is_refused_and_a_better_one_named() -> None:
    with pytest.raises(InputError) as caught:
        build_toolpath(replace(ON_ROLLER["rhombus"], tool_x=EX), ROLLER)

    message = str(caught.value)
    assert message.startswith("cell.yaml:9: tasks.ring.tool_x: expected a direction across the tool axis, but +x runs")
    assert message.endswith("write tool_x: +y")


def test_tool_x_along_the_normal_between_two_samples_is_found() -> None:
    path = PolygonPath(plane=PlaneName.YZ, corners=((-0.1, 0.0), (0.1003, 0.0)), is_closed=False)

    with pytest.raises(InputError, match=r"\+x runs along it at \(300, .*write tool_x: \+z"):
        build_toolpath(task_on(path, project=EX), part_of(Sphere(0.3)))


def test_normal_needs_a_surface() -> None:
    with pytest.raises(InputError, match=r"tasks\.ring\.tool_axis: 'normal' needs a surface"):
        build_toolpath(task_on(circle()), ROLLER)


ARC = np.linspace(0.0, 1.5, 16)
ARC_POINTS = np.stack([0.2 * np.cos(ARC), 0.2 * np.sin(ARC), 0.02 * ARC], axis=1)


def test_straight_files_stop_at_every_corner_and_smooth_ones_do_not() -> None:
    straight = build_toolpath(task_on(sampled(ARC_POINTS), tool_axis=-EZ), ROLLER)
    smooth = build_toolpath(task_on(sampled(ARC_POINTS, is_smooth=True), tool_axis=-EZ), ROLLER)

    assert len(straight.pieces) == 15
    assert len(smooth.pieces) == 1
    assert smooth.length == pytest.approx(1.5 * np.hypot(0.2, 0.02), rel=1e-5)
    assert straight.length < smooth.length
    assert residual_of_twists(smooth) <= 1e-3  # the curvature jumps at the points: differences see it there only


def test_closed_smooth_files_return_to_their_start() -> None:
    angles = 2.0 * np.pi * np.arange(90) / 90
    ring = np.stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), 0.0 * angles], axis=1)

    path = build_toolpath(task_on(sampled(ring, is_smooth=True, is_closed=True), project=EZ), ROLLER)
    exact = build_toolpath(ON_ROLLER["circle"], ROLLER)

    first, last = path.pieces[0].twists_per_length(np.array([0.0, path.length]))
    assert path.is_closed
    assert path.length == pytest.approx(exact.length, rel=1e-5)
    assert np.allclose(first, last, atol=1e-12)
    assert np.allclose(path.poses(np.array([0.0])), path.poses(np.array([path.length])), atol=1e-14)


@pytest.mark.parametrize("is_smooth", [True, False])
@pytest.mark.parametrize("kind", ["axes", "rotations"])
def test_orientations_of_a_file_are_met_at_its_points(kind: str, is_smooth: bool) -> None:
    rotations = rotation_exp(np.stack([2.8 + 0.2 * ARC, 0.1 * ARC, 0.3 * np.sin(ARC)], axis=1))
    given = {kind: rotations[:, :, 2] if kind == "axes" else rotations}

    path = build_toolpath(task_on(sampled(ARC_POINTS, is_smooth=is_smooth, **given)), ROLLER)
    X = path.poses(path.arc.behind_knots(path.tip.knots))

    assert np.allclose(X[:, :3, 3], ARC_POINTS, atol=1e-14)
    assert np.allclose(X[:, :3, 2], rotations[:, :, 2], atol=1e-13)
    if kind == "rotations":
        assert np.allclose(X[:, :3, :3], rotations, atol=1e-13)
    if not is_smooth:
        assert residual_of_twists(path) <= 1e-6


def test_a_rounded_file_keeps_its_orientations_smooth() -> None:
    rotations = rotation_exp(np.stack([3.0 + 0.1 * ARC, 0.2 * ARC, 0.0 * ARC], axis=1))
    task = task_on(sampled(ARC_POINTS, rotations=rotations), blend=0.005)

    path = build_toolpath(task, ROLLER)
    twists = path.pieces[0].twists_per_length(np.linspace(0.0, path.length, 8001))

    assert len(path.pieces) == 1
    assert np.linalg.norm(np.diff(twists[:, 3:], axis=0), axis=1).max() <= 0.05  # no jump of the angular velocity
    assert np.linalg.norm(np.diff(twists[:, :3], axis=0), axis=1).max() <= 0.02
