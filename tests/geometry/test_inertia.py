"""Centres and inertias of solids: closed forms against sums over fine meshes of the same solids."""

import numpy as np
import pytest

from cellplan.geometry.inertia import centre_and_inertia
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import pose, transform_points

FINE = 96  # sides of a round mesh: it is within a thousandth of the round solid


@pytest.mark.parametrize(
    "solid",
    [Box((0.1, 0.2, 0.3)), Cylinder(0.1, 0.4), Sphere(0.2), Capsule(0.1, 0.3)],
    ids=lambda it: type(it).__name__,
)
def test_closed_forms_are_those_of_a_mesh_of_the_same_solid(solid: Solid) -> None:
    mesh = tessellate(solid, FINE)

    centre, inertia = centre_and_inertia(make_mesh(mesh.vertices, mesh.faces, source="fine"))

    np.testing.assert_allclose(centre, 0.0, atol=1e-12)
    np.testing.assert_allclose(inertia, centre_and_inertia(solid)[1], rtol=5e-3, atol=1e-9)


def test_a_mesh_drawn_elsewhere_has_its_centre_there_and_its_inertia_turned() -> None:
    box = tessellate(Box((0.1, 0.2, 0.3)), 4)
    X = pose((0.4, -0.2, 1.0), (0.3, 0.5, -0.7))

    centre, inertia = centre_and_inertia(make_mesh(transform_points(X, box.vertices), box.faces, source="moved"))

    np.testing.assert_allclose(centre, X[:3, 3], atol=1e-12)
    along_axes = np.diag([0.13, 0.10, 0.05]) / 12.0
    np.testing.assert_allclose(inertia, X[:3, :3] @ along_axes @ X[:3, :3].T, atol=1e-12)
