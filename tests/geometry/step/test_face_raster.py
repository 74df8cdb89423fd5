"""Rasters of faces of STEP solids against closed forms: distances on the face, border, normals, gaps and refusals."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.step_files import Named, box, cut, cylinder, write_step
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
from OCP.collections import Array2_gp_Pnt
from OCP.GeomAbs import GeomAbs_C2
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_SOLID

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.step.face_raster import FaceRequest, Raster, RasterSettings, StepSizeError, raster, read_raster
from cellplan.geometry.step.kernel import Face, Solid, explored

BALL, CAP = 0.15, 0.06  # [m] radius of a ball, and height of the cap of it above z = 0
MOST_OFF = 1e-4  # [m] of the border
MOST_LEANING = np.deg2rad(1e-6)  # [rad]


def settings(step: float = 0.02, **changes: float) -> RasterSettings:
    """Settings in [m] and [rad]."""
    plain = {"direction": 0.0, "overlap": 0.0, "lead": 0.0, "chord": 1e-5, "standoff": 0.0}
    return RasterSettings(step=step, **(plain | changes))


def face_of(shape: Any, kind: str) -> Face:
    """The largest face of one kind of the first solid of a shape."""
    solid = Solid(next(explored(shape, TopAbs_SOLID)), "PART", {})
    return max(
        (face for face in solid.faces if face.kind == kind), key=lambda face: (round(face.area, 9), face.box[1][2])
    )


def dome() -> Any:
    """A cap of a ball in [mm], its flat side at z = 0."""
    ball = BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, 1e3 * (CAP - BALL)), 1e3 * BALL).Shape()
    return BRepAlgoAPI_Common(ball, box((-500, -500, 0), (500, 500, 500))).Shape()


def lines_of(content: Raster) -> list[Array]:
    """Points of each line with the process on, shape (N, 3) each."""
    ends = np.flatnonzero(content.is_off)
    pieces = np.split(np.arange(len(content.points)), ends + 1)
    return [content.points[piece] for piece in pieces if len(piece) > 1]


@pytest.mark.parametrize("direction", [pytest.param(0.0, marks=pytest.mark.slow), 0.7])
def test_lines_on_a_dome_are_a_step_apart_on_it_and_end_at_its_border(direction: float) -> None:
    content = raster(face_of(dome(), "sphere"), settings(direction=direction))

    centre = np.array([0.0, 0.0, CAP - BALL])
    across = np.array([-np.sin(direction), np.cos(direction), 0.0])
    lines = lines_of(content)
    latitudes = [BALL * np.arcsin((line - centre) @ across / BALL) for line in lines]
    places = np.array([latitude.mean() for latitude in latitudes])
    assert content.line_count == len(lines) == 14
    assert max(np.ptp(latitude) for latitude in latitudes) <= 1e-6  # one distance from the great circle in the middle
    np.testing.assert_allclose(np.diff(places), 0.02, rtol=1e-4)
    np.testing.assert_allclose(places, -places[::-1], atol=1e-5)
    assert max(abs(line[k, 2]) for line in lines for k in (0, -1)) <= MOST_OFF
    out = (content.points - centre) / np.linalg.norm(content.points - centre, axis=1, keepdims=True)
    assert (
        np.abs(np.linalg.norm(content.points - centre, axis=1) - BALL)[np.append(~content.is_off, True)].max() <= 1e-9
    )
    assert 2.0 * np.arcsin(0.5 * np.linalg.norm(out - content.normals, axis=1).max()) <= MOST_LEANING


@pytest.mark.slow
def test_sides_of_lines_are_within_the_chord_also_at_a_distance_from_the_face() -> None:
    content = raster(face_of(dome(), "sphere"), settings(standoff=0.1, chord=5e-5))

    centre = np.array([0.0, 0.0, CAP - BALL])
    for line in lines_of(content):
        assert np.abs(np.linalg.norm(line - centre, axis=1) - BALL - 0.1).max() <= 1e-9
        middle = 0.5 * (line[:-1] + line[1:])
        assert (BALL + 0.1 - np.linalg.norm(middle - centre, axis=1)).max() <= 5e-5 + 1e-9


def test_beyond_the_border_lines_bend_ever_less_so_that_the_tool_turns_without_a_jerk() -> None:
    content = raster(face_of(dome(), "sphere"), settings(direction=0.7, overlap=0.04, chord=1e-6, step=0.1))

    count = len(lines_of(content)[0])
    line, normals = content.points[count // 2 : count], content.normals[count // 2 : count]
    turns = np.linalg.norm(np.cross(normals[:-1], normals[1:]), axis=1)
    sides = np.linalg.norm(np.diff(line, axis=0), axis=1)
    to_end = np.append(np.cumsum(sides[::-1])[::-1], 0.0)
    middles = 0.5 * (to_end[:-1] + to_end[1:])
    beyond = middles < 0.04
    rates = np.where(beyond, middles / 0.04, 1.0) / BALL  # [rad/m] of a line that straightens evenly
    assert 10 < beyond.sum() < len(beyond)
    np.testing.assert_allclose(turns / sides, rates, atol=1e-2 / BALL)
    assert turns[beyond].sum() == pytest.approx(0.04 / (2.0 * BALL), rel=1e-3)
    assert np.abs(np.sum(np.diff(line, axis=0) * (normals[:-1] + normals[1:]), axis=1) / sides).max() < 1e-4


def test_every_second_line_is_run_back_and_the_process_is_off_between_lines() -> None:
    content = raster(face_of(box((0, 0, 0), (200, 100, 10)), "plane"), settings(overlap=0.005, lead=0.03))

    lines = lines_of(content)
    assert [round(float(1e3 * (line[-1] - line[0])[0])) for line in lines] == [210, -210, 210, -210, 210]
    np.testing.assert_allclose(
        sorted({round(float(1e3 * p[1]), 6) for line in lines for p in line}), [10, 30, 50, 70, 90]
    )
    assert np.ptp(content.points[:, 0]) == pytest.approx(0.2 + 2.0 * (0.005 + 0.03), abs=1e-6)
    assert not content.is_off[0]
    assert not content.is_off[-1]
    assert int(content.is_off.sum()) == 3 * (len(lines) - 1)  # out, over and in


@pytest.mark.parametrize("overlap", [0.0, 0.004])
def test_lines_stop_at_holes_and_go_over_narrow_ones_with_the_process_on(overlap: float) -> None:
    plate = cut(box((0, 0, 0), (200, 100, 10)), cylinder(25, 30, (90, 50, -5)))
    plate = cut(plate, cylinder(3, 30, (150, 50, -5)))
    content = raster(face_of(plate, "plane"), settings(overlap=overlap))

    lines = [line for line in lines_of(content) if abs(line[0, 1] - 0.05) < 1e-6]
    ends = sorted(float(1e3 * p[0]) for line in lines for p in line[[0, -1]])
    o = 1e3 * overlap
    small = [] if overlap else [147.0, 153.0]
    np.testing.assert_allclose(ends, [-o, 65.0 + o, 115.0 - o, *small, 200.0 + o], atol=1e3 * MOST_OFF)
    off = {round(float(1e3 * line[0, 1])) for line in lines_of(content)}
    assert off == {10, 30, 50, 70, 90}


@pytest.mark.parametrize("direction", [0.0, pytest.param(90.0, marks=pytest.mark.slow)])
def test_lines_on_a_pipe_run_round_it_or_along_it(direction: float) -> None:
    content = raster(face_of(cylinder(40, 100), "cylinder"), settings(direction=np.deg2rad(direction)))

    lines = lines_of(content)
    radius = [np.hypot(line[:, 0], line[:, 1]) for line in lines]
    assert max(np.abs(it - 0.04).max() for it in radius) <= 1e-9
    heights = np.array([line[:, 2].mean() for line in lines])
    angles = np.unwrap([np.arctan2(line[0, 1], line[0, 0]) for line in lines])
    spacing = np.diff(heights) if max(np.ptp(line[:, 2]) for line in lines) < 1e-6 else 0.04 * np.diff(angles)
    np.testing.assert_allclose(np.abs(spacing), 0.02, rtol=1e-6)


@pytest.mark.slow
def test_lines_on_a_saddle_of_a_torus_are_a_step_apart_across_them() -> None:
    """No closed form: from points of a line the nearest points of the next one are a step away."""
    ring = BRepPrimAPI_MakeTorus(120.0, 50.0).Shape()
    inner = BRepAlgoAPI_Common(ring, box((20, -60, -30), (110, 60, 30))).Shape()
    content = raster(face_of(inner, "torus"), settings(0.01, direction=0.5))

    lines = [line for line in lines_of(content) if len(line) > 2]
    for one, other in pairwise(lines):
        sides = np.concatenate([a + np.linspace(0.0, 1.0, 50)[:, None] * (b - a) for a, b in pairwise(other)])
        apart = np.linalg.norm(one[len(one) // 2] - sides, axis=1).min()
        assert apart == pytest.approx(0.01, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("direction", [0.0, 0.6])
def test_lines_on_a_wavy_surface_of_splines_are_a_step_apart_along_it(direction: float) -> None:
    points = Array2_gp_Pnt(1, 12, 1, 12)
    for row, column in np.ndindex(12, 12):
        x, y = 20.0 * row, 15.0 * column
        points.SetValue(row + 1, column + 1, gp_Pnt(x, y, 40.0 * np.sin(x / 90.0) * np.cos(y / 70.0)))
    surface = GeomAPI_PointsToBSplineSurface(points, 3, 8, GeomAbs_C2, 1e-3).Surface()
    face = Face(BRepBuilderAPI_MakeFace(surface, 1e-6).Face())

    lines = [line for line in lines_of(raster(face, settings(direction=direction))) if len(line) > 2]

    apart = []
    for one, other in pairwise(lines):
        sides = np.concatenate([a + np.linspace(0.0, 1.0, 30)[:, None] * (b - a) for a, b in pairwise(other)])
        for point in one[2:-2:6]:
            k = int(np.argmin(np.linalg.norm(sides - point, axis=1)))
            if 40 <= k < len(sides) - 40:  # no end of a line
                _, feet, _ = face.project(point + np.linspace(0.0, 1.0, 40)[:, None] * (sides[k] - point))
                apart.append(np.linalg.norm(np.diff(feet, axis=0), axis=1).sum())
    assert len(apart) > 30
    np.testing.assert_allclose(apart, 0.02, rtol=0.01)


@pytest.mark.parametrize(
    ("shape", "kind", "step", "words"),
    [
        (box((0, 0, 0), (200, 100, 10)), "plane", 0.12, "expected a step of at most 100 mm, the width of the face"),
        (cylinder(40, 100), "cylinder", 0.05, "expected a step below the smallest radius of the face, 40.\\d* mm"),
    ],
)
def test_steps_that_do_not_suit_the_face_are_refused(shape: Any, kind: str, step: float, words: str) -> None:
    with pytest.raises(StepSizeError, match=words):
        raster(face_of(shape, kind), settings(step, direction=np.pi / 2 if kind == "cylinder" else 0.0))


@pytest.mark.slow
def test_lines_that_would_cover_a_pipe_twice_are_refused() -> None:
    with pytest.raises(InputError, match=r"cover once, but they meet at .* choose another direction_deg"):
        raster(face_of(cylinder(40, 100), "cylinder"), settings(direction=0.5))


def test_faces_have_the_names_of_the_file_and_an_unknown_one_gives_all_names(tmp_path: Path) -> None:
    part = Named("PLATE", box((0, 0, 0), (30, 20, 10)), {}, {2: "PAD"})
    path = write_step(tmp_path / "a.step", [part])

    names = read_raster(path, "a.step", None, FaceRequest("LID", settings(0.005)))

    assert names == ("F1", "F2", "PAD", "F4", "F5", "F6")
    assert isinstance(read_raster(path, "a.step", None, FaceRequest("PAD", settings(0.005))), Raster)
