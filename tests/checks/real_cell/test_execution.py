"""Execution on a real cell: tools on the part, and what a measuring system makes of them."""

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.checks.real_cell.execution import RealCell, measured_poses
from cellplan.geometry.transforms import inverse, pose_from, rotation_vector
from cellplan.kinematics.pinocchio_model import CombinedModel
from cellplan.model.settings.cell_errors import MeasurementEntry


def test_tools_stand_on_the_part_where_the_planners_engine_has_them(cells):
    cell = load_cell(cells / "four_robots.yaml")
    q = np.concatenate([robot.start for robot in cell.robots])
    state = CombinedModel(cell).state(q)

    tips = RealCell(cell).tool_poses(["kuka", "staubli"], q[None])

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
