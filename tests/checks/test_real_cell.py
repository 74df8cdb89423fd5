"""Execution on a real cell: tools on the part, and what a measuring system makes of them."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.checks.real_cell import (
    RealCell,
    check_true_errors,
    measured_poses,
    path_figures,
    pose_figures,
    worst_share,
)
from cellplan.geometry.transforms import inverse, pose_from, rotation_vector
from cellplan.model.cell.cell_errors import Draw
from cellplan.model.report.rehearsal import RunRehearsal, Trial
from cellplan.model.report.report import TaskAccuracy
from cellplan.model.settings.cell_errors import MeasurementEntry
from cellplan.model.settings.units import Mm
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

ROUNDING = 1e-12  # [m], [rad]
N = 11


def test_tools_stand_on_the_part_where_the_planners_engine_has_them(cells):
    cell = load_cell(cells / "four_robots.yaml")
    q = np.concatenate([robot.start for robot in cell.robots])
    state = CombinedModel(cell).state(q)

    tips = RealCell(cell).tool_poses([task for task in cell.tasks if task.robot in ("kuka", "staubli")], q[None])

    for poses, index in zip(tips, (1, 3), strict=True):
        np.testing.assert_allclose(poses[0], inverse(state.X_WP) @ state.X_WT[index], atol=1e-12)  # rounding


def test_noise_is_as_large_as_stated_and_sits_on_the_part():
    n = 4000
    X = np.repeat(pose_from(np.eye(3), np.array([1.0, 2.0, 3.0]))[None], n, axis=0)
    system = MeasurementEntry(position_noise_mm=0.02, orientation_noise_deg=np.degrees(1e-4))

    (seen,) = measured_poses([X], system, np.random.default_rng(1))

    tolerance = 4 / np.sqrt(2 * n)  # four standard errors of a standard deviation
    assert (seen - X)[:, :3, 3].std(axis=0) == pytest.approx(2e-5, rel=tolerance)
    assert rotation_vector(seen[:, :3, :3]).std(axis=0) == pytest.approx(1e-4, rel=tolerance)


def test_a_perfect_system_sees_the_truth_and_draws_nothing():
    rng = np.random.default_rng(1)
    X = np.eye(4)[None]

    (seen,) = measured_poses([X], MeasurementEntry(), rng)

    np.testing.assert_array_equal(seen, X)
    assert rng.random() == np.random.default_rng(1).random()


def test_a_constant_error_is_accuracy_and_no_repeatability():
    errors = np.tile([3e-4, -4e-4, 0.0, 1e-3, -2e-3, 3e-3], (5, 1))

    figures = pose_figures(errors, 1.5)

    assert (figures.at_s, figures.AP_p) == (1.5, pytest.approx(5e-4))
    assert figures.AP_abc == pytest.approx((1e-3, 2e-3, 3e-3))
    assert figures.RP_l == pytest.approx(0.0, abs=ROUNDING)
    assert figures.RP_abc == pytest.approx((0.0, 0.0, 0.0), abs=ROUNDING)


def test_two_runs_apart_scatter_about_their_middle():
    """Both are 1 mm from the middle, so the mean distance is 1 mm and its deviation nil; S of +-1 is sqrt(2)."""
    errors = np.zeros((2, 6))
    errors[:, 1], errors[:, 5] = (1e-3, -1e-3), (1e-2, -1e-2)

    figures = pose_figures(errors, 0.0)

    assert figures.AP_p == pytest.approx(0.0, abs=ROUNDING)
    assert figures.RP_l == pytest.approx(1e-3)
    assert figures.RP_abc == pytest.approx((0.0, 0.0, 3 * np.sqrt(2) * 1e-2), abs=ROUNDING)


def test_normal_scatter_along_a_line_repeats_as_the_folded_normal_distribution_says():
    """Mean of |x| is sigma sqrt(2/pi) and its deviation sigma sqrt(1 - 2/pi)."""
    sigma, n = 2e-4, 20_000
    errors = np.zeros((n, 6))
    errors[:, 0] = sigma * np.random.default_rng(8).standard_normal(n)

    expected = sigma * (np.sqrt(2 / np.pi) + 3 * np.sqrt(1 - 2 / np.pi))
    assert pose_figures(errors, 0.0).RP_l == pytest.approx(expected, rel=0.03)  # four standard errors of n draws


def test_a_path_is_judged_at_its_worst_instants():
    times = np.array([0.0, 0.1, 0.2])
    errors = np.zeros((2, 3, 6))
    errors[:, 1, 2] = 7e-4  # both runs are off here: accuracy
    errors[:, 2, 2] = (-2e-4, 2e-4)  # here they are off in opposite ways: repeatability

    figures = path_figures(errors, times)

    assert (figures.AT_p, figures.AT_p_at_s) == (pytest.approx(7e-4), 0.1)
    assert (figures.RT_p, figures.RT_p_at_s) == (pytest.approx(2e-4), 0.2)


def test_one_run_repeats_nothing():
    figures, pose = path_figures(np.ones((1, 2, 6)), np.array([0.0, 1.0])), pose_figures(np.ones((1, 6)), 0.0)

    assert figures.RT_p is figures.RT_p_at_s is figures.RT_abc is None
    assert pose.RP_l is pose.RP_abc is None
    assert figures.AT_p == pose.AP_p == pytest.approx(np.sqrt(3.0))


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "planar_pair.yaml")  # tolerance: 0.003 mm, 0.001 deg


def accuracy(position=0.0, at=0):
    errors = np.zeros((N, 3))
    errors[at, 0] = position
    return TaskAccuracy(
        task="circle",
        robot="right",
        position_error=errors,
        orientation_error=np.zeros((N, 3)),
        path_length=1.0,
        start_s=0.0,
        end_s=1.0,
    )


def run_of(*errors, judged_from=0):
    trials = tuple(
        Trial(draw=Draw(robots={}, X_grasps={}), before=(error,), correction=None, in_pass=None) for error in errors
    )
    return RunRehearsal(
        name=None,
        times=0.1 * np.arange(N),
        judged_from={"circle": judged_from},
        trials=trials,
        before={},
        after=None,
        corrected=None,
    )


def test_the_worst_trial_and_instant_are_named(cell):
    run = run_of(accuracy(1e-6), accuracy(5e-6, at=4))

    position, orientation = check_true_errors(cell, run)

    assert not position.passed
    assert position.message == (
        "true position error of task 'circle': 0.005 mm at 0.400 s in trial 2 of 2, allowed 0.003 mm"
    )
    assert orientation.passed


def test_a_tool_on_its_way_to_the_path_is_not_judged(cell):
    late = run_of(accuracy(5e-6, at=4), judged_from=5)

    assert all(check.passed for check in check_true_errors(cell, late))
    assert worst_share(cell, late.trials[0].before, late.judged_from) == 0.0


def test_errors_count_as_shares_of_their_tolerance(cell):
    assert worst_share(cell, (accuracy(6e-6),), {"circle": 0}) == pytest.approx(2.0)


def test_where_nothing_is_allowed_anything_is_infinitely_much(cell):
    task = cell.task("circle")
    strict = replace(cell, tasks=(replace(task, tolerance=task.tolerance.model_copy(update={"position_mm": Mm(0.0)})),))

    assert worst_share(strict, (accuracy(1e-9),), {"circle": 0}) == np.inf
    assert worst_share(strict, (accuracy(0.0),), {"circle": 0}) == 0.0
