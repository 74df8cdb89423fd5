"""Outlines of solids from above."""

import numpy as np
import pytest

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.outlines import AROUND, outlines, swept_outlines
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere, support
from cellplan.geometry.transforms import rotation_from_rpy

SOLIDS: list[Solid] = [
    Box((0.3, 0.5, 0.2)),
    Cylinder(0.1, 0.4),
    Capsule(0.1, 0.4),
    Sphere(0.2),
    tessellate(Box((0.2, 0.3, 0.4))),
]


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)
def test_an_outline_reaches_as_far_as_its_solid_in_each_of_its_directions(solid: Solid) -> None:
    R = np.array([rotation_from_rpy(np.array([0.4 * k, -0.7 + 0.3 * k, 1.1])) for k in range(12)])
    p = np.random.default_rng(1).uniform(-1.0, 1.0, (12, 3))

    result = outlines(solid, R, p)

    for k in range(12):
        reach = support(solid, AROUND @ R[k]) + AROUND @ p[k]
        np.testing.assert_allclose((result[k] @ AROUND[:, :2].T).max(axis=0), reach, atol=1e-12)


def test_a_swept_outline_holds_both_of_its_ends() -> None:
    R = np.array([np.eye(3), rotation_from_rpy(np.array([0.0, 0.0, 0.6]))])
    p = np.array([[0.0, 0.0, 0.5], [0.4, 0.1, 0.5]])
    solid = Box((0.6, 0.1, 0.1))

    (both,) = swept_outlines(solid, R, p)

    reach = (both @ AROUND[:, :2].T).max(axis=0)
    for end in outlines(solid, R, p):
        assert ((end @ AROUND[:, :2].T).max(axis=0) <= reach + 1e-12).all()
