"""Smoothed paths of files: what stays, that curves stay in their tubes between points too, and every refusal."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.roller_paths import task_on
from builders.scans import entry, off_file, scan

from cellplan.files.cell.build.smoothed_path import smoothed
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.mirror import mirrored_task, signs_of
from cellplan.model.task.task import PlaneName, ProgrammedPath, SampledPath

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
TUBE = {"position_mm": 0.2, "direction_deg": 2.0}
PROJECTED = "path: {circle: {radius_mm: 100, plane: xy}, project: +z}\n    tool_axis: normal\n"
TOLERANCE = "tolerance: {position_mm: 0.3, orientation_deg: 3}\n"


@pytest.mark.parametrize("is_closed", [False, True])
def test_the_curve_stays_in_its_tube_between_the_points_too(is_closed: bool) -> None:
    path = scan(is_closed=is_closed)

    distances, angles, depths, _ = off_file(smoothed(path, entry(**TUBE, into_mm=0.05), None))

    assert 1.8e-4 < distances.max() <= 2.01e-4
    assert np.deg2rad(0.3) < angles.max() <= np.deg2rad(2.01)
    assert depths.max() <= 0.051e-3


def test_without_a_depth_no_point_is_farther_in_the_part() -> None:
    path = scan()
    moved = smoothed(path, entry(position_mm=0.2), None)

    depths = np.sum((moved.points - path.points) * np.asarray(path.axes), axis=1)
    assert depths.max() <= 1e-12
    assert depths.min() < -1e-4


def test_ends_stay_and_what_has_no_tube_stays_everywhere() -> None:
    path = scan()
    moved, turned = smoothed(path, entry(position_mm=0.2), None), smoothed(path, entry(direction_deg=2.0), None)

    assert np.array_equal(moved.points[[0, -1]], path.points[[0, -1]])
    assert np.array_equal(np.asarray(moved.axes), np.asarray(path.axes))
    assert np.array_equal(turned.points, path.points)
    assert np.array_equal(np.asarray(turned.axes)[[0, -1]], np.asarray(path.axes)[[0, -1]])
    assert turned.listed is path


def test_rotations_turn_as_little_as_their_axes_do() -> None:
    path = scan()
    z = np.asarray(path.axes)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    rotations = np.stack([x, np.cross(z, x), z], axis=2)
    by_axes = smoothed(path, entry(direction_deg=2.0), None)

    moved = smoothed(scan(axes=None, rotations=rotations), entry(direction_deg=2.0), None)

    assert moved.rotations is not None
    assert moved.rotations[:, :, 2] == pytest.approx(np.asarray(by_axes.axes), abs=1e-12)
    cosines = 0.5 * (np.trace(moved.rotations @ np.swapaxes(rotations, 1, 2), axis1=1, axis2=2) - 1.0)
    assert cosines == pytest.approx(np.sum(z * np.asarray(by_axes.axes), axis=1), abs=1e-9)


def test_corners_with_a_stop_and_rapids_of_cam_stay() -> None:
    path = scan(41)
    points = path.points.copy()
    points[21:, :2] = points[20, :2] + (points[21:, :2] - points[20, :2]) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    programmed = ProgrammedPath(
        source="p.apt",
        points=points,
        axes=path.axes,
        rotations=None,
        is_smooth=False,
        is_closed=False,
        speeds=np.full(40, 0.02),
        is_rapid=np.arange(40) == 30,
        rounding=1e-5,
        stop_angle=np.deg2rad(30.0),
    )

    moved = smoothed(programmed, entry(**TUBE), None)

    stays = [0, 20, 30, 31, 40]
    assert np.array_equal(moved.points[stays], points[stays])
    assert np.array_equal(np.asarray(moved.axes)[stays], np.asarray(path.axes)[stays])
    assert np.linalg.norm(np.delete(moved.points - points, stays, axis=0), axis=1).min() > 1e-7
    distances, _, _, toolpath = off_file(moved)
    assert len(toolpath.stops) == 5
    assert distances.max() <= 2.01e-4


def test_the_mirror_image_of_a_smoothed_path_is_the_smoothed_mirror_image() -> None:
    path = scan()

    image = mirrored_task(task_on(smoothed(path, entry(**TUBE), None)), PlaneName.XZ).path

    assert isinstance(image, SampledPath)
    S = signs_of(PlaneName.XZ)
    again = smoothed(image.listed, entry(**TUBE), None)
    assert image.listed.points == pytest.approx(path.points * S, abs=0.0)
    assert image.points == pytest.approx(again.points, abs=1e-7)


@pytest.fixture
def scanned(tmp_path: Path) -> Path:
    """The scan as a table, beside a cell of its folder."""
    path = scan()
    rows = np.hstack([1e3 * path.points + [0.0, 0.0, 200.0], np.asarray(path.axes)])
    np.savetxt(tmp_path / "p.csv", rows, fmt="%.6f", delimiter=",", header="x_mm,y_mm,z_mm,i,j,k", comments="")
    np.savetxt(tmp_path / "bare.csv", rows[:, :3], fmt="%.6f", delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    angles = np.linspace(0.0, 0.5 * np.pi, 30)
    arc = np.hstack(
        [80.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1), np.tile([250.0, 0.0, 0.0, -1.0], (30, 1))]
    )
    np.savetxt(tmp_path / "arc.csv", arc, fmt="%.6f", delimiter=",", header="x_mm,y_mm,z_mm,i,j,k", comments="")
    timed = np.hstack([0.1 * np.arange(40.0)[:, None], rows])
    np.savetxt(tmp_path / "t.csv", timed, fmt="%.6f", delimiter=",", header="t_s,x_mm,y_mm,z_mm,i,j,k", comments="")
    return tmp_path


def with_path(words: str, tolerance: str = TOLERANCE) -> tuple[str, str]:
    return PROJECTED, f"path: {{{words}}}\n    {tolerance}"


@pytest.mark.usefixtures("scanned")
@pytest.mark.parametrize("more", ["", ", from_mm: 5, to_mm: 60, reverse: true, weave: {side_mm: 1, wavelength_mm: 4}"])
def test_a_cell_has_what_smoothing_leaves_as_its_tolerance_and_is_written_as_it_was_read(load: Load, more: str) -> None:
    cell = load(with_path(f"csv: p.csv, smooth: {{position_mm: 0.2, direction_deg: 2, into_mm: 0.1}}{more}"))
    Path("again").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell("again")
    tolerance = cell.tasks[0].tolerance

    assert tolerance.between == pytest.approx((1e-4, np.deg2rad(1.0)), rel=1e-12)
    assert (tolerance.position_mm, tolerance.orientation_deg) == pytest.approx((0.1, 1.0), rel=1e-12)
    assert render_cell(again) == render_cell(cell)
    path, same = cell.tasks[0].path, again.tasks[0].path
    assert isinstance(path, SampledPath)
    assert isinstance(same, SampledPath)
    assert np.array_equal(path.points, same.points)


@pytest.mark.usefixtures("scanned")
@pytest.mark.parametrize(
    ("words", "remark"),
    [
        ("csv: p.csv, smooth: {position_mm: 0.2, direction_deg: 2}", None),
        (
            "csv: p.csv, smooth: {position_mm: 0.001}",
            r"0.001 mm gains nothing: 9\d.\d % .*; one of 0.064 mm leaves [2-7]\d %",
        ),
        (
            "csv: p.csv, smooth: {direction_deg: 0.01}",
            r"0.01 deg gains nothing: .*; one of [\d.]+ deg leaves [2-7]\d %",
        ),
        (
            "csv: arc.csv, smooth: {position_mm: 0.001}",
            r"0.001 mm .* of arc.csv is left; .* leaves 9\d %; leave it out",
        ),
    ],
)
def test_a_tube_that_gains_nothing_is_located_with_one_that_does(load: Load, words: str, remark: str | None) -> None:
    remarks = load(with_path(words)).remarks

    assert len(remarks) == (remark is not None)
    assert all(re.fullmatch(rf"a tube of {remark}", text) for _, text in remarks)
    assert all(f"{key.rpartition('.')[2]}:" in words for key, _ in remarks)


SMOOTH = "c:19: tasks.ring.path.smooth"


@pytest.mark.usefixtures("scanned")
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            "circle: {radius_mm: 100, plane: xy}, smooth: {position_mm: 0.1}",
            f"{SMOOTH}: unexpected key, only a path of many points (csv, apt, gcode, outline, face) is smoothed",
        ),
        (
            "polyline: {points_mm: [[0, 0], [1, 2]], plane: xy}, smooth: {position_mm: 0.1}",
            f"{SMOOTH}: unexpected key, only a path of many points (csv, apt, gcode, outline, face) is smoothed; list "
            "them in a table",
        ),
        (
            "csv: p.csv, project: +z, smooth: {position_mm: 0.1}",
            f"{SMOOTH}: unexpected key, a projected path takes points and normals from the part; list them in a "
            "table (csv)",
        ),
        (
            "csv: p.csv, work_deg: 5, smooth: {position_mm: 0.1}",
            "c:19: tasks.ring.path.work_deg: unexpected key beside smooth, which smooths tool axes that are stated, "
            "not those held to walls",
        ),
        (
            "csv: p.csv, smooth: {}",
            f"{SMOOTH}.position_mm: missing, expected position_mm, direction_deg or both",
        ),
        (
            "csv: p.csv, smooth: {position_mm: 0.0001}",
            f"{SMOOTH}.position_mm: expected a number of millimetres of at least 0.001, got 0.0001",
        ),
        (
            "csv: p.csv, smooth: {position_mm: 0.3}",
            f"{SMOOTH}.position_mm: expected less than tolerance.position_mm = 0.3, shared with the tracking error, "
            "got 0.3; make it smaller, or the tolerance larger",
        ),
        (
            "csv: p.csv, smooth: {direction_deg: 4}",
            f"{SMOOTH}.direction_deg: expected less than tolerance.orientation_deg = 3, shared with the tracking "
            "error, got 4; make it smaller, or the tolerance larger",
        ),
        (
            "csv: p.csv, smooth: {position_mm: 0.1, into_mm: 0.2}",
            f"{SMOOTH}.into_mm: expected at most position_mm = 0.1, got 0.2",
        ),
        (
            "csv: {file: p.csv, smooth: false}, smooth: {position_mm: 0.1}",
            f"{SMOOTH}: unexpected key beside csv.smooth: false, where the tool stops at every corner and corners stay",
        ),
        (
            "csv: t.csv, smooth: {position_mm: 0.1}",
            f"{SMOOTH}: unexpected key, a path with a column t_s is used as it stands in the file",
        ),
    ],
)
def test_what_contradicts_smoothing_is_refused(refuse: Refuse, words: str, message: str) -> None:
    assert refuse(with_path(words)) == [message]


@pytest.mark.usefixtures("scanned")
def test_directions_need_axes_in_the_file(refuse: Refuse) -> None:
    words = "csv: bare.csv, smooth: {direction_deg: 1}"

    assert refuse(with_path(words, f"{TOLERANCE}    tool_axis: -z\n")) == [
        f"{SMOOTH}.direction_deg: expected tool axes in bare.csv to smooth: add columns i,j,k, or leave direction_deg "
        "out"
    ]
