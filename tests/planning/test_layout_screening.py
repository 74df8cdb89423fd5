"""Screening of candidate cells: each as if it were resolved alone, whatever becomes of the others."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import Array, pose
from cellplan.planning.layout_screening import AT_ONCE, Candidates, screen_layouts
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.timing.schedule import clock_path, schedule_paths
from cellplan.planning.tracking.motion_task import MotionTask

CELL = Path(__file__).resolve().parents[2] / "cells" / "four_robots.yaml"
FAR = 20.0  # [m] out of reach of any arm


@pytest.fixture(scope="module")
def job() -> SimpleNamespace:
    cell = load_cell(CELL)
    schedule = schedule_paths(cell, [clock_path(cell, task, build_toolpath(task, cell.part)) for task in cell.tasks])
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    return SimpleNamespace(cell=cell, schedule=schedule, start=start, moving=[robot.name for robot in cell.robots])


def candidates(job: SimpleNamespace, shifts: Array) -> Candidates:
    """The cell with its operators' bases shifted, shape (K, operators, 3) in [m]."""
    count = len(shifts)
    X_WB = np.array([[robot.X_WB for robot in job.cell.robots]] * count)
    X_WB[:, 1:, :3, 3] += shifts
    X_FT = np.array([[robot.tool.X_FT for robot in job.cell.robots]] * count)
    return Candidates(X_WB=X_WB, X_FT=X_FT, start=np.tile(job.start, (count, 1)))


def shifts(count: int, largest: float) -> Array:
    return np.random.default_rng(3).uniform(-largest, largest, (count, 3, 3))


def test_a_candidate_has_the_figures_of_the_cell_resolved_alone(job: SimpleNamespace) -> None:
    wanted = candidates(job, shifts(3, 0.1))

    screening = screen_layouts(job.cell, job.schedule, wanted, moving=job.moving, accuracy=1e-6)

    assert screening.is_feasible.all()
    for k in range(3):
        robots = tuple(replace(robot, X_WB=X_WB) for robot, X_WB in zip(job.cell.robots, wanted.X_WB[k], strict=True))
        cell = replace(job.cell, robots=robots)
        motion = plan_motion(MotionTask(cell, job.schedule, job.moving, screening.start[k]))
        joints = [joint for robot in robots for joint in robot.model.joints]
        margins = np.minimum(
            motion.q.min(axis=0) - [joint.lower for joint in joints],
            [joint.upper for joint in joints] - motion.q.max(axis=0),
        )
        speeds = np.abs(np.diff(motion.q, axis=0)).max(axis=0) / job.cell.motion.step
        # the turning points of joints lie between the instants that either of them looks at
        np.testing.assert_allclose(screening.margins[k], margins, rtol=0.0, atol=np.radians(0.02))
        np.testing.assert_allclose(
            screening.speed_ratios[k], speeds / [j.velocity for j in joints], rtol=0.02, atol=1e-3
        )


def test_it_does_not_matter_who_else_is_screened(job: SimpleNamespace) -> None:
    everywhere = shifts(AT_ONCE + 3, 0.05)
    chosen = [0, 7, AT_ONCE + 1]

    among_others = screen_layouts(job.cell, job.schedule, candidates(job, everywhere), moving=job.moving)
    few = screen_layouts(job.cell, job.schedule, candidates(job, everywhere[chosen]), moving=job.moving)

    np.testing.assert_allclose(among_others.margins[chosen], few.margins, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(among_others.speed_ratios[chosen], few.speed_ratios, rtol=0.0, atol=1e-8)
    np.testing.assert_array_equal(among_others.lost_at[chosen], few.lost_at)


def test_a_cell_moved_as_a_whole_keeps_its_figures(job: SimpleNamespace) -> None:
    here = candidates(job, shifts(2, 0.05))
    moved = Candidates(X_WB=pose((3.0, -2.0, 1.0), (0.1, 0.2, 2.0)) @ here.X_WB, X_FT=here.X_FT, start=here.start)

    before, after = (screen_layouts(job.cell, job.schedule, case, moving=job.moving) for case in (here, moved))

    np.testing.assert_allclose(after.margins, before.margins, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(after.speed_ratios, before.speed_ratios, rtol=0.0, atol=1e-8)


def test_a_longer_tool_changes_the_start_of_its_own_robot_only(job: SimpleNamespace) -> None:
    here = candidates(job, np.zeros((2, 3, 3)))
    X_FT = here.X_FT.copy()
    X_FT[1, 1] = X_FT[1, 1] @ pose((0.0, 0.0, 0.03))

    screening = screen_layouts(job.cell, job.schedule, replace(here, X_FT=X_FT), moving=job.moving)

    assert screening.is_followed.all()
    kuka = job.cell.columns("kuka")
    assert np.max(np.abs(screening.margins[1, kuka] - screening.margins[0, kuka])) > np.radians(0.5)
    assert np.max(np.abs(screening.start[1] - screening.start[0])[kuka]) > np.radians(0.5)
    others = np.delete(screening.start[1] - screening.start[0], np.arange(kuka.start, kuka.stop))
    assert np.max(np.abs(others)) <= 1e-12  # [rad] rounding


def test_what_is_out_of_reach_is_lost_and_affects_no_other(job: SimpleNamespace) -> None:
    places = shifts(4, 0.05)
    places[2, 1] += FAR
    alone = screen_layouts(job.cell, job.schedule, candidates(job, places[[0, 1, 3]]), moving=job.moving)

    screening = screen_layouts(job.cell, job.schedule, candidates(job, places), moving=job.moving)

    assert screening.lost_at[2] == -np.inf
    assert screening.is_followed.tolist() == [True, True, False, True]
    assert not screening.is_feasible[2]
    np.testing.assert_allclose(screening.margins[[0, 1, 3]], alone.margins, rtol=0.0, atol=1e-9)


@pytest.mark.slow
def test_a_tool_that_cannot_follow_is_lost_on_the_way(job: SimpleNamespace) -> None:
    places = np.zeros((41, 3, 3))
    places[:, 0, 1] = np.linspace(0.0, 0.8, 41)  # the first operator stands farther and farther away

    screening = screen_layouts(
        job.cell, job.schedule, candidates(job, places), moving=job.moving[1:]
    )  # the part at rest

    lost = np.flatnonzero((screening.lost_at >= 0.0) & ~screening.is_followed)
    assert len(lost) > 0
    assert np.all(screening.lost_at[lost] < job.schedule.times[-1])
    assert screening.is_followed[0]


def test_candidates_must_fit_the_cell(job: SimpleNamespace) -> None:
    here = candidates(job, np.zeros((1, 3, 3)))

    with pytest.raises(ValueError, match="expected 4 robots with 24 joints in all"):
        screen_layouts(job.cell, job.schedule, replace(here, start=here.start[:, :5]), moving=job.moving)
    with pytest.raises(ValueError, match="expected X_WB and X_FT of shape"):
        replace(here, X_FT=here.X_FT[:, :2])
    with pytest.raises(ValueError, match="not finite"):
        replace(here, start=here.start * np.nan)


def test_no_candidates_give_no_figures(job: SimpleNamespace) -> None:
    none = candidates(job, np.zeros((1, 3, 3)))
    none = Candidates(X_WB=none.X_WB[:0], X_FT=none.X_FT[:0], start=none.start[:0])

    screening = screen_layouts(job.cell, job.schedule, none, moving=job.moving)

    assert screening.margins.shape == (0, job.cell.joint_count)
    assert not len(screening.is_feasible)
