"""Angles of welds by rotations of a weld that is known, by closed forms and by projections."""

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import pose, pose_from, rotation_about
from cellplan.measures.weld_position import position_name, torch_angles, weld_angles

DOWN = pose((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0))  # the tool looks down
ALONG = np.array([1.0, 0.0, 0.0])


def turned(R: Array) -> tuple[Array, Array]:
    """A flat weld along x, turned as a whole: its tool pose and its direction of travel, one row each."""
    return pose_from(R @ DOWN[:3, :3], np.zeros(3))[None], (R @ ALONG)[None]


def proper(rng: np.random.Generator) -> Array:
    """A rotation at random."""
    R: Array = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return R * np.sign(np.linalg.det(R))


@pytest.mark.parametrize(
    ("rotation", "slope", "name"),
    [(0, 0, "PA"), (45, 0, "PB"), (-90, 0, "PC"), (135, 0, "PD"), (180, 0, "PE"), (0, 85, "PF"), (0, -85, "PG")],
)
def test_a_flat_weld_turned_about_its_axis_and_raised(rotation: float, slope: float, name: str) -> None:
    """First turned about its axis, then raised about the horizontal across it: the two angles are the two turns."""
    about, raised = rotation_about(ALONG, np.radians(rotation)), rotation_about(-np.eye(3)[1], np.radians(slope))

    slopes, rotations = weld_angles(*turned(raised @ about))

    assert np.degrees(slopes) == pytest.approx([slope], abs=1e-9)
    assert np.abs(np.degrees(rotations)) == pytest.approx([abs(rotation)], abs=1e-9)
    assert abs(rotation) == 180 or np.degrees(rotations) == pytest.approx([rotation], abs=1e-9)
    assert position_name(float(slopes[0]), float(rotations[0])) == name


def test_turns_about_gravity_change_nothing_and_backwards_changes_the_signs() -> None:
    rng = np.random.default_rng(3)
    X, travel = pose_from(proper(rng), np.zeros(3))[None], proper(rng)[:1]
    here = weld_angles(X, travel)
    about = rotation_about(np.eye(3)[2], 1.1)

    elsewhere = weld_angles(pose_from(about @ X[0, :3, :3], np.zeros(3))[None], travel @ about.T)
    backwards = weld_angles(X, -travel)

    np.testing.assert_allclose(elsewhere, here, atol=1e-12)
    np.testing.assert_allclose(backwards, [-here[0], -here[1]], atol=1e-12)
    np.testing.assert_allclose(torch_angles(pose_from(about @ X[0, :3, :3], np.zeros(3))[None]), torch_angles(X))


def test_the_rotation_is_the_angle_between_projections_across_the_weld() -> None:
    rng = np.random.default_rng(8)
    for _ in range(40):
        X, travel = pose_from(proper(rng), np.zeros(3))[None], proper(rng)[:1]
        across = np.eye(3) - travel.T @ travel
        face, up = across @ -X[0, :3, 2], across @ np.eye(3)[2]
        cosine = face @ up / np.linalg.norm(face) / np.linalg.norm(up)

        slope, rotation = weld_angles(X, travel)

        assert np.cos(rotation[0]) == pytest.approx(cosine, abs=1e-9)
        assert np.sin(slope[0]) == pytest.approx(travel[0, 2])
        assert np.cos(torch_angles(X)[0]) == pytest.approx(-X[0, 2, 2])
