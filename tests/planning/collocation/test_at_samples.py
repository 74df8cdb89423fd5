"""Motions known at instants only, put right at each of them."""

from dataclasses import replace

import numpy as np
from builders.timed_cells import Case, case_of, shipped, slowly_clocked

from cellplan.geometry.transforms import Array, pose
from cellplan.model.motion.motion import Schedule
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.solver import Integrator
from cellplan.planning.collocation.at_samples import brought_onto_tasks
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.tracking.motion_task import MotionTask

EULER = Integrator.EULER


def errors(case: Case, schedule: Schedule, q: Array) -> Array:
    return AccurateRun(case.task).errors(schedule, q)


def stepped() -> tuple[Case, Array]:
    case = case_of(slowly_clocked(shipped("four_robots"), 0.004))
    return case, case.resolved(integrator=EULER).q


def test_what_steps_leave_is_taken_away() -> None:
    case, q = stepped()

    brought = brought_onto_tasks(case.task, q)

    assert errors(case, case.schedule, q).max() > 1e-6
    assert errors(case, case.schedule, brought).max() <= 1e-12  # [m] and [rad] rounding
    assert np.abs(brought - q).max() <= 1e-4


def test_joints_move_as_little_as_they_can() -> None:
    """The correction has no part in the null space of the tasks: what is done twice changes nothing."""
    case, q = stepped()
    brought = brought_onto_tasks(case.task, q)

    again = brought_onto_tasks(case.task, brought)

    assert np.abs(again - brought).max() <= 1e-12


def test_what_is_far_away_stays_where_it_is() -> None:
    case, q = stepped()
    far = tuple(replace(task, X_PT=pose((0.0, 0.0, 0.1)) @ task.X_PT) for task in case.schedule.tasks)

    brought = brought_onto_tasks(MotionTask(case.cell, replace(case.schedule, tasks=far), case.moving, q[0]), q)

    assert np.array_equal(brought, q)


def test_a_joint_that_fails_leaves_everything_as_it_is() -> None:
    case, q = stepped()
    lock = LockedJointEntry(robot="kuka", joint="A2", from_s=0.5)
    cell = replace(case.cell, motion=replace(case.cell.motion, locked=(lock,)))

    assert brought_onto_tasks(MotionTask(cell, case.schedule, case.moving, q[0]), q) is q
