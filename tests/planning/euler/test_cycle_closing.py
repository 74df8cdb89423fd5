"""A cyclic motion brings every joint back, and no task notices."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask

FOLDER = Path(__file__).parents[3] / "cells"


def planned(cell: Cell, start: np.ndarray) -> tuple[Schedule, Motion]:
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    moving = tuple(robot.name for robot in cell.robots)
    return schedule, integrate_schedule(MotionTask(cell, schedule, moving, start))


def four_robots(*, cyclic: bool) -> tuple[Cell, np.ndarray]:
    cell = load_cell(FOLDER / "four_robots.yaml")
    cell = replace(
        cell,
        motion=replace(cell.motion, step=0.01, cyclic=cyclic),
        solver=cell.solver.changed(gain_per_s=50.0),
    )
    return cell, np.concatenate([robot.start for robot in cell.robots if robot.start is not None])


@cache
def four_robots_planned(*, cyclic: bool) -> tuple[Cell, Schedule, Motion]:
    cell, start = four_robots(cyclic=cyclic)
    return (cell, *planned(cell, start))


@pytest.mark.slow
def test_four_robots_come_back_only_when_they_are_asked_to() -> None:
    drift = {}
    for cyclic in (False, True):
        _, _, motion = four_robots_planned(cyclic=cyclic)
        drift[cyclic] = float(np.max(np.abs(motion.q[-1] - motion.q[0])))

    assert drift[False] > np.radians(0.5)
    assert drift[True] < np.radians(0.005)  # the tools come back to within the tracking error of a step of 10 ms


@pytest.mark.slow
def test_a_closed_motion_follows_the_tasks_as_well_as_an_open_one() -> None:
    """The drift lies in the null space of the tasks, so that the error stays that of Euler's method."""
    errors = {}
    for cyclic in (False, True):
        errors[cyclic] = tool_error(*four_robots_planned(cyclic=cyclic))

    assert errors[True] < 1.1 * errors[False]


def test_a_path_that_does_not_come_back_is_refused_by_name() -> None:
    cell, start = four_robots(cyclic=True)
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    half = len(schedule.times) // 2
    cut = replace(
        schedule,
        times=schedule.times[:half],
        tasks=tuple(
            replace(task, X_PT=task.X_PT[:half], V_PT_P=task.V_PT_P[:half], end=float(schedule.times[half - 1]))
            for task in schedule.tasks
        ),
    )

    with pytest.raises(InputError, match=r"motion\.cyclic: expected closed paths .* task 'circle' is not back at its"):
        integrate_schedule(MotionTask(cell, cut, tuple(robot.name for robot in cell.robots), start))


def tool_error(cell: Cell, schedule: Schedule, motion: Motion) -> float:
    """Largest position error in [m], by the kinematics of the checks."""
    from cellplan.measures.tool_errors import part_poses, task_accuracy
    from cellplan.scene.kinematics.screw_chain import ScrewChain

    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    q = {robot.name: motion.q[:, cell.columns(robot.name)] for robot in cell.robots}
    X_WP = part_poses(cell, chains, q)
    return max(
        float(np.linalg.norm(accuracy.position_error, axis=1).max())
        for accuracy in (
            task_accuracy(task, chains[task.task.robot], q=q[task.task.robot], X_WP=X_WP) for task in schedule.tasks
        )
    )


@pytest.mark.slow
def test_nicolato_s_ellipse_closes_in_each_of_25_cycles() -> None:
    """The published motion drifts; a constant drift alone would be lost again, as one cycle's map is no contraction."""
    cell = load_cell(FOLDER / "papers" / "nicolato_ellipse.yaml")
    (arm,) = cell.robots
    assert arm.start is not None
    at_ends = {}
    for cyclic in (False, True):
        motion = replace(cell.motion, step=0.0025, cyclic=cyclic)
        _, result = planned(replace(cell, motion=motion, solver=cell.solver.changed(gain_per_s=200.0)), arm.start)
        at_ends[cyclic] = result.q[::800]

    assert len(at_ends[True]) == 26
    assert np.abs(np.diff(at_ends[False], axis=0)).max() > np.radians(10.0)
    assert np.abs(np.diff(at_ends[True], axis=0)).max() < np.radians(0.001)  # what the check of the joint drift asks
