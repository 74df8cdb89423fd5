"""What carries a base: where the solid stands in the world, and where its top ends."""

import numpy as np
import pytest
import trimesh

from cellplan.geometry.shapes import Box, Cylinder, Mesh
from cellplan.geometry.transforms import pose
from cellplan.model.cell.mounting import Bracket, Hanger, Pedestal, Wedge

UPSIDE_DOWN = pose((1.0, 2.0, 2.2), (np.pi, 0.0, 0.5))


def test_a_hanger_fills_the_vertical_from_the_base_to_the_ceiling() -> None:
    shape, X_BS = Hanger(size=(0.4, 0.3), ceiling=3.0).solid(UPSIDE_DOWN) or (None, np.eye(4))

    X_WS = UPSIDE_DOWN @ X_BS
    assert shape == Box((0.4, 0.3, pytest.approx(0.8)))
    np.testing.assert_allclose(X_WS, pose((1.0, 2.0, 2.6), (0.0, 0.0, 0.5)), atol=1e-12)
    assert Hanger(radius=0.1, ceiling=2.2).solid(UPSIDE_DOWN) is None


def test_a_bracket_lies_behind_its_base_however_that_is_turned() -> None:
    sideways = pose((0.0, 0.0, 1.5), (0.0, np.pi / 2, 0.0))  # z of the base points along +x of the world

    shape, X_BS = Bracket(radius=0.2, length=0.3).solid(sideways)

    assert shape == Cylinder(0.2, 0.3)
    np.testing.assert_allclose((sideways @ X_BS)[:3, 3], (-0.15, 0.0, 1.5), atol=1e-12)


@pytest.mark.parametrize("tilt", [(0.0, 0.5, 0.3), (-0.4, 0.2, 2.0), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("column", [{"size": (0.3, 0.5)}, {"radius": 0.25}])
def test_a_wedge_ends_in_the_plane_of_its_base(
    tilt: tuple[float, float, float], column: dict[str, float | tuple[float, float]]
) -> None:
    X_WB = pose((1.0, -2.0, 0.8), tilt)

    shape, X_BS = Wedge(**column, floor=0.1).solid(X_WB) or (None, np.eye(4))

    assert isinstance(shape, Mesh)
    corners = shape.vertices
    lower, upper = corners[: len(corners) // 2], corners[len(corners) // 2 :]
    in_base = upper @ X_BS[:3, :3].T + X_BS[:3, 3]
    in_world = lower @ (X_WB @ X_BS)[:3, :3].T + (X_WB @ X_BS)[:3, 3]
    np.testing.assert_allclose(in_base[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(in_world[:, 2], 0.1, atol=1e-12)
    np.testing.assert_allclose(upper[:, :2], lower[:, :2], atol=1e-12)  # it is upright


def test_a_wedge_is_a_closed_solid_of_the_volume_under_the_plane() -> None:
    """A prism under a plane through the middle of its top has the volume of base area times mean height."""
    for column, area in (({"size": (0.3, 0.5)}, 0.15), ({"radius": 0.25}, 48 * np.tan(np.pi / 48) * 0.25**2)):
        shape, _ = Wedge(**column, floor=0.1).solid(pose((0.0, 0.0, 0.8), (0.2, 0.5, 0.3))) or (None, None)
        assert isinstance(shape, Mesh)
        solid = trimesh.Trimesh(shape.vertices, shape.faces, process=False)

        assert solid.is_watertight
        heights = np.einsum("fk,fvk->fv", solid.face_normals, shape.vertices[None] - solid.triangles[:, :1])
        assert heights.max() < 1e-12  # no corner in front of a face: convex, normals outwards
        assert solid.volume == pytest.approx(area * 0.7, rel=1e-12)


def test_a_wedge_of_which_nothing_is_left_at_one_side_is_none() -> None:
    assert Wedge(size=(1.0, 1.0), floor=0.0).solid(pose((0.0, 0.0, 0.2), (0.0, 0.8, 0.0))) is None


@pytest.mark.parametrize("column", [{}, {"radius": 0.1, "size": (0.1, 0.1)}])
def test_a_column_is_round_or_a_box(column: dict[str, float | tuple[float, float]]) -> None:
    with pytest.raises(ValueError, match="either a radius"):
        Pedestal(**column)
