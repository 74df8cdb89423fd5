"""What of a tool lies outside the contact zone: all of it that is outside, and next to nothing that is inside."""

import numpy as np
import pytest

from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.scene.collision.overlap.contact_zone import outside_zone

TIP = np.array([0.0, 0.0, 0.05])
RADIUS = 0.02
BORDER = RADIUS / 16.0  # triangles across the border are cut down to this


@pytest.mark.parametrize("shape", [Cylinder(0.01, 0.1), Box((0.03, 0.02, 0.1)), Capsule(0.01, 0.08)])
def test_the_surface_outside_begins_at_the_border_of_the_zone(shape: Solid) -> None:
    outside, is_in_zone = outside_zone(shape, TIP, RADIUS)

    assert is_in_zone
    assert outside is not None
    nearest = np.linalg.norm(outside.vertices - TIP, axis=1).min()
    assert RADIUS - BORDER <= nearest <= RADIUS + BORDER
    assert outside.vertices[:, 2].min() == pytest.approx(-0.05, abs=1e-4)  # the far end is still there


def test_a_tool_within_the_zone_leaves_nothing_outside() -> None:
    outside, is_in_zone = outside_zone(Sphere(0.005), np.array([0.0, 0.0, 0.005]), RADIUS)

    assert outside is None
    assert is_in_zone


def test_a_body_far_from_the_tip_does_not_reach_into_the_zone() -> None:
    outside, is_in_zone = outside_zone(Cylinder(0.05, 0.1), np.array([0.0, 0.0, 0.2]), RADIUS)

    assert outside is not None
    assert not is_in_zone


def test_a_wide_tool_sticks_out_of_the_zone_at_its_face() -> None:
    outside, is_in_zone = outside_zone(Cylinder(0.04, 0.1), TIP, RADIUS)

    assert is_in_zone
    assert outside is not None
    assert outside.vertices[:, 2].max() == pytest.approx(0.05)
