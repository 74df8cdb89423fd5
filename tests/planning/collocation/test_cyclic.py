"""Cycles that close, each on its own, and repeat each other where they are alike."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.batch_cells import CELLS
from builders.planar_arms import planar_cell
from builders.random_cells import make_task
from builders.timed_cells import Case, between_samples, case_of, largest_error, shipped, slowly_clocked, triangles

from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.task.task import CirclePath, PlaneName, StraightMove, TimeLaw, TimeLawKind
from cellplan.planning.collocation.cyclic import PERIODIC, closed_path
from cellplan.planning.collocation.joint_polynomials import CollocatedPath
from cellplan.planning.collocation.run import STEADY, AccurateRun
from cellplan.planning.euler.cycle_closing import CLOSED
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.scene.kinematics.screw_chain import ScrewChain

CONSTANT = TimeLaw(kind=TimeLawKind.CONSTANT)
MOVES = {"approach": StraightMove(distance=0.02, duration=0.5), "retract": StraightMove(distance=0.02, duration=0.5)}


def cyclic(case: Case, cycles: int, *, step: float = 0.05, **words: Any) -> Case:
    """The same paths so many times, 1 s each, on a slow clock."""
    words = {"repeat": cycles, "duration": float(cycles), "start": 0.0} | words
    tasks = tuple(replace(task, **words) for task in case.cell.tasks)
    leaving = 0.5 if words.get("retract") else 0.0
    motion = {"cyclic": True, "duration": words["start"] + cycles + leaving}
    return case_of(slowly_clocked(replace(case.cell, tasks=tasks), step, **motion), start=case.start)


def circling(**words: Any) -> Case:
    """A planar arm with two joints to spare whose tip goes round and round without a stop."""
    start = np.array([0.4, 0.7, -0.5, 0.9])
    cell = planar_cell([1.0] * 4, SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=10.0))
    tip = ScrewChain(cell.robots[0]).tool_poses(start[None])[0, :3, 3]
    path = CirclePath(plane=PlaneName.XY, center=(tip[0] - 0.3, tip[1]), radius=0.3)
    words = {"path": path, "axes": (0, 1), "tool_axis": np.eye(3)[2], "time_law": CONSTANT} | words
    return Case(replace(cell, tasks=(make_task("arm", **words),)), None, ("arm",), start)  # type: ignore[arg-type]


def closed(case: Case) -> CollocatedPath:
    run = AccurateRun(case.task)
    problem = TrackingProblem(case.task)
    path = closed_path(run, problem)
    assert path is not None
    return path


def drift(path: CollocatedPath, ends: list[float]) -> np.ndarray:
    """Largest difference of any joint between the ends of neighbouring cycles, shape (cycles,)."""
    moved: np.ndarray = np.abs(np.diff(path.at(np.array(ends)), axis=0)).max(axis=1)
    return moved


def closing_tol(case: Case) -> float:
    """What closing guarantees for any joint, in [rad] or [m].

    Broyden's method ends when each of the r coordinates of ``q(T) - q(0)`` in the null space of the tasks at the start
    is at most ``CLOSED``; a joint takes up at most the length of that vector, ``sqrt(r)`` of it. Across the null space
    the tools are back, and both configurations are within ``STEADY`` of the limit of their passes: twice that, and
    twice again for the estimate by which passes are stopped.
    """
    J = TrackingProblem(case.task).first_order(0, case.start).J
    free = case.cell.joint_count - int(np.linalg.matrix_rank(J))
    return float(np.sqrt(free)) * CLOSED + 4.0 * STEADY


@pytest.mark.parametrize(
    "name", ["plain", "sliding", pytest.param("mixed", marks=pytest.mark.slow), "closed", "spin and partial"]
)
def test_joints_come_back_in_every_cycle_and_no_task_notices(name: str) -> None:
    case = cyclic(triangles(CELLS[name]), 3)
    path = closed(case)

    assert drift(path, [0.0, 1.0, 2.0, 3.0]).max() <= closing_tol(case)
    open_ended = replace(case, cell=replace(case.cell, motion=replace(case.cell.motion, cyclic=False))).path()
    assert drift(open_ended, [0.0, 1.0, 2.0, 3.0]).min() > 1e-7
    assert largest_error(case, path, between_samples(case, path, count=2)) <= 1e-7


def test_cycles_that_are_alike_are_the_same_motion_to_the_last_digit() -> None:
    path = closed(cyclic(circling(), 25))
    t = np.linspace(0.01, 0.99, 30)
    first = path.at(t)
    for cycle in (1, 7, 24):
        np.testing.assert_allclose(path.at(cycle + t), first, atol=1e-12)  # rounding of the instants
    assert drift(path, [float(k) for k in range(26)]).max() <= 1e-9


@pytest.mark.parametrize("cycles", [2, 3])
def test_cycles_under_one_law_close_each_on_its_own(cycles: int) -> None:
    """They take different times, or go the other way through the same speeds: none is the other once more."""
    case = cyclic(circling(time_law=TimeLaw(kind=TimeLawKind.QUINTIC)), cycles)
    (task,) = case.schedule.tasks
    path = closed(case)
    assert drift(path, [0.0, *task.cycle_ends]).max() <= PERIODIC
    assert largest_error(case, path, between_samples(case, path, count=2)) <= 1e-7


def test_coming_and_leaving_are_no_part_of_the_cycle() -> None:
    case = cyclic(triangles(CELLS["sliding"]), 3, step=0.01, start=0.5, **MOVES)
    path = closed(case)
    assert drift(path, [0.5, 1.5, 2.5, 3.5]).max() <= PERIODIC
    assert path.end == pytest.approx(4.0)
    times = between_samples(case, path, count=2)
    assert largest_error(case, path, times[times > 0.5]) <= 1e-7


def test_a_start_beside_the_path_spoils_the_first_cycle_only() -> None:
    case = cyclic(triangles(CELLS["sliding"]), 3)
    path = closed(replace(case, start=case.start + 1e-5))
    result = drift(path, [0.0, 1.0, 2.0, 3.0])
    assert 1e-6 < result[0] < 1e-3
    assert result[1:].max() <= PERIODIC


@pytest.mark.parametrize(
    "since", [pytest.param(0.0, marks=pytest.mark.slow), 1.3, pytest.param(9.0, marks=pytest.mark.slow)]
)
def test_cycles_close_before_and_after_a_joint_fails(since: float) -> None:
    case = cyclic(triangles(CELLS["sliding"]), 3)
    lock = LockedJointEntry(robot="op1", joint="j1", from_s=since)
    case = replace(case, cell=replace(case.cell, motion=replace(case.cell.motion, locked=(lock,))))
    path = closed(case)
    result = drift(path, [0.0, 1.0, 2.0, 3.0])
    assert result.max() <= 1e-8
    assert largest_error(case, path, between_samples(case, path, count=2)) <= 1e-7


def test_a_coarse_accuracy_does_not_keep_cycles_from_closing() -> None:
    case = cyclic(triangles(CELLS["sliding"]), 2)
    coarse = replace(case.cell, solver=case.cell.solver.changed(accuracy_mm=1.0))
    assert drift(closed(replace(case, cell=coarse)), [0.0, 1.0, 2.0]).max() <= closing_tol(case)


@pytest.mark.slow
@pytest.mark.parametrize("counts", [(1, 2, 3, 6), (6, 1, 4, 3)])
def test_tasks_without_a_common_cycle_close_over_the_whole_motion(counts: tuple[int, ...]) -> None:
    case = cyclic(triangles(CELLS["mixed"]), 6)
    tasks = (replace(task, repeat=count) for task, count in zip(case.cell.tasks, counts, strict=True))
    case = case_of(replace(case.cell, tasks=tuple(tasks)), start=case.start)
    assert drift(closed(case), [0.0, 6.0]).max() <= closing_tol(case)


def test_passes_settle_where_operators_cannot_do_their_tasks_alone() -> None:
    """Lost digits of singular blocks keep passes from settling, and what is cut up then closes nowhere."""
    case = triangles(CELLS["mixed"])
    case = replace(case, cell=replace(case.cell, motion=replace(case.cell.motion, cyclic=True)))
    run = AccurateRun(case.task)
    path = run.path(case.start, begin=0.0, end=run.end)
    assert len(path.panels) == 6  # three sides in two panels each, none of which is cut
    assert run.sweeps <= 4 * len(path.panels)


def test_no_way_through_a_cycle_leaves_it_to_the_steps() -> None:
    case = cyclic(circling(), 2)
    (task,) = case.cell.tasks
    far = replace(task.path, radius=4.5, center=(task.path.center[0] - 4.2, task.path.center[1]))
    case = case_of(replace(case.cell, tasks=(replace(task, path=far),)), start=case.start)
    run = AccurateRun(case.task)
    problem = TrackingProblem(case.task)
    assert closed_path(run, problem) is None


@pytest.mark.slow
def test_nicolato_s_ellipse_closes_in_each_of_25_cycles() -> None:
    cell = shipped("papers/nicolato_ellipse")
    case = case_of(replace(cell, motion=replace(cell.motion, step=0.0025, cyclic=True)))
    result = np.abs(np.diff(case.resolved().q[::800], axis=0)).max(axis=1)
    assert result[0] <= 1e-8  # the start posture is written with nine decimals
    assert result[1:].max() <= 1e-11
