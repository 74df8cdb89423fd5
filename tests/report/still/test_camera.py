"""Parallel projection onto a sheet."""

import numpy as np
import pytest

from cellplan.report.still.camera import Camera, framed, view_axes


def test_a_view_from_the_front_has_x_to_the_right_and_z_upwards() -> None:
    camera = Camera(
        axes=view_axes(np.radians(-90.0), 0.0), middle=np.zeros(2), scale=100.0, place=np.array([500.0, 300.0])
    )

    np.testing.assert_allclose(camera.project(np.array([1.0, 2.0, 3.0])), [600.0, 0.0, -2.0], atol=1e-9)


def test_a_view_from_above_has_depth_along_z() -> None:
    camera = Camera(
        axes=view_axes(np.radians(-90.0), np.radians(90.0)), middle=np.zeros(2), scale=1.0, place=np.zeros(2)
    )

    np.testing.assert_allclose(camera.project(np.array([1.0, 2.0, 3.0])), [1.0, -2.0, 3.0], atol=1e-9)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0.3, 0.2), (-2.0, 0.9), (4.0, 0.0)])
def test_axes_are_a_rotation_that_keeps_z_upright(azimuth: float, elevation: float) -> None:
    axes = view_axes(azimuth, elevation)

    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[0, 2] == pytest.approx(0.0)
    assert axes[1, 2] >= 0.0


def test_a_framed_picture_touches_its_rectangle_and_does_not_leave_it() -> None:
    points = np.random.default_rng(2).uniform(-1.0, 1.0, (30, 3))
    low, high = np.array([100.0, 50.0]), np.array([900.0, 450.0])

    seen = framed(view_axes(0.4, 0.5), points, low=low, high=high).project(points)[:, :2]

    assert (seen >= low - 1e-9).all()
    assert (seen <= high + 1e-9).all()
    assert np.ptp(seen, axis=0)[1] == pytest.approx(400.0) or np.ptp(seen, axis=0)[0] == pytest.approx(800.0)
