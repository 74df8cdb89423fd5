"""Tool axes that lean within their cones: in modes, with load sharing, in programs, and at starts."""

from pathlib import Path

import numpy as np
import pytest
from builders.cam_files import milling_cell

from cellplan import Solution, load_cell, solve
from cellplan.errors import StartNotFoundError
from cellplan.model.cell.cell import Cell

CELLS = Path(__file__).parents[2] / "cells"
TILT_DEG = 5.0
FREE = ["spin", {"tilt_deg": TILT_DEG}]


def leaning(name: str, tasks: list[str], **values: object) -> Solution:
    """A shipped cell in which the axes of some tools may lean."""
    settings = {"solver.method": "quadratic_program", **{f"tasks.{task}.free": FREE for task in tasks}}
    return solve(load_cell(CELLS / f"{name}.yaml").with_values({**settings, **values}))


def leans(solution: Solution) -> dict[str, float]:
    """Largest angle in [deg] of each tool axis that may lean from the desired one, by a kinematics of the checks."""
    angles = {}
    for run in solution.runs:
        for scheduled, accuracy in zip(run.schedule.tasks, run.report.accuracy, strict=True):
            if scheduled.task.tilt and accuracy.lean is not None:
                angles[scheduled.task.name] = float(np.rad2deg(accuracy.lean))
                assert np.abs(accuracy.orientation_error).max() <= 1e-9
    return angles


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tasks", "mode"),
    [
        ("turntable", ["ring"], "simultaneous"),
        ("load_sharing", ["rectangle"], "simultaneous"),
        ("four_robots", ["circle", "rhombus"], "pairwise"),
    ],
)
def test_axes_lean_up_to_their_cones_in_every_mode(name: str, tasks: list[str], mode: str) -> None:
    solution = leaning(name, tasks, **{"motion.mode": mode})
    angles = leans(solution)

    assert solution.passed
    assert sorted(angles) == sorted(tasks)
    assert min(angles.values()) > 0.5
    assert max(angles.values()) <= TILT_DEG


@pytest.mark.slow
def test_axes_lean_in_programs_from_home_to_home() -> None:
    tasks = ["left_seam", "left_ring", "right_seam", "right_ring"]
    solution = leaning("three_tasks_each", tasks, **{"motion.mode": "semi_coordinated"})
    angles = leans(solution)

    assert solution.passed
    assert sorted(angles) == sorted(tasks)
    assert max(angles.values()) <= TILT_DEG


def milling(folder: Path, free: str, method: str) -> Cell:
    """An arm whose wrist may not bend as far as the desired axis at the start of the path takes it."""
    (folder / "part.apt").write_text("UNITS/MM\nFEDRAT/2400\nGOTO/-15,0,201\nGOTO/15,0,201\n")
    more = "    standoff_mm: [0, 3]\n    tool_axis: -z\n"
    text = milling_cell("{apt: part.apt}", more=more).replace("free: [spin]", f"free: {free}")
    (folder / "cell.yaml").write_text(f"{text}solver: {{method: {method}}}\n")
    cell = load_cell(folder / "cell.yaml")
    bent = np.rad2deg(solve(cell).runs[0].motion.q[0, 4])
    return cell.with_values({"robots.arm.limits": {"A5": {"upper_deg": float(bent) - 1.5, "lower_deg": -60}}})


@pytest.mark.slow
def test_tool_begins_leaning_where_no_start_has_the_desired_axis(tmp_path: Path) -> None:
    cell = milling(tmp_path, "[spin, {tilt_deg: 6}]", "quadratic_program")
    solution = solve(cell)
    start = np.rad2deg(solution.runs[0].motion.q[0]).tolist()

    assert solution.passed
    assert 1.0 < leans(solution)["mill"] <= 6.0
    again = solve(cell.with_values({"robots.arm.start_deg": start}))
    assert again.passed
    assert np.abs(again.runs[0].motion.q - solution.runs[0].motion.q).max() <= 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("free", "method"),
    [("[spin]", "quadratic_program"), ("[spin, {tilt_deg: 6}]", "weighted_pseudo_inverse")],
)
def test_tool_that_keeps_its_axis_has_no_such_start(tmp_path: Path, free: str, method: str) -> None:
    with pytest.raises(StartNotFoundError, match="no configuration within the joint limits"):
        solve(milling(tmp_path, free, method))
