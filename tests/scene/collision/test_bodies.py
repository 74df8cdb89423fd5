"""Solids as the collision engines take them."""

import numpy as np

from cellplan.geometry.mesh.topology import make_mesh
from cellplan.scene.collision.bodies import FLAT_PADDING, _box_round


def test_the_box_of_a_flat_mesh_holds_all_of_it_with_the_padding_on_every_side() -> None:
    corners = np.array([[0.1, 0.2, 0.3], [0.5, 0.2, 0.3], [0.5, 0.7, 0.3], [0.1, 0.7, 0.3]])
    flat = make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), source="sheet.stl")

    box = _box_round(flat)

    np.testing.assert_allclose(box.vertices.min(axis=0), corners.min(axis=0) - FLAT_PADDING, atol=1e-15)
    np.testing.assert_allclose(box.vertices.max(axis=0), corners.max(axis=0) + FLAT_PADDING, atol=1e-15)
    assert FLAT_PADDING > 0.0
