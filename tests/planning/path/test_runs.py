"""Runs beyond the ends of a path: tangential, at their height, and as long as the speed says."""

from pathlib import Path

import numpy as np
import pytest
from builders.three_feeds import approached

from cellplan import Cell, load_cell
from cellplan.geometry.arrays import Array
from cellplan.model.task.clocked_path import ClockedPath, demanded_spans, process_spans, work_span
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_path

FEED, RADIUS = 0.06, 0.03  # [m/s], [m] of the ring
UP = np.array([0.0, 0.0, 1.0])


def ring(folder: Path, process: str) -> tuple[Cell, Toolpath]:
    """The ring of the top arm, a circle in the xy plane that starts at +x, with the tool straight down."""
    file = folder / "cell.yaml"
    text = approached().replace("tool_axis: +y", "tool_axis: -z").replace("axes: [x, y, rz]", "axes: [x, y, z]")
    text = text.replace("process: {feed_mm_s: 60}", f"process: {{feed_mm_s: 60, {process}}}")
    file.write_text(text, encoding="utf-8")
    cell = load_cell(file)
    return cell, build_toolpath(cell.task("ring"), cell.part)


def clocked(folder: Path, process: str) -> ClockedPath:
    cell, toolpath = ring(folder, process)
    return clock_path(cell, cell.task("ring"), toolpath)


def ends(toolpath: Toolpath) -> tuple[Array, Array]:
    """Tips and unit tangents at both ends of the work."""
    X_PT, twists = toolpath.targets(
        np.zeros(2, dtype=int), np.array([toolpath.runs[0], toolpath.length - toolpath.runs[1]])
    )
    return X_PT[:, :3, 3], twists[:, :3]


@pytest.mark.parametrize(
    "process",
    ["run_in_mm: 20, run_out_mm: 15", "run_in_mm: 20, lift_mm: 8", "run_out_mm: 7, run_arc_mm: 12, lift_mm: 3"],
)
def test_twists_per_length_are_derivatives_all_along_and_never_jump(tmp_path: Path, process: str) -> None:
    _, toolpath = ring(tmp_path, process)
    s, h = np.linspace(1e-4, toolpath.length - 1e-4, 2001), 1e-7

    tips = [toolpath.poses(s + shift)[:, :3, 3] for shift in (-h, h)]

    tangents = toolpath.targets(np.zeros(len(s), dtype=int), s)[1][:, :3]
    assert np.abs((tips[1] - tips[0]) / (2.0 * h) - tangents).max() < 2e-5  # the arcs bend at once
    turns = np.linalg.norm(np.diff(tangents, axis=0), axis=1) / np.diff(s)
    assert turns.max() < 1.05 * max(1.0 / 0.012, 6.0 * 8e-3 / 0.02**2)  # 1/m of the arcs, and of the lift


def test_a_quarter_circle_leads_to_the_path_and_away_on_one_side(tmp_path: Path) -> None:
    radius, straight = 0.012, 0.02
    _, toolpath = ring(tmp_path, "run_in_mm: 20, run_arc_mm: 12")

    first, last = toolpath.poses(np.array([0.0, toolpath.length]))[:, :3, 3]

    points, tangents = ends(toolpath)
    left = np.cross(UP, tangents[0])
    assert toolpath.runs == pytest.approx((straight + 0.5 * np.pi * radius, 0.5 * np.pi * radius), rel=1e-9)
    assert np.allclose(first, points[0] - radius * tangents[0] + (radius + straight) * left, atol=1e-9)
    assert np.allclose(last, points[1] + radius * tangents[1] + radius * left, atol=1e-9)


def test_the_other_side_is_the_mirror_image(tmp_path: Path) -> None:
    starts = []
    for side in ("left", "right"):
        _, toolpath = ring(tmp_path, f"run_in_mm: 5, run_arc_mm: 12, run_arc_side: {side}")
        points, tangents = ends(toolpath)
        off = toolpath.poses(np.zeros(1))[0, :3, 3] - points[0]
        starts.append((off @ tangents[0], off @ np.cross(UP, tangents[0])))

    assert starts[0] == pytest.approx((starts[1][0], -starts[1][1]), abs=1e-9)


def test_a_lifted_run_begins_at_its_height_and_touches_down_along_the_path(tmp_path: Path) -> None:
    _, toolpath = ring(tmp_path, "run_in_mm: 20, run_out_mm: 15, lift_mm: 8")
    begin, end = toolpath.runs[0], toolpath.length - toolpath.runs[1]
    s = np.array([0.0, begin, end, toolpath.length])

    X_PT, twists = toolpath.targets(np.zeros(4, dtype=int), s)

    assert np.allclose(X_PT[:, 2, 3] - X_PT[1, 2, 3], [8e-3, 0.0, 0.0, 8e-3], atol=1e-9)
    assert np.allclose(twists[:, 2], 0.0, atol=1e-6)
    assert toolpath.runs[0] > 0.02  # down a slope


@pytest.mark.parametrize("process", ["run_in_mm: 20, run_out_mm: 15", "run_in_mm: 20, run_out_mm: 15, lift_mm: 6"])
def test_each_ramp_is_as_long_as_its_run(tmp_path: Path, process: str) -> None:
    """On a run of length L the tool speeds up in 2 L / v, its acceleration at most 3/4 v^2 / L."""
    path = clocked(tmp_path, process)
    begin, end = work_span(path)

    for run, span in zip(path.toolpath.runs, ((path.start, begin), (end, path.end)), strict=True):
        times = np.linspace(*span, 2001)
        speeds = np.linalg.norm(path.targets(times)[1][:, :3], axis=1)
        assert span[1] - span[0] == pytest.approx(2.0 * run / FEED)
        assert np.abs(np.gradient(speeds, times)).max() == pytest.approx(0.75 * FEED**2 / run, rel=1e-3)
    inside = np.linspace(begin, end, 500)
    assert np.allclose(np.linalg.norm(path.targets(inside)[1][:, :3], axis=1), FEED, rtol=1e-9)
    assert end - begin == pytest.approx(2.0 * np.pi * RADIUS / FEED)


def test_without_a_run_out_the_tool_slows_down_on_the_work(tmp_path: Path) -> None:
    path = clocked(tmp_path, "run_in_mm: 20, ramp_s: 0.2, off_delay_s: 0.3")

    ((begin, end, feed),) = demanded_spans(path)

    assert (feed, end) == (FEED, pytest.approx(path.end - 0.2))
    assert begin == pytest.approx(path.start + 2.0 * 0.02 / FEED)
    assert process_spans(path) == ((pytest.approx(begin), pytest.approx(path.end + 0.3)),)
    assert path.end - begin == pytest.approx(2.0 * np.pi * RADIUS / FEED + 0.1)


def test_a_valve_is_switched_ahead_of_both_ends_of_the_work(tmp_path: Path) -> None:
    path = clocked(tmp_path, "run_in_mm: 20, run_out_mm: 15, lead_s: 0.04")
    begin, end = work_span(path)

    assert process_spans(path) == ((pytest.approx(begin - 0.04), pytest.approx(end - 0.04)),)
    assert demanded_spans(path)[0][:2] == pytest.approx((begin, end))
