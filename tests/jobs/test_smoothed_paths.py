"""Smoothed paths from the file to rows: CAM files, and the second published curve of two robots with one part."""

from pathlib import Path

import numpy as np
import pytest
from builders.cam_files import as_gcode, dome, dome_apt, milling_cell

from cellplan import Cell, Solution, load_cell, solve
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import inverse
from cellplan.model.task.task import ProgrammedPath
from cellplan.runs.overrides import with_overrides
from cellplan.scene.scene import Scene

ROOT = Path(__file__).resolve().parents[2]
ROUNDED_MM = 2e-3  # tracking errors, and points between the rows at a stop
ROUNDING_MM = 0.01  # of corners of CAM files
BY_HAND = 1191.0  # [mm/s] greatest feed along curve 2 with normals smoothed by hand, its ramps on straight ends
GREATEST = (
    "tasks.curve.process={feed_mm_s: greatest, ramp_mm: 158}",
    "tasks.curve.duration_s=null",
    "tasks.curve.time_law=null",
    "tasks.curve.standoff_mm=[0, 5000]",
)


def rough_dome() -> str:
    """Four lines on a dome in APT, with noise of up to 0.1 mm but at their ends, and a rapid between them."""
    points = dome(200.0, 20.0, 14)[:4]
    points[:, 1:-1] += np.random.default_rng(5).uniform(-0.1, 0.1, points[:, 1:-1].shape)
    return dome_apt(points, (1800.0, 1200.0), rapid_every=2, lift=20.0)


def solved_dome(folder: Path, key: str, text: str) -> tuple[Cell, Solution]:
    (folder / f"part.{key}").write_text(text)
    words = f"{{{key}: part.{key}, smooth: {{position_mm: 0.25, direction_deg: 0.5, into_mm: 0.1}}}}"
    more = "    tolerance: {position_mm: 0.3, orientation_deg: 1}\n    standoff_mm: [0, 3]\n    tool_depth_mm: 1\n"
    (folder / "cell.yaml").write_text(milling_cell(words, more=more))
    cell = load_cell(folder / "cell.yaml")
    return cell, solve(cell)


def from_sides(points: Array, corners: Array) -> Array:
    """Distances of points from the nearest straight side between corners, in their unit, shape (N,)."""
    begin, side = corners[:-1], np.diff(corners, axis=0)
    off = points[:, None] - begin
    share = np.clip(np.sum(off * side, axis=2) / np.sum(side**2, axis=1), 0.0, 1.0)
    return np.linalg.norm(off - share[:, :, None] * side, axis=2).min(axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["apt", "gcode"])
def test_tools_on_smoothed_paths_of_cam_stay_near_the_lines_of_the_file(tmp_path: Path, key: str) -> None:
    apt = rough_dome()
    cell, solution = solved_dome(tmp_path, key, apt if key == "apt" else as_gcode(apt))
    path = cell.tasks[0].path
    assert isinstance(path, ProgrammedPath)
    (run,) = solution.runs
    X_PT = inverse(cell.part.X_CP) @ Scene.from_cell(cell).chains["arm"].tool_poses(solution.motion.q)
    tips, corners = 1e3 * X_PT[:, :3, 3], 1e3 * path.listed.points
    off, at_corners = from_sides(tips, corners), np.linalg.norm(tips[:, None] - corners, axis=2).min(axis=0)
    is_off = np.zeros(len(tips), dtype=bool)
    for begin, end in run.report.accuracy[0].process_off:
        is_off |= (solution.motion.times >= begin) & (solution.motion.times <= end)

    assert solution.passed
    assert np.count_nonzero(is_off) > 50
    assert off[is_off].max() < ROUNDED_MM
    assert 0.1 < off[~is_off].max() <= 0.25 + ROUNDING_MM
    stays = np.concatenate([[True], path.inner_stops, [True]])
    assert at_corners[stays].max() < ROUNDED_MM
    listed = run.report.accuracy[0].listed
    assert listed is not None
    assert 1e3 * listed.position >= off.max() - ROUNDING_MM  # the nearest place of the file is nearer than its own


@pytest.mark.slow
def test_curve_2_with_its_normals_as_given_is_nearly_as_fast_as_with_normals_smoothed_by_hand() -> None:
    folder = ROOT.parent / "shared" / "data" / "dual_robot"
    if not folder.is_dir():
        pytest.skip("the published curves (../shared/data/dual_robot) are not on this machine")

    def greatest(name: str, *more: str) -> Solution:
        solution = solve(with_overrides(load_cell(folder / name / "cell.yaml"), (*GREATEST, *more)))
        assert solution.passed
        return solution

    by_hand = greatest("curve_2_table_minimum").runs[0].report
    (run,) = greatest("curve_2_raw_normals", "tasks.curve.path.smooth={direction_deg: 2.9}").runs

    feed = 1e3 * run.report.greatest_feeds[0].feed
    assert feed >= 0.95 * max(BY_HAND, 1e3 * by_hand.greatest_feeds[0].feed)
    listed = run.report.accuracy[0].listed
    assert listed is not None
    assert np.deg2rad(1.0) < listed.orientation <= np.deg2rad(3.0)
    assert listed.position <= 0.5e-3
