"""Support points and bounding boxes against the support function."""

import numpy as np
import pytest

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Sphere, bounding_box, support, support_point

SHAPES = [Box((0.2, 0.3, 0.1)), Cylinder(0.1, 0.3), Capsule(0.08, 0.2), Sphere(0.1), tessellate(Box((0.2, 0.3, 0.1)))]
ROUNDING = 1e-12  # [m]
AXES = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_support_point_reaches_as_far_as_the_shape(shape) -> None:
    directions = np.random.default_rng(0).normal(size=(50, 3))
    for n in [*AXES, *(directions / np.linalg.norm(directions, axis=1, keepdims=True))]:
        assert support_point(shape, n) @ n == pytest.approx(float(support(shape, n)), abs=ROUNDING)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_support_point_of_a_face_is_its_middle(shape) -> None:
    for n in AXES:
        np.testing.assert_allclose(support_point(shape, n), n * support(shape, n), atol=ROUNDING)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_bounding_box_touches_the_shape_on_all_sides(shape) -> None:
    middle, half = bounding_box(shape)
    for n in AXES:
        assert middle @ n + half @ np.abs(n) == pytest.approx(float(support(shape, n)), abs=ROUNDING)
