"""Curves that go on straight, and orientations that come to rest there: derivatives, continuity, closed form."""

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import CircleCurve
from cellplan.geometry.curves.extension import ExtendedCurve, ExtendedFrame, Extension, Tail
from cellplan.geometry.curves.orientation import AxisFrame
from cellplan.geometry.transforms import rotation_vector

BEFORE, BEHIND = 0.5, 0.8  # [rad] of the parameter
STEP = 1e-5
END = 2.0 * np.pi
PLACES = np.array([-0.4, -0.1, 0.3, 1.1, 1.9, 4.0, END + 0.1, END + 0.7])

CIRCLE = CircleCurve(centre=np.zeros(3), first=np.array([0.2, 0.0, 0.0]), second=np.array([0.0, 0.2, 0.0]))
INWARD = CircleCurve(centre=np.array([0.0, 0.0, -1.0]), first=np.array([-1.0, 0.0, 0.0]), second=np.array([0.0, -1, 0]))
WHOLE = (-BEFORE, END + BEHIND)
FRAME = AxisFrame(axes=INWARD, x_hint=np.array([0.3, 0.2, 1.0]))


def extension(arc: float = 0.0, lift: float = 0.0) -> Extension:
    """Of the circle, whose speed is its radius at any parameter; with quarter circles [m] the tangents are shorter."""
    (p,), (dp,) = CIRCLE.evaluate(np.zeros(1), WHOLE)
    lengths = [0.2 * angle - 0.5 * np.pi * arc for angle in (BEFORE, BEHIND)]
    before, behind = (
        Tail(p=p, dp=dp, side=np.eye(3)[0], normal=np.eye(3)[2], straight=length, arc=arc, lift=lift, sign=sign)
        for length, sign in zip(lengths, (-1.0, 1.0), strict=True)
    )
    return Extension(knots=CIRCLE.knots, tails=(before, behind))


STRAIGHT, BENT = extension(), extension(arc=0.03, lift=0.01)
KINDS = pytest.mark.parametrize("kind", [STRAIGHT, BENT], ids=["straight", "bent"])


def points(kind: Extension, u: Array) -> tuple[Array, Array]:
    return ExtendedCurve(curve=CIRCLE, extension=kind).evaluate(u, WHOLE)


def frames(kind: Extension, u: Array) -> tuple[Array, Array]:
    p, dp = points(kind, u)
    return ExtendedFrame(frame=FRAME, curve=CIRCLE, extension=kind).frames(u, WHOLE, p=p, dp=dp)


@KINDS
def test_points_and_frames_have_their_derivatives(kind: Extension) -> None:
    ahead, back = (points(kind, PLACES + h)[0] for h in (STEP, -STEP))
    R_ahead, R_back = (frames(kind, PLACES + h)[0] for h in (STEP, -STEP))

    assert np.allclose((ahead - back) / (2.0 * STEP), points(kind, PLACES)[1], atol=1e-8)
    turned = rotation_vector(R_ahead @ np.swapaxes(R_back, 1, 2)) / (2.0 * STEP)
    assert np.allclose(turned, frames(kind, PLACES)[1], atol=1e-6)


@KINDS
@pytest.mark.parametrize("end", [0.0, END])
def test_rates_are_continuous_where_the_curve_ends(end: float, kind: Extension) -> None:
    u = end + np.array([-1e-9, 1e-9])

    assert np.ptp(points(kind, u)[1], axis=0).max() < 1e-8
    R, w = frames(kind, u)
    assert np.ptp(R, axis=0).max() < 1e-8
    assert np.ptp(w, axis=0).max() < 1e-8


def test_tangents_are_straight_and_the_orientation_is_at_rest_at_their_ends() -> None:
    u = np.linspace(END, END + BEHIND, 5)

    assert np.allclose(points(STRAIGHT, u)[0], np.stack([0.2 + 0.0 * u, 0.2 * (u - END), 0.0 * u], axis=1))
    assert np.allclose(frames(STRAIGHT, np.array(WHOLE))[1], 0.0, atol=1e-12)
    assert np.linalg.norm(frames(STRAIGHT, np.array([END]))[1]) > 0.1


def test_quarter_circles_end_across_the_path_at_the_height_of_their_lift() -> None:
    """From (0.2, 0) along y: the circle of 30 mm turns to x, and the tangent goes on along it."""
    p, dp = points(BENT, np.array([END + BEHIND]))

    straight = 0.2 * BEHIND - 0.5 * np.pi * 0.03
    assert np.allclose(p, [[0.2 + 0.03 + straight, 0.03, 0.01]])
    assert np.allclose(dp, [[0.2, 0.0, 0.0]])
