"""The tool stands on the surface, as a direction or as the file says."""

from dataclasses import replace

import numpy as np
import pytest
from builders.roller_paths import (
    EX,
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
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import rotation_about, rotation_exp
from cellplan.model.task import (
    PlaneName,
    PolygonPath,
)
from cellplan.planning.path.build import build_toolpath


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
