"""Paths along outlines of a drawing in a cell: on faces of a STEP file, projected, with rapids; and refusals."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from builders.drawings import CUT, HEAD, LINE, TAIL, entity, write_drawing
from builders.step_files import Named, box, moved, write_step
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import pose
from cellplan.model.task.clocked_path import ClockedPath, demanded_spans, process_spans, work_span
from cellplan.model.task.task import ProgrammedPath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_path

STEP = "step: {file: part.step}"
BALL = "geometry: {sphere: {radius_mm: 80}}"
CELL = """\
cellplan: 1
name: cut
robots:
  arm:
    model: kuka_kr6
    start_deg: [0, -90, 90, 0, 30, 0]
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 5, length_mm: 150}}}
part:
  PART
  at: {xyz_mm: [900, 0, 400]}
tasks:
  cut:
    robot: arm
    path: {PATH}
    process: {feed_mm_s: 20}
motion: {mode: simultaneous}
"""
PLACE = "cell.yaml:14: tasks.cut"
TOLERANT = "    tolerance: {position_mm: 0.1, orientation_deg: 2}\n"
AT_LEAST = 1e-9  # [m]


def draw(_, space) -> None:
    space.add_circle((0, 0), 10, dxfattribs=CUT)
    space.add_lwpolyline([(20, 0), (40, 0), (40, 15), (20, 15)], close=True, dxfattribs=CUT)
    space.add_line((-30, 0), (-15, 0), dxfattribs=CUT)
    space.add_line((0, 0), (500, 0), dxfattribs={"layer": "LONG"})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drawing, and a plate with a dome of radius 70 mm on it and a slope at its end."""
    place = tmp_path_factory.mktemp("outlines")
    write_drawing(place, draw)
    slab = BRepAlgoAPI_Cut(
        box((-150, -60, 0), (100, 60, 20)), moved(box((-80, -80, 0), (0, 80, 80)), _tilted())
    ).Shape()
    parts = [
        Named("PLATE", slab, {}, {3: "TOP", 4: "SLOPE"}),
        Named("DOME", BRepAlgoAPI_Cut(BRepPrimAPI_MakeSphere(70).Shape(), box((-90, -90, -90), (90, 90, 30))).Shape()),
    ]
    write_step(place / "part.step", parts)
    return place


def _tilted() -> np.ndarray:
    """Where a tool takes the end of the plate off, at 30 deg to its top."""
    X = pose((0.0, 0.0, 0.0), (0.0, np.deg2rad(-30.0), 0.0))
    X[:3, 3] = [-110.0, 0.0, 20.0]
    return X


def path_of(folder: Path, path: str, part: str = STEP, more: str = "") -> ProgrammedPath:
    file = folder / "cell.yaml"
    file.write_text(CELL.replace("PART", part).replace("PATH", path).replace("motion:", f"{more}motion:"))
    read = load_cell(file).task("cut").path
    assert isinstance(read, ProgrammedPath)
    return read


def refusal(folder: Path, path: str, part: str = STEP) -> str:
    with pytest.raises(InputError) as refused:
        path_of(folder, path, part)
    return str(refused.value).replace(f"{folder}/", "")


def test_an_outline_on_a_ball_needs_no_step_file_and_has_rapids_between_contours(folder: Path) -> None:
    path = path_of(folder, "outline: logo.dxf, layer: CUT, project: +z, standoff_mm: 2", BALL)

    on = np.append(~path.is_rapid, True) & np.append(True, ~path.is_rapid)
    np.testing.assert_allclose(np.linalg.norm(path.points[on], axis=1), 0.082, rtol=1e-9)
    np.testing.assert_allclose(path.axes[on], -path.points[on] / 0.082, atol=1e-9)  # type: ignore[index]
    assert path.is_rapid.sum() == 2 * 3
    lifted = path.points[~on]
    top = path.points[on][:, 2].max()
    np.testing.assert_allclose(lifted[:, 2].max(), top + 0.02, atol=AT_LEAST)
    assert set(path.speeds[path.is_rapid]) == {0.25}
    assert set(path.speeds[~path.is_rapid]) == {0.02}


def test_one_contour_is_one_feed_and_can_begin_and_run_otherwise(folder: Path) -> None:
    one = "outline: {file: logo.dxf, contours: [1], start_at_mm: [0, 99]}, layer: CUT, project: +z"
    path, back = (path_of(folder, text, BALL) for text in (one, f"{one}, reverse: true"))

    assert path.holds_one_feed
    np.testing.assert_allclose(path.points[[0, -1], :2], [[0.0, 0.01]] * 2, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(path.points[:, :2], axis=1), 0.01, rtol=1e-9)
    assert path.points[1, 0] < 0.0 < back.points[1, 0]


def test_contours_are_run_in_the_order_that_is_listed_or_the_nearest_next(folder: Path) -> None:
    def begins(options: str) -> list[float]:
        path = path_of(folder, f"outline: {{file: logo.dxf{options}}}, layer: CUT, project: +z", BALL)
        return [round(1e3 * x, 6) for x in path.points[np.flatnonzero(np.diff(path.is_rapid.astype(int)) < 0) + 1, 0]]

    assert begins("") == [20.0, -30.0]
    assert begins(", contours: [3, 2, 1]") == [20.0, 10.0]
    assert begins(", contours: [3, 2, 1], order: nearest") == [10.0, 20.0]


def test_an_outline_on_a_face_lies_in_its_plane_where_the_cell_says(folder: Path) -> None:
    at = "at: {x_mm: 70, y_mm: -20, turn_deg: 90}"
    path = path_of(folder, f"outline: {{file: logo.dxf, contours: [2], {at}}}, layer: CUT, on: TOP")

    corners = [[70, 0, 20], [70, 20, 20], [55, 20, 20], [55, 0, 20], [70, 0, 20]]
    np.testing.assert_allclose(1e3 * path.points, corners, atol=1e-9)
    np.testing.assert_allclose(path.axes, [[0.0, 0.0, -1.0]] * 5, atol=1e-12)


def test_a_tilted_face_has_the_stated_frame(folder: Path) -> None:
    path = path_of(folder, "outline: {file: logo.dxf, contours: [1], at: {x_mm: -105}}, layer: CUT, on: SLOPE")

    assert path.axes is not None
    n = -path.axes[0]
    np.testing.assert_allclose(n, [-0.5, 0.0, np.sqrt(0.75)], atol=1e-12)
    x = np.array([np.sqrt(0.75), 0.0, 0.5])  # +x of the part along the face
    foot = n * (n @ path.points[0])  # that of the origin of the part
    np.testing.assert_allclose(path.points[0], foot - 0.095 * x, atol=1e-9)  # a circle begins at its +x


def test_projection_onto_a_step_file_is_exact(folder: Path) -> None:
    path = path_of(folder, "outline: {file: logo.dxf, contours: [1], at: {x_mm: 12, y_mm: 5}}, layer: CUT, project: +z")

    np.testing.assert_allclose(np.linalg.norm(path.points, axis=1), 0.07, rtol=1e-12)
    np.testing.assert_allclose(path.axes, -path.points / 0.07, atol=1e-12)  # type: ignore[operator]
    np.testing.assert_allclose(np.linalg.norm(path.points[:, :2] - [0.012, 0.005], axis=1), 0.01, rtol=1e-9)


def test_travel_and_work_angles_lean_the_tool_from_the_normal(folder: Path) -> None:
    options = "outline: {file: logo.dxf, contours: [1]}, layer: CUT, project: +z"
    pushed, leant = (path_of(folder, f"{options}, {angle}", BALL) for angle in ("push_deg: 10", "work_deg: 15"))

    for path, degrees in ((pushed, 10.0), (leant, 15.0)):
        normals = path.points / 0.08
        assert path.axes is not None
        np.testing.assert_allclose(np.sum(-path.axes * normals, axis=1), np.cos(np.deg2rad(degrees)), rtol=1e-9)
    travel = np.diff(pushed.points, axis=0)
    assert np.all(np.sum(travel * pushed.axes[:-1], axis=1) > 0.0)  # type: ignore[index]


def test_a_stated_tool_axis_is_kept_along_an_outline(folder: Path) -> None:
    file = folder / "cell.yaml"
    text = CELL.replace("PART", BALL).replace("PATH", "outline: logo.dxf, layer: CUT, project: +z")
    file.write_text(text.replace("    process:", "    tool_axis: -z\n    process:"))
    cell = load_cell(file)
    path = build_toolpath(cell.task("cut"), cell.part)

    np.testing.assert_allclose(path.spread(99)[:, :3, 2], [[0.0, 0.0, -1.0]] * 99, atol=1e-12)


def test_a_mirrored_part_has_the_mirrored_outline(folder: Path) -> None:
    options = "outline: {file: logo.dxf, at: {x_mm: 5, turn_deg: 20}}, layer: CUT, project: +z"
    path, mirrored = (path_of(folder, options, f"{BALL}{more}") for more in ("", "\n  mirror: {plane: yz}"))

    np.testing.assert_allclose(mirrored.points, path.points * [-1.0, 1.0, 1.0], atol=1e-12)


OUTLINE = "outline: logo.dxf, layer: CUT"
FACES = "a plane face of the STEP file"
SURFACES = ".path.outline: expected an outline"
REFUSED = {
    f"{OUTLINE}, on: TOPP": f".path.on: expected {FACES} (F1, F2, F3, TOP, SLOPE, F6, F8), got 'TOPP', which is none",
    f"{OUTLINE}, on: F7": ", got 'F7', which is a sphere: project the outline (project: +z)",
    "outline: logo.dxf, layer: LONG, project: +z": f"{SURFACES} on the part, but it leaves it at x 1",
    "outline: {file: logo.dxf, at: {x_mm: 40}}, layer: CUT, project: +z": f"{SURFACES} within a smooth face, but at x ",
    "outline: {file: logo.dxf, contours: [4]}, layer: CUT, on: F2": "outline: expected contours up to 3, as many as",
    "outline: {file: logo.dxf, contours: [2, 1, 2]}, layer: CUT, on: F2": "outline: expected every contour once, got 2",
    f"{OUTLINE}": f".path.on: missing, expected {FACES} of the part, or project: +z (or another side)",
    f"{OUTLINE}, on: F2, project: +z": ".path.on: expected either on or project, got both",
    "outline: logo.dxf, on: F2": ".path.layer: missing, expected the layer of the drawing",
    f"{OUTLINE}, on: F2, weave: {{side_mm: 2, wavelength_mm: 5}}": ".path.weave: unexpected key, an outline has",
    f"{OUTLINE}, on: F2, from_mm: 5": ".path.from_mm: unexpected key, an outline has work_deg, push_deg, drag_deg",
    f"{OUTLINE}, on: F2, offset_mm: 5": ".path.offset_mm: unexpected key, only a path in a plane has an offset",
    "polyline: {points_mm: [[0, 0, 0], [9, 0, 0]]}, layer: CUT": ".path.layer: unexpected key, it goes with an outline",
    "outline: none.dxf, layer: CUT, on: F2": ".path.outline: expected an existing file, got 'none.dxf'",
}


@pytest.mark.parametrize("path", REFUSED)
def test_what_is_wrong_with_an_outline_is_said_at_its_key(folder: Path, path: str) -> None:
    message = refusal(folder, path)

    assert message.startswith(f"{PLACE}.path.")
    assert REFUSED[path] in message


def test_an_outline_is_no_path_of_tacks(folder: Path) -> None:
    text = CELL.replace("PART", STEP).replace(
        "{feed_mm_s: 20}", "{feed_mm_s: 20}\n    tacks: {length_mm: 5, pitch_mm: 9}"
    )
    (folder / "tacks.yaml").write_text(text.replace("PATH", "outline: logo.dxf, layer: CUT, on: F2"))

    with pytest.raises(InputError, match=r"tasks\.cut\.tacks: unexpected key, an outline or a raster is run as it is"):
        load_cell(folder / "tacks.yaml")


RUNS = "run_in_mm: 8, run_out_mm: 5, run_arc_mm: 6, run_arc_side: right"


def with_runs(folder: Path, contours: str, more: str = RUNS) -> ClockedPath:
    text = CELL.replace("PART", STEP).replace("feed_mm_s: 20", f"feed_mm_s: 20, {more}")
    (folder / "runs.yaml").write_text(
        text.replace("PATH", f"outline: {{file: logo.dxf, contours: {contours}}}, layer: CUT, on: F2")
    )
    cell = load_cell(folder / "runs.yaml")
    task = cell.task("cut")
    return clock_path(cell, task, build_toolpath(task, cell.part))


def test_a_closed_contour_begins_and_ends_on_quarter_circles_at_its_feed(folder: Path) -> None:
    path = with_runs(folder, "[1]")
    (begin, end), length = work_span(path), 0.5 * np.pi * 0.006
    runs = path.toolpath.runs

    assert runs == pytest.approx((0.008 + length, 0.005 + length), rel=5e-3)  # chords of the arcs
    assert process_spans(path) == ((pytest.approx(begin), pytest.approx(end)),)
    assert begin - path.start == pytest.approx(2.0 * runs[0] / 0.02)
    X_PT, V_PT_P, _ = path.targets(np.linspace(begin, end, 500))
    assert np.allclose(np.linalg.norm(V_PT_P[:, :3], axis=1), 0.02, rtol=1e-9)
    ends, twists = (values[[0, -1], :3] for values in (X_PT[:, :, 3], V_PT_P))
    along = twists / 0.02
    assert np.allclose(ends[0], ends[1], atol=1e-6)
    assert along[0] @ along[1] > np.cos(np.deg2rad(10.0))  # no corner, but for the chords of a circle
    right = np.cross(along, X_PT[0, :3, 2] * -1.0)
    outer = path.targets(np.array([path.start, path.end]))[0][:, :3, 3]
    for k, (straight, sign) in enumerate(((0.008, -1.0), (0.005, 1.0))):
        off = outer[k] - ends[k]
        assert (off @ along[k], off @ right[k]) == pytest.approx((sign * 0.006, 0.006 + straight), abs=1.2e-3)


def test_every_contour_has_its_runs_with_rapids_between_them(folder: Path) -> None:
    path = with_runs(folder, "[1, 2, 3]", "run_in_mm: 4, run_out_mm: 3, lead_s: 0.05")

    spans = process_spans(path)

    lengths = [2.0 * np.pi * 0.01, 2.0 * (0.02 + 0.015), 0.015]
    assert len(spans) == 3
    stops = [0, 3, 0]  # sharp corners of the rectangle, each with two ramps of 0.1 s
    for (on, off), length, corners in zip(spans, lengths, stops, strict=True):
        assert off - on == pytest.approx(length / 0.02 + 0.1 * corners, rel=2e-3)
    tips = path.targets(np.array([span[0] + 0.05 for span in spans]))[0][:, :3, 3]
    assert tips[:, 2] == pytest.approx(tips[0, 2])
    assert [span.feed for span in demanded_spans(path)] == [0.02] * len(demanded_spans(path))


def test_an_outline_needs_lengths_of_its_runs(folder: Path) -> None:
    with pytest.raises(
        InputError, match=r"tasks\.cut\.process\.run_in_mm: expected a length in mm for an outline, got"
    ):
        with_runs(folder, "[1]", "run_in_mm: auto")


def test_a_face_of_a_part_that_comes_from_no_step_file_is_refused(folder: Path) -> None:
    words = f"{PLACE}.path.on: expected a part from a STEP file (part.step), or project: +z (or another side)"
    assert words in refusal(folder, f"{OUTLINE}, on: F2", BALL)


def test_an_axis_that_would_jump_at_a_corner_is_refused(folder: Path) -> None:
    path = "outline: {file: logo.dxf, contours: [2]}, layer: CUT, project: +z, push_deg: 10"
    assert "expected a tool axis without a jump, but at the corner [40.000, 0.000, 69.282] mm of the part it would" in (
        refusal(folder, path, BALL)
    )


def test_a_task_along_an_outline_has_a_process_and_no_times(folder: Path) -> None:
    def words(old: str, new: str) -> str:
        text = CELL.replace("PART", BALL).replace("PATH", f"{OUTLINE}, project: +z").replace(old, new)
        (folder / "cell.yaml").write_text(text)
        with pytest.raises(InputError) as refused:
            load_cell(folder / "cell.yaml")
        return str(refused.value)

    process = "    process: {feed_mm_s: 20}\n"
    assert "tasks.cut.process: missing, expected the feed along an outline, such as {feed_mm_s: 20}" in words(
        process, ""
    )
    open_feed = words("{feed_mm_s: 20}", "{feed_mm_s: greatest}")
    assert "tasks.cut.process.feed_mm_s: expected a number above 0 in mm/s for an outline" in open_feed
    assert "tasks.cut.process.feed_mm_s: missing" in words("{feed_mm_s: 20}", "{ramp_s: 0.1}")
    assert "tasks.cut.corners: unexpected key, the process has the feed" in words(
        process, f"{process}    corners: stop\n"
    )
    assert "tasks.cut.repeat: expected 1 for a path with rapids" in words(process, f"{process}    repeat: 2\n")
    world = words(process, f"{process}    relative_to: world\n")
    assert "tasks.cut.relative_to: expected part for a path on the part, got world" in world


def test_a_spoilt_drawing_is_refused_by_its_line_from_the_child_process(folder: Path) -> None:
    text = HEAD + LINE + entity("TEXT", (10, 0), (20, 0), (40, 3), (1, "words")) + TAIL
    (folder / "spoilt.dxf").write_text(text.replace("0\nLINE", "0\nLINE\n5\n2E").replace("TEXT", "TEXT\n5\n2F"))

    assert refusal(folder, "outline: spoilt.dxf, layer: CUT, project: +z", BALL) == (
        "spoilt.dxf:33: TEXT #2F: expected LINE, ARC, CIRCLE, ELLIPSE, LWPOLYLINE, POLYLINE and SPLINE on the layer "
        "CUT, got this; move it to another layer"
    )


def test_without_the_extra_the_package_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.files.cell.paths.dxf.find_spec", lambda _: None)

    assert refusal(folder, f"{OUTLINE}, project: +z", BALL) == (
        "logo.dxf: expected the package ezdxf, got none: pip install 'cellplan[dxf]'"
    )


def test_normals_of_a_rough_mesh_are_smoothed_along_an_outline(folder: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=80.0)
    ball.vertices *= 1.0 + np.random.default_rng(1).uniform(-4e-4, 4e-4, (len(ball.vertices), 1))
    ball.export(folder / "ball.stl")
    part = "geometry: {mesh: ball.stl, unit: mm}"
    outline = "outline: {file: logo.dxf, contours: [1, 3]}, layer: CUT, project: +z"
    tube = ", smooth: {position_mm: 0.03, direction_deg: 1.5}"

    rough = path_of(folder, outline, part, TOLERANT)
    path = path_of(folder, outline + tube, part, TOLERANT)

    assert path.smoothing is not None
    for roughness, share in ((path.smoothing.of_points, 0.97), (path.smoothing.of_axes, 0.7)):
        assert roughness is not None  # the circle itself bends by 100 /m
        assert roughness.bound <= roughness.smoothed < share * roughness.given
    assert np.array_equal(path.listed.points, rough.points)
    assert 1e-5 < np.linalg.norm(path.points - rough.points, axis=1).max() <= 0.03e-3
    assert np.array_equal(path.points[:-1][path.is_rapid], rough.points[:-1][path.is_rapid])
    assert np.linalg.norm(path.axes - rough.axes, axis=1).max() <= np.deg2rad(1.5)
