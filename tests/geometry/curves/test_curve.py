"""Curves pass their points, their derivatives are true, and their length is measured to the last digits."""

from itertools import pairwise

import numpy as np
import pytest

from cellplan.geometry.curves.arc_length import measure, quickly
from cellplan.geometry.curves.curve import (
    CircleCurve,
    Curve,
    chord_lengths,
    rounded_sides,
    smooth_through,
    spans_at,
    straight_sides,
)

EX, EY, EZ = np.eye(3)
ELL = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.2, 0.0], [0.3, 0.2, 0.4]])
WAVY = np.array([[0.0, 0.0, 0.0], [0.1, 0.05, 0.0], [0.15, 0.02, 0.1], [0.3, 0.1, 0.1], [0.35, 0.0, 0.0]])


def _curves() -> list[Curve]:
    lengths = chord_lengths(ELL)
    closed = np.vstack([WAVY, WAVY[:1]])
    return [
        CircleCurve(centre=EZ, first=0.2 * EX, second=0.2 * EY),
        straight_sides(lengths, ELL),
        rounded_sides(lengths, ELL, 0.08),
        smooth_through(chord_lengths(WAVY), WAVY, breaks=np.array([True, False, False, False, True])),
        smooth_through(chord_lengths(closed), closed, breaks=np.zeros(6, dtype=bool)),
    ]


@pytest.mark.parametrize("curve", _curves(), ids=lambda curve: type(curve).__name__)
def test_derivative_agrees_with_central_differences(curve: Curve) -> None:
    whole = (curve.knots[0], curve.knots[-1])
    for low, high in pairwise(curve.knots):
        width = high - low
        u, h = low + width * np.linspace(0.05, 0.95, 37), 1e-5 * width
        difference = (curve.evaluate(u + h, whole)[0] - curve.evaluate(u - h, whole)[0]) / (2.0 * h)
        rate = curve.evaluate(u, whole)[1]
        assert np.abs(difference - rate).max() <= 1e-8 * np.abs(rate).max()  # truncation 1e-10, rounding 1e-10


def test_a_stop_belongs_to_the_side_the_interval_names() -> None:
    knots = chord_lengths(ELL)
    curve = straight_sides(knots, ELL)

    before = curve.evaluate(knots[1:2], (knots[0], knots[1]))[1]
    after = curve.evaluate(knots[1:2], (knots[1], knots[2]))[1]

    assert np.allclose(before, EX, atol=1e-15)
    assert np.allclose(after, EY, atol=1e-15)


def test_intervals_may_differ_from_point_to_point() -> None:
    knots = np.array([0.0, 1.0, 2.0, 3.0])

    spans = spans_at(knots, np.array([1.0, 1.0, 2.5]), (np.array([0.0, 1.0, 0.0]), np.array([1.0, 2.0, 3.0])))

    assert spans.tolist() == [0, 1, 2]


def test_rounded_corners_join_their_sides_without_a_jump_of_tangent_or_curvature() -> None:
    knots, blend = chord_lengths(ELL), 0.08
    curve = rounded_sides(knots, ELL, blend)
    whole = (knots[0], knots[-1])
    for knot in curve.knots[1:-1]:
        h = 1e-6
        rates = curve.evaluate(knot + h * np.array([-1.0, 1.0]), whole)[1]
        speeds = np.linalg.norm(rates, axis=1)
        turn = np.diff(rates / speeds[:, None], axis=0)[0]
        assert speeds == pytest.approx([1.0, 1.0], abs=1e-4)  # the speed grows by 1/h at most, no jump
        assert np.linalg.norm(turn) / (2.0 * h) <= 1e-3 / blend  # curvature grows from zero, a circle has 1 / blend


def test_rounded_corners_are_little_sharper_than_an_arc() -> None:
    knots, blend = chord_lengths(ELL), 0.08
    curve, h = rounded_sides(knots, ELL, blend), 1e-6
    u = np.linspace(knots[1] - blend + 2 * h, knots[1] + blend - 2 * h, 4001)
    whole = (knots[0], knots[-1])

    rates = curve.evaluate(u, whole)[1]
    second = (curve.evaluate(u + h, whole)[1] - curve.evaluate(u - h, whole)[1]) / (2.0 * h)
    curvature = np.linalg.norm(np.cross(rates, second), axis=1) / np.linalg.norm(rates, axis=1) ** 3

    assert curvature.max() * blend <= 1.3  # measured 1.29; an arc over a right angle has the radius of the blend


def test_rounded_corners_keep_within_their_distance() -> None:
    knots, blend = chord_lengths(ELL), 0.08
    curve = rounded_sides(knots, ELL, blend)
    u = np.linspace(knots[1] - blend, knots[1] + blend, 1001)

    p, dp = curve.evaluate(u, (knots[0], knots[-1]))

    assert np.linalg.norm(p - ELL[1], axis=1).max() <= blend * (1.0 + 1e-12)
    assert p[:, 0].max() <= 0.3 + 1e-15  # inside the corner's triangle: not beyond either side
    assert p[:, 1].min() >= -1e-15
    assert np.linalg.norm(p - ELL[1], axis=1).min() == pytest.approx(0.25 * blend * np.sqrt(2.0), rel=1e-12)
    assert np.linalg.norm(dp, axis=1).min() > 0.5  # no standstill in a right angle


def test_rounding_may_use_up_a_side() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])

    curve = rounded_sides(chord_lengths(square), square, 0.5)

    assert np.allclose(curve.knots, [0.0, 0.5, 1.5, 2.5, 3.0])
    assert np.allclose(curve.evaluate(np.array([1.5]), (0.0, 3.0))[0], [[1.0, 0.5, 0.0]])


def test_smooth_curve_passes_its_points_with_one_tangent() -> None:
    knots = chord_lengths(WAVY)
    curve = smooth_through(knots, WAVY, breaks=np.array([True, False, False, False, True]))
    for k in range(1, 4):
        left, left_rate = curve.evaluate(knots[k : k + 1], (knots[0], knots[k]))
        right, right_rate = curve.evaluate(knots[k : k + 1], (knots[k], knots[-1]))
        assert np.allclose(left, WAVY[k], atol=1e-15)
        assert np.allclose(right, WAVY[k], atol=1e-15)
        assert np.allclose(left_rate, right_rate, atol=1e-14)


def test_smooth_curve_reproduces_a_parabola() -> None:
    u = np.array([0.0, 0.2, 0.5, 0.6, 1.0])
    values = np.stack([u, u**2, 1.0 - 3.0 * u + 2.0 * u**2], axis=1)
    curve = smooth_through(u, values, breaks=np.array([True, False, False, False, True]))
    fine = np.linspace(0.0, 1.0, 101)

    p, _ = curve.evaluate(fine, (0.0, 1.0))

    assert np.allclose(p, np.stack([fine, fine**2, 1.0 - 3.0 * fine + 2.0 * fine**2], axis=1), atol=1e-14)


def test_closed_smooth_curve_returns_with_its_first_tangent() -> None:
    closed = np.vstack([WAVY, WAVY[:1]])
    knots = chord_lengths(closed)
    curve = smooth_through(knots, closed, breaks=np.zeros(6, dtype=bool))

    _, rates = curve.evaluate(knots[[0, -1]], (knots[0], knots[-1]))

    assert np.allclose(rates[0], rates[1], atol=1e-14)


def test_smooth_curve_through_many_points_of_a_circle_is_nearly_the_circle() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 181)
    points = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    points[-1] = points[0]
    knots = chord_lengths(points)
    curve = smooth_through(knots, points, breaks=np.zeros(181, dtype=bool))

    p, _ = curve.evaluate(np.linspace(0.0, knots[-1], 2001), (0.0, knots[-1]))

    middle = np.cos(np.pi / 180.0) * (1.0 + 0.5 * np.sin(np.pi / 180.0) ** 2)  # of a cubic over 2 deg, by hand
    assert np.linalg.norm(p, axis=1).min() == pytest.approx(middle, abs=1e-12)
    assert np.linalg.norm(p, axis=1).max() <= 1.0 + 1e-15


def test_a_span_between_two_breaks_is_straight() -> None:
    knots = chord_lengths(WAVY)
    curve = smooth_through(knots, WAVY, breaks=np.ones(5, dtype=bool))
    straight = straight_sides(knots, WAVY)
    u = np.linspace(0.0, knots[-1], 77)

    assert np.allclose(curve.evaluate(u, (0.0, knots[-1]))[0], straight.evaluate(u, (0.0, knots[-1]))[0], atol=1e-15)


def test_length_of_an_ellipse_agrees_with_the_complete_elliptic_integral() -> None:
    a, b = 0.3, 0.1
    ellipse = CircleCurve(centre=EZ, first=a * EX, second=b * EY)
    x, y = a, np.sqrt(a * a - b * b)
    mean, root, weight, total = a, b, 0.5, 0.5 * y * y  # arithmetic-geometric mean of a and b
    while abs(mean - root) > 1e-16 * x:
        mean, root, weight, gap = 0.5 * (mean + root), np.sqrt(mean * root), 2.0 * weight, 0.5 * (mean - root)
        total += weight * gap * gap
    perimeter = 2.0 * np.pi * (a * a - total) / mean

    assert measure(ellipse).total == pytest.approx(perimeter, rel=1e-12)


@pytest.mark.parametrize("curve", _curves(), ids=lambda curve: type(curve).__name__)
def test_parameters_at_lengths_invert_the_length(curve: Curve) -> None:
    arc = measure(curve)
    whole = (float(curve.knots[0]), float(curve.knots[-1]))
    desired = np.linspace(0.0, arc.total, 57)

    u = arc.parameters(desired, whole)

    assert np.all(np.diff(u) > 0.0)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for low, high, expected in zip(u[:-1], u[1:], np.diff(desired), strict=True):
        cuts = np.concatenate([[low], curve.knots[(curve.knots > low) & (curve.knots < high)], [high]])
        length = 0.0
        for a, b in pairwise(cuts):
            rates = curve.evaluate(a + 0.5 * (nodes + 1.0) * (b - a), whole)[1]
            length += 0.5 * (b - a) * float(weights @ np.linalg.norm(rates, axis=1))
        assert length == pytest.approx(expected, abs=1e-11 * arc.total)


@pytest.mark.parametrize(
    "curve", [*_curves(), CircleCurve(centre=EZ, first=EX, second=1e-3 * EY)], ids=lambda value: type(value).__name__
)
@pytest.mark.parametrize("count", [1, 12, 300])
def test_the_quick_way_to_parameters_leads_to_the_same(curve: Curve, count: int) -> None:
    arc = measure(curve)
    whole = (float(curve.knots[0]), float(curve.knots[-1]))
    desired = np.sort(np.random.default_rng(count).uniform(0.0, arc.total, count))

    u = quickly(arc).parameters(desired, whole)

    # both are roots to rounding of the length; the flat ellipse is slow at its ends
    assert np.abs(arc.lengths(u) - desired).max() <= 1e-14 * arc.total
    assert np.allclose(u, arc.parameters(desired, whole), rtol=0.0, atol=1e-11)


def test_the_quick_way_keeps_within_its_interval() -> None:
    curve = next(curve for curve in _curves() if len(curve.knots) > 2)
    arc = measure(curve)
    low, high = (float(knot) for knot in curve.knots[1:3])

    u = quickly(arc).parameters(np.array([0.0, arc.total]), (low, high))

    assert u == pytest.approx([low, high], rel=1e-15)
    assert low <= u[0]
    assert u[1] <= high


def test_a_flat_ellipse_is_measured_as_well() -> None:
    flat = CircleCurve(centre=EZ, first=EX, second=1e-3 * EY)
    arc = measure(flat)
    u = np.linspace(0.0, 0.5 * np.pi, 2_000_001)  # the trapezoid rule as a second opinion
    speed = np.hypot(np.sin(u), 1e-3 * np.cos(u))
    quarter = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(u)))

    assert arc.total == pytest.approx(4.0 * quarter, rel=1e-9)  # the rule itself is that good
    halves = arc.parameters(np.array([0.0, 0.25, 0.5, 1.0]) * arc.total, (0.0, 2.0 * np.pi))
    assert np.allclose(halves, np.array([0.0, 0.25, 0.5, 1.0]) * 2.0 * np.pi, atol=1e-9)


def test_a_side_as_short_as_rounding_is_measured_without_endless_splitting() -> None:
    points = np.array([[0.1, 0.1, 0.0], [0.0, 0.1, 0.0], [0.0, 0.1, 1e-17], [0.0, 0.3, 0.2]])
    noisy = straight_sides(np.array([0.0, 0.1, 0.3, 0.6]), points + 1e-17 * np.sin(np.arange(12.0)).reshape(4, 3))

    class Shaken:
        knots = noisy.knots

        def evaluate(self, u: np.ndarray, interval: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
            p, dp = noisy.evaluate(u, interval)
            return p, dp + 1e-17 * np.sin(1e6 * u)[:, None]

    arc = measure(Shaken())

    assert arc.total == pytest.approx(0.1 + np.sqrt(0.08), rel=1e-14)
    assert len(arc.edges) < 100
