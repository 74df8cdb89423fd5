"""Weights that vary: the gradient against differences, the load against virtual work, and what both do to a motion."""

from dataclasses import replace

import numpy as np
import pytest
from builders.planar_arm import START, circle_schedule, largest_error, planar_arm_cell
from builders.random_cells import random_cell

from cellplan.model.cell.cell import Grasp, Part
from cellplan.model.settings.solver import WeightingEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.joint_weights import LARGEST_FACTOR, JointWeights, limit_slope
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

LOWER, UPPER = np.array([-2.0, 0.1, -np.inf]), np.array([1.0, 3.1, np.inf])


def nearness(q):
    """H of Chan and Dubey over the joints with limits."""
    l, u, q = LOWER[:2], UPPER[:2], q[:2]  # noqa: E741
    return np.sum((u - l) ** 2 / (4.0 * (u - q) * (q - l)))


@pytest.mark.parametrize("q", [[-1.7, 0.2, 9.0], [0.0, 1.6, 0.0], [0.9, 3.0, -9.0]])
def test_slope_is_the_derivative_of_the_nearness_of_limits(q):
    q, h = np.array(q), 1e-6
    differences = [(nearness(q + h * e) - nearness(q - h * e)) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(limit_slope(q, LOWER, UPPER), differences, rtol=1e-5, atol=1e-7)  # of the second order


def test_slope_points_to_the_nearer_limit_and_stays_finite_at_and_beyond_it():
    at, beyond = limit_slope(UPPER, LOWER, UPPER), limit_slope(UPPER + 1.0, LOWER, UPPER)
    assert np.all(np.isfinite(at))
    np.testing.assert_array_equal(at, beyond)
    assert np.all(at[:2] > 1e4)
    assert np.all(limit_slope(LOWER, LOWER, UPPER)[:2] < -1e4)
    assert at[2] == 0.0


def weighted(cell, **strengths):
    return replace(cell, solver=cell.solver.changed(weighting=WeightingEntry(**strengths)))


def weights_of(cell, q, *, xdot=None, J=None):
    model = CombinedModel(cell)
    J = np.random.default_rng(0).normal(size=(3, len(q))) if J is None else J
    xdot = np.ones(len(J)) if xdot is None else xdot
    return JointWeights(cell, model).at(model.state(q), q, J=J, xdot=xdot, secondary=None)


def test_without_strength_the_weights_are_those_of_the_cell():
    cell = random_cell(3, operators=2)
    q = np.random.default_rng(3).uniform(-1, 1, cell.joint_count)
    np.testing.assert_array_equal(weights_of(cell, q), np.concatenate([robot.weights for robot in cell.robots]))


def test_a_joint_is_held_back_on_its_way_to_a_limit_and_free_on_its_way_back():
    cell = weighted(planar_arm_cell(), near_limits=1.0)
    q = np.array([3.0, 0.0, 0.0, -3.0])
    slope = np.abs(limit_slope(q, np.full(4, -np.pi), np.full(4, np.pi)))
    np.testing.assert_allclose(weights_of(cell, q, J=np.eye(4), xdot=np.full(4, 5.0)), [1 + slope[0], 1, 1, 1])
    np.testing.assert_allclose(weights_of(cell, q, J=np.eye(4), xdot=np.full(4, -5.0)), [1, 1, 1, 1 + slope[3]])


def test_the_factor_is_capped():
    cell = weighted(planar_arm_cell(), near_limits=1e6)
    q = np.full(4, np.pi)
    np.testing.assert_allclose(weights_of(cell, q, J=np.eye(4), xdot=np.full(4, 5.0)), LARGEST_FACTOR)


def loaded_cell():
    """Two holders of a heavy part and an operator with a tool; every third joint slides."""
    cell = random_cell(7, operators=2, with_follower=True)
    masses = (0.0, 3.0, 8.0)
    robots = tuple(
        replace(robot, tool=replace(robot.tool, mass=mass)) for robot, mass in zip(cell.robots, masses, strict=True)
    )
    X_PS = np.eye(4)
    X_PS[:3, 3] = [0.3, -0.2, 0.5]
    held_by = (*cell.part.held_by, Grasp(robot="op0", X_PT=np.eye(4)))
    part = Part(shape=cell.part.shape, X_PS=X_PS, held_by=held_by, X_WP=None, mass=10.0)
    return replace(cell, robots=robots, part=part), masses


def test_load_is_the_derivative_of_the_potential_energy():
    """Virtual work by central differences of the kinematics: tools at their tips, half of the part on each holder."""
    cell, masses = loaded_cell()
    model = CombinedModel(cell)
    q, h = np.random.default_rng(1).uniform(-1, 1, cell.joint_count), 1e-6
    centre = np.linalg.inv(model.state(q).X_WP) @ model.state(q).X_WT @ np.eye(4)  # tips in P at this configuration
    p_TS = [np.linalg.inv(X) @ np.append(cell.part.X_PS[:3, 3], 1.0) for X in centre]

    def energies(q):
        X_WT = model.state(q).X_WT
        part = [5.0, 5.0, 0.0]
        return np.array([m * X[2, 3] + p * (X @ s)[2] for X, m, p, s in zip(X_WT, masses, part, p_TS, strict=True)])

    derivative = np.array([(energies(q + h * e) - energies(q - h * e)) / (2 * h) for e in np.eye(len(q))])
    expected = np.abs(derivative).max(axis=1) / 8.0  # each joint moves one robot only; 8 kg is the heaviest load

    loads = JointWeights(cell, model).load(model.state(q))

    np.testing.assert_allclose(loads, expected, atol=1e-8)
    assert np.count_nonzero(loads) > 0.7 * len(q)


def test_load_without_masses_changes_nothing():
    cell = weighted(random_cell(3, operators=1), load=5.0)
    q = np.zeros(cell.joint_count)
    np.testing.assert_array_equal(weights_of(cell, q), np.concatenate([robot.weights for robot in cell.robots]))


def test_load_spares_the_shoulder_more_than_the_wrist():
    """An upright arm stretched out level: the torque falls from the shoulder to the wrist as the lever does."""
    cell = planar_arm_cell()
    arm = cell.robots[0]
    X_WB = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # its plane stands upright
    cell = replace(cell, robots=(replace(arm, X_WB=X_WB, tool=replace(arm.tool, mass=4.0)),))
    np.testing.assert_allclose(
        weights_of(weighted(cell, load=2.0), np.zeros(4)), 1 + 2 * np.array([0.8, 0.6, 0.4, 0.2])
    )


@pytest.mark.parametrize(
    "method", ["weighted_pseudo_inverse", pytest.param("quadratic_program", marks=pytest.mark.slow)]
)
def test_a_joint_near_its_limit_moves_less_and_the_task_is_kept(method):
    limits = {"q4": {"lower": 0.35, "upper": 1.2}}
    cell = planar_arm_cell(method=method, limits=limits)
    schedule = circle_schedule(cell)

    def solved(strength):
        return integrate_schedule(MotionTask(weighted(cell, near_limits=strength), schedule, ["arm"], START)).q

    constant, varying = solved(0.0), solved(0.5)

    def margin(q):
        return min((q[:, 3] - 0.35).min(), (1.2 - q[:, 3]).min())

    assert margin(varying) > margin(constant) + 0.05  # [rad]
    assert np.ptp(varying[:, 3]) < np.ptp(constant[:, 3])
    assert largest_error(schedule, varying) < 2e-5
    assert np.abs(np.diff(varying, 2, axis=0)).max() < 1e-4  # [rad] per step squared: no leaps when joints turn round
