"""Curves that go on straight, and orientations that come to rest there: derivatives, continuity, closed form."""

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import CircleCurve
from cellplan.geometry.curves.extension import ExtendedCurve, ExtendedFrame, Extension
from cellplan.geometry.curves.orientation import AxisFrame
from cellplan.geometry.transforms import rotation_vector

BEFORE, BEHIND = 0.5, 0.8  # [rad] of the parameter
STEP = 1e-5
END = 2.0 * np.pi
PLACES = np.array([-0.4, -0.1, 0.3, 1.1, 1.9, 4.0, END + 0.1, END + 0.7])

CIRCLE = CircleCurve(centre=np.zeros(3), first=np.array([0.2, 0.0, 0.0]), second=np.array([0.0, 0.2, 0.0]))
INWARD = CircleCurve(centre=np.array([0.0, 0.0, -1.0]), first=np.array([-1.0, 0.0, 0.0]), second=np.array([0.0, -1, 0]))
EXTENSION = Extension(knots=CIRCLE.knots, before=BEFORE, behind=BEHIND)
CURVE = ExtendedCurve(curve=CIRCLE, extension=EXTENSION)
FRAME = ExtendedFrame(frame=AxisFrame(axes=INWARD, x_hint=np.array([0.3, 0.2, 1.0])), curve=CIRCLE, extension=EXTENSION)
WHOLE = (-BEFORE, END + BEHIND)


def frames(u: Array) -> tuple[Array, Array]:
    p, dp = CURVE.evaluate(u, WHOLE)
    return FRAME.frames(u, WHOLE, p=p, dp=dp)


def test_points_and_frames_have_their_derivatives() -> None:
    ahead, back = (CURVE.evaluate(PLACES + h, WHOLE)[0] for h in (STEP, -STEP))
    R_ahead, R_back = (frames(PLACES + h)[0] for h in (STEP, -STEP))

    assert np.allclose((ahead - back) / (2.0 * STEP), CURVE.evaluate(PLACES, WHOLE)[1], atol=1e-8)
    turned = rotation_vector(R_ahead @ np.swapaxes(R_back, 1, 2)) / (2.0 * STEP)
    assert np.allclose(turned, frames(PLACES)[1], atol=1e-6)


@pytest.mark.parametrize("end", [0.0, END])
def test_rates_are_continuous_where_the_curve_ends(end: float) -> None:
    u = end + np.array([-1e-9, 1e-9])

    assert np.ptp(CURVE.evaluate(u, WHOLE)[1], axis=0).max() < 1e-8
    R, w = frames(u)
    assert np.ptp(R, axis=0).max() < 1e-8
    assert np.ptp(w, axis=0).max() < 1e-8


def test_tangents_are_straight_and_the_orientation_is_at_rest_at_their_ends() -> None:
    u = np.linspace(END, END + BEHIND, 5)

    assert np.allclose(CURVE.evaluate(u, WHOLE)[0], np.stack([0.2 + 0.0 * u, 0.2 * (u - END), 0.0 * u], axis=1))
    assert np.allclose(frames(np.array(WHOLE))[1], 0.0, atol=1e-12)
    assert np.linalg.norm(frames(np.array([END]))[1]) > 0.1
