"""Paths run the way round they promise, stop at corners and round them as asked."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from builders.roller_paths import (
    EX,
    EZ,
    ON_ROLLER,
    PLANES,
    ROLLER,
    circle,
    part_of,
    residual_of_twists,
    task_on,
)

from cellplan.errors import InputError
from cellplan.geometry.shapes import Box
from cellplan.model.task.path_direction import run_direction
from cellplan.model.task.task import PlaneName, PolygonPath, RunDirection, SpacePolylinePath
from cellplan.planning.path.build import build_toolpath


@pytest.mark.parametrize(("axis", "sign"), list(product(range(3), (1.0, -1.0))))
def test_shapes_run_the_way_round_that_is_asked_for_seen_from_every_side(axis: int, sign: float) -> None:
    side = sign * np.eye(3)[axis]
    plane = next(name for name, axes in PLANES.items() if not any(a[axis] for a in axes))
    first, second = PLANES[plane]
    block = part_of(Box((0.6, 0.6, 0.6)))
    square = PolygonPath(plane=plane, corners=((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)), is_closed=True)
    for curve, direction in product((circle(0.1, plane), square), RunDirection):
        path = replace(curve, direction=direction)
        task = task_on(path, project=side, tool_x=first)
        toolpath = build_toolpath(task, block)
        p = toolpath.poses(np.linspace(0.0, toolpath.length, 401))[:, :3, 3]
        area = 0.5 * np.cross(p[:-1], p[1:]).sum(axis=0) @ side
        assert (area > 0.0) == (direction is RunDirection.COUNTERCLOCKWISE)
        assert run_direction(task) == (direction, pytest.approx(side))
        start = 0.1 * first if curve is not square else 0.1 * (first + second)
        assert np.allclose(p[0], start + 0.3 * side, atol=1e-15)
        assert np.allclose(p[-1], p[0], atol=1e-12)


def test_a_circle_starts_at_its_stated_point_and_runs_on_from_there() -> None:
    path = replace(circle(0.1, PlaneName.XY), start=(0.6, -0.8), direction=RunDirection.CLOCKWISE)

    toolpath = build_toolpath(task_on(path, tool_axis=-EZ), ROLLER)

    quarter = toolpath.poses(np.array([0.0, 0.25, 0.5]) * toolpath.length)[:, :3, 3]
    assert np.allclose(quarter, [[0.06, -0.08, 0], [-0.08, -0.06, 0], [-0.06, 0.08, 0]], atol=1e-12)


@pytest.mark.parametrize("side", [EX, -EX])
@pytest.mark.parametrize("is_reversed", [False, True])
def test_closed_lists_of_points_run_as_listed_from_every_side(side: np.ndarray, is_reversed: bool) -> None:
    corners = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1))  # counter-clockwise seen from +x
    listed = corners[::-1] if is_reversed else corners
    task = task_on(
        PolygonPath(plane=PlaneName.YZ, corners=listed, is_closed=True),
        project=side,
        tool_x=EZ,
    )

    toolpath = build_toolpath(task, part_of(Box((0.6, 0.6, 0.6))))

    passed = toolpath.poses(toolpath.behind)[:, 1:3, 3]
    assert np.allclose(passed, [*listed, listed[0]], atol=1e-12)
    is_counterclockwise = (side[0] > 0.0) != is_reversed
    expected = RunDirection.COUNTERCLOCKWISE if is_counterclockwise else RunDirection.CLOCKWISE
    assert run_direction(task) == (expected, pytest.approx(side))


def test_a_closed_list_that_encloses_nothing_has_no_way_round() -> None:
    eight = ((0.1, 0.1), (-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1))

    task = task_on(PolygonPath(plane=PlaneName.XY, corners=eight, is_closed=True), tool_axis=-EZ)

    assert run_direction(task) == (None, None)


@pytest.mark.parametrize("plane", list(PlaneName))
def test_without_projection_the_outside_is_against_the_tool_axis(plane: PlaneName) -> None:
    first, second = PLANES[plane]
    normal = np.cross(first, second)
    for axis in (normal, -normal):
        task = task_on(circle(0.1, plane), tool_axis=axis, tool_x=first, plane_offset=0.05)
        path = build_toolpath(task, ROLLER)
        p = path.poses(np.linspace(0.0, path.length, 101))[:, :3, 3]
        assert np.allclose(p @ normal, 0.05, atol=1e-15)
        assert 0.5 * np.cross(p[:-1], p[1:]).sum(axis=0) @ -axis > 0.0
        assert path.length == pytest.approx(0.2 * np.pi, rel=1e-14)


def test_open_paths_run_as_listed() -> None:
    path = PolygonPath(plane=PlaneName.XY, corners=((0.1, 0.0), (0.1, 0.1), (0.0, 0.1)), is_closed=False)

    toolpath = build_toolpath(task_on(path, tool_axis=EZ), ROLLER)

    assert np.allclose(toolpath.poses(np.array([0.0, 0.1, 0.2]))[:, :3, 3], [[0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])


def test_the_tool_stops_at_corners_but_not_at_points_of_a_straight_side() -> None:
    points = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.2, 0.0))

    path = build_toolpath(task_on(SpacePolylinePath(points=points, is_closed=False), tool_axis=-EZ), ROLLER)

    assert [piece.length for piece in path.pieces] == pytest.approx([0.3, 0.2], abs=1e-15)


def test_turning_back_is_a_corner() -> None:
    points = ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.1, 0.0, 0.0))

    path = build_toolpath(task_on(SpacePolylinePath(points=points, is_closed=False), tool_axis=-EZ), ROLLER)

    assert [piece.length for piece in path.pieces] == pytest.approx([0.3, 0.2], abs=1e-15)


def test_pieces_join_and_leave_a_corner_in_their_own_direction() -> None:
    path = build_toolpath(ON_ROLLER["rectangle"], ROLLER)
    ends = [piece.poses(np.array([piece.length]))[0] for piece in path.pieces]
    starts = [piece.poses(np.zeros(1))[0] for piece in path.pieces]

    assert np.allclose(ends, [*starts[1:], starts[0]], atol=1e-14)
    assert np.allclose(path.pieces[0].twists_per_length(np.array([0.35]))[0, :3], -EX, atol=1e-14)
    assert np.allclose(path.pieces[1].twists_per_length(np.zeros(1))[0, :3], [0, -0.5, -np.sqrt(0.75)], atol=1e-14)


@pytest.mark.parametrize("name", ["rhombus", pytest.param("rectangle", marks=pytest.mark.slow)])
def test_blended_paths_are_one_piece_near_the_corners(name: str) -> None:
    task, blend = ON_ROLLER[name], 0.01
    sharp, round_ = build_toolpath(task, ROLLER), build_toolpath(replace(task, blend=blend), ROLLER)

    p = round_.poses(np.linspace(0.0, round_.length, 4001))[:, :3, 3]
    q = sharp.poses(np.linspace(0.0, sharp.length, 8001))[:, :3, 3]
    away = np.array([np.linalg.norm(q - point, axis=1).min() for point in p[::5]])

    assert len(round_.pieces) == 1
    assert away.max() <= blend
    assert np.linalg.norm(p - q[0], axis=1).min() <= 1e-15  # the start stays a corner and a stop
    assert residual_of_twists(round_) <= 1e-4  # curvature of a rounding of 10 mm, on steps of 1e-5 of the length
    turn = np.diff(np.diff(p, axis=0) / np.linalg.norm(np.diff(p, axis=0), axis=1, keepdims=True), axis=0)
    assert np.linalg.norm(turn, axis=1).max() < 3.5 / blend * 2.5e-4  # at most the curvature of a turn by 120 deg


def test_a_rounding_longer_than_half_a_side_is_refused_with_numbers() -> None:
    with pytest.raises(InputError) as caught:
        build_toolpath(replace(ON_ROLLER["rectangle"], blend=0.13), ROLLER)

    assert str(caught.value) == (
        "cell.yaml:30: motion.corners: expected a rounding of at most 125 mm, half of the shorter side at the corner "
        "(-175, 0, 125) mm, got 130 mm"
    )


def test_a_path_that_turns_back_cannot_be_rounded() -> None:
    path = SpacePolylinePath(points=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.1, 0.0, 0.0)), is_closed=False)

    with pytest.raises(InputError, match=r"got 180 deg at \(300, 0, 0\) mm; write corners: stop"):
        build_toolpath(task_on(path, tool_axis=-EZ, blend=0.01), ROLLER)


def test_a_corner_that_turns_back_in_the_view_cannot_be_rounded_either() -> None:
    points = ((0.0, 0.0, 0.3), (0.1, 0.0, 0.4), (0.0, 0.0, 0.5))
    path = SpacePolylinePath(points=points, is_closed=False)

    with pytest.raises(InputError, match=r"got 180 deg at \(100, 0, 400\) mm; write corners: stop"):
        build_toolpath(task_on(path, project=EZ, blend=0.01), ROLLER)
