"""A positioner on a given path: it keeps to it, and the operators follow their tasks."""

from dataclasses import replace

import numpy as np
import pytest
from builders.timed_cells import Case, case_of, shipped, slowly_clocked

from cellplan.errors import DivergedError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.layout_screening import Candidates, screen_layouts
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

COEFFICIENTS = 30
CELL = shipped("four_robots")


def on_path(cell: Cell, spline: JointSpline) -> Cell:
    """The cell with a path of its first robot, which holds the part."""
    holder = replace(cell.robots[0], path=spline, start=spline.start)
    return replace(cell, robots=(holder, *cell.robots[1:]))


def fitted(case: Case) -> JointSpline:
    """The path nearest to the motion by the pseudo-inverse."""
    motion = case.resolved()
    shares = motion.times / motion.times[-1]
    return JointSpline.fitted(shares, motion.q[:, :6], count=COEFFICIENTS, degree=5)


@pytest.fixture(scope="module")
def free() -> Case:
    return case_of(CELL)


@pytest.fixture(scope="module")
def given(free: Case) -> Case:
    return case_of(on_path(CELL, fitted(free)))


def test_the_fit_of_a_motion_gives_the_motion_back(free: Case, given: Case) -> None:
    free_q, given_q = free.resolved().q, given.resolved().q
    fit = np.abs(given_q[:, :6] - free_q[:, :6]).max()

    assert fit < np.radians(0.05)
    np.testing.assert_allclose(given_q, free_q, rtol=0.0, atol=5.0 * fit)  # wrists turn faster than what they follow


def test_the_positioner_is_where_its_spline_is_and_as_fast(given: Case) -> None:
    motion, spline = given.resolved(), given.cell.robots[0].path
    assert spline is not None
    assert motion.path is not None
    end, times = motion.times[-1], motion.times

    np.testing.assert_allclose(motion.q[:, :6], spline.at(times / end), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(motion.path.at(times, 1)[:, :6], spline.at(times / end, 1) / end, rtol=0.0, atol=1e-9)
    step = times[1] - times[0]
    mean = (motion.q[2:] - motion.q[:-2]) / (2.0 * step)
    inside = np.abs(times[1:-1, None] - given.schedule.breaks).min(axis=1) > 2.0 * step
    np.testing.assert_allclose(motion.path.at(times[1:-1], 1)[inside], mean[inside], rtol=0.0, atol=2e-4)


def test_another_engine_sees_all_tools_on_their_paths(given: Case) -> None:
    motion, model = given.resolved(), CombinedModel(given.cell)

    for row in range(0, len(motion.times), 97):
        state = model.state(motion.q[row])
        for number, scheduled in enumerate(given.schedule.tasks, start=1):
            X_PT = inverse(state.X_WP) @ state.X_WT[number]
            np.testing.assert_allclose(X_PT, scheduled.X_PT[row], rtol=0.0, atol=2.0 * CELL.solver.accuracy_mm.si)


def test_a_path_that_stands_still_is_a_part_at_rest(free: Case) -> None:
    start = np.asarray(CELL.robots[0].start)
    still = case_of(on_path(CELL, JointSpline(coefficients=np.tile(start, (3, 1)), degree=3)))
    at_rest = case_of(CELL, moving=[robot.name for robot in CELL.robots[1:]])

    q = still.resolved().q

    np.testing.assert_array_equal(q[:, :6], np.tile(start, (len(q), 1)))
    np.testing.assert_allclose(q, at_rest.resolved().q, rtol=0.0, atol=1e-6)


def test_eulers_steps_lead_the_operators_the_same_way(given: Case) -> None:
    slow = case_of(slowly_clocked(given.cell, 0.01))

    stepped, whole = integrate_schedule(slow.task), given.resolved()

    rows = np.searchsorted(whole.times, stepped.times - 1e-9)
    np.testing.assert_allclose(stepped.q[:, :6], whole.q[rows, :6], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(stepped.q, whole.q[rows], rtol=0.0, atol=np.radians(2.0))


def test_screening_has_the_figures_of_the_same_motion(given: Case) -> None:
    candidates = Candidates.of([given.cell], given.start[None])

    screening = screen_layouts(given.cell, given.schedule, candidates, moving=given.moving, accuracy=1e-6)

    motion, limits = given.resolved(), CELL.joint_limits
    margins = np.minimum(motion.q.min(axis=0) - limits.lower, limits.upper - motion.q.max(axis=0))
    assert screening.is_feasible.all()
    np.testing.assert_allclose(screening.margins[0], margins, rtol=0.0, atol=np.radians(0.02))
    np.testing.assert_allclose(screening.speed_ratios[0], speed_ratios(motion.q, motion.times, CELL), rtol=0.02)


def speed_ratios(q: Array, times: Array, cell: Cell) -> Array:
    """Largest mean speeds between rows as shares of the limits, shape (nq,)."""
    return (np.abs(np.diff(q, axis=0)) / np.diff(times)[:, None]).max(axis=0) / cell.joint_limits.velocity


def test_a_path_that_leads_tools_out_of_reach_is_named_by_line(given: Case) -> None:
    start = np.asarray(given.cell.robots[0].start)
    far = start + np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0])
    away = JointSpline(coefficients=np.stack([start, far]), degree=5)
    cell = slowly_clocked(on_path(CELL, away), 0.01)

    # Beyond the reach either the tool is left behind or the wrist flips first: rounding decides which.
    with pytest.raises(
        DivergedError, match=r"yaml:\d+: robots\.reis\.path: at 2\.9\d+ s (the tool|joint '\w+') of 'abb' "
    ):
        case_of(cell).resolved()
