"""Goals and changing weights in the accurate mode: the velocities of Euler's steps, their limit, and exact tools."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.batch_cells import CELLS
from builders.timed_cells import Case, between_samples, case_of, largest_error, shipped, slowly_clocked, triangles

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.solver import WeightingEntry
from cellplan.model.solver import Integrator
from cellplan.planning.collocation.batch_targets import sampled
from cellplan.planning.collocation.batch_tasks import BatchTasks
from cellplan.planning.collocation.redundancy import Redundancy
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.planning.tracking.weighted_inverse import WeightedInverse

Goal = dict[str, dict[str, Any]]  # a goal under its key
GOALS: dict[str, Goal] = {
    "manipulability": {"manipulability": {"gain": 0.5}},
    "joint_limits": {"joint_limits": {"gain": 30.0}},
    "posture": {"posture": {"gain": 1.0}},
}
OBSTACLES: Goal = {"obstacles": {"gain": 0.1, "within_mm": 250.0}}
PLANAR_START = np.radians([50.0, -85.0, 35.0, -26.91606059, 95.64533787, -68.72927727])
HEAVY = WeightingEntry(load=1.0)
HELD_BACK = WeightingEntry(near_limits=1.0)
ACCURACY = 1e-7  # [m]


def varied(cell: Cell, *goals: Goal, weighting: WeightingEntry | None = None) -> Cell:
    """A cell with goals and changing weights, whose tools and part have masses."""
    robots = [replace(robot, tool=replace(robot.tool, mass=2.0 + index)) for index, robot in enumerate(cell.robots)]
    solver = cell.solver.changed(
        secondary={key: goal for it in goals for key, goal in it.items()}, weighting=weighting or WeightingEntry()
    )
    return replace(cell, robots=tuple(robots), part=replace(cell.part, mass=7.0), solver=solver)


def with_solver(case: Case, *goals: Goal, weighting: WeightingEntry | None = None) -> Case:
    return Case(varied(case.cell, *goals, weighting=weighting), case.schedule, case.moving, case.start)


def four_robots(*goals: Goal, step: float = 0.02, **changes: Any) -> Case:
    return case_of(varied(slowly_clocked(shipped("four_robots"), step), *goals, **changes))


def dense_velocities(case: Case, k: int, q: Array) -> Array:
    """What Euler's step takes without feedback, from pinocchio and one dense matrix."""
    cell = replace(case.cell, solver=case.cell.solver.changed(gain_per_s=None))
    problem = TrackingProblem(replace(case.task, cell=cell))
    problem._goal_step = 0.0  # the gain of an infinitely short step
    tasks = problem.first_order(k, q)
    inverse = WeightedInverse(tasks.J, tasks.weights)
    speeds = inverse.velocities(tasks.twist, 0.0)
    if tasks.secondary is not None:
        speeds += tasks.bounded(inverse.null_space_projection(tasks.secondary), velocities=speeds)
    return speeds


def batched_velocities(case: Case, samples: slice, q: Array) -> Array:
    """The same at some samples of the clock, configurations of shape (K, nq)."""
    tasks = BatchTasks(case.cell, case.task.relations, case.moving)
    schedule: Schedule = case.schedule
    _, speeds = Redundancy(case.task, tasks).velocities(
        schedule.times[samples],
        q.T,
        sampled(schedule, samples, case.task.grasps),
        placement=tasks.chains.placement(case.cell),
        mobile=np.ones(case.cell.joint_count),
        drift=None,
    )
    return speeds.T


@pytest.mark.parametrize("name", ["plain", "sliding", "mixed", "closed", "spin and partial"])
def test_velocities_are_those_of_euler_s_steps_at_every_configuration(name: str) -> None:
    """All goals, and weights that depend on loads and on the way to a limit."""
    both = WeightingEntry(load=0.7, near_limits=1.3)
    case = with_solver(triangles(CELLS[name]), *GOALS.values(), weighting=both)
    middle = len(case.schedule.times) // 2
    samples = slice(middle, middle + 3)
    q = case.start + np.random.default_rng(5).normal(size=(3, len(case.start))) * 0.005
    expected = np.array([dense_velocities(case, middle + i, entry) for i, entry in enumerate(q)])

    velocities = batched_velocities(case, samples, q)

    np.testing.assert_allclose(velocities, expected, atol=3e-6 * np.abs(expected).max())  # what keeps blocks regular
    plain = with_solver(triangles(CELLS[name]))
    assert np.abs(np.array([dense_velocities(plain, middle, q[0])]) - expected[:1]).max() > 1e-4


def test_bounds_of_joint_speeds_are_those_of_euler_s_steps() -> None:
    """A gain so large that every configuration is at a bound: all of it is scaled, by the same share."""
    case = with_solver(triangles(CELLS["plain"]), {"posture": {"gain": 1e5}})
    middle = len(case.schedule.times) // 2
    q = case.start + np.random.default_rng(6).normal(size=(2, len(case.start))) * 0.005
    velocities = batched_velocities(case, slice(middle, middle + 2), q)
    expected = np.array([dense_velocities(case, middle + i, entry) for i, entry in enumerate(q)])
    top = 0.9 * case.cell.joint_limits.velocity
    assert np.all(np.abs(velocities) <= top + 1e-9)
    np.testing.assert_allclose(velocities, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("goals", "weighting", "step"),
    [
        pytest.param((GOALS["manipulability"],), None, 0.02, marks=pytest.mark.slow),
        ((GOALS["joint_limits"],), HEAVY, 0.02),
        # of a longer step the tool error shows, which is of the second order
        pytest.param((GOALS["posture"],), None, 0.008, marks=pytest.mark.slow),
        pytest.param((), HELD_BACK, 0.02, marks=pytest.mark.slow),
    ],
)
def test_euler_s_steps_come_to_the_accurate_motion_in_proportion_to_the_step(
    goals: tuple[Goal, ...], weighting: WeightingEntry | None, step: float
) -> None:
    accurate = four_robots(*goals, step=step, weighting=weighting).resolved()
    assert accurate.resolution is not None
    assert accurate.resolution.euler_from is None
    gaps = []
    for every in (1, 2):
        stepped = four_robots(*goals, step=step / every, weighting=weighting).resolved(integrator=Integrator.EULER)
        gaps.append(float(np.abs(stepped.q[::every] - accurate.q).max()))
    assert gaps[0] / gaps[1] == pytest.approx(2.0, rel=0.25)  # of the first order
    assert gaps[1] < np.radians(1.0)
    plain = four_robots(step=step).resolved()
    assert np.abs(plain.q - accurate.q).max() > 3.0 * gaps[1]


@pytest.mark.parametrize("kind", list(GOALS))
def test_tools_are_exact_everywhere_between_the_rows(kind: str) -> None:
    case = with_solver(triangles(CELLS["spin and partial"]), GOALS[kind], weighting=HEAVY)
    path = case.path()
    assert path.worst <= ACCURACY
    assert largest_error(case, path, between_samples(case, path, count=3)) <= ACCURACY


def test_the_velocity_of_the_motion_solves_the_differential_equation() -> None:
    """Residual between the nodes, in the null space as well, by the dense matrices of Euler's steps."""
    case = four_robots(GOALS["posture"], GOALS["manipulability"])
    path, times, h = case.path(), case.schedule.times, 1e-5
    away = [int(k) for k in np.linspace(7, len(times) - 8, 9) if np.abs(case.schedule.breaks - times[int(k)]).min() > h]
    assert len(away) > 5
    for k in away:
        before, at, after = path.at(times[k] + h * np.array([-1.0, 0.0, 1.0]))
        rate = (after - before) / (2.0 * h)
        np.testing.assert_allclose(rate, dense_velocities(case, k, at), atol=1e-5)


def test_obstacles_are_kept_off_with_exact_tools() -> None:
    cell = slowly_clocked(shipped("planar_pair"), 0.02, duration=4.0)
    plain = case_of(varied(cell), start=PLANAR_START)
    case = case_of(varied(cell, OBSTACLES), start=PLANAR_START)
    path = case.path()
    assert path.end == plain.path().end
    assert largest_error(case, path, between_samples(case, path, count=2)) <= ACCURACY
    q = path.at(case.schedule.times)
    stepped = case.resolved(integrator=Integrator.EULER).q
    assert np.abs(stepped - q).max() < 0.5 * np.abs(plain.resolved().q - q).max()


def test_robots_that_stand_and_joints_that_are_locked_are_not_moved() -> None:
    cell = replace(CELLS["plain"])
    name = cell.tasks[0].robot
    locked = LockedJointEntry(robot=name, joint=cell.robot(name).model.joints[1].name, from_s=0.5)
    case = with_solver(triangles(replace(cell, motion=replace(cell.motion, locked=(locked,)))), *GOALS.values())
    path = case.path()
    later = path.at(np.linspace(0.5, path.end, 20))
    column = case.cell.columns(name).start + 1
    np.testing.assert_allclose(later[:, column], later[0, column], atol=1e-12)
    others = np.delete(np.arange(case.cell.joint_count), column)
    assert np.abs(np.diff(later, axis=0)).max(axis=0)[others].max() > 1e-3


def test_the_motion_begins_and_ends_at_rest_where_the_tasks_do() -> None:
    path = four_robots(*GOALS.values()).path()
    ends = path.at(np.array([0.0, 1e-4, path.end - 1e-4, path.end]))
    assert np.abs(np.diff(ends, axis=0)[[0, 2]]).max() / 1e-4 < 1e-3


@pytest.mark.slow
def test_a_cycle_closes_with_goals() -> None:
    """A goal that leads away and is the same in every cycle."""
    goal = {"joint_limits": {"gain": 5.0}}
    cell = varied(slowly_clocked(shipped("four_robots"), 0.02, cyclic=True), goal)
    motion = case_of(cell).resolved()
    assert motion.resolution is not None
    assert motion.resolution.euler_from is None
    np.testing.assert_allclose(motion.q[-1], motion.q[0], atol=1e-8)


def test_without_goals_and_weights_nothing_is_evaluated() -> None:
    case = four_robots()
    assert AccurateRun(case.task)._redundancy is None
    assert AccurateRun(four_robots(weighting=HEAVY).task)._redundancy is not None
