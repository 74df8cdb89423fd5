"""Runs may be less exact than the work: errors on them are judged by a tolerance of their own."""

from pathlib import Path

import numpy as np
import pytest
from builders.three_feeds import THREE_FEEDS

from cellplan import load_cell
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.progress import silent
from cellplan.model.report.report import Check
from cellplan.runs.solve import solve_motion

FEED, STEP, RADIUS = 50.0, 0.05, 3.0  # [mm/s], [s], [mm]
RUN = 15.0 - 0.5 * np.pi * RADIUS  # [mm] whose ramp ends with a row
CUT = RADIUS - np.sqrt(RADIUS**2 - (0.5 * FEED * STEP) ** 2)  # [mm] of an arc, by the chord of a step at the feed


def judged(folder: Path, more: str) -> tuple[TaskSchedule, dict[str, Check]]:
    """A straight seam with small arcs at both ends, which the steps between rows cut."""
    process = f"process: {{feed_mm_s: {FEED}, run_in_mm: {RUN}, run_out_mm: {RUN}, run_arc_mm: {RADIUS}{more}}}"
    text = THREE_FEEDS.replace("process: {feed_mm_s: 50, on_delay_s: 0.2}", process)
    text = text.replace("step_s: 0.01, timing: fastest", f"step_s: {STEP}, controller_cycle_ms: 50")
    text = text.replace("start_deg: [-82.022627711826, 116.279474033978, -34.256846322152]", "start_deg: auto")
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    (run,) = solve_motion(load_cell(file), task="seam", progress=silent)[1].runs
    return run.schedule.tasks[0], {check.name: check for check in run.report.checks if check.subject == "seam"}


def test_an_arc_that_is_cut_fails_by_the_tolerance_of_the_work(tmp_path: Path) -> None:
    scheduled, checks = judged(tmp_path, "")

    between = checks["position_error_between_rows"]
    assert (between.passed, between.limit) == (False, pytest.approx(0.1))
    assert 0.5 * CUT < between.value < 1.02 * CUT
    assert not scheduled.work[0] < between.at_s < scheduled.work[1]


def test_its_own_tolerance_holds_on_the_runs_alone(tmp_path: Path) -> None:
    scheduled, checks = judged(tmp_path, ", run_tolerance_mm: 0.5")

    between = checks["position_error_between_rows"]
    assert (between.passed, between.limit) == (True, pytest.approx(0.5))
    assert 0.5 * CUT < between.value < 1.02 * CUT
    inside = np.linspace(*scheduled.work, 100)
    outside = np.array([scheduled.begin - 0.1, scheduled.begin + 0.1, scheduled.end - 0.1, scheduled.end + 0.1])
    assert np.all(scheduled.easing(inside) == 1.0)
    assert scheduled.easing(outside) == pytest.approx([1.0, 0.2, 0.2, 1.0])
