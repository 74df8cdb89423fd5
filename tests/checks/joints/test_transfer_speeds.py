"""Speeds in transfer moves: what planned rows keep, and what tables that are made by hand break, by name."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.uncertified import uncertified

from cellplan.checks.verify import verify_motion
from cellplan.files.cell.load import load_cell
from cellplan.model.motion.motion import JointTable
from cellplan.model.report.report import Check
from cellplan.runs.solution import Run, Solution

CELL = Path(__file__).resolve().parents[3] / "cells" / "in_turn.yaml"
LIMITS = {"program.transfer": {"speed_percent": 20, "tcp_mm_s": 400}, "motion.step_s": 0.05}
NAMES = ("transfer_joint_speed", "transfer_speed")


@pytest.fixture(scope="module")
def slow() -> Solution:
    return uncertified(load_cell(CELL).with_values(LIMITS))


def limited(checks: tuple[Check, ...]) -> list[Check]:
    return [check for check in checks if check.name in NAMES]


def by_hand(run: Run, rate: float) -> Mapping[tuple[str, str], Check]:
    """The checks of a transfer move of which the rows follow each other faster."""
    tables, times = [], run.schedule.times / rate
    for robot in run.cell.robots:
        q = run.report.q[robot.name]
        tables.append(JointTable(robot=robot.name, joints=robot.model.joint_names, times=times, q=q))
    schedule = replace(run.schedule, times=times)
    report = verify_motion(run.scene, schedule, tables, moving=run.moving, idle=run.phase.idle)
    return {(check.name, check.subject): check for check in limited(report.checks)}


@pytest.mark.slow
def test_transfer_moves_keep_both_limits_and_come_near_one_of_them(slow: Solution) -> None:
    for run in slow.runs:
        checks = limited(run.report.checks)
        assert len(checks) == (0 if run.phase.tasks else 8)
        assert all(check.passed for check in checks)
    speeds = [check for run in slow.runs for check in limited(run.report.checks)]
    assert {(check.name, check.limit) for check in speeds} == {(NAMES[0], 20.0), (NAMES[1], 400.0)}
    assert max(check.value / check.limit for check in speeds) > 0.9


def test_tables_made_by_hand_break_them_by_name_value_and_limit(slow: Solution) -> None:
    run = next(run for run in slow.runs if not run.phase.tasks)

    assert all(check.passed for check in by_hand(run, 1.0).values())
    faster = by_hand(run, 1.2)

    failed = faster["transfer_speed", "reis"]
    assert not failed.passed
    assert failed.limit == pytest.approx(400.0)
    true = 1.2 * next(
        check.value for check in limited(run.report.checks) if check.subject == "reis" and check.unit == "mm/s"
    )
    assert failed.value == pytest.approx(true, rel=1e-9)
    assert failed.message.startswith("tool tip, flange or held part of reis may go at ")
    fastest = by_hand(run, 20.0)["transfer_joint_speed", "reis"]
    assert not fastest.passed
    assert fastest.unit == "%"
    use = max(
        (use for use in run.report.joints if use.robot == "reis"),
        key=lambda use: use.peak_velocity / use.velocity_limit,
    )
    assert fastest.value == pytest.approx(20.0 * 100.0 * use.peak_velocity / use.velocity_limit)


def test_the_carried_part_counts_not_the_tip_alone(slow: Solution) -> None:
    """The middle of the part is 150 mm before the flange of its holder, which only turns about the axes of its arm."""
    run = next(run for run in slow.runs if not run.phase.tasks)
    chain, q = run.scene.chains["reis"], run.report.q["reis"]
    tip, far = chain.tool_poses(q)[:, :3, 3], (chain.tool_poses(q) @ np.array([0.0, 0.0, 0.3, 1.0]))[:, :3]
    value = next(check.value for check in limited(run.report.checks) if (check.subject, check.unit) == ("reis", "mm/s"))

    speeds = [np.linalg.norm(np.diff(points, axis=0), axis=1).max() / 0.05 * 1e3 for points in (tip, far)]
    assert speeds[0] < 0.9 * value
    assert speeds[1] <= value
