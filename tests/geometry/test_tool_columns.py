"""Depths of tools in closed form: along the axis, under a leaning rod, in a hollow, behind a sheet, at a wall."""

import numpy as np
import pytest

from cellplan.geometry import tool_columns
from cellplan.geometry.line_spans import Spans, line_spans
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.tool_columns import axis_depths, body_columns, depths, line_depths
from cellplan.geometry.transforms import Array, pose

BLOCK = Box((0.4, 0.4, 0.1))  # its top at 50 mm
ROD = Cylinder(0.012, 0.1)
ZONE = 0.02


def at(x: float, y: float, z: float, lean: float = 0.0) -> Array:
    """A tool that looks down, shape (1, 4, 4), leaning in the plane yz."""
    return pose((x, y, z), (np.pi + lean, 0.0, 0.0))[None]


def on_axis(part: Solid, X_ST: Array, length: float = 0.15) -> float:
    return float(axis_depths(length, part, X_ST)[0])


def of_body(body: Solid, part: Solid, X_ST: Array, *, length: float = 0.1) -> float:
    return float(depths(body_columns(body, pose((0.0, 0.0, -0.5 * length)), ZONE), part, X_ST)[0])


@pytest.mark.parametrize("part", [BLOCK, tessellate(BLOCK)])
@pytest.mark.parametrize(
    ("z", "depth"),
    [(0.06, 0.0), (0.05, 0.0), (0.035, 0.015), (-0.049, 0.099), (-0.06, 0.11), (-0.099, 0.149), (-0.11, 0.0)],
)
def test_depth_of_an_axis_counts_from_where_it_enters_as_far_as_there_is_a_tool(
    part: Solid, z: float, depth: float
) -> None:
    assert on_axis(part, at(0.0, 0.01, z), length=0.1499 if z > -0.1 else 0.05) == pytest.approx(depth, abs=1e-12)


def test_a_tool_that_is_buried_with_all_its_length_entered_behind_it() -> None:
    assert on_axis(BLOCK, at(0.0, 0.0, -0.04), length=0.02) == pytest.approx(0.09, abs=1e-12)


def test_a_pen_through_a_sheet_is_as_deep_as_all_that_is_beyond_its_near_side() -> None:
    sheet = Box((0.4, 0.4, 0.002))

    assert on_axis(sheet, at(0.0, 0.0, -0.014)) == pytest.approx(0.015, abs=1e-12)
    assert of_body(Cylinder(0.002, 0.1), sheet, at(0.0, 0.0, -0.014)) == pytest.approx(0.015, abs=1e-12)


@pytest.mark.parametrize("offset", [-5e-6, -1e-9, 0.0, 1e-9])
@pytest.mark.parametrize("part", [BLOCK, tessellate(BLOCK)])
def test_an_axis_that_runs_along_a_surface_is_free_whatever_rounding_says(part: Solid, offset: float) -> None:
    assert on_axis(part, at(0.0, 0.01, 0.05 + offset, lean=0.5 * np.pi)) <= 1e-5


def test_an_axis_along_a_surface_but_below_it_is_not_free() -> None:
    assert on_axis(BLOCK, at(0.0, 0.0, 0.049, lean=0.5 * np.pi)) == pytest.approx(0.2)


@pytest.mark.parametrize("degrees", [1.0, 10.0, 30.0])
def test_a_leaning_flat_rod_goes_in_with_its_rim_and_a_round_one_less(degrees: float) -> None:
    lean = np.radians(degrees)

    assert of_body(ROD, BLOCK, at(0.0, 0.0, 0.05, lean)) == pytest.approx(0.012 * np.tan(lean), rel=2e-3)
    ball_end = of_body(Capsule(0.012, 0.076), BLOCK, at(0.0, 0.0, 0.05, lean))
    exact = 0.012 / np.cos(lean) - 0.012
    assert exact - 0.005 * 0.012 <= ball_end <= exact + 1e-12


@pytest.mark.parametrize("part", [Sphere(0.3), Cylinder(0.3, 0.5), BLOCK])
def test_a_flat_rod_that_stands_on_a_flat_or_bulging_surface_only_touches(part: Solid) -> None:
    top = {Sphere: 0.3, Cylinder: 0.25, Box: 0.05}[type(part)]

    assert of_body(ROD, part, at(0.0, 0.0, top)) == pytest.approx(0.0, abs=1e-12)


def test_a_flat_rod_in_a_hollow_goes_in_by_the_sagitta() -> None:
    ball = tessellate(Sphere(0.2), 96)
    hollow = Mesh(vertices=ball.vertices, faces=ball.faces[:, ::-1], source="hollow", is_closed=True)
    shell = tessellate(Sphere(0.25), 96)
    vertices = np.concatenate([shell.vertices, hollow.vertices])
    faces = np.concatenate([shell.faces, hollow.faces + len(shell.vertices)])
    part = Mesh(vertices=vertices, faces=faces, source="shell", is_closed=True)
    bottom = float(-ball.vertices[:, 2].max())

    depth = of_body(ROD, part, at(0.0, 0.0, bottom), length=0.1)

    assert depth == pytest.approx(0.2 - np.sqrt(0.2**2 - 0.012**2), abs=1e-4)  # the mesh is that fine


def test_a_side_that_touches_a_wall_within_a_tenth_of_a_millimetre_is_free_and_one_beyond_is_not() -> None:
    wall = 0.2 + 0.012

    assert of_body(ROD, BLOCK, at(wall - 5e-5, 0.0, -0.01)) == 0.0
    assert of_body(ROD, BLOCK, at(wall - 3e-4, 0.0, -0.01)) == pytest.approx(0.06, abs=1e-12)


def test_a_body_beside_the_axis_counts() -> None:
    columns = body_columns(Box((0.01, 0.01, 0.04)), pose((0.03, 0.0, -0.015)), ZONE)

    assert depths(columns, BLOCK, at(0.0, 0.0, 0.05))[0] == pytest.approx(0.005, abs=1e-12)
    assert on_axis(BLOCK, at(0.0, 0.0, 0.05)) == 0.0


def test_a_body_that_goes_round_a_part_is_free() -> None:
    jaw = tessellate(Box((0.1, 0.02, 0.01)))
    both = np.concatenate([np.add(jaw.vertices, (0.0, 0.0, -0.005)), np.add(jaw.vertices, (0.0, 0.0, -0.125))])
    faces = np.concatenate([jaw.faces, jaw.faces + len(jaw.vertices)])
    clamp = Mesh(vertices=both, faces=faces, source="clamp", is_closed=True)

    depth = depths(body_columns(clamp, np.eye(4), ZONE), BLOCK, at(0.0, 0.0, -0.06))

    assert depth[0] == 0.0


def test_a_tool_that_points_back_at_its_flange_is_a_line_to_it_unless_bodies_say_where_it_goes() -> None:
    X_FT = pose((0.0, 0.0, 0.15), (np.pi, 0.0, 0.0))
    X_ST = at(0.0, 0.0, 0.05)  # it looks down into the block; its flange is 50 mm below the block

    assert line_depths(X_FT, BLOCK, X_ST, zone=ZONE, is_all=True)[0] == pytest.approx(0.1, abs=1e-12)
    assert line_depths(X_FT, BLOCK, X_ST, zone=ZONE, is_all=False)[0] == 0.0


def test_moving_part_and_tool_together_changes_no_depth() -> None:
    rng = np.random.default_rng(3)
    columns = body_columns(ROD, pose((0.001, 0.002, -0.05), (0.1, 0.0, 0.0)), ZONE)
    X_ST = np.concatenate([at(*rng.uniform(-0.05, 0.05, 3), lean) for lean in rng.uniform(-0.5, 0.5, 5)])
    block = tessellate(BLOCK)
    X = pose((1.0, -2.0, 0.5), (0.4, 1.1, -2.0))
    moved = Mesh(vertices=block.vertices @ X[:3, :3].T + X[:3, 3], faces=block.faces, source="moved", is_closed=True)

    assert np.allclose(depths(columns, BLOCK, X_ST), depths(columns, moved, X @ X_ST), atol=1e-9)


def test_columns_of_poses_beside_a_mesh_meet_no_triangle_and_no_depth_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    part, columns = tessellate(BLOCK), body_columns(ROD, pose((0.0, 0.0, -0.05)), ZONE)
    X_ST = np.concatenate([at(*rng.uniform(-0.3, 0.3, 3), lean) for lean in rng.uniform(-1.5, 1.5, 200)])
    counts: list[int] = []

    def counting(shape: Solid, points: Array, directions: Array) -> Spans:
        counts.append(len(points) if isinstance(shape, Mesh) else 0)
        return line_spans(shape, points, directions)

    monkeypatch.setattr(tool_columns, "line_spans", counting)
    near = depths(columns, part, X_ST)
    followed = sum(counts)
    monkeypatch.setattr(tool_columns, "_spans_near", lambda _, *lines: line_spans(*lines))

    assert np.array_equal(near, depths(columns, part, X_ST))
    assert np.count_nonzero(near) > 20
    assert followed < 0.5 * len(X_ST) * len(columns.line)
    assert depths(columns, part, at(1.0, 0.0, 0.0)) == 0.0
