"""Facets of solids: closed, outward, and as near to the solid as is asked."""

import numpy as np
import pytest

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere, support
from cellplan.report.still.facets import facets, sides

VOLUMES = [
    (Box((0.3, 0.6, 0.2)), 0.036),
    (Cylinder(0.1, 0.6), np.pi * 0.006),
    (Capsule(0.1, 0.6), np.pi * (0.006 + 4.0 / 3.0 * 0.001)),
    (Sphere(0.2), np.pi * 4.0 / 3.0 * 0.008),
    (tessellate(Box((0.3, 0.6, 0.2))), 0.036),
]


@pytest.mark.parametrize(("solid", "volume"), VOLUMES, ids=lambda entry: type(entry).__name__)
def test_facets_enclose_the_volume_of_their_solid(solid: Solid, volume: float) -> None:
    corners = facets(solid, 48)

    areas = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    np.testing.assert_allclose(areas.sum(axis=0), 0.0, atol=1e-12)  # a closed surface
    enclosed = float((areas * corners.mean(axis=1)).sum()) / 3.0
    assert enclosed == pytest.approx(volume, rel=0.02)
    assert isinstance(solid, Sphere | Capsule) or enclosed == pytest.approx(volume, rel=0.004)


@pytest.mark.parametrize(
    "solid", [Cylinder(0.25, 0.5), Capsule(0.08, 0.4), Sphere(0.2)], ids=lambda s: type(s).__name__
)
def test_round_solids_have_as_many_sides_as_a_deviation_needs(solid: Cylinder | Capsule | Sphere) -> None:
    deviation = 0.002
    corners = facets(solid, sides(solid, deviation)).reshape(-1, 3)

    around = np.linspace(0.0, 2.0 * np.pi, 200)
    directions = np.stack([np.cos(around), np.sin(around), np.zeros(200)], axis=1)
    gap = support(solid, directions) - (corners @ directions.T).max(axis=0)

    assert gap.min() > -1e-12
    assert gap.max() < 1.2 * deviation
