"""Secondary goals: each improves what it names, and no tool notices."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.random_cells import random_cell

from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Motion, Schedule, TaskSchedule
from cellplan.model.robot.robot import start_keys
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.obstacle_distances import ClosestPairs
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.planning.tracking.secondary_goals import share_within
from cellplan.planning.tracking.weighted_inverse import WeightedInverse
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.scene import Scene

FOLDER = Path(__file__).parents[3] / "cells"
PLANAR_START = np.radians([50.0, -85.0, 35.0, -26.91606059, 95.64533787, -68.72927727])
UNNOTICED = 1e-9  # [m/s] or [rad/s]: rounding of the projection, whose terms are of order one
H = 1e-6  # [rad] or [m]: central differences leave H^2 and eps / H, both below 1e-9

Goal = dict[str, dict[str, Any]]  # a goal under its key
GOALS: dict[str, Goal] = {
    "manipulability": {"manipulability": {"gain": 0.5}},
    "joint_limits": {"joint_limits": {"gain": 30.0}},
    "obstacles": {"obstacles": {"gain": 0.1}},
    "posture": {"posture": {"gain": 1.0}},
}
HUGE = 1e9


def with_goals(cell: Cell, *goals: Goal) -> Cell:
    return replace(cell, solver=cell.solver.changed(secondary={key: goal for it in goals for key, goal in it.items()}))


def posture_of(cell: Cell, robot: str, q: np.ndarray, *, gain: float) -> Goal:
    """A desired configuration of a robot."""
    model = cell.robot(robot).model
    scales = [joint.display_unit.scale for joint in model.joints]
    at = dict(zip(start_keys(model), scales * q, strict=True))
    return {"posture": {"gain": gain, "at": {robot: at}}}


def names(cell: Cell) -> tuple[str, ...]:
    return tuple(robot.name for robot in cell.robots)


def four_robots() -> tuple[Cell, np.ndarray]:
    cell = load_cell(FOLDER / "four_robots.yaml")
    cell = replace(cell, motion=replace(cell.motion, step=0.02), solver=cell.solver.changed(gain_per_s=25.0))
    return cell, np.concatenate([robot.start for robot in cell.robots if robot.start is not None])


def planar_pair() -> tuple[Cell, np.ndarray]:
    cell = load_cell(FOLDER / "planar_pair.yaml")
    return replace(
        cell, motion=replace(cell.motion, step=0.02), solver=cell.solver.changed(gain_per_s=25.0)
    ), PLANAR_START


def planned(cell: Cell, start: np.ndarray) -> tuple[Schedule, Motion]:
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    return schedule, integrate_schedule(MotionTask(cell, schedule, names(cell), start))


def at_rest(cell: Cell, q: np.ndarray) -> Schedule:
    """Tools that are to stay where they are on the part for 2 s."""
    operators = [names(cell).index(task.robot) for task in cell.tasks]
    state = CombinedModel(cell).state(q)
    times = np.linspace(0.0, 2.0, 21)
    still = tuple(
        TaskSchedule(
            task=task,
            X_PT=np.tile(np.linalg.solve(state.X_WP, state.X_WT[operator]), (len(times), 1, 1)),
            V_PT_P=np.zeros((len(times), 6)),
            travelled=times,
            length=1.0,
            end=2.0,
        )
        for task, operator in zip(cell.tasks, operators, strict=True)
    )
    return Schedule(times=times, tasks=still)


def problem_at_rest(cell: Cell, q: np.ndarray, *, moving: tuple[str, ...] | None = None) -> TrackingProblem:
    """Tools that are to stay where they are; instant 10 is the middle of the motion, away from its ends."""
    return TrackingProblem(MotionTask(cell, at_rest(cell, q), moving or names(cell), q))


def random_problem(
    seed: int, *goals: Goal, moving: tuple[str, ...] | None = None
) -> tuple[TrackingProblem, np.ndarray]:
    cell = with_goals(random_cell(seed, operators=1 + seed % 3, joints=7, with_follower=seed % 2 == 0), *goals)
    q = np.random.default_rng(seed).uniform(-1.0, 1.0, cell.joint_count)
    return problem_at_rest(cell, q, moving=moving), q


def log_manipulability(problem: TrackingProblem, q: np.ndarray, k: int = 10) -> float:
    J = problem.first_order(k, q).J
    return 0.5 * float(np.linalg.slogdet(J @ J.T)[1])


def limit_measure(cell: Cell, q: np.ndarray) -> float:
    """D.46, robot by robot, as printed."""
    total = 0.0
    for robot in cell.robots:
        lower, upper = robot.model.lower, robot.model.upper
        share = (q[cell.columns(robot.name)] - 0.5 * (lower + upper)) / (upper - lower)
        total -= float(share @ share) / (2 * len(lower))
    return total


def nearness(pairs: ClosestPairs, q: np.ndarray, within: float) -> float:
    return -0.5 * sum(((within - pair.distance) / within) ** 2 for pair in pairs.at(q, within=within))


def central_differences(measure, q: np.ndarray, step: float = H) -> np.ndarray:
    return np.array([(measure(q + step * e) - measure(q - step * e)) / (2 * step) for e in np.eye(len(q))])


@pytest.mark.parametrize("seed", range(4))
def test_manipulability_pulls_along_its_gradient_in_the_metric_of_the_weights(seed: int) -> None:
    gain = 1e-6  # small: no speed limit is near
    problem, q = random_problem(seed, {"manipulability": {"gain": gain}})

    secondary = problem.first_order(10, q).secondary

    expected = central_differences(lambda x: log_manipulability(problem, x), q) / problem.first_order(10, q).weights
    np.testing.assert_allclose(
        secondary / gain, expected, atol=1e-4 * np.abs(expected).max()
    )  # 1 / (1 + k h c) is left


def test_joint_limits_pull_along_the_gradient_of_d46() -> None:
    gain = 1e-3
    problem, q = random_problem(3, {"joint_limits": {"gain": gain}})
    expected = central_differences(lambda x: limit_measure(problem.cell, x), q)
    first = problem.first_order(10, q)
    np.testing.assert_allclose(first.secondary * first.weights / gain, expected, rtol=1e-5, atol=1e-9)


def test_joint_without_limits_has_no_middle() -> None:
    problem, q = random_problem(1, GOALS["joint_limits"])
    robots = list(problem.cell.robots)
    joints = list(robots[1].model.joints)
    joints[3] = replace(joints[3], lower=-np.inf, upper=np.inf)
    robots[1] = replace(robots[1], model=replace(robots[1].model, joints=tuple(joints)))
    secondary = problem_at_rest(replace(problem.cell, robots=tuple(robots)), q).first_order(10, q).secondary
    column = problem.cell.columns("op0").start + 3
    assert secondary[column] == 0.0
    assert np.count_nonzero(secondary) == len(q) - 1


def test_obstacles_pull_along_the_gradient_of_their_distances() -> None:
    cell, start = planar_pair()
    gain, within = 1e-6, 0.25
    pairs = ClosestPairs(Scene.from_cell(cell))
    cell = with_goals(cell, {"obstacles": {"gain": gain, "within_mm": 1e3 * within}})
    secondary = problem_at_rest(cell, start).first_order(10, start).secondary
    expected = central_differences(lambda x: nearness(pairs, x, within), start, 1e-4)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(secondary / gain, expected, atol=1e-3 * np.abs(expected).max())  # kinks of flat faces


def test_posture_pulls_to_the_desired_posture_and_else_to_the_start() -> None:
    cell = random_cell(4, operators=2, joints=7)
    start = np.random.default_rng(4).uniform(-1.0, 1.0, cell.joint_count)
    gain = 1e-3
    goal = posture_of(cell, "op1", np.full(7, 0.25), gain=gain)
    problem = problem_at_rest(with_goals(cell, goal), start)
    q = start + 0.01
    desired = start.copy()
    desired[cell.columns("op1")] = 0.25
    first = problem.first_order(10, q)
    np.testing.assert_allclose(
        first.secondary * first.weights / gain, desired - q, rtol=1e-3
    )  # 1 / (1 + k h c) is left


@pytest.mark.parametrize("kind", [kind for kind in GOALS if kind != "obstacles"])
@pytest.mark.parametrize("seed", range(6))
def test_no_task_notices_and_the_goal_grows(kind: str, seed: int) -> None:
    """``grad w . qdot >= 0`` after the projection, in the metric of unequal weights."""
    problem, start = random_problem(seed, GOALS[kind])
    q = start + 0.002  # off the start posture, which is the desired one
    tasks = problem.first_order(10, q)
    motion = WeightedInverse(tasks.J, tasks.weights).null_space_projection(tasks.secondary)
    if len(tasks.J) < len(q):
        assert np.abs(motion).max() > 0.0
    assert np.abs(tasks.J @ motion).max() <= UNNOTICED
    assert (tasks.secondary * tasks.weights) @ motion >= -UNNOTICED


def test_more_rows_than_joints_have_no_manipulability() -> None:
    cell = with_goals(random_cell(5, operators=2, joints=3), GOALS["manipulability"])
    q = np.random.default_rng(5).uniform(-1.0, 1.0, cell.joint_count)
    tasks = problem_at_rest(cell, q).first_order(10, q)
    assert tasks.J.shape == (12, 9)
    np.testing.assert_array_equal(tasks.secondary, 0.0)


def test_gain_means_the_same_for_one_and_for_three_operators() -> None:
    """Operators round a part at rest do not know of each other."""
    cell = random_cell(6, operators=3, joints=7, held=False)
    cell = with_goals(cell, GOALS["manipulability"])
    q = np.random.default_rng(6).uniform(-1.0, 1.0, cell.joint_count)
    gain = {"manipulability": {"gain": 1e-6}}
    together = problem_at_rest(with_goals(cell, gain), q).first_order(10, q).secondary
    alone = problem_at_rest(with_goals(replace(cell, tasks=cell.tasks[:1]), gain), q, moving=("op0",))
    columns = cell.columns("op0")
    np.testing.assert_allclose(together[columns], alone.first_order(10, q).secondary[columns], atol=1e-10)


def test_robots_that_stand_and_joints_that_are_locked_are_not_moved() -> None:
    cell = random_cell(7, operators=2, joints=7)
    locked = LockedJointEntry(robot="op0", joint="j4", from_s=0.0)
    cell = replace(cell, motion=replace(cell.motion, locked=(locked,)))
    cell = with_goals(cell, *(goal for kind, goal in GOALS.items() if kind != "obstacles"))
    start = np.random.default_rng(7).uniform(-1.0, 1.0, cell.joint_count)
    q = start + 0.01
    tasks = problem_at_rest(cell, start, moving=("op0", "op1")).first_order(10, q)
    stands = np.zeros(cell.joint_count, dtype=bool)
    stands[cell.columns("holder")] = True
    stands[cell.columns("op0").start + 4] = True
    left = WeightedInverse(tasks.J, tasks.weights).null_space_projection(tasks.secondary)
    np.testing.assert_array_equal(tasks.secondary[stands], 0.0)
    np.testing.assert_array_equal(left[stands], 0.0)
    assert np.all(tasks.secondary[~stands] != 0.0)


def test_goals_set_in_and_leave_off_at_rest() -> None:
    problem, q = random_problem(8, GOALS["joint_limits"])
    sizes = [float(np.abs(problem.first_order(k, q).secondary).max()) for k in (0, 1, 10, 20)]
    assert sizes[0] == sizes[3] == 0.0
    assert 0.0 < sizes[1] < sizes[2]


def test_goals_rest_at_both_ends_of_a_motion_that_is_to_close() -> None:
    """Whoever starts the program starts it from rest."""
    cell = with_goals(random_cell(8, operators=1, joints=7), GOALS["joint_limits"])
    cell = replace(cell, motion=replace(cell.motion, cyclic=True))
    q = np.random.default_rng(8).uniform(-1.0, 1.0, cell.joint_count)
    problem = problem_at_rest(cell, q)
    secondary = [problem.first_order(k, q).secondary for k in (0, 10, len(problem.times) - 1)]
    assert [bool(np.any(speeds)) for speeds in secondary if speeds is not None] == [False, True, False]


def test_share_takes_no_joint_beyond_its_bounds() -> None:
    speeds, extra = np.array([0.5, -0.5, 0.0, 0.2]), np.array([1.0, -0.1, 0.0, -4.0])
    lowest, highest = np.full(4, -1.0), np.array([1.0, 1.0, 0.0, 1.0])
    assert share_within(speeds, extra, lowest=lowest, highest=highest) == pytest.approx(0.3)  # the last joint's room


def test_joint_beyond_its_bounds_is_not_taken_farther_but_may_come_back() -> None:
    bounds = {"lowest": np.array([-1.0]), "highest": np.array([1.0])}
    assert share_within(np.array([1.5]), np.array([0.1]), **bounds) == 0.0
    assert share_within(np.array([1.5]), np.array([-0.1]), **bounds) == 1.0


@pytest.mark.parametrize("kind", [kind for kind in GOALS if kind != "obstacles"])
def test_huge_gain_breaks_no_speed_limit_and_takes_no_joint_to_its_end(kind: str) -> None:
    cell, start = planar_pair()
    goal: Goal = {kind: {"gain": HUGE}}
    if kind == "posture":  # far outside of what the arms can do
        goal = posture_of(cell, "left", np.radians([500.0, 500.0, 500.0]), gain=HUGE)
    _, motion = planned(with_goals(cell, goal), start)
    for robot in cell.robots:
        q = motion.q[:, cell.columns(robot.name)]
        assert np.all(np.abs(np.diff(q, axis=0)) / 0.02 <= robot.model.velocity)
        assert np.all((q > robot.model.lower) & (q < robot.model.upper))


def test_without_goals_nothing_is_asked_for() -> None:
    problem, q = random_problem(9)
    tasks = problem.first_order(10, q)
    assert tasks.secondary is None
    assert tasks.bounds is None


def tracking_errors(cell: Cell, schedule: Schedule, motion: Motion) -> np.ndarray:
    """Position errors of all tools in [m], shape (N, tasks)."""
    problem = TrackingProblem(
        MotionTask(with_goals(cell), schedule, names(cell), np.zeros(with_goals(cell).joint_count))
    )
    axes = [3 if 2 in task.axes else 2 for task in problem.tasks]
    errors = [problem.first_order(k, q).error for k, q in enumerate(motion.q)]
    parts = np.cumsum([len(task.axes) for task in problem.tasks])[:-1]
    return np.array(
        [[np.linalg.norm(e[:n]) for e, n in zip(np.split(row, parts), axes, strict=True)] for row in errors]
    )


@pytest.fixture(scope="module")
def without_goals() -> tuple[Schedule, Motion]:
    return planned(*four_robots())


@pytest.mark.parametrize("kind", list(GOALS))
def test_each_goal_improves_along_a_whole_motion_of_four_robots(
    kind: str, without_goals: tuple[Schedule, Motion]
) -> None:
    (cell, start), (schedule, plain) = four_robots(), without_goals
    goal = GOALS[kind]
    _, helped = planned(with_goals(cell, goal), start)
    samples = range(0, len(plain.q), 20)

    if kind == "manipulability":
        problem = TrackingProblem(MotionTask(cell, schedule, names(cell), np.zeros(cell.joint_count)))
        before, after = ([log_manipulability(problem, m.q[k], k) for k in samples] for m in (plain, helped))
    elif kind == "joint_limits":
        before, after = ([limit_measure(cell, m.q[k]) for k in samples] for m in (plain, helped))
    elif kind == "obstacles":
        pairs = ClosestPairs(Scene.from_cell(cell))
        before, after = (
            [min(pair.distance for pair in pairs.at(m.q[k], within=0.2)) for k in samples] for m in (plain, helped)
        )
        assert min(after) > min(before) + 0.01  # 10 mm more clearance
    else:
        before, after = ([-float(np.linalg.norm(m.q[k] - start)) for k in samples] for m in (plain, helped))

    assert np.mean(after) > np.mean(before)
    worst, worst_plain = (tracking_errors(cell, schedule, m).max() for m in (helped, plain))
    assert worst < 1.5 * worst_plain  # Euler's error is of second order in all speeds, the goal's among them


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(GOALS))
def test_no_step_of_a_whole_motion_is_noticed_by_a_task(kind: str) -> None:
    cell, start = planar_pair()
    cell = with_goals(cell, GOALS[kind])
    schedule, motion = planned(cell, start)
    problem = TrackingProblem(MotionTask(cell, schedule, names(cell), start))
    largest = 0.0
    for k in range(0, len(motion.q), 5):
        tasks = problem.first_order(k, motion.q[k])
        left = WeightedInverse(tasks.J, tasks.weights).null_space_projection(tasks.secondary)
        largest = max(largest, float(np.abs(tasks.J @ tasks.bounded(left, velocities=np.zeros(6))).max()))
    assert largest <= UNNOTICED


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(GOALS))
def test_four_robots_keep_their_accuracy_with_every_goal(kind: str) -> None:
    cell = load_cell(FOLDER / "four_robots.yaml")
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    schedule, motion = planned(with_goals(cell, GOALS[kind]), start)
    assert tracking_errors(cell, schedule, motion).max() <= 3e-6  # [m] what the cell is to keep
