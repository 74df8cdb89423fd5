"""A closer look at a resolved motion: errors at every instant of the clock, as an independent kinematics sees them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from builders.timed_cells import Case, case_of, shipped

from cellplan.checks.tools.tracking import part_poses, task_accuracy
from cellplan.geometry.curves.curve import Curve, Interval
from cellplan.geometry.transforms import Array
from cellplan.model.motion.motion import Motion
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.refine_motion import plan_within_accuracy
from cellplan.planning.timing.schedule import schedule_paths
from cellplan.scene.kinematics.screw_chain import ScrewChain

DENT = 2e-5  # [m] depth
DENT_AT, DENT_WIDTH = 2.9, 0.004  # [rad] along a circle of 0.1 m: narrower than the distance of two nodes
NOISE = 1e-13  # [m] rounding of chains of about ten metres


@dataclass(frozen=True)
class Dented:
    """A curve with a narrow dent of which its knots say nothing."""

    smooth: Curve

    @property
    def knots(self) -> Array:
        return self.smooth.knots

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        p, dp = self.smooth.evaluate(u, interval)
        share = (u - DENT_AT) / DENT_WIDTH
        depth = DENT * np.exp(-(share**2))[:, None] * np.array([0.0, 0.0, 1.0])
        return p + depth, dp - 2.0 / DENT_WIDTH * share[:, None] * depth


def closely(case: Case) -> Motion:
    return plan_within_accuracy(case.task)


def seen_by_the_checks(case: Case, q: Array) -> Array:
    """Largest position or orientation error of all tools at each instant, by successive screw displacements."""
    chains = {robot.name: ScrewChain(robot) for robot in case.cell.robots}
    positions = {robot.name: q[:, case.cell.columns(robot.name)] for robot in case.cell.robots}
    X_WP = part_poses(case.cell, chains, positions)
    worst = np.zeros(len(q))
    for task in case.schedule.tasks:
        result = task_accuracy(task, chains[task.task.robot], q=positions[task.task.robot], X_WP=X_WP)
        for error in (result.position_error, result.orientation_error):
            worst = np.maximum(worst, np.linalg.norm(error, axis=1))
    return worst


def test_errors_at_the_clock_s_instants_are_those_of_the_checks() -> None:
    case = case_of(shipped("four_robots"))
    q = closely(case).q + 1e-5 * np.random.default_rng(0).normal(size=(len(case.schedule.times), case.cell.joint_count))

    errors = AccurateRun(case.task).errors(case.schedule, q)

    np.testing.assert_allclose(errors, seen_by_the_checks(case, q), rtol=1e-6, atol=NOISE)


@pytest.mark.parametrize("name", ["four_robots", "four_robots_initial"])
def test_no_instant_of_the_clock_is_farther_off_than_the_motion_says(name: str) -> None:
    case = case_of(shipped(name))

    motion = closely(case)

    assert motion.resolution is not None
    assert motion.resolution.error_between is not None
    assert seen_by_the_checks(case, motion.q).max() <= motion.resolution.error_between + NOISE
    assert motion.resolution.error_between <= case.cell.solver.accuracy_mm.si


def test_an_instant_that_is_looked_at_becomes_an_end_of_panels() -> None:
    case = case_of(shipped("four_robots"))
    looked_at = 0.377  # [s] nothing happens there by itself

    closer = replace(case, schedule=replace(case.schedule, extra_breaks=np.array([looked_at])))

    assert looked_at not in [panel.end for panel in case.path().panels]
    assert looked_at in [panel.end for panel in closer.path().panels]
    assert np.abs(closer.resolved().q - case.resolved().q).max() <= 1e-5  # [rad] ten times the accuracy, at most


def test_what_the_nodes_and_the_points_between_them_miss_is_found_and_resolved() -> None:
    case = case_of(shipped("four_robots"))
    circle, *others = case.schedule.paths
    dented = replace(circle, toolpath=replace(circle.toolpath, tip=Dented(circle.toolpath.tip)))
    case = replace(case, schedule=schedule_paths(case.cell, (dented, *others)))
    allowed = case.cell.solver.accuracy_mm.si

    missed, result = case.resolved(), closely(case)

    assert missed.resolution is not None
    assert missed.resolution.error_between is not None
    assert missed.resolution.error_between <= allowed < 0.5 * DENT < seen_by_the_checks(case, missed.q).max()
    assert seen_by_the_checks(case, result.q).max() <= allowed
