"""Tessellated shapes are never smaller than the true ones."""

import numpy as np
import pytest

from cellplan.geometry.mesh.load import (
    tessellate,
)
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere, support


@pytest.mark.parametrize("shape", [Box((0.3, 0.1, 0.5)), Cylinder(0.2, 0.5), Capsule(0.1, 0.4), Sphere(0.3)])
@pytest.mark.parametrize("segments", [4, 5, 17, 48])
def test_tessellated_shapes_hold_the_true_ones_and_are_little_larger(shape: Solid, segments: int) -> None:
    mesh = tessellate(shape, segments)

    assert mesh.is_closed
    directions = np.random.default_rng(0).normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    corner = mesh.vertices[mesh.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    planes = np.sum(normals * corner[:, 0], axis=1)
    assert np.all(planes >= support(shape, normals) - 1e-15)  # no face cuts into the shape
    assert np.all(support(mesh, directions) >= support(shape, directions) - 1e-15)
    if segments >= 17:
        growth = 1 / np.cos(np.pi / segments) ** 2 - 1
        assert np.all(support(mesh, directions) <= support(shape, directions) * (1 + 1.7 * growth) + 1e-15)
