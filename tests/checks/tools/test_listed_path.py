"""Tools on smoothed paths against their files: rows of a solved cell, and verdicts on both sides of each limit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.roller_paths import EZ, sampled, task_on

from cellplan import Solution, load_cell
from cellplan.checks.tools.listed_path import check_listed
from cellplan.model.progress import silent
from cellplan.model.report.report import TaskAccuracy
from cellplan.model.report.smoothing import ListedErrors
from cellplan.model.settings.solver import METHODS
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.settings.units import Deg, Mm
from cellplan.model.task.smoothing import Smoothing
from cellplan.model.task.task import SampledPath
from cellplan.runs.solve import solve_motion

CELL = """\
cellplan: 1
name: scanned
robots:
  arm:
    model: planar_3r
    tool: {xyz_mm: [0, 0, 60]}
part:
  geometry: {box: {size_mm: [400, 400, 10]}}
  at: {xyz_mm: [700, 300, -86]}
tasks:
  bead:
    robot: arm
    path: {csv: scan.csv, smooth: {position_mm: 0.2}}
    tolerance: {position_mm: 0.3}
    tool_axis: -z
    axes: [x, y, rz]
    duration_s: 2
motion: {step_s: 0.01}
"""
LISTED = ("listed_position_error", "listed_orientation_error", "listed_depth")


def solved(folder: Path, *changes: tuple[str, str]) -> Solution:
    """A path along a line with noise across it, done in 2 s, in a cell with other words."""
    noise = np.random.default_rng(8).uniform(-0.15, 0.15, 30) * (np.arange(30) % 29 > 0)
    rows = np.stack([np.full(30, -100.0) + noise, np.linspace(-130.0, -30.0, 30), np.full(30, 6.0)], axis=1)
    np.savetxt(folder / "scan.csv", rows, fmt="%.6f", delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    text = CELL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    return solve_motion(load_cell(folder / "cell.yaml"), task=None, progress=silent)[1]


def test_rows_are_held_against_the_points_of_the_file(tmp_path: Path) -> None:
    solution = solved(tmp_path)
    (run,) = solution.runs
    accuracy: TaskAccuracy = run.report.accuracy[0]
    path = solution.cell.tasks[0].path
    assert isinstance(path, SampledPath)
    assert accuracy.listed is not None

    noise = np.abs(path.listed.points[:, 0] + 0.1).max()
    tracking = np.linalg.norm(accuracy.position_error, axis=1).max()
    straight = np.abs(path.points[:, 0] + 0.1).max()
    assert straight < 0.05 * noise
    # rows are nearly at all points; a curve through noise swings beyond it by less than a half
    assert 0.8 * noise < accuracy.listed.position < 1.5 * noise + tracking + straight
    assert abs(accuracy.listed.into) < 1e-6
    assert {check.name for check in run.report.checks if check.name in LISTED} == set(LISTED)
    assert run.report.passed


@pytest.mark.parametrize(
    ("position", "orientation", "into", "failed"),
    [
        (0.29e-3, 0.0, 0.19e-3, ()),
        (0.31e-3, 0.0, 0.0, ("listed_position_error",)),
        (0.0, np.deg2rad(3.1), 0.0, ("listed_orientation_error",)),
        (0.0, np.deg2rad(2.9), 0.21e-3, ("listed_depth",)),
    ],
)
def test_smoothing_and_tracking_share_the_tolerance(
    position: float, orientation: float, into: float, failed: tuple[str, ...]
) -> None:
    path = sampled([0.0 * EZ, EZ], is_smooth=True)
    smoothing = Smoothing(
        listed=path, position=0.2e-3, direction=np.deg2rad(2.0), into=0.1e-3, of_points=None, of_axes=None
    )
    left = ToleranceEntry(position_mm=Mm(0.1), orientation_deg=Deg(1.0))
    task = replace(task_on(replace(path, smoothing=smoothing)), tolerance=left)
    errors = ListedErrors(
        position=position, position_at_s=1.0, orientation=orientation, orientation_at_s=1.0, into=into, into_at_s=1.0
    )

    checks = list(check_listed(task, errors))

    assert tuple(check.name for check in checks if not check.passed) == failed
    assert all(("a narrower path.smooth" in check.message) != check.passed for check in checks)
    assert list(check_listed(task_on(path), None)) == []


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_every_method_spends_no_more_than_the_tolerance(tmp_path: Path, method: str) -> None:
    solution = solved(tmp_path, ("motion: {", f"solver: {{method: {method}}}\nmotion: {{"))

    (run,) = solution.runs
    accuracy: TaskAccuracy = run.report.accuracy[0]
    assert accuracy.listed is not None
    limits = {check.name: check.limit for check in run.report.checks}
    assert limits["position_error"] == pytest.approx(0.1, abs=1e-12)  # what 0.2 mm of smoothing leave of 0.3 mm
    assert limits["listed_position_error"] == pytest.approx(0.3, abs=1e-12)
    verdicts = {check.name: check.passed for check in run.report.checks}
    assert verdicts["listed_position_error"] == (accuracy.listed.position <= 0.3e-3)
    assert verdicts["listed_position_error"] or not verdicts["position_error"]


def test_depth_is_that_of_the_components_that_the_task_has(tmp_path: Path) -> None:
    (run,) = solved(tmp_path, ("-86", "-84")).runs  # 2 mm nearer to a tool that is free along its axis

    listed = run.report.accuracy[0].listed
    assert listed is not None
    assert abs(listed.into) < 1e-6
    assert run.report.passed
