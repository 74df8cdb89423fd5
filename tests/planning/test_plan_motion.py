"""A closer look at a resolved motion: errors at every instant of the clock, as an independent kinematics sees them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from builders.batch_cells import CELLS
from builders.planar_arms import planar_cell, tip_jacobians
from builders.random_cells import make_task
from builders.timed_cells import Case, case_of, shipped, slowly_clocked, triangles

from cellplan.errors import DivergedError, InputError, NoSolutionError
from cellplan.geometry.curves.curve import Curve, Interval
from cellplan.geometry.transforms import Array
from cellplan.measures.tool_errors import part_poses, task_accuracy
from cellplan.model.motion.motion import Motion
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.solver import Integrator
from cellplan.model.task.task import SpacePolylinePath
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.methods.weighted_pseudo_inverse import SINGULAR_REGION
from cellplan.planning.plan_motion import plan_within_accuracy
from cellplan.planning.timing.schedule import schedule_paths
from cellplan.planning.tracking.weighted_inverse import LARGEST_DAMPING
from cellplan.scene.kinematics.screw_chain import ScrewChain

DENT = 2e-5  # [m] depth
DENT_AT, DENT_WIDTH = 2.9, 0.004  # [rad] along a circle of 0.1 m: narrower than the distance of two nodes
NOISE = 1e-13  # [m] rounding of chains of about ten metres
EULER = Integrator.EULER
MOST_SOLVES = 20_000  # [-] systems of equations, four times what the hardest of these motions takes


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


def arm(points: list[Any], start: list[float], *, step: float = 1e-3, damping: float | str = "auto") -> Case:
    """A planar arm of links of 1 m whose tip goes along straight lines from where it is in 1 s."""
    solver = SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=0.5 / step, damping=damping)
    cell = planar_cell([1.0] * len(start), solver)
    q = np.array(start)
    tip = ScrewChain(cell.robots[0]).tool_poses(q[None])[0, :3, 3]
    path = SpacePolylinePath(points=tuple((float(x), float(y), 0.0) for x, y in [tip[:2], *points]), is_closed=False)
    task = make_task("arm", path=path, axes=(0, 1), tool_axis=np.eye(3)[2], tolerance=cell.tasks[0].tolerance)
    return case_of(replace(cell, tasks=(task,), motion=replace(cell.motion, step=step)), start=q)


def tips(case: Case, q: Array) -> Array:
    result: Array = ScrewChain(case.cell.robots[0]).tool_poses(q)[:, :2, 3]
    return result


@pytest.mark.slow
def test_euler_s_steps_lead_to_the_same_posture_the_better_the_shorter_they_are() -> None:
    """What is left falls with the step; twice the better minus the worse is better than both."""
    case = case_of(shipped("four_robots"))
    accurate = case.resolved().q[-1]
    coarse, fine, finest = (
        case_of(slowly_clocked(case.cell, step)).resolved(integrator=EULER).q[-1] for step in (0.02, 0.01, 0.005)
    )

    gaps = [np.abs(q - accurate).max() for q in (coarse, fine, finest)]
    assert gaps[2] < np.radians(0.05)
    assert gaps[0] / gaps[1] == pytest.approx(2.0, rel=0.2)  # first order: Euler's drift in the null space
    assert gaps[1] / gaps[2] == pytest.approx(2.0, rel=0.1)
    assert np.abs(2.0 * finest - fine - accurate).max() < np.radians(0.01)
    roughly = case.resolved(accuracy_mm=1e-3).q[-1]
    assert np.abs(2.0 * finest - fine - roughly).max() < np.radians(0.02)


@pytest.mark.parametrize("name", CELLS)
def test_random_cells_agree_with_short_steps(name: str) -> None:
    case = triangles(slowly_clocked(CELLS[name], 0.005))
    accurate, stepped = case.resolved().q, case.resolved(integrator=EULER).q
    assert np.abs(accurate - stepped)[-1].max() < np.radians(0.02)


def test_the_same_input_gives_the_same_bytes() -> None:
    case = triangles(CELLS["mixed"])
    one, other = case.resolved(), replace(case).resolved()
    assert one.q.tobytes() == other.q.tobytes()
    assert one.resolution == other.resolution


def test_more_accuracy_takes_more_work_and_gives_less_error() -> None:
    case = triangles(CELLS["mixed"], side=0.15)
    exact = case.resolved(accuracy_mm=1e-9).q
    loose, tight = (case.resolved(accuracy_mm=accuracy) for accuracy in (1e-1, 1e-5))

    assert loose.resolution.solves < tight.resolution.solves
    assert np.abs(tight.q - exact).max() < 0.05 * np.abs(loose.q - exact).max()
    assert np.abs(tight.q - exact).max() < 1e-6


def test_an_account_is_kept() -> None:
    motion = triangles(CELLS["mixed"]).resolved()
    result = motion.resolution
    assert result.integrator is Integrator.ACCURATE
    assert result.nodes == 6 * 24 + 1  # three sides in two panels each
    assert result.panels == 6
    assert result.sweeps > 0
    assert result.solves >= result.nodes
    assert result.euler_from is None
    stepped = triangles(CELLS["mixed"]).resolved(integrator=EULER).resolution
    assert (stepped.integrator, stepped.nodes, stepped.solves, stepped.error_between) == (EULER, 1001, 1000, None)


def test_near_a_singularity_there_are_more_panels() -> None:
    far, near = arm([(1.4, 0.0)], [0.5, 0.9]), arm([(1.9999, 0.0)], [0.5, 0.9])
    easy, hard = far.resolved(), near.resolved()
    assert easy.resolution.euler_from is None
    assert hard.resolution.euler_from is None
    assert hard.resolution.solves > easy.resolution.solves
    assert tips(near, hard.q)[-1] == pytest.approx([1.9999, 0.0], abs=1e-7)


@pytest.mark.parametrize(
    ("points", "start"),
    [
        ([(6.0, 0.0)], [0.5, 0.9, -0.3, 0.2, 0.1, 0.0]),  # ends stretched out
        ([(0.0, 2.0), (0.0, 3.0), (0.0, 2.0)], [0.5, 0.9, -0.3]),  # is stretched out on the way
        ([(-2.0, 1.0)], [0.0, np.pi, 0.0]),  # starts folded
    ],
)
@pytest.mark.parametrize("step", [pytest.param(1e-3, marks=pytest.mark.slow), 0.02])
def test_through_a_singularity_steps_lead_on_to_the_end(points: Any, start: Any, step: float) -> None:
    case = arm(points, start, step=step)
    motion = case.resolved()

    assert motion.resolution.euler_from is None or 0.0 <= motion.resolution.euler_from < 1.0
    assert len(motion.q) == len(case.schedule.times)
    assert np.all(np.isfinite(motion.q))
    assert np.linalg.norm(tips(case, motion.q)[-1] - points[-1]) < 0.05
    assert motion.resolution.solves < MOST_SOLVES  # nothing is halved without end


def test_an_arm_that_cannot_leave_its_singularity_stays_as_with_steps() -> None:
    """Stretched out it cannot move towards its base, to first order."""
    case = arm([(1.5, 0.0)], [0.0, 0.0], step=0.01)
    motion = case.resolved()
    assert motion.resolution.euler_from <= 0.05  # as long as the tip is desired less than the accuracy away
    np.testing.assert_allclose(tips(case, motion.q)[-1], [2.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(tips(case, case.resolved(integrator=EULER).q)[-1], [2.0, 0.0], atol=1e-6)


SAYS_WHY = (
    r"motion: at \d\.\d+ s (the tool of 'arm' is .* mm from task 'task_arm'|joint 'j\d' of 'arm' would move).*"
    r"closest to a singularity: robot 'arm' on task 'task_arm': smallest singular value \d"
)


@pytest.mark.parametrize("point", [(3.5, 0.5), (9.0, 0.0)])
def test_what_is_out_of_reach_is_lost_as_with_steps(point: tuple[float, float]) -> None:
    case = arm([point], [0.5, 0.9, -0.3])
    for integrator in Integrator:
        with pytest.raises(DivergedError, match=SAYS_WHY):
            case.resolved(integrator=integrator)


@pytest.mark.parametrize("reach", [2.02, 2.1])
def test_what_is_just_out_of_reach_is_followed_to_its_edge_and_then_by_damped_steps(reach: float) -> None:
    """Where nothing can be reached Euler's steps swing, and no digit of their end is a property of the motion.

    What is: up to where collocation ends the tool is on its path, which is not yet out of reach; and from there on each
    row follows from the one before, by the equations of the method in closed form.
    """
    case = arm([(reach, 0.0)], [0.5, 0.9])
    motion, (task,) = case.resolved(), case.schedule.tasks
    desired, first = task.X_PT[:, :2, 3], round(motion.resolution.euler_from / case.schedule.step)

    off_path = np.linalg.norm(tips(case, motion.q) - desired, axis=1)
    assert off_path[: first + 1].max() <= 2.0 * case.cell.solver.accuracy_mm.si
    assert 1.8 < np.linalg.norm(desired[first]) <= 2.0

    gain = case.cell.solver.gain
    J = tip_jacobians([1.0, 1.0], motion.q)
    s = np.linalg.svd(J, compute_uv=False)[:, -1]
    damping = np.maximum(1.0 - (s / SINGULAR_REGION) ** 2, 0.0) * LARGEST_DAMPING**2
    twist = task.V_PT_P[:, :2] + gain * (desired - tips(case, motion.q))
    JJ = J @ np.swapaxes(J, 1, 2) + damping[:, None, None] * np.eye(2)
    speeds = np.swapaxes(J, 1, 2) @ np.linalg.solve(JJ, twist[..., None])
    followed = motion.q[:-1] + speeds[:-1, :, 0] * case.schedule.step
    np.testing.assert_allclose(motion.q[first + 1 :], followed[first:], atol=1e-9)
    assert damping[first:].max() > 0.0


def test_without_damping_steps_are_refused_where_they_have_to_take_over() -> None:
    with pytest.raises(NoSolutionError, match="singular"):
        arm([(1.5, 0.0)], [0.0, 0.0], damping=0.0).resolved()


@pytest.mark.parametrize("reach", [2.02, 2.1])
def test_a_failing_run_takes_little_more_work_than_steps_alone(reach: float) -> None:
    case = arm([(reach, 0.0)], [0.5, 0.9])
    stepped, resolution = case.resolved(integrator=EULER).resolution.solves, case.resolved().resolution
    assert resolution.euler_from is not None
    assert resolution.solves < 3.0 * stepped


def test_settings_that_rule_the_accurate_mode_out_take_steps() -> None:
    motion = triangles(slowly_clocked(CELLS["single"], 0.02)).resolved(method="damped_least_squares")
    assert motion.resolution.integrator is EULER


def test_an_open_path_does_not_close() -> None:
    case = arm([(1.5, 0.5)], [0.5, 0.9, -0.3])
    cell = replace(case.cell, motion=replace(case.cell.motion, cyclic=True))
    for integrator in Integrator:
        with pytest.raises(InputError) as caught:
            replace(case, cell=cell).resolved(integrator=integrator)
        assert str(caught.value) == (
            "<cell>: motion.cyclic: expected closed paths whose cycles end on a multiple of motion.step_s, but the "
            "tool of task 'task_arm' is not back at its start at 1 s"
        )
