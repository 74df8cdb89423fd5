"""Accurate runs: on the tasks at every instant, by a kinematics that shares nothing with the planner's."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.batch_cells import CELLS, seen_poses
from builders.roller_paths import sampled
from builders.timed_cells import Case, between_samples, case_of, largest_error, shipped, slowly_clocked, triangles

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Cylinder
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.task.task import StraightMove, TimeLaw, TimeLawKind
from cellplan.planning.collocation.run import SETTLING_STEPS, AccurateRun
from cellplan.planning.modes import plan_phases

ACCURACY = 1e-7  # [m], [rad] asked for by default
SAME = 1e-12  # [m], [rad] two kinematics of arms of some metres
POSTURES = 3e-6  # [rad], [m]: passes end ten times the accuracy from their limit, in each of some windows
CONSTANT = TimeLaw(kind=TimeLawKind.CONSTANT)
LAWS = {
    "constant": CONSTANT,
    "quintic": TimeLaw(kind=TimeLawKind.QUINTIC),
    "trapezoid": TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.13),
}


def assert_on_tasks(case: Case, *, count: int = 3, accuracy: float = ACCURACY) -> None:
    """Between all samples of the clock and at the nodes of the clock itself."""
    path = case.path()
    assert path.end == pytest.approx(case.schedule.times[-1], abs=1e-9)
    assert largest_error(case, path, between_samples(case, path, count=count)) <= accuracy + SAME
    assert path.worst <= accuracy


def with_words(cell: Cell, **words: Any) -> Cell:
    return replace(cell, tasks=tuple(replace(task, **words) for task in cell.tasks))


@pytest.mark.parametrize("name", CELLS)
def test_tools_keep_to_their_tasks_between_all_samples(name: str) -> None:
    assert_on_tasks(triangles(CELLS[name]))


def test_four_robots_keep_to_their_paths_at_ten_points_between_all_samples() -> None:
    assert_on_tasks(case_of(shipped("four_robots")), count=10)


@pytest.mark.parametrize("name", ["mixed", "spin", "closures", "carried"])
@pytest.mark.parametrize("accuracy", [1e-4, *(pytest.param(at, marks=pytest.mark.slow) for at in (1e-6, 1e-9)), 1e-11])
def test_the_error_is_below_what_is_asked_for(name: str, accuracy: float) -> None:
    cell = CELLS[name]
    case = triangles(replace(cell, solver=cell.solver.changed(accuracy_mm=1e3 * accuracy)), side=0.15)
    assert_on_tasks(case, count=2, accuracy=accuracy)


@pytest.mark.parametrize("law", LAWS)
def test_corners_between_instants_of_the_clock_are_passed_exactly(law: str) -> None:
    """No instant of the clock falls on a corner or on the end of a ramp."""
    cell = with_words(CELLS["mixed"], time_law=LAWS[law])
    assert_on_tasks(triangles(replace(cell, motion=replace(cell.motion, step=0.0173))))


def test_tasks_may_start_late_end_early_and_come_and_leave() -> None:
    """The tool that is off its path at first, as the approach begins elsewhere, is given time to come to it."""
    case = triangles(CELLS["mixed"], time_law=CONSTANT)
    moves = {
        "approach": StraightMove(distance=0.02, duration=0.1),
        "retract": StraightMove(distance=0.03, duration=0.1),
    }
    changes = [{"start": 0.21, "duration": 0.4}, {"duration": 0.31}, {"start": 0.1003, **moves}, {"start": 0.5}]
    tasks = [replace(task, **change) for task, change in zip(case.cell.tasks, changes, strict=True)]
    late = case_of(replace(case.cell, tasks=tuple(tasks)))
    path = late.path()

    times = between_samples(late, path, count=2)
    settled = times[times > SETTLING_STEPS * late.cell.motion.step]
    assert largest_error(late, path, settled) <= ACCURACY + SAME
    assert largest_error(late, path, times[:1]) > 0.01  # the approach begins 20 mm off


@pytest.mark.parametrize("settle", [0.0, 0.3])
def test_a_start_beside_the_path_is_left_without_a_jump(settle: float) -> None:
    case = triangles(with_words(CELLS["mixed"], settle=settle))
    start = case.start + 1e-3
    moved = replace(case, start=start)
    path = moved.path()

    times = between_samples(case, path, count=2)
    soon = settle or SETTLING_STEPS * case.cell.motion.step
    assert largest_error(moved, path, times[times > soon]) <= ACCURACY + SAME
    q = path.at(np.linspace(0.0, 5e-4, 3))
    assert np.array_equal(q[0], start)
    assert np.abs(np.diff(q, axis=0)).max() < 1e-3 * 0.05  # a twentieth of the way in a tenth of the time, at most


@pytest.mark.parametrize("since", [0.0, 0.31, 0.5, 1.0, 7.0])
def test_a_joint_that_fails_stands_still_to_the_last_bit(since: float) -> None:
    case = triangles(CELLS["sliding"])
    column = case.cell.columns("op1").start + 2
    lock = LockedJointEntry(robot="op1", joint="j2", from_s=since)
    failing = replace(case, cell=replace(case.cell, motion=replace(case.cell.motion, locked=(lock,))))

    assert_on_tasks(failing)
    q = failing.path().at(np.linspace(0.0, 1.0, 2001))[:, column]
    after = q[int(np.ceil(min(since, 1.0) * 2000 - 1e-9)) :]
    assert np.ptp(after) == 0.0
    assert since == 0.0 or np.ptp(q) > 1e-4
    assert since < 1.0 or np.array_equal(q, case.path().at(np.linspace(0.0, 1.0, 2001))[:, column])


@pytest.mark.parametrize("mode", [Mode.SIMULTANEOUS, Mode.PART_AT_REST, Mode.PAIRWISE])
def test_each_mode_moves_its_robots_and_no_others(mode: Mode) -> None:
    cell = slowly_clocked(shipped("four_robots"), 0.02, mode=mode)
    for plan in plan_phases(cell).program:
        case = case_of(replace(cell, tasks=tuple(cell.task(name) for name in plan.tasks)), moving=plan.moving)
        assert_on_tasks(case)
        q = case.path().at(case.schedule.times)
        for robot in cell.robots:
            assert (np.ptp(q[:, cell.columns(robot.name)]) == 0.0) <= (robot.name not in plan.moving)
            if robot.name not in plan.moving:
                assert np.all(q[:, cell.columns(robot.name)] == robot.start)


def test_a_part_that_rests_needs_no_further_holder() -> None:
    case = triangles(CELLS["closed"])
    moving = tuple(task.robot for task in case.cell.tasks)
    path = replace(case, moving=moving).path()
    q = path.at(case.schedule.times)
    for grasp in case.cell.part.held_by:
        columns = case.cell.columns(grasp.robot)
        assert np.array_equal(q[:, columns], np.tile(case.start[columns], (len(q), 1)))


@pytest.mark.parametrize("step", [1e-3, 0.01, 0.1, 1.0])
def test_the_clock_has_no_say_in_the_motion(step: float) -> None:
    case = triangles(CELLS["mixed"])
    clocked = case_of(replace(case.cell, motion=replace(case.cell.motion, step=step)))
    t = np.linspace(0.0, 1.0, 11)
    assert np.array_equal(clocked.path().at(t), case.path().at(t))


@pytest.mark.parametrize("factor", [1e-3, 1e4])
def test_the_same_motion_may_take_any_time(factor: float) -> None:
    """Joints depend on how far the tasks are, not on when: without drift the integral knows no time."""
    case = triangles(CELLS["mixed"])
    motion = replace(case.cell.motion, duration=factor, step=1e-3 * factor)
    other = case_of(replace(case.cell, motion=motion))
    t = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(other.path().at(t * factor), case.path().at(t), atol=POSTURES)


@pytest.mark.parametrize("rows", [30, pytest.param(400, marks=pytest.mark.slow)])
def test_files_of_many_points_are_followed_over_their_knots(rows: int) -> None:
    """A smooth curve through so many points, and one through as many noisy ones: each knot is a break of the third
    derivative, and panels reach over many of them where the noise lets them."""
    case = triangles(CELLS["mixed"])
    rng, u = np.random.default_rng(rows), np.linspace(0.0, 1.0, rows)
    bow = 0.05 * np.stack([u, np.sin(3.0 * u), np.cos(2.0 * u) - 1.0], axis=1)
    tasks = []
    for index, (task, X) in enumerate(zip(case.cell.tasks, seen_poses(case.cell, case.start[None])[0], strict=True)):
        noise = (index % 2) * 1e-5 * rng.normal(size=bow.shape) * (u[:, None] > 0.0)
        path = sampled(X[:3, 3] + bow + noise, is_smooth=True)
        tasks.append(replace(task, path=path))
    many = case_of(replace(case.cell, tasks=tuple(tasks)))

    assert_on_tasks(many, count=2)
    panels = many.path().panels
    assert rows < 100 or len(panels) < 4 * (rows - 1)  # of as many knots in each of four files
    assert rows < 100 or any(panel.knots for panel in panels)


@pytest.mark.slow
def test_a_path_on_a_mesh_takes_fewer_panels_than_rays() -> None:
    cell = shipped("four_robots")
    meshed = case_of(replace(cell, part=replace(cell.part, shape=tessellate(Cylinder(0.25, 0.5)))))
    meshed = replace(meshed, cell=replace(meshed.cell, motion=replace(cell.motion, step=0.01)))
    path = meshed.path()
    assert len(path.panels) < 0.05 * len(meshed.schedule.breaks)
    assert path.end == 4.0
    settled = SETTLING_STEPS * 0.01  # the start posture is that on the cylinder itself
    times = np.linspace(settled, 4.0, 10_001)[1:-1]
    assert largest_error(meshed, path, times) <= ACCURACY + SAME


def test_stretches_are_cut_where_joints_fail() -> None:
    case = triangles(CELLS["sliding"])
    lock = LockedJointEntry(robot="op1", joint="j2", from_s=0.31)
    cell = replace(case.cell, motion=replace(case.cell.motion, locked=(lock,)))
    ends = [panel.end for panel in replace(case, cell=cell).path().panels]
    assert any(end == pytest.approx(0.31, abs=1e-12) for end in ends)


def test_a_motion_goes_on_from_anywhere() -> None:
    case = triangles(CELLS["mixed"])
    run = AccurateRun(case.task)
    whole = run.path(case.start, begin=0.0, end=1.0)
    first = run.path(case.start, begin=0.0, end=0.37)
    rest = run.path(first.last, begin=0.37, end=1.0)
    np.testing.assert_allclose(rest.last, whole.last, atol=POSTURES)
    assert run.path(case.start, begin=0.4, end=0.4).panels == []


def test_progress_runs_from_zero_to_one() -> None:
    case, reported = triangles(CELLS["single"]), []
    run = AccurateRun(case.task, progress=lambda _stage, share: reported.append(share))
    run.path(case.start, begin=0.0, end=1.0)
    assert reported == sorted(reported)
    assert reported[-1] == pytest.approx(1.0)


def test_a_motion_known_at_samples_only_is_refused() -> None:
    case = case_of(shipped("four_robots"))
    samples = replace(case.schedule, paths=())

    assert case.schedule.is_continuous
    assert not samples.is_continuous
    with pytest.raises(TypeError, match=r"^accurate run: expected a desired motion between samples, got none$"):
        AccurateRun(replace(case.task, schedule=samples))
