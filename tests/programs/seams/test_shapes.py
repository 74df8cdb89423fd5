"""Lines and arcs of a tool, rules of orientation and corners, against closed forms."""

import numpy as np
import pytest

from cellplan.geometry.transforms import Array, inverse, pose, pose_from, rotation_exp, rotation_vector
from cellplan.programs.seams.shapes import arc, corner_cut, line, rule_difference

Z = np.array([0.0, 0.0, 1.0])


def on_circle(angle: float, *, radius: float = 0.2, spin: float = 1.0) -> Array:
    """A tool on a circle about z, which turns with its radius times ``spin``."""
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    return pose_from(rotation_exp(spin * angle * Z), np.array([0.1, -0.3, 0.05]) + radius * direction)


def test_rules_of_orientation_differ_by_a_fifth_of_a_degree_at_ten_and_ten() -> None:
    """Half of the commutator of a swing and a spin, in the middle; a quarter of it at half the spacing."""
    tilt, spin = rotation_exp(np.deg2rad([10.0, 0.0, 0.0])), rotation_exp(np.deg2rad(10.0) * Z)
    half = rotation_exp(np.deg2rad([5.0, 0.0, 0.0])) @ rotation_exp(np.deg2rad(5.0) * Z)

    whole = np.rad2deg(rule_difference(tilt @ spin))

    assert whole == pytest.approx(1.1 * 0.218, rel=0.02)
    assert np.rad2deg(rule_difference(half)) == pytest.approx(whole / 4.0, rel=0.02)
    assert rule_difference(spin) < 1e-12
    assert rule_difference(tilt) < 1e-12


@pytest.mark.parametrize("angle", [0.01, 0.7, 2.0])
def test_an_arc_goes_through_every_pose_of_its_circle(angle: float) -> None:
    shape = arc(on_circle(0.3), on_circle(0.3 + 0.4 * angle), on_circle(0.3 + angle))

    assert shape is not None
    assert shape.length == pytest.approx(0.2 * angle, rel=1e-9)
    for share in (0.0, 0.25, 0.9, 1.0):
        expected = on_circle(0.3 + share * angle)
        np.testing.assert_allclose(shape.poses(np.array([share]))[0], expected, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(shape.shares(expected[None, :3, 3]), [share], atol=1e-7)
    assert shape.rule_margin < 1e-7


def test_an_orientation_in_the_middle_that_some_controllers_pass_is_part_of_the_margin() -> None:
    middle = on_circle(0.5)
    middle[:3, :3] = rotation_exp(np.array([0.01, 0.0, 0.0])) @ middle[:3, :3]

    shape = arc(on_circle(0.0), middle, on_circle(1.0))

    assert shape is not None
    assert shape.rule_margin == pytest.approx(0.01, rel=1e-6)


def test_no_arc_leads_through_points_of_a_line_or_round_more_than_a_third_of_a_circle() -> None:
    points = [pose(xyz=(x, 0.0, 0.0)) for x in (0.0, 0.1, 0.2)]
    assert arc(*points) is None
    assert arc(points[0], points[0], points[2]) is None
    assert arc(on_circle(0.0), on_circle(1.2), on_circle(2.4)) is None


@pytest.mark.parametrize("turn", [0.01, 0.5, np.pi / 2])
def test_a_parabola_in_a_corner_stays_within_the_cut(turn: float) -> None:
    """The distance from the corner to the chord of its triangle is the radius times the sine of half of the turn."""
    radius, ahead = 0.005, np.array([np.cos(turn), np.sin(turn), 0.0])
    corner = pose(xyz=(0.1, 0.0, 0.0))
    end = pose_from(rotation_exp(0.02 * Z), corner[:3, 3] + 0.2 * ahead)

    cut, turned, swung = corner_cut(line(pose(), corner), line(corner, end), radius)

    assert cut == pytest.approx(radius * np.sin(turn / 2.0), rel=1e-9)
    assert turned == pytest.approx(0.5 * 0.02 * radius / 0.2, abs=1e-12)
    assert swung == pytest.approx(0.0, abs=1e-12)  # the tool turns about its own axis only
    u = np.linspace(0.0, 1.0, 101)[:, None]
    parabola = (1 - u) ** 2 * (corner[:3, 3] - radius * np.eye(3)[0]) + 2 * u * (1 - u) * corner[:3, 3]
    parabola = parabola + u**2 * (corner[:3, 3] + radius * ahead)
    legs = np.minimum(np.abs(parabola[:, 1]), np.abs(np.cross(parabola - corner[:3, 3], ahead)[:, 2]))
    assert legs.max() <= cut


@pytest.mark.parametrize("distance", [1e-3, 1e-2])
def test_where_arcs_of_one_circle_meet_almost_nothing_is_cut(distance: float) -> None:
    """The chord of two pieces of a circle is off it by the radius times one less the cosine of half of its angle."""
    shapes = [arc(*(on_circle(angle) for angle in angles)) for angles in ((0.0, 1.0, 2.0), (2.0, 3.0, 4.0))]
    one, other = (shape for shape in shapes if shape is not None)
    radius = one.length / 2.0

    corner = corner_cut(one, other, distance)

    assert corner.cut == pytest.approx(radius * (1.0 - np.cos(distance / radius)), rel=1e-6)


def test_a_line_turns_about_one_axis_of_the_part() -> None:
    start = pose(rpy=(0.3, -0.2, 0.5))
    end = pose_from(rotation_exp(np.array([0.1, 0.2, -0.3])) @ start[:3, :3], np.array([0.3, 0.0, 0.1]))

    poses = line(start, end).poses(np.array([0.0, 0.5, 1.0]))

    np.testing.assert_allclose(poses[[0, 2]], [start, end], atol=1e-12)
    steps = [rotation_vector((inverse(a) @ b)[:3, :3]) for a, b in ((poses[0], poses[1]), (poses[1], poses[2]))]
    np.testing.assert_allclose(steps[0], steps[1], atol=1e-12)
