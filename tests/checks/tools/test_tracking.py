"""Errors of tools and co-holders against what is allowed."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import make_task
from builders.scene_builders import make_cell

from cellplan.checks.tools.tracking import check_accuracy, check_closure
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import ClosureAccuracy, TaskAccuracy
from cellplan.model.settings.task import ToleranceEntry

TOLERANCE = ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1e-3))
TASK = make_task("arm", name="ring", tolerance=TOLERANCE)


def accuracy_of(offset):
    return TaskAccuracy(
        task="ring",
        robot="arm",
        position_error=offset,
        orientation_error=np.zeros_like(offset),
        path_length=1.0,
        start_s=0.0,
        end_s=1.0,
    )


def test_check_names_instant_and_amount():
    offset = np.zeros((3, 3))
    offset[1, 0] = 2e-4
    accuracy = accuracy_of(offset)
    schedule = Schedule(times=np.array([0.0, 0.5, 1.0]), tasks=())
    position, orientation = check_accuracy(schedule, accuracy, TASK)
    assert not position.passed
    assert position.message == "position error of task 'ring': 0.2 mm at 0.500 s, allowed 0.1 mm"
    assert orientation.passed


def test_errors_are_judged_from_the_instant_on_that_the_tool_has_settled():
    offset = np.zeros((5, 3))
    offset[:, 0] = [0.7, 0.1, 5e-5, 2e-5, 1e-5]
    accuracy = accuracy_of(offset)
    schedule = Schedule(times=np.array([0.0, 0.5, 1.0, 1.5, 2.0]), tasks=())
    task = replace(TASK, start=0.5, settle=0.5)

    settled, _ = check_accuracy(schedule, accuracy, task)
    early, _ = check_accuracy(schedule, accuracy, replace(task, settle=0.49))

    assert settled.passed
    assert settled.message == "position error of task 'ring': 0.05 mm at 1.000 s, allowed 0.1 mm, evaluated from 1 s"
    assert early.passed
    assert not check_accuracy(schedule, accuracy, replace(task, start=0.0))[0].passed
    assert check_accuracy(schedule, accuracy, replace(task, settle=99.0))[0].at_s == 2.0  # the last instant at least


def test_an_error_beyond_what_is_allowed_is_named_with_instant_and_cure():
    cell, times, errors = make_cell(), np.array([0.0, 0.1, 0.2]), np.zeros((3, 3))
    errors[:, 1] = [0.0, 1e-6, 5e-6]
    closures = [ClosureAccuracy(robot="second", axes=(0, 1), position_error=errors, orientation_error=np.zeros((3, 3)))]

    position, orientation = check_closure(cell, times, closures)

    assert (position.name, position.subject, position.passed) == ("closure_position_error", "second", False)
    assert position.value == pytest.approx(5e-3)
    assert position.limit == pytest.approx(3e-3)
    assert position.message == (
        "closure position error of 'second' on the part: 0.005 mm at 0.200 s, allowed 0.003 mm; a shorter "
        "motion.step_s, a slower motion or a path farther from singularities reduces it"
    )
    assert (orientation.name, orientation.passed, orientation.limit) == (
        "closure_orientation_error",
        True,
        pytest.approx(1e-3),
    )
    wider = replace(cell, checks=cell.checks.changed(closure_mm=0.006))
    assert all(check.passed for check in check_closure(wider, times, closures))
