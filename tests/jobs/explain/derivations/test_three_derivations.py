"""Three derivations of the cooperation Jacobian, and the planner's matrix, must be one matrix."""

from dataclasses import replace

import numpy as np
import pytest
from builders.jacobian_cells import model_of, planners_jacobian, with_operator
from builders.random_cells import carried, make_task, random_cell, sharing

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.geometry.transforms import pose
from cellplan.jobs.explain.derivations.davies import davies_cooperation_jacobian
from cellplan.jobs.explain.derivations.denavit_hartenberg import dh_cooperation_jacobian
from cellplan.jobs.explain.derivations.successive_screws import screw_cooperation_jacobian

AGREEMENT = 1e-11  # [-] of the largest entry; a dozen products of 4x4 matrices leave some 1e-14
DERIVATIONS = [dh_cooperation_jacobian, screw_cooperation_jacobian, davies_cooperation_jacobian]


def assert_one_matrix(cell, q):
    matrices = [planners_jacobian(cell, q), *(derivation(cell, q) for derivation in DERIVATIONS)]
    largest = np.abs(matrices[0]).max()
    for i, first in enumerate(matrices):
        for second in matrices[i + 1 :]:
            assert np.abs(first - second).max() <= AGREEMENT * largest


@pytest.mark.parametrize("operators", [1, 2, 3, *(pytest.param(n, marks=pytest.mark.slow) for n in range(4, 9))])
@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
@pytest.mark.parametrize("held", [True, False], ids=["held", "fixed"])
def test_all_ways_agree_on_random_cells(operators, with_follower, held):
    cell = random_cell(100 + operators, operators=operators, held=held, with_follower=with_follower)
    for seed in range(3):
        assert_one_matrix(cell, np.random.default_rng(seed).uniform(-3.0, 3.0, cell.joint_count))


@pytest.mark.parametrize("holders", [1, 2, 3])
@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_all_ways_agree_where_several_robots_hold_the_part(holders, with_follower):
    cell = carried(sharing(random_cell(130 + holders, operators=holders + 1, with_follower=with_follower), holders))
    for seed in range(3):
        q = np.random.default_rng(seed).uniform(-3.0, 3.0, cell.joint_count)
        assert dh_cooperation_jacobian(cell, q).shape == (2 + holders, 6, cell.joint_count)
        assert_one_matrix(cell, q)


@pytest.mark.parametrize("name", ["load_sharing", "load_sharing_planar"])
def test_all_ways_agree_on_shipped_cells_of_several_holders(cells, name):
    cell = load_cell(cells / f"{name}.yaml")
    for seed in range(4):
        assert_one_matrix(cell, np.random.default_rng(seed).uniform(-0.5, 0.5, cell.joint_count))


@pytest.mark.parametrize("name", ["four_robots", "four_robots_initial", "planar_pair", "turntable", "rail", "dual_arm"])
def test_all_ways_agree_on_shipped_cells(cells, name):
    cell = load_cell(cells / f"{name}.yaml")
    rng = np.random.default_rng(1)
    lower = np.concatenate([robot.model.lower for robot in cell.robots])
    upper = np.concatenate([robot.model.upper for robot in cell.robots])
    for q in [np.zeros(cell.joint_count), *rng.uniform(lower, upper, (6, cell.joint_count))]:
        assert_one_matrix(cell, q)


def test_all_ways_agree_at_the_start_of_the_four_robots(cells):
    cell = load_cell(cells / "four_robots.yaml")
    assert_one_matrix(cell, np.concatenate([robot.start for robot in cell.robots]))


def test_all_ways_agree_far_from_the_world_origin():
    cell = random_cell(120, operators=2)
    far = pose([50.0, -80.0, 3.0], [0.3, 0.2, 1.0])
    cell = replace(cell, robots=tuple(replace(robot, X_WB=far @ robot.X_WB) for robot in cell.robots))
    assert_one_matrix(cell, np.random.default_rng(0).uniform(-3.0, 3.0, cell.joint_count))


def test_two_tasks_of_one_operator_are_two_equal_rows():
    cell = random_cell(121, operators=1)
    cell = replace(cell, tasks=(*cell.tasks, make_task("op0", name="again")))
    q = np.random.default_rng(2).uniform(-3.0, 3.0, cell.joint_count)

    assert_one_matrix(cell, q)
    for derivation in DERIVATIONS:
        J = derivation(cell, q)
        assert np.abs(J[0] - J[1]).max() <= AGREEMENT * np.abs(J).max()


def test_a_robot_without_joints_has_no_columns():
    """A tool on a stand: only the positioner moves it over the part."""
    cell = with_operator(random_cell(122, operators=1), model_of([], pose([0.1, 0.2, 0.3], [0.4, 0.5, 0.6])))
    q = np.random.default_rng(3).uniform(-3.0, 3.0, cell.joint_count)

    assert_one_matrix(cell, q)
    assert davies_cooperation_jacobian(cell, q).shape == (1, 6, len(cell.robots[0].model.joints))


@pytest.mark.parametrize("derivation", DERIVATIONS)
def test_hinges_in_line_have_the_closed_form(derivation):
    """One hinge each, bases 2 m apart along y, links of 1 m along x: lever arm times rate, minus for the positioner."""
    cell = random_cell(123, operators=1)
    hinge = model_of([("R", (0, 0, 1), (0, 0, 0))], pose([1.0, 0.0, 0.0]))
    robots = tuple(
        replace(robot, model=hinge, X_WB=pose([0.0, y, 0.0]), tool=replace(robot.tool, X_FT=np.eye(4)))
        for robot, y in zip(cell.robots, (0.0, 2.0), strict=True)
    )
    part = replace(cell.part, held_by=(replace(cell.part.held_by[0], X_PT=np.eye(4)),))

    J = derivation(replace(cell, robots=robots, part=part), np.zeros(2))[0]

    np.testing.assert_allclose(J[:, 0], [2.0, -1.0, 0, 0, 0, -1.0], atol=1e-15)  # -(z x (1, 2, 0)) and -z
    np.testing.assert_allclose(J[:, 1], [0.0, 1.0, 0, 0, 0, 1.0], atol=1e-15)  # z x (1, 0, 0) and z


@pytest.mark.parametrize("derivation", DERIVATIONS)
def test_a_posture_that_does_not_fit_is_refused(derivation):
    cell = random_cell(124, operators=1, joints=5)
    with pytest.raises(InputError, match=r"^q: expected 10 joint positions, one per joint, got shape \(9,\)$"):
        derivation(cell, np.zeros(9))
    with pytest.raises(InputError, match=r"^q: expected finite joint positions, got nan$"):
        derivation(cell, np.full(10, np.nan))
