"""Joint drift is what the positions say it is, between the instants at which all tools are back."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import joint, make_cell, no_tool, placed, schedule, work

from cellplan.checks.joints.drift import check_joint_drift, repeatability
from cellplan.model.robot.robot import RobotModel

TIMES = np.linspace(0.0, 4.0, 401)


def turn_and_slide(name):
    joints = (joint("turn", -1), joint("slide", 0, slides=True))
    model = RobotModel(name=name, source="test", joints=joints, flange_link=1, X_BF=np.eye(4), bodies=())
    return placed(name, model, tool=no_tool())


CELL = make_cell(turn_and_slide("a"), turn_and_slide("b"))


def clocked(*cycles, **words):
    """Tasks of robots a and b that are back at the given instants."""
    tasks = [replace(work(robot), **words) for robot in ("a", "b")[: len(cycles)]]
    still = schedule(len(TIMES), *tasks, duration=4.0)
    ended = zip(still.tasks, cycles, strict=True)
    return replace(still, tasks=tuple(replace(one, cycle_ends=ends) for one, ends in ended))


def positions(**drifting):
    """Joints that swing back every second, plus a motion of their own."""
    swing = 0.3 * np.sin(2.0 * np.pi * TIMES)
    zero = 0.0 * TIMES
    return {
        robot: np.stack([swing + drifting.get(f"{robot}_turn", zero), swing + drifting.get(f"{robot}_slide", zero)], 1)
        for robot in ("a", "b")
    }


def test_the_drift_of_each_cycle_is_found_with_its_sign():
    q = positions(a_turn=0.01 * TIMES, b_slide=-0.002 * TIMES**2)

    drift = repeatability(CELL, clocked((1.0, 2.0, 3.0, 4.0)), q)

    turn, _, _, slide = drift.drifts
    assert (drift.cycles, drift.period, drift.closes) == (4, pytest.approx(1.0, abs=1e-15), False)
    assert turn.drift == pytest.approx([0.01] * 4, abs=1e-15)
    assert slide.drift == pytest.approx([-0.002, -0.006, -0.010, -0.014], abs=1e-15)
    assert (slide.worst, slide.at_cycle, slide.is_revolute) == (pytest.approx(0.014, abs=1e-15), 4, False)


def test_between_two_samples_a_joint_moves_evenly():
    drift = repeatability(CELL, clocked((0.005, 0.0125)), positions(a_turn=TIMES))

    swing = 0.3 * np.sin(2.0 * np.pi * TIMES)
    expected = 0.5 * (swing[0] + swing[1]) + 0.005
    assert drift.drifts[0].drift[0] == pytest.approx(expected, abs=1e-15)
    assert drift.period is None  # 5 ms and 7.5 ms


def test_tasks_that_do_not_come_back_together_make_one_cycle_of_the_run():
    drift = repeatability(CELL, clocked((1.0, 2.0, 3.0, 4.0), (2.0, 4.0)), positions(b_turn=0.01 * TIMES))

    assert drift.cycle_times.tolist() == [0.0, 4.0]
    assert drift.drifts[2].drift == pytest.approx([0.04], abs=1e-15)


def test_one_cycle_of_the_run_lasts_from_the_first_start_to_the_last_end():
    timed = clocked((1.0, 3.0), (2.0, 4.0))
    late = replace(timed.tasks[0], task=replace(timed.tasks[0].task, start=0.5))

    drift = repeatability(CELL, replace(timed, tasks=(late, timed.tasks[1])), positions())

    assert drift.cycle_times.tolist() == [0.0, 4.0]


def test_an_open_task_or_none_leaves_nothing_to_say():
    assert repeatability(CELL, clocked((2.0, 4.0), ()), positions()) is None
    assert repeatability(CELL, clocked(), positions()) is None


def test_cycles_that_begin_while_the_tool_settles_are_left_out():
    transient = 0.5 * np.exp(-20.0 * TIMES)

    drift = repeatability(CELL, clocked((1.0, 2.0, 3.0, 4.0), settle=0.7), positions(a_turn=transient))

    assert drift.cycle_times.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert drift.closes
    assert repeatability(CELL, clocked((4.0,), settle=0.7), positions()) is None


def test_a_drift_is_judged_only_when_the_cell_asks_for_none():
    drifting = repeatability(CELL, clocked((2.0, 4.0)), positions(a_turn=0.01 * TIMES))
    closed = repeatability(CELL, clocked((2.0, 4.0)), positions(a_turn=1e-6 * TIMES, b_slide=1e-7 * TIMES))

    assert check_joint_drift(drifting, is_demanded=False) == ()
    assert closed.closes
    assert all(check.passed for check in check_joint_drift(closed, is_demanded=True))
    broken = [check for check in check_joint_drift(drifting, is_demanded=True) if not check.passed]
    assert [check.message for check in broken] == [
        "a turn is 1.15 deg away from its position one cycle earlier, at 2.000 s, the end of cycle 1; allowed 0.001 deg"
    ]
    assert (broken[0].name, broken[0].subject, broken[0].unit) == ("joint_drift", "a turn", "deg")


def test_a_demand_that_nothing_can_be_said_about_is_not_kept():
    (check,) = check_joint_drift(None, is_demanded=True)

    assert not check.passed
    assert check.message == (
        "joint drift: there is no cycle to judge, as not all tools come back to the pose of their start"
    )
