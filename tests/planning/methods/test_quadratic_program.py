"""The quadratic program: optimality seen from outside, limits that are never broken, slack that is told."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from builders.planar_arm import START, circle_schedule, largest_error, planar_arm_cell
from builders.random_cells import random_cell
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import DivergedError, StartOutsideLimitsError
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.methods.quadratic_program import bounded_velocities
from cellplan.planning.methods.support.speed_bounds import VelocityBounds
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import FirstOrder
from cellplan.planning.tracking.weighted_inverse import WeightedInverse
from cellplan.scene.kinematics.screw_chain import ScrewChain

RNG = np.random.default_rng(5)
RHO = 1e8


def random_tasks(m, n, *, secondary=True, spread=1.0):
    tasks = FirstOrder(
        RNG.normal(size=(m, n)),
        np.zeros(m),
        np.zeros(m),
        np.exp(spread * RNG.normal(size=n)),
        RNG.normal(size=n) if secondary else None,
    )
    return tasks, RNG.normal(size=m)


def solve(tasks, xdot, limit, rho=RHO):
    bounds = VelocityBounds(np.full(len(tasks.weights), -limit), np.full(len(tasks.weights), limit))
    return bounded_velocities(tasks, xdot, bounds, mobile=np.ones(len(tasks.weights), bool), slack_weight=rho)


def with_some_held(tasks, xdot, held, rho):
    """Optimum when the joints of ``held`` (index to speed) are given: linear least squares over the others."""
    n = len(tasks.weights)
    q0 = np.zeros(n) if tasks.secondary is None else tasks.secondary
    free = [i for i in range(n) if i not in held]
    qd = np.array([held.get(i, 0.0) for i in range(n)])
    rows = np.concatenate([np.diag(np.sqrt(tasks.weights)), np.sqrt(rho) * tasks.J])
    desired = np.concatenate([np.sqrt(tasks.weights) * q0, np.sqrt(rho) * xdot])
    if free:
        qd[free] = np.linalg.lstsq(rows[:, free], desired - rows @ qd, rcond=None)[0]
    gradient = rows.T @ (rows @ qd - desired)
    return qd, gradient, 0.5 * np.sum((rows @ qd - desired) ** 2)


@pytest.mark.parametrize("limit", [10.0, 1.0, 0.3, 0.05])
def test_solution_meets_the_karush_kuhn_tucker_conditions(limit):
    for _ in range(10):
        tasks, xdot = random_tasks(12, 18)
        qd = solve(tasks, xdot, limit)
        held = {i: qd[i] for i in range(18) if abs(qd[i]) > limit - 1e-10}  # the engine's tolerance is 1e-9 of a row
        expected, gradient, _ = with_some_held(tasks, xdot, held, RHO)
        np.testing.assert_allclose(qd, expected, atol=1e-7)  # the check itself squares nothing but has rho^(1/2) = 1e4
        for i, speed in held.items():
            assert gradient[i] * np.sign(speed) < 0.0  # the cost would fall if the joint might go farther
        assert np.abs(qd).max() <= limit


def test_no_choice_of_active_bounds_does_better():
    """Second opinion: all 3^4 ways to hold four joints at their bounds or leave them free."""
    for limit in (0.2, 0.5, 1.0):
        tasks, xdot = random_tasks(2, 4)
        best = min(
            (cost, tuple(qd))
            for choice in product((-limit, None, limit), repeat=4)
            for qd, _, cost in [with_some_held(tasks, xdot, {i: v for i, v in enumerate(choice) if v is not None}, RHO)]
            if np.abs(qd).max() <= limit * (1 + 1e-12)
        )
        np.testing.assert_allclose(solve(tasks, xdot, limit), best[1], atol=1e-8)


def test_far_from_all_bounds_it_is_the_weighted_pseudo_inverse():
    tasks, xdot = random_tasks(12, 18)
    inverse = WeightedInverse(tasks.J, tasks.weights)

    exact = solve(tasks, xdot, 1e3, rho=1e12)
    np.testing.assert_allclose(
        exact, inverse.velocities(xdot, 0.0) + inverse.null_space_projection(tasks.secondary), atol=1e-8
    )

    by_default = solve(replace(tasks, secondary=None), xdot, 1e3)
    np.testing.assert_allclose(by_default, inverse.velocities(xdot, 1.0 / RHO), atol=1e-11)


def test_a_weak_slack_weight_gives_the_task_up_for_smaller_speeds():
    tasks, xdot = random_tasks(12, 18, secondary=False)
    weak, strong = solve(tasks, xdot, 1e3, rho=0.1), solve(tasks, xdot, 1e3)
    assert np.linalg.norm(weak) < 0.9 * np.linalg.norm(strong)
    assert np.linalg.norm(xdot - tasks.J @ weak) > 1e4 * np.linalg.norm(xdot - tasks.J @ strong)


@pytest.mark.parametrize("rho", [1e-3, 1e8, 1e12])
@pytest.mark.parametrize("limit", [0.01, 0.5])
def test_extreme_weights_and_lost_rows_are_solved(rho, limit):
    for _ in range(25):
        tasks, xdot = random_tasks(12, 18, spread=4.0)
        tasks.J[:, :4] *= [0.0, 1e-3, 1e-6, 1e3]
        tasks.J[3] = tasks.J[4]  # a row twice: the tasks contradict each other
        tasks.J[5] = 0.0
        qd = solve(tasks, xdot, limit, rho=rho)
        assert np.all(np.isfinite(qd))
        assert np.abs(qd).max() <= limit


def arm_motion(**limits):
    cell = planar_arm_cell(limits=limits)
    schedule = circle_schedule(cell)
    return schedule, integrate_schedule(MotionTask(cell, schedule, ["arm"], START))


@pytest.mark.slow
def test_position_limit_is_kept_within_the_redundancy():
    """[Nicolato2007]_ section 4.2: the fourth joint may turn from 0.60 to 0.85 rad only; three others do its share."""
    free_schedule, free = arm_motion()
    schedule, motion = arm_motion(q4={"lower": 0.60, "upper": 0.85})

    assert free.q[:, 3].min() < 0.40  # the pseudo-inverse's way, which is the program's without limits
    assert motion.q[:, 3].min() >= 0.60
    assert motion.q[:, 3].max() <= 0.85
    assert largest_error(schedule, motion.q) < 1.05 * largest_error(free_schedule, free.q)
    assert motion.slack.max() < 1e-6  # [m/s] of 0.94


def test_speed_and_acceleration_limits_are_kept_within_the_redundancy():
    schedule = circle_schedule(planar_arm_cell(), smooth=True)
    cell = planar_arm_cell(limits={"q4": {"velocity": 0.5, "acceleration": 4.0}})
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))

    speeds = np.diff(motion.q[:, 3]) / 1e-3
    assert np.abs(speeds).max() == pytest.approx(0.5, rel=1e-6)
    assert np.abs(np.diff(speeds)).max() / 1e-3 == pytest.approx(4.0, rel=1e-6)
    assert motion.slack.max() < 1e-5  # [m/s] of 1.8
    assert largest_error(schedule, motion.q) < 5e-5


def test_what_is_too_fast_for_the_joints_is_given_up_and_reported():
    slow = {f"q{i}": {"velocity": 0.7} for i in range(1, 5)}
    schedule, motion = arm_motion(**slow)
    assert motion.slack.max() > 0.1
    assert largest_error(schedule, motion.q) > 1e-2
    assert np.abs(np.diff(motion.q, axis=0)).max() / 1e-3 <= 0.7


def test_a_start_outside_the_limits_is_refused_also_from_python():
    with pytest.raises(StartOutsideLimitsError, match="joint 'arm/q4' starts at 45 deg, outside its limits"):
        arm_motion(q4={"upper": 0.7})


def test_a_locked_joint_stands_still_and_others_do_its_share():
    cell = planar_arm_cell()
    cell = replace(cell, motion=replace(cell.motion, locked=(LockedJointEntry(robot="arm", joint="q2", from_s=0.3),)))
    schedule = circle_schedule(cell)
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))
    assert np.ptp(motion.q[300:, 1]) == 0.0
    assert largest_error(schedule, motion.q) < 2e-5


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000))
def test_no_limit_is_ever_broken(seed):
    """Random cells with sliding joints, narrow limits and a tool that is asked for more than they can do."""
    rng = np.random.default_rng(seed)
    cell = random_cell(seed, operators=1, joints=5)
    start = rng.uniform(-1, 1, cell.joint_count)
    robots = []
    for robot in cell.robots:
        q0 = start[cell.columns(robot.name)]
        joints = tuple(
            replace(
                joint,
                lower=q - rng.uniform(0, 0.05),
                upper=q + rng.uniform(0, 0.05),
                velocity=rng.uniform(0.1, 1.0),
                acceleration=rng.choice([None, 5.0]),
            )
            for joint, q in zip(robot.model.joints, q0, strict=True)
        )
        robots.append(replace(robot, model=replace(robot.model, joints=joints)))
    cell = replace(
        cell,
        robots=tuple(robots),
        solver=cell.solver.changed(method="quadratic_program", gain_per_s=float(rng.choice([0.0, 200.0])) or None),
    )
    chain = ScrewChain(cell.robots[1])
    X = np.linalg.inv(
        ScrewChain(cell.robots[0]).tool_poses(start[None, :5])[0] @ np.linalg.inv(cell.part.held_by[0].X_PT)
    )
    X = np.tile(X @ chain.tool_poses(start[None, 5:])[0], (101, 1, 1))
    V = np.zeros((101, 6))
    V[:, :3] = rng.normal(size=3)
    X[:, :3, 3] += np.linspace(0.0, 0.4, 101)[:, None] * V[:, :3] / np.linalg.norm(V[0, :3])
    times = np.arange(101) * 2e-3
    scheduled = TaskSchedule(task=cell.tasks[0], X_PT=X, V_PT_P=V, travelled=times, length=1.0, end=0.2)
    try:
        motion = integrate_schedule(
            MotionTask(cell, Schedule(times=times, tasks=(scheduled,)), ["holder", "op0"], start)
        )
    except DivergedError:  # the tool could not follow; what it did until then is not returned
        return
    speeds = np.diff(motion.q, axis=0) / np.diff(times)[:, None]
    for index, joint in enumerate(joint for robot in cell.robots for joint in robot.model.joints):
        assert np.all((motion.q[:, index] >= joint.lower) & (motion.q[:, index] <= joint.upper))
        assert np.all(np.abs(speeds[:, index]) <= joint.velocity)
        if joint.acceleration is not None:
            assert np.all(np.abs(np.diff(speeds[:, index])) / np.diff(times)[1:] <= joint.acceleration)
