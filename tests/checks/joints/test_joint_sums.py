"""Sums of joint angles: judged in closed form, refused where they name no joint, and kept by modes and programs."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.checks.joints.limits import check_sums
from cellplan.errors import ImpossibleTasksError, InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.runs.solve import solve

ROOT = Path(__file__).resolve().parents[3]
FIXED, OPEN = ROOT / "cells" / "fixed_part.yaml", ROOT / "examples" / "open_tasks" / "open_frame.yaml"


def sums(*joints: str, low: float, high: float) -> list[dict[str, object]]:
    return [{"joints": list(joints), "range_deg": [low, high]}]


@pytest.mark.parametrize(("high", "passed"), [(61.0, True), (60.0, True), (59.9, False)])
def test_the_worst_row_is_that_with_the_least_margin(high: float, passed: bool) -> None:
    """A3 + E3 goes from 0 to 60 degrees; the other joints do not count."""
    values = {"robots.right.joint_sums": sums("A3", "E3", low=-270, high=high)}
    robot = load_cell(FIXED).with_values(values).robot("right")
    q = np.radians(np.outer(np.linspace(0, 1, 4), [20, 300, 300, 300, 40, 300]))

    [check] = check_sums(robot, np.arange(4.0), q)

    assert (check.name, check.subject, check.passed, check.at_s) == ("joint_sum", "right/A3 + E3", passed, 3.0)
    assert check.value == pytest.approx(60.0)
    assert check.limit == pytest.approx(high)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (sums("A3", "E4", low=0, high=9), "joint_sums[0].joints[1]: expected a revolute joint of this robot (A3, B3"),
        (sums("A3", "A3", low=0, high=9), "joint_sums[0].joints[1]: expected each word once"),
        (sums("A3", "E3", low=9, high=0), "joint_sums[0].range_deg: expected [low, high], got [9, 0]"),
    ],
)
def test_wrong_ranges_are_refused_where_they_stand(given: object, message: str) -> None:
    with pytest.raises(InvalidFileError) as refused:
        load_cell(FIXED).with_values({"robots.right.joint_sums": given})

    assert message in str(refused.value)


@pytest.mark.slow
def test_a_program_by_hand_is_held_to_them() -> None:
    values = {"motion": {"mode": "part_at_rest", "step_s": 0.05}, "tasks.ring.duration_s": 4}
    cell = load_cell(FIXED).with_values({**values, "tasks.frame.duration_s": 5})
    free = solve(cell, is_reported=False)
    q = free.runs[0].report.q["right"]
    largest = float(np.degrees((q[:, 3] + q[:, 5]).max()))

    for shift in (-1.0, 1.0):
        ranges = sums("D3", "F3", low=-720, high=largest + shift)
        solution = solve(cell.with_values({"robots.right.joint_sums": ranges}), is_reported=False)
        [check] = [it for it in solution.runs[0].report.checks if it.name == "joint_sum"]
        assert check.passed == (shift > 0)
        assert check.value == pytest.approx(largest)


def with_sums(folder: Path, low: float, high: float) -> AssignmentDraft:
    """The frame with ranges for both arms."""
    key = f"    joint_sums: [{{joints: [D2, F2], range_deg: [{low}, {high}]}}]\n"
    text = OPEN.read_text()
    home = "    home_deg: [0, -40, 60, 0, 60, 0]\n"
    (folder / "cell.yaml").write_text(text.replace(home, home + key))
    return AssignmentDraft.load(folder / "cell.yaml")


@pytest.mark.slow
def test_an_assignment_has_modes_within_them_only_or_names_the_filter(tmp_path: Path) -> None:
    assignment = assign(with_sums(tmp_path, -200, 200), effort=1)

    assert assignment.passed
    for modes in assignment.instance.modes.values():
        for mode in modes:
            assert np.degrees(np.abs(mode.q[:, 3] + mode.q[:, 5])).max() <= 200.0 + 1e-6
    checks = [it for run in assignment.solution.runs for it in run.report.checks if it.name == "joint_sum"]
    assert len(checks) == 2 * len(assignment.solution.runs)
    with pytest.raises(ImpossibleTasksError, match="nothing is left after the filter 'sums of joints'"):
        assign(with_sums(tmp_path, 359, 360), effort=1)
