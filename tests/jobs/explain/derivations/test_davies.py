"""Davies' method: closure of circuits for any choice of primary joints, in space and in the plane."""

from dataclasses import replace

import numpy as np
import pytest
from builders.jacobian_cells import model_of, planners_jacobian
from builders.random_cells import random_cell, sharing

from cellplan import load_cell
from cellplan.errors import InputError, NotPlanarError, PrimaryChoiceError
from cellplan.geometry.transforms import inverse, pose
from cellplan.jobs.explain.derivations.davies import davies_cooperation_jacobian, network, partition, solve_network
from cellplan.model.task.task import Frame, PlaneName

AGREEMENT = 1e-11  # [-] of the largest entry
SOLVE_TOL = 1e-9  # [-] of the largest speed: rounding times the condition of a random network


@pytest.fixture
def pair():
    """Positioner and operator with six joints each, at a configuration without singularity."""
    cell = random_cell(31, operators=1, joints=6)
    q = np.random.default_rng(31).uniform(-1.5, 1.5, 12)
    return cell, q, network(cell, q)


def desired_twist(cell, V):
    """A tool's twist on the part as speeds of the virtual joints."""
    task = cell.tasks[0]
    return {f"{task.name}:{name}": speed for name, speed in zip(("px", "py", "pz", "rx", "ry", "rz"), V, strict=True)}


def closure_gap(net, velocities):
    return np.abs(net.matrix @ np.array([velocities[name] for name in net.joints])).max()


@pytest.mark.parametrize("seed", range(6))
def test_any_spanning_tree_gives_the_same_matrix(seed):
    cell = random_cell(32, operators=4, with_follower=True)
    q = np.random.default_rng(seed).uniform(-3, 3, cell.joint_count)
    edges = len(network(cell, q).graph.joints)
    order = np.random.default_rng(seed).permutation(edges).tolist()

    J, planned = davies_cooperation_jacobian(cell, q, tree_order=order), planners_jacobian(cell, q)

    assert np.abs(J - planned).max() <= AGREEMENT * np.abs(planned).max()


def test_secondary_and_primary_sides_are_the_closure(pair):
    _, _, net = pair
    primary = ["op0/j1", "task_op0:rx", "holder/j4"]
    N_s, N_p = partition(net, primary)
    velocities = np.random.default_rng(0).normal(size=len(net.joints))
    given = [net.joints.index(name) for name in primary]
    sought = [i for i in range(len(net.joints)) if i not in given]

    np.testing.assert_allclose(N_s @ velocities[sought] - N_p @ velocities[given], net.matrix @ velocities, atol=1e-13)


def test_imposed_tool_motion_with_a_locked_and_a_driven_joint_agrees_with_the_matrix(pair):
    """Twelve joints, six desired components; one joint locked, five imposed: six are left, and there is one answer."""
    cell, q, net = pair
    V = np.array([0.1, -0.2, 0.05, 0.3, -0.1, 0.2])
    imposed = {"holder/j0": 0.0, "op0/j1": 0.4, "holder/j1": -0.3, "holder/j2": 0.2, "holder/j5": 0.1, "op0/j2": 0.25}

    solved = solve_network(net, desired_twist(cell, V) | imposed)

    J = planners_jacobian(cell, q)[0]
    known = [net.joints.index(name) for name in imposed]
    free = [i for i in range(12) if i not in known]
    by_matrix = np.linalg.solve(J[:, free], V - J[:, known] @ np.array(list(imposed.values())))
    velocities = np.array([solved.velocities[name] for name in net.joints])
    assert solved.freedom == 0
    assert np.abs(velocities[free] - by_matrix).max() <= SOLVE_TOL * np.abs(by_matrix).max()
    np.testing.assert_array_equal(velocities[known], list(imposed.values()))
    assert closure_gap(net, solved.velocities) <= SOLVE_TOL * np.abs(by_matrix).max()


def test_monitored_tool_motion_is_what_the_joints_give(pair):
    """All real joints imposed: the virtual joints are monitored, and read the tool's twist on the part."""
    cell, q, net = pair
    qdot = np.random.default_rng(1).normal(size=12)

    solved = solve_network(net, dict(zip(net.joints[:12], qdot, strict=True)))

    measured = [solved.velocities[name] for name in desired_twist(cell, np.zeros(6))]
    expected = planners_jacobian(cell, q)[0] @ qdot
    assert np.abs(measured - expected).max() <= AGREEMENT * np.abs(expected).max() * 10  # one more solve
    assert solved.freedom == 0


def test_freedom_is_counted_and_spent_on_the_least_weighted_motion(pair):
    cell, q, net = pair
    V = np.array([0.1, -0.2, 0.05, 0.3, -0.1, 0.2])
    weights = np.random.default_rng(2).uniform(0.5, 3.0, len(net.joints))

    solved = solve_network(net, desired_twist(cell, V), weights=weights)

    J, W_inv = planners_jacobian(cell, q)[0], np.diag(1.0 / weights[:12])
    expected = W_inv @ J.T @ np.linalg.solve(J @ W_inv @ J.T, V)  # weighted pseudo-inverse, D.28
    result = np.array([solved.velocities[name] for name in net.joints[:12]])
    assert solved.freedom == 6
    assert np.abs(result - expected).max() <= SOLVE_TOL * np.abs(expected).max()


def test_a_driven_positioner_joint_moves_the_operator_that_holds_its_place(pair):
    """Tool at rest on the part, one positioner joint imposed, the others locked: the operator follows alone."""
    cell, q, net = pair
    locked = {f"holder/j{i}": 0.0 for i in range(1, 6)}

    solved = solve_network(net, desired_twist(cell, np.zeros(6)) | {"holder/j0": 1.0} | locked)

    J = planners_jacobian(cell, q)[0]
    follow = np.linalg.solve(J[:, 6:], -J[:, 0])
    result = [solved.velocities[f"op0/j{i}"] for i in range(6)]
    assert np.abs(result - follow).max() <= SOLVE_TOL * np.abs(follow).max()


def test_too_many_imposed_speeds_are_refused(pair):
    cell, _, net = pair
    imposed = dict.fromkeys(net.joints[:12], 0.0) | desired_twist(cell, [0.1, 0, 0, 0, 0, 0])
    with pytest.raises(PrimaryChoiceError, match="no speeds of the other joints keep the circuits closed"):
        solve_network(net, imposed)


def test_a_choice_that_leaves_too_few_turning_joints_is_refused(pair):
    """Two turning and four sliding joints are left: as many as rows, yet they cannot turn the tool as asked."""
    cell, _, net = pair
    imposed = dict.fromkeys(["holder/j0", "holder/j1", "holder/j3", "holder/j4", "op0/j1", "op0/j4"], 0.0)
    with pytest.raises(PrimaryChoiceError, match="no speeds of the other joints keep the circuits closed"):
        solve_network(net, desired_twist(cell, [0, 0, 0, 0.3, -0.1, 0.2]) | imposed)


def test_all_imposed_is_accepted_when_it_fits(pair):
    cell, q, net = pair
    qdot = np.random.default_rng(3).normal(size=12)
    V = planners_jacobian(cell, q)[0] @ qdot

    solved = solve_network(net, dict(zip(net.joints[:12], qdot, strict=True)) | desired_twist(cell, V))

    assert solved.freedom == 0


def test_nothing_imposed_is_rest(pair):
    _, _, net = pair
    solved = solve_network(net, {})
    assert set(solved.velocities.values()) == {0.0}
    assert solved.freedom == 12


@pytest.mark.parametrize(
    ("imposed", "weights", "message"),
    [
        ({"op0/j9": 1.0}, None, r"^joint: expected one of holder/j0, .*, got 'op0/j9'$"),
        ({"op0/j1": np.nan}, None, r"^joint 'op0/j1': expected a finite speed, got nan$"),
        ({}, np.zeros(18), r"^weights: expected 18 positive numbers, one per joint of the network$"),
        ({}, np.ones(3), r"^weights: expected 18 positive numbers, one per joint of the network$"),
    ],
)
def test_unusable_wishes_are_refused(pair, imposed, weights, message):
    with pytest.raises(InputError, match=message):
        solve_network(pair[2], imposed, weights=weights)


def test_planar_pair_needs_three_rows(cells):
    """Appendix E: PPR in place of PPPS, and the rows x, y and rz of the spatial matrix."""
    cell = load_cell(cells / "planar_pair.yaml")
    for q in np.random.default_rng(4).uniform(-2, 2, (5, 6)):
        net = network(cell, q, plane=PlaneName.XY)

        J = davies_cooperation_jacobian(cell, q, plane=PlaneName.XY)

        spatial = planners_jacobian(cell, q)
        assert net.matrix.shape == (3, 9)
        assert J.shape == (1, 3, 6)
        assert np.abs(J - spatial[:, [0, 1, 5]]).max() <= AGREEMENT * np.abs(spatial).max()


@pytest.mark.parametrize(
    ("plane", "rpy", "rows"),
    [(PlaneName.YZ, (0, np.pi / 2, 0), [1, 2, 3]), (PlaneName.XZ, (np.pi / 2, 0, 0), [0, 2, 4])],
)
def test_a_part_lying_otherwise_is_planar_in_another_plane(cells, plane, rpy, rows):
    cell = load_cell(cells / "planar_pair.yaml")
    grasp = cell.part.held_by[0]
    turned = replace(grasp, X_PT=inverse(pose(rpy=rpy)) @ grasp.X_PT)
    cell = replace(cell, part=replace(cell.part, held_by=(turned,)))
    q = np.random.default_rng(5).uniform(-2, 2, 6)

    J, spatial = davies_cooperation_jacobian(cell, q, plane=plane), planners_jacobian(cell, q)

    assert np.abs(J - spatial[:, rows]).max() <= AGREEMENT * np.abs(spatial).max()


def test_a_cell_in_space_has_no_planar_chains():
    cell = random_cell(33, operators=1)
    with pytest.raises(NotPlanarError, match=r"^joint 'holder/j0': expected motion in a plane of the part"):
        network(cell, np.zeros(cell.joint_count), plane=PlaneName.XY)


def test_the_worked_example_of_the_concept_page_is_what_the_library_gives():
    """Hinges in P: A (-1, 0) in the positioner; B (2, 0), C (2, 1), D (1, 1) in the operator; tip (1, 0.5)."""
    cell = random_cell(34, operators=1)
    z = (0, 0, 1)
    models = [
        model_of([("R", z, (-1, 0, 0))], np.eye(4)),
        model_of([("R", z, (2, 0, 0)), ("R", z, (2, 1, 0)), ("R", z, (1, 1, 0))], pose([1.0, 0.5, 0.0])),
    ]
    robots = tuple(
        replace(robot, model=model, X_WB=np.eye(4), tool=replace(robot.tool, X_FT=np.eye(4)))
        for robot, model in zip(cell.robots, models, strict=True)
    )
    part = replace(cell.part, held_by=(replace(cell.part.held_by[0], X_PT=np.eye(4)),))
    cell = replace(cell, robots=robots, part=part)

    J = davies_cooperation_jacobian(cell, np.zeros(4), plane=PlaneName.XY)[0]
    net = network(cell, np.zeros(4), plane=PlaneName.XY)
    rest = {joint.name: 0.0 for joint in net.graph.joints if joint.is_virtual}
    following = solve_network(net, rest | {"holder/j0": 1.0}).velocities

    np.testing.assert_allclose(J, [[0.5, -0.5, 0.5, 0.5], [-2, -1, -1, 0], [-1, 1, 1, 1]], atol=1e-14)
    np.testing.assert_allclose([following[f"op0/j{i}"] for i in range(3)], [1, -3, 3], atol=1e-12)


def test_a_further_holder_closes_a_real_circuit_without_a_virtual_chain():
    """Two arms of six joints hold the part: one real circuit; with a tool held still on the part six freedoms stay."""
    cell = sharing(random_cell(51, operators=2, joints=6), 1)
    q = np.random.default_rng(51).uniform(-1.5, 1.5, cell.joint_count)
    net = network(cell, q)
    chords = [net.graph.joints[circuit.chord] for circuit in net.circuits]
    is_real = [not any(net.graph.joints[i].is_virtual for i, _ in circuit.passed) for circuit in net.circuits]
    assert sorted(is_real) == [False, True]
    assert len(chords) == 2
    assert not any(name.startswith("op1@part") for name in net.joints)

    solved = solve_network(net, {**desired_twist(cell, np.zeros(6)), "holder/j0": 0.3})

    J = planners_jacobian(cell, q)
    velocities = np.array([solved.velocities[name] for name in net.joints[: cell.joint_count]])
    assert solved.freedom == 5
    assert np.abs(J @ velocities).max() <= SOLVE_TOL * np.abs(velocities).max()  # neither tool strays on the part


def test_what_a_grasp_leaves_open_is_a_joint_that_is_not_measured():
    cell = sharing(random_cell(52, operators=2, joints=6), 1, axes=(0, 1, 2))
    q = np.random.default_rng(52).uniform(-1.5, 1.5, cell.joint_count)
    net = network(cell, q)
    twist = planners_jacobian(cell, q)[1]

    solved = solve_network(net, desired_twist(cell, np.zeros(6)) | {"holder/j0": 0.3})

    velocities = np.array([solved.velocities[name] for name in net.joints[: cell.joint_count]])
    turn = [solved.velocities[f"op1@part:{name}"] for name in ("rx", "ry", "rz")]
    np.testing.assert_allclose(twist @ velocities, [0.0, 0.0, 0.0, *turn], atol=SOLVE_TOL * np.abs(velocities).max())


def test_planar_holders_have_three_rows_each(cells):
    cell = load_cell(cells / "load_sharing_planar.yaml")
    cell = replace(cell, tasks=tuple(replace(task, relative_to=Frame.PART, robot="right") for task in cell.tasks))
    q = np.random.default_rng(3).uniform(-1, 1, 6)

    net = network(cell, q, plane=PlaneName.XY)
    J = davies_cooperation_jacobian(cell, q, plane=PlaneName.XY)

    assert net.matrix.shape == (6, 9)  # two circuits; six driven joints and the three that measure the task
    np.testing.assert_allclose(J, planners_jacobian(cell, q)[:, [0, 1, 5]], atol=1e-12)


def test_a_task_in_the_world_has_no_chain_in_a_plane_of_the_part(cells):
    cell = load_cell(cells / "load_sharing_planar.yaml")
    with pytest.raises(NotPlanarError) as caught:
        network(cell, np.zeros(6), plane=PlaneName.XY)
    assert str(caught.value) == (
        "task 'carry': expected a path on the part in a plane of the part, got one in the world; omit the plane "
        "and use the spatial chains"
    )
