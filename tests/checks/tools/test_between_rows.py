"""Errors between the rows: what a tool does while its joints move evenly, bounded and looked at."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import fixed_part, joint, make_cell, placed, schedule, work

from cellplan import load_cell, solve
from cellplan.checks.tools.between_checks import check_between_rows, check_task_between
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.measures.tool_errors import part_poses, task_accuracy
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.between_rows import BetweenRows
from cellplan.model.report.report import Check
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.task import ToleranceEntry
from cellplan.scene.scene import Scene

CELLS = Path(__file__).resolve().parents[3] / "cells"
ARM = 0.8  # [m]
ROWS = 11


def swinger() -> RobotModel:
    """One joint that swings a tool at the end of an arm round the world's z axis."""
    X_BF = pose((ARM, 0.0, 0.0))
    return RobotModel(name="swinger", source="test", joints=(joint("a", -1),), flange_link=0, X_BF=X_BF, bodies=())


@dataclass(frozen=True, kw_only=True, eq=False)
class Known(Schedule):
    """Its one tool is desired at the poses of the rows and on straight lines between them, or late by a corner."""

    jump_times: Array
    corner: float = 0.0

    @property
    def is_continuous(self) -> bool:
        return True

    @property
    def jumps(self) -> Array:
        return self.jump_times

    def poses(self, times: Array) -> tuple[Array, ...]:
        desired = np.tile(np.eye(4), (len(times), 1, 1))
        for axis in range(3):
            desired[:, axis, 3] = np.interp(times, self.times, self.tasks[0].X_PT[:, axis, 3])
        step = self.times[1]
        inside = 1.0 - np.abs(times - self.jumps[0]) / (0.5 * step) if len(self.jumps) else np.zeros(len(times))
        desired[:, 2, 3] += self.corner * np.clip(inside, 0.0, 1.0)
        return (desired,)


def looked(
    turn: float, tolerance: ToleranceEntry, corner: float = 0.0, jumps: tuple[float, ...] = ()
) -> tuple[BetweenRows, tuple[Check, ...]]:
    """The arm swings by ``turn`` in each step of 0.1 s, and is desired on the chords of its circle."""
    task = replace(work("arm"), axes=(0, 1, 2), tolerance=tolerance)
    cell = make_cell(placed("arm", swinger()), part=fixed_part(Sphere(0.01), np.eye(4)), tasks=(task,))
    scene, q = Scene.from_cell(cell), turn * np.arange(ROWS)[:, None]
    rows = scene.chains["arm"].tool_poses(q)
    plain = schedule(ROWS, task)
    scheduled = replace(plain.tasks[0], X_PT=rows)
    jump_times = np.array([0.35] if corner else jumps)
    known = Known(times=plain.times, tasks=(scheduled,), jump_times=jump_times, corner=corner)
    accuracy = task_accuracy(scheduled, scene.chains["arm"], q=q, X_WP=part_poses(cell, scene.chains, {"arm": q}))
    ((between,), _) = check_between_rows(scene, known, {"arm": q}, accuracy=(accuracy,), closures=())
    assert between.between is not None
    return between.between, check_task_between(between, tolerance)


@pytest.mark.parametrize("turn", [0.01, 0.1])
def test_an_arm_that_is_desired_on_chords_strays_by_the_height_of_its_arc(turn: float) -> None:
    sagitta = ARM * (1.0 - np.cos(0.5 * turn))

    between, checks = looked(turn, ToleranceEntry(position_mm=1e3 * 10.0 * sagitta, orientation_deg=np.degrees(1.0)))

    assert between.position.largest == pytest.approx(sagitta, rel=1e-9)
    assert between.position.bound is not None
    assert sagitta <= between.position.bound <= 1.5 * sagitta
    assert between.position.proof == "bound"
    assert all(check.passed for check in checks)


def test_a_step_that_is_too_long_fails_and_names_one_that_keeps_the_tolerance() -> None:
    allowed = 1e-4

    between, checks = looked(0.1, ToleranceEntry(position_mm=1e3 * allowed, orientation_deg=np.degrees(1.0)))

    step = between.position.longest_step
    assert step is not None
    assert ARM * (1.0 - np.cos(0.5 * 0.1 * step / 0.1)) <= allowed  # the turn of a shorter step is smaller by as much
    assert ARM * (1.0 - np.cos(0.5 * 0.1 * 1.3 * step / 0.1)) > allowed
    assert (between.position.bound, between.position.proof) == (None, "ten subdivisions")
    assert [check.passed for check in checks] == [False, True]
    assert checks[0].message == (
        "position error of task 'work_of_arm' between the rows of its table: 1 mm at "
        f"{between.position.at_s:.4f} s, allowed 0.1 mm; a motion.step_s of at most {step:g} meets the tolerance"
    )


def test_what_is_allowed_between_the_rows_may_differ_from_what_is_at_them() -> None:
    _, checks = looked(0.1, ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1.0), between_rows_mm=2.0))
    assert all(check.passed for check in checks)
    _, checks = looked(0.1, ToleranceEntry(position_mm=10.0, orientation_deg=np.degrees(1.0), between_rows_mm=0.2))
    assert not all(check.passed for check in checks)


def test_a_corner_within_a_step_is_found_and_shrinks_with_the_step_itself() -> None:
    between, _ = looked(1e-4, ToleranceEntry(position_mm=1.0, orientation_deg=np.degrees(1.0)), corner=4e-3)

    assert between.position.largest == pytest.approx(4e-3, rel=1e-3)
    assert between.position.at_s == pytest.approx(0.35)
    assert between.position.longest_step == pytest.approx(0.025 * 0.925, abs=2e-3)


def test_a_corner_that_lies_on_a_row_by_chance_shortens_the_step_that_is_named() -> None:
    allowed, turn = 1e-4, 0.1
    tolerance = ToleranceEntry(position_mm=1e3 * allowed, orientation_deg=np.degrees(1.0))
    chance = looked(turn, tolerance, jumps=(0.3,))[0].position.longest_step
    corner = ARM * np.sin(0.5 * turn) ** 2  # a quarter of a step and of the change between two chords

    assert chance is not None
    assert 0.85 * 0.1 * allowed / corner < chance <= 0.1 * allowed / corner


def test_a_tool_that_stops_at_once_gets_a_step_of_which_the_duration_is_a_multiple() -> None:
    end = 0.1 * (ROWS - 1)
    tolerance = ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1.0))

    any_step = looked(0.1, tolerance)[0].position.longest_step
    fitting = looked(0.1, tolerance, jumps=(end,))[0].position.longest_step

    assert any_step is not None
    assert fitting is not None
    assert end / any_step % 1.0 > 0.1  # the row after the end lies beyond it
    assert end / fitting == pytest.approx(round(end / fitting), abs=1e-9)
    assert 0.5 * any_step < fitting < any_step


def test_a_corner_that_lies_on_a_row_by_chance_fails_no_step_that_keeps_what_is_allowed() -> None:
    between, checks = looked(0.1, ToleranceEntry(position_mm=1.5, orientation_deg=np.degrees(1.0)), jumps=(0.3,))

    assert between.position.longest_step is None
    assert all(check.passed for check in checks)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_no_instant_is_worse_than_the_bound(seed: int) -> None:
    cell = load_cell(CELLS / "turntable.yaml")
    rng = np.random.default_rng(seed)
    step = float(rng.choice([0.02, 0.05, 0.1]))
    cell = replace(cell, motion=replace(cell.motion, step=step), checks=cell.checks.changed(clearance_mm=0.0))
    cell = replace(
        cell,
        tasks=tuple(
            replace(task, tolerance=ToleranceEntry(position_mm=1000.0, orientation_deg=np.degrees(3.0)))
            for task in cell.tasks
        ),
    )
    (run,) = solve(cell).runs
    desired, report = run.schedule, run.report
    fine = np.linspace(0.0, report.times[-1], 23 * (len(report.times) - 1) + 1)
    q = {
        name: np.stack([np.interp(fine, report.times, column) for column in rows.T], axis=1)
        for name, rows in report.q.items()
    }
    scene = Scene.from_cell(cell)
    X_WP = part_poses(cell, scene.chains, q)
    for scheduled, accuracy, X_PT in zip(run.schedule.tasks, report.accuracy, desired.poses(fine), strict=True):
        robot = scheduled.task.robot
        truth = task_accuracy(replace(scheduled, X_PT=X_PT), scene.chains[robot], q=q[robot], X_WP=X_WP)
        between = accuracy.between
        assert between is not None
        for error, entry in ((truth.position_error, between.position), (truth.orientation_error, between.orientation)):
            worst = float(np.linalg.norm(error, axis=1).max())
            assert entry.bound is not None
            assert worst <= entry.bound
            assert worst <= 1.02 * entry.largest + 1e-9
