"""Tool frames pass the given orientations, and their angular velocity is the derivative of the frame."""

import numpy as np
import pytest

from cellplan.geometry.curves.curve import smooth_through
from cellplan.geometry.curves.orientation import AxisFrame, FixedFrame, NormalFrame, Orientation, rotations_through
from cellplan.geometry.curves.surface_patch import Ball
from cellplan.geometry.transforms import Array, rotation_exp, rotation_vector

KNOTS = np.array([0.0, 0.3, 0.4, 1.0, 1.2])
INNER = np.array([True, False, False, False, True])
RNG = np.random.default_rng(5)
ROTATIONS = rotation_exp(RNG.normal(size=(5, 3)))
AXES = np.array([[0.0, 0, 1], [0.6, 0, 0.8], [0.6, 0.48, 0.64], [0, 0.8, 0.6], [0, 0.6, 0.8]])


def _frames(orientation: Orientation, u: Array) -> tuple[Array, Array]:
    p, dp = np.stack([np.sin(u), np.cos(u), 2.0 + u], axis=1), np.stack([np.cos(u), -np.sin(u), 1.0 + 0.0 * u], axis=1)
    return orientation.frames(u, (0.0, 1.2), p=p, dp=dp)


@pytest.mark.parametrize(
    "orientation",
    [
        FixedFrame(R=ROTATIONS[0]),
        AxisFrame(axes=smooth_through(KNOTS, AXES, breaks=INNER), x_hint=np.array([0.1, -2.0, 0.3])),
        rotations_through(KNOTS, ROTATIONS, breaks=INNER),
        rotations_through(KNOTS, ROTATIONS, breaks=np.ones(5, dtype=bool)),
    ],
    ids=["fixed", "axes", "rotations", "rotations with stops"],
)
def test_angular_velocity_is_the_derivative_of_the_frame(orientation: Orientation) -> None:
    h = 1e-5
    u = np.setdiff1d(np.linspace(0.01, 1.19, 119), KNOTS)
    u = u[np.abs(u[:, None] - KNOTS).min(axis=1) > 2.0 * h]
    R, w = _frames(orientation, u)

    above, below = _frames(orientation, u + h)[0], _frames(orientation, u - h)[0]

    difference = rotation_vector(above @ np.swapaxes(below, 1, 2)) / (2.0 * h)
    assert np.abs(difference - w).max() <= 1e-7 * max(np.abs(w).max(), 1.0)  # truncation grows with the short spans
    assert np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() <= 1e-14


def test_normal_frame_turns_with_the_surface() -> None:
    ball, h = Ball(centre=np.array([0.0, 0.0, 1.0]), radius=2.0), 1e-5
    orientation = NormalFrame(patch=ball, x_hint=np.array([1.0, 0.2, 0.0]))

    def on_ball(u: Array) -> tuple[Array, Array]:
        n = np.stack([np.sin(u) * 0.6, np.sin(u) * 0.8, np.cos(u)], axis=1)
        dn = np.stack([np.cos(u) * 0.6, np.cos(u) * 0.8, -np.sin(u)], axis=1)
        return ball.centre + 2.0 * n, 2.0 * dn

    def frames(u: Array) -> tuple[Array, Array]:
        p, dp = on_ball(u)
        return orientation.frames(u, (0.0, 1.2), p=p, dp=dp)

    u = np.linspace(0.1, 1.0, 31)
    R, w = frames(u)
    difference = rotation_vector(frames(u + h)[0] @ np.swapaxes(frames(u - h)[0], 1, 2)) / (2.0 * h)

    assert np.abs(difference - w).max() <= 1e-9
    assert np.allclose(R[:, :, 2], (ball.centre - on_ball(u)[0]) / 2.0, atol=1e-15)
    assert np.all(R[:, :, 0] @ np.array([1.0, 0.2, 0.0]) > 0.0)


def test_given_rotations_are_met_and_the_rate_does_not_jump() -> None:
    orientation = rotations_through(KNOTS, ROTATIONS, breaks=INNER)
    for k in range(5):
        for interval in ((KNOTS[0], KNOTS[max(k, 1)]), (KNOTS[min(k, 3)], KNOTS[-1])):
            R, _ = orientation.frames(KNOTS[k : k + 1], interval, p=np.zeros((1, 3)), dp=np.zeros((1, 3)))
            assert np.abs(R[0] - ROTATIONS[k]).max() <= 1e-14
    for k in range(1, 4):
        u, none = KNOTS[k : k + 1], np.zeros((1, 3))
        left = orientation.frames(u, (KNOTS[0], KNOTS[k]), p=none, dp=none)[1]
        right = orientation.frames(u, (KNOTS[k], KNOTS[-1]), p=none, dp=none)[1]
        assert np.allclose(left, right, atol=1e-12)


def test_between_two_stops_the_tool_turns_evenly_about_one_axis() -> None:
    orientation = rotations_through(KNOTS, ROTATIONS, breaks=np.ones(5, dtype=bool))
    u = np.linspace(0.4, 1.0, 21)

    R, w = orientation.frames(u, (0.4, 1.0), p=np.zeros((21, 3)), dp=np.zeros((21, 3)))

    turn = rotation_vector(ROTATIONS[3] @ ROTATIONS[2].T)
    assert np.allclose(w, turn / 0.6, atol=1e-13)
    assert np.allclose(R[10], rotation_exp(0.5 * turn) @ ROTATIONS[2], atol=1e-14)


def test_orientations_know_where_they_are_joined() -> None:
    axes = AxisFrame(axes=smooth_through(KNOTS, AXES, breaks=INNER), x_hint=np.array([0.1, -2.0, 0.3]))
    ball = NormalFrame(patch=Ball(centre=np.zeros(3), radius=1.0), x_hint=np.array([1.0, 0.0, 0.0]))

    assert axes.knots.tolist() == rotations_through(KNOTS, ROTATIONS, breaks=INNER).knots.tolist() == KNOTS.tolist()
    assert len(ball.knots) == len(FixedFrame(R=np.eye(3)).knots) == 0
