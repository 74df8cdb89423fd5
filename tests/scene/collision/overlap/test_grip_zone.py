"""What a further holder may not touch the part with."""

import numpy as np
import pytest

from cellplan.geometry.shapes import Box, Cylinder, Mesh
from cellplan.geometry.transforms import pose
from cellplan.scene.collision.overlap.contact_zone import outside_grip

TIP = pose((0.0, 0.0, 0.05))  # the tip in the middle of the front face of a solid of 0.1 m


def area(mesh: Mesh) -> float:
    sides = mesh.vertices[mesh.faces]
    return 0.5 * float(np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1).sum())


def test_the_face_at_the_tip_is_left_out_however_broad_it_is() -> None:
    surface, is_cut = outside_grip(Box((0.2, 0.2, 0.1)), TIP, radius=0.0, layer=0.002)

    assert is_cut
    assert surface is not None
    assert surface.vertices[:, 2].max() == pytest.approx(0.048, abs=1e-12)
    assert area(surface) == pytest.approx(0.2 * 0.2 + 4 * 0.2 * 0.098, rel=1e-9)


def test_a_solid_far_behind_the_tip_is_whole() -> None:
    surface, is_cut = outside_grip(Cylinder(0.03, 0.02), TIP, radius=0.02, layer=0.002)

    assert not is_cut
    assert surface is not None


def test_a_plate_as_thin_as_the_layer_may_touch_with_all_of_it() -> None:
    surface, is_cut = outside_grip(Box((0.2, 0.2, 0.002)), pose((0.0, 0.0, 0.001)), radius=0.0, layer=0.0021)

    assert surface is None
    assert is_cut


@pytest.mark.parametrize("height", [-0.012, 0.003, 0.017])
def test_fingers_before_the_tip_are_kept_beyond_the_layer(height: float) -> None:
    surface, _ = outside_grip(Box((0.2, 0.2, 0.1)), pose((0.0, 0.0, height)), radius=0.0, layer=0.002)

    assert surface is not None
    z = surface.vertices[:, 2]
    assert (z.min(), z.max()) == (-0.05, 0.05)
    assert not np.any(np.abs(z - height) < 0.002 - 1e-12)
