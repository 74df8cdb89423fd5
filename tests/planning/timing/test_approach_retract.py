"""Approach and retreat: straight along the tool's axis, from rest to rest, and nothing else of the task changes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.task.task import StraightMove
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.runs.solve import solve

CELLS = Path(__file__).parents[3] / "cells"
APPROACH = StraightMove(distance=0.05, duration=0.5)
RETRACT = StraightMove(distance=0.08, duration=0.4)
START = {  # [rad] off the part, as the search finds it for this cell
    "table": [-0.6675707068347263, 3.1389407939263374],
    "kuka": [
        0.0008912463134276833,
        -0.03942130701620488,
        0.7065199836729175,
        0.0070306192092390194,
        -0.32641467497543586,
        -0.004118376507751711,
    ],
}


@pytest.fixture(scope="module")
def cell() -> Cell:
    """An arm and a turntable; the path takes the second and the third of four seconds."""
    given = load_cell(CELLS / "turntable.yaml")
    (task, *_) = given.tasks
    task = replace(task, start=1.0, duration=2.0, feed=None, approach=APPROACH, retract=RETRACT)
    return replace(
        given,
        robots=tuple(replace(robot, start=np.array(START[robot.name])) for robot in given.robots),
        tasks=(task,),
        motion=replace(given.motion, duration=4.0, step=0.005),
        solver=given.solver.changed(gain_per_s=100.0),
    )


def scheduled(cell: Cell) -> tuple[np.ndarray, TaskSchedule]:
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    return schedule.times, schedule.tasks[0]


def test_the_tool_stands_off_before_and_after_its_path(cell: Cell) -> None:
    times, moved = scheduled(cell)
    _, plain = scheduled(replace(cell, tasks=(replace(cell.tasks[0], approach=None, retract=None),)))

    at_rest = plain.X_PT[np.minimum(np.arange(len(times)), len(plain.X_PT) - 1)]  # its clock ends with the path
    shift = inverse(at_rest) @ moved.X_PT  # in the axes of the tool

    np.testing.assert_allclose(shift[:, :3, :3], np.broadcast_to(np.eye(3), (len(times), 3, 3)), atol=1e-12)
    np.testing.assert_allclose(shift[:, :2, 3], 0.0, atol=1e-12)
    np.testing.assert_allclose(shift[times <= 0.5, 2, 3], -APPROACH.distance, atol=1e-12)
    np.testing.assert_allclose(shift[times >= 3.4, 2, 3], -RETRACT.distance, atol=1e-12)
    at_work = (times >= 1.0) & (times <= 3.0)
    np.testing.assert_array_equal(moved.X_PT[at_work], at_rest[at_work])
    assert np.all(np.diff(shift[times <= 1.0, 2, 3]) >= 0.0)
    assert np.all(np.diff(shift[times >= 3.0, 2, 3]) <= 0.0)


def test_the_twist_is_the_derivative_of_the_pose(cell: Cell) -> None:
    times, moved = scheduled(cell)
    away = (times < 1.0) | (times > 3.0)
    slope = np.gradient(moved.X_PT[:, :3, 3], times, axis=0)

    # central differences of a quintic over h = 5 ms: h^2 / 6 times its third derivative, 60 d / T^3
    np.testing.assert_allclose(moved.V_PT_P[away, :3], slope[away], atol=0.005**2 / 6 * 60 * 0.08 / 0.4**3 * 1.1)
    assert np.abs(moved.V_PT_P[[0, -1]]).max() < 1e-15  # rest, but for the rounding of the last instant


def test_a_clock_without_a_length_ends_when_the_tool_has_left(cell: Cell) -> None:
    motion = replace(cell.motion, duration=None)
    times, _ = scheduled(replace(cell, motion=motion, tasks=(replace(cell.tasks[0], duration=2.9),)))

    assert times[-1] == pytest.approx(4.3)


@pytest.mark.slow
def test_a_program_starts_and_ends_clear_of_the_part(cell: Cell) -> None:
    report = solve(cell).runs[0].report

    assert max(np.linalg.norm(errors.position_error, axis=1).max() for errors in report.accuracy) < 1e-4
    allowed = [contact for contact in report.clearance.contacts if contact.is_allowed]
    assert allowed
    assert all(contact.first_s > 0.5 and contact.last_s < 3.4 for contact in allowed)


def test_another_duration_leaves_time_for_the_way_back(cell: Cell) -> None:
    filled = replace(cell, tasks=(replace(cell.tasks[0], duration=None),), motion=replace(cell.motion, duration=6.0))

    times, moved = scheduled(filled)

    assert times[-1] == 6.0
    assert moved.end == pytest.approx(6.0 - filled.tasks[0].leaving)
