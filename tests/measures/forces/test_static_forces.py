"""Torques by processes and weights: virtual power with the planner's kinematics, an arm by hand, holders together."""

from dataclasses import replace

import numpy as np
import pytest
from builders.forced_cells import always_on, drawn_rows, process, random_forces
from builders.scene_builders import fixed_part, held_part, joint, make_cell, placed, work

from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import Array, pose, rotation_about
from cellplan.measures.forces.static_forces import force_report, joint_torques, static_forces
from cellplan.measures.forces.wrenches import GRAVITY, at_origin, in_part, in_world, inertial_wrench
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Cell, Grasp, Tool
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

POWER_TOL = 1e-12  # [-] of the sum of the sizes of all powers: rounding


def forces_of(cell: Cell, q, schedule=None):
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    X_WP = part_poses(cell, chains, q)
    forces = static_forces(cell, chains, schedule or always_on(cell, len(q[cell.robots[0].name])), q, X_WP)
    assert forces is not None
    return forces, chains


def at_point(twist: Array, point: Array) -> Array:
    """Velocity of a point of a body from its twist at the world origin."""
    return twist[:3] + np.cross(twist[3:], point)


@pytest.mark.parametrize("seed", range(10))
def test_torques_processes_and_weights_do_no_work_together(seed: int) -> None:
    """Twists are those of pinocchio, powers those of forces at their points: nothing of the package's own statics."""
    cell = random_forces(seed, holders=seed % 3)
    q, rng = drawn_rows(cell, seed), np.random.default_rng(seed)
    forces, chains = forces_of(cell, q)
    model = CombinedModel(cell)
    links = model.links(np.concatenate([q[robot.name][0] for robot in cell.robots]))
    flange_screws = model.by_flange(links.screws_W)
    screws = {robot.name: flange_screws[:, cell.columns(robot.name)] for robot in cell.robots}
    qd = {robot.name: rng.normal(size=len(robot.model.joints)) for robot in cell.robots}
    twist_P = screws["holder"] @ qd["holder"]
    for grasp in cell.closures:
        qd[grasp.robot] = np.linalg.pinv(screws[grasp.robot]) @ twist_P
    twists, powers = {name: S @ qd[name] for name, S in screws.items()}, []
    for name, robot in ((robot.name, robot) for robot in cell.robots):
        total = forces.by_process(name) + forces.by_weight(name)
        powers.append(float(joint_torques(chains[name].flange_screws(q[name]), total)[0] @ qd[name]))
        X_WT = chains[name].tool_poses(q[name])[0]
        X_WF = chains[name].flange_poses(q[name])[0]
        centre = X_WF[:3, :3] @ robot.tool.centre + X_WF[:3, 3]
        powers.append(-robot.tool.mass * GRAVITY * at_point(twists[name], centre)[2])
        for task in (task for task in cell.tasks if task.robot == name):
            wrench = task.process.force.wrench
            R = {"tool": X_WT[:3, :3], "part": forces.X_WP[0, :3, :3], "world": np.eye(3)}[task.process.force.frame]
            relative = twists[name] - twist_P
            powers.append(R @ wrench[:3] @ at_point(relative, X_WT[:3, 3]) + R @ wrench[3:] @ relative[3:])
    centre = (forces.X_WP[0] @ cell.part.X_PS)[:3, 3]
    powers.append(-cell.part.mass * GRAVITY * at_point(twist_P, centre)[2])

    assert abs(sum(powers)) <= POWER_TOL * np.abs(powers).sum()
    assert np.abs(powers).min() > 1e-6


def planar(*lengths: float) -> RobotModel:
    """Arm in the vertical plane y = 0: its joints turn about -y, so that a positive angle lifts it from x to z."""
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    joints = tuple(joint(f"j{k}", k - 1, axis=(0, -1, 0), point=(x, 0, 0)) for k, x in enumerate(starts[:-1]))
    X_BF = pose((float(starts[-1]), 0.0, 0.0))
    return RobotModel(name="planar", source="test", joints=joints, flange_link=len(lengths) - 1, X_BF=X_BF, bodies=())


def test_torques_of_a_planar_arm_by_hand() -> None:
    """Links of 0.5 m and 0.3 m at 30 deg and -60 deg more; 20 N back and 10 N up at the tip; a tool of 4 kg."""
    tool = Tool(X_FT=np.eye(4), bodies=(), mass=4.0)
    task = replace(work("arm"), process=process((-20.0, 0.0, 10.0), (0.0, 3.0, 0.0), frame="world"))
    cell = make_cell(placed("arm", planar(0.5, 0.3), tool=tool), tasks=[task])
    q = {"arm": np.radians([[30.0, -60.0]] * 2)}
    (elbow_x, elbow_z) = 0.5 * np.cos(np.pi / 6), 0.5 * np.sin(np.pi / 6)
    x, z = elbow_x + 0.3 * np.cos(-np.pi / 6), elbow_z + 0.3 * np.sin(-np.pi / 6)

    forces, chains = forces_of(cell, q)
    report = force_report(forces, chains, q)

    # about -y the moment of (fx, fz) at (x, z) is x fz - z fx, and that of (0, 3, 0) is -3; joints hold against it
    process_0, process_1 = -(x * 10.0 + z * 20.0 - 3.0), -((x - elbow_x) * 10.0 + (z - elbow_z) * 20.0 - 3.0)
    weight_0, weight_1 = 4.0 * GRAVITY * x, 4.0 * GRAVITY * (x - elbow_x)
    torques = joint_torques(chains["arm"].flange_screws(q["arm"]), forces.by_process("arm"))
    assert torques[0] == pytest.approx([process_0, process_1])
    assert [load.by_process.size for load in report.joints] == pytest.approx([abs(process_0), abs(process_1)])
    assert [load.by_weight and load.by_weight.size for load in report.joints] == pytest.approx([weight_0, weight_1])
    assert [load.total.size for load in report.joints] == pytest.approx(
        [abs(process_0 + weight_0), abs(process_1 + weight_1)]
    )


def test_a_process_acts_while_it_is_on_and_its_worst_time_is_named() -> None:
    task = replace(work("arm"), process=process((0.0, 0.0, -10.0), frame="world"))
    cell = make_cell(placed("arm", planar(1.0)), tasks=[task])
    rows = np.linspace(0.0, 1.0, 11)[:, None]  # lifts the arm: the moment falls as the cosine does
    clock = always_on(cell, 11)
    clock = replace(clock, tasks=(replace(clock.tasks[0], process_on=((0.3, 0.6),)),))

    forces, chains = forces_of(cell, {"arm": rows}, clock)
    (load,) = force_report(forces, chains, {"arm": rows}).joints

    acts = np.linalg.norm(forces.by_process("arm"), axis=1) > 0.0
    assert list(np.flatnonzero(acts)) == [3, 4, 5, 6]
    assert load.by_process.at_s == pytest.approx(0.3)
    assert load.by_process.size == pytest.approx(10.0 * np.cos(0.3))
    assert load.by_weight is not None  # a bare flange weighs nothing
    assert load.by_weight.size == 0.0


def test_the_reaction_of_a_process_is_borne_by_the_holder_and_by_nothing_if_the_part_is_fixed() -> None:
    task = replace(work("arm"), process=process((5.0, 0.0, 30.0), (1.0, 2.0, 0.5), frame="part"))
    arm, holder = placed("arm", planar(0.5, 0.3)), placed("holder", planar(0.7), base=pose((1.5, 0.1, 0.0)))
    held = make_cell(arm, holder, part=held_part(Box((0.1, 0.1, 0.1)), "holder", pose((0.2, 0.0, 0.1))), tasks=[task])
    fixed = make_cell(arm, holder, part=fixed_part(Sphere(0.1), pose((1.0, 0.0, 0.0))), tasks=[task])
    q = {"arm": np.full((2, 2), 0.3), "holder": np.full((2, 1), 2.5)}

    assert forces_of(held, q)[0].by_process("holder") == pytest.approx(-forces_of(held, q)[0].by_process("arm"))
    assert not forces_of(fixed, q)[0].by_process("holder").any()


def test_wrenches_of_processes_are_internal_to_the_cell_and_weights_are_borne_once() -> None:
    cell = random_forces(4, holders=2)
    q = drawn_rows(cell, 4)
    forces, _ = forces_of(cell, q)
    names = [robot.name for robot in cell.robots]

    everything = sum(forces.by_process(name) for name in names)
    weights = sum(forces.by_weight(name) for name in names)

    assert everything == pytest.approx(np.zeros((2, 6)), abs=1e-9)
    masses = cell.part.mass + sum(robot.tool.mass for robot in cell.robots)
    assert weights[:, :3] == pytest.approx(np.tile([0.0, 0.0, -GRAVITY * masses], (2, 1)))


def test_weights_are_unknown_where_one_of_a_robot_is_not_stated() -> None:
    arm, tool = planar(0.5), Tool(X_FT=pose((0.1, 0.0, 0.0)), bodies=())
    part = replace(held_part(Box((0.1, 0.1, 0.1)), "holder", np.eye(4)), mass=2.0)
    robots = placed("arm", arm, tool=tool), placed("holder", arm, base=pose((2.0, 0.0, 0.0)))
    cell = make_cell(*robots, part=part, tasks=[replace(work("arm"), process=process((0.0, 0.0, 5.0)))])
    q = {"arm": np.zeros((2, 1)), "holder": np.zeros((2, 1))}

    forces, chains = forces_of(cell, q)
    by_robot = {load.robot: load for load in force_report(forces, chains, q).joints}

    assert by_robot["arm"].by_weight is None
    assert by_robot["holder"].by_weight is not None
    assert by_robot["holder"].by_weight.size == pytest.approx(2.0 * GRAVITY * 0.5)


def test_a_cell_that_states_no_force_has_no_figures() -> None:
    cell = make_cell(placed("arm", planar(0.5)), tasks=[work("arm")])
    chains = {"arm": ScrewChain(cell.robots[0])}
    q = {"arm": np.zeros((2, 1))}

    forces = static_forces(cell, chains, always_on(cell), q, part_poses(cell, chains, q))
    report = force_report(forces, chains, q)

    assert forces is None
    assert report.joints == report.holders == report.grips == ()


def test_wrenches_go_to_the_part_and_back() -> None:
    cell = random_forces(1)
    forces, _ = forces_of(cell, drawn_rows(cell, 1))
    wrench = np.random.default_rng(1).normal(size=(2, 6))

    assert in_world(forces.X_WP, in_part(forces.X_WP, wrench)) == pytest.approx(wrench)
    point = np.array([[1.0, 2.0, 3.0]] * 2)
    assert at_origin(wrench[:, :3], point)[:, 3:] == pytest.approx(np.cross(point, wrench[:, :3]))


def test_the_inertia_of_a_part_that_turns_and_speeds_up_is_that_of_newton_and_euler() -> None:
    """A box that turns about its own z axis with the angle t^3 while it slides by t^3 along x."""
    cell = make_cell(placed("arm", planar(0.5)), part=held_part(Box((0.4, 0.2, 0.1)), "arm", np.eye(4)))
    part, times = replace(cell.part, mass=6.0), np.linspace(0.0, 1.0, 2001)
    X = np.tile(np.eye(4), (len(times), 1, 1))
    X[:, :3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), times**3)
    X[:, 0, 3] = times**3

    wrench = inertial_wrench(part, times, X)

    inner = slice(100, -100)
    assert wrench[inner, 0] == pytest.approx(-6.0 * 6.0 * times[inner], rel=1e-5)
    assert wrench[inner, 5] == pytest.approx(-6.0 * (0.4**2 + 0.2**2) / 12.0 * 6.0 * times[inner], rel=1e-5)
    assert np.abs(wrench[inner, 1:5]).max() < 1e-9


def test_holders_of_a_part_in_balance_share_its_weight() -> None:
    grasps = tuple(Grasp(robot=name, X_PT=pose((x, 0.0, 0.0))) for name, x in (("left", -0.5), ("right", 0.5)))
    robots = [placed(name, planar(0.5), base=pose((x, 0.0, 1.0))) for name, x in (("left", -1.0), ("right", 1.0))]
    part = replace(held_part(Box((1.2, 0.1, 0.1)), "left", np.eye(4)), held_by=grasps, mass=8.0)
    cell = make_cell(*robots, part=part)

    forces, chains = forces_of(cell, {"left": np.zeros((2, 1)), "right": np.zeros((2, 1))})
    report = force_report(forces, chains, {"left": np.zeros((2, 1)), "right": np.zeros((2, 1))})

    assert [holder.force.size for holder in report.holders] == pytest.approx([4.0 * GRAVITY] * 2)
    assert [holder.moment.size for holder in report.holders] == pytest.approx([0.0] * 2, abs=1e-9)
    assert report.length == pytest.approx(0.5)
