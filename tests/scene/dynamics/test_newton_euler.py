"""Torques against other engines, the energy of the motion, the momentum of the whole, and closed forms."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from builders.dynamic_robots import GRAVITY, mujoco_xml, pinocchio_model, random_robot
from builders.scene_builders import joint, placed

from cellplan.files.robots.joint_table import bundled_names, load_bundled
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.inertia import CarriedMass, LinkInertia
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.dynamics.newton_euler import JointRows, JointTorques, joint_torques
from cellplan.scene.kinematics.screw_chain import ScrewChain

ARMS = [placed("a", load_bundled(name)) for name in bundled_names() if load_bundled(name).inertias is not None]
ROBOTS = [random_robot(seed) for seed in range(3)] + [
    replace(arm, X_WB=pose((0.3, -0.2, 0.5), (0.4, 0.8, -1.1))) for arm in ARMS
]
STEP = 1e-4  # [s] of difference quotients of smooth motions, whose second order is 1e-8


def random_rows(robot: Robot, count: int = 20) -> JointRows:
    rng = np.random.default_rng(5)
    n = len(robot.model.joints)
    return JointRows(q=rng.normal(size=(count, n)), qd=rng.normal(size=(count, n)), qdd=rng.normal(size=(count, n)))


def torques_of(robot: Robot, rows: JointRows, carried: tuple[CarriedMass, ...] = ()) -> JointTorques:
    return joint_torques(ScrewChain(robot), robot.model, rows, carried=carried)


@pytest.mark.parametrize("robot", ROBOTS)
def test_torques_are_those_of_pinocchio(robot: Robot) -> None:
    rows, engine = random_rows(robot), pinocchio_model(robot)
    data = engine.createData()
    expected = [pin.rnea(engine, data, *row) for row in zip(rows.q, rows.qd, rows.qdd, strict=True)]
    np.testing.assert_allclose(torques_of(robot, rows).joints, expected, rtol=1e-10, atol=1e-10)  # rounding


@pytest.mark.parametrize("robot", ROBOTS)
def test_torques_are_those_of_mujoco(robot: Robot) -> None:
    mujoco = pytest.importorskip("mujoco")
    rows, model = random_rows(robot), mujoco.MjModel.from_xml_string(mujoco_xml(robot))
    data = mujoco.MjData(model)
    expected = []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(rows.q, rows.qd, rows.qdd, strict=True):
        mujoco.mj_inverse(model, data)
        expected.append(data.qfrc_inverse.copy())
    np.testing.assert_allclose(torques_of(robot, rows).joints, expected, rtol=1e-6, atol=1e-6)  # it rounds inertias


def smooth_motion(robot: Robot, times: Array) -> JointRows:
    """Sines of several periods, with their derivatives."""
    n = len(robot.model.joints)
    w, phase = np.linspace(1.0, 2.3, n), np.linspace(0.0, 3.0, n)
    turn = times[:, None] * w + phase
    return JointRows(q=0.8 * np.sin(turn), qd=0.8 * w * np.cos(turn), qdd=-0.8 * w * w * np.sin(turn))


def link_centres(robot: Robot, q: Array) -> list[tuple[LinkInertia, Array, Array]]:
    """Each mass, its rotation and its centre in the world."""
    D = ScrewChain(robot).link_displacements(q)
    links = [(mass, D[:, mass.link + 1]) for mass in robot.model.inertias or ()]
    return [(mass, X[:, :3, :3], X[:, :3, :3] @ mass.centre_B + X[:, :3, 3]) for mass, X in links]


def energy(robot: Robot, times: Array) -> Array:
    """Kinetic and potential energy, by difference quotients of the poses of the masses."""
    before, now, after = (link_centres(robot, smooth_motion(robot, times + s).q) for s in (-STEP, 0.0, STEP))
    total = np.zeros(len(times))
    for (mass, R0, c0), (_, R, c), (_, R1, c1) in zip(before, now, after, strict=True):
        S = (R1 - R0) / (2 * STEP) @ R.transpose(0, 2, 1)
        turn = np.stack([S[:, 2, 1], S[:, 0, 2], S[:, 1, 0]], axis=1)
        inertia = R @ mass.inertia_B @ R.transpose(0, 2, 1)
        speed = (c1 - c0) / (2 * STEP)
        total += 0.5 * mass.mass * np.sum(speed**2, axis=1) + mass.mass * GRAVITY * c[:, 2]
        total += 0.5 * np.einsum("ni,nij,nj->n", turn, inertia, turn)
    return total


@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_the_power_of_the_drives_is_the_rate_of_the_energy(with_follower: bool) -> None:
    robot, times = random_robot(7, with_follower=with_follower), np.linspace(0.0, 3.0, 40)
    rows = smooth_motion(robot, times)
    power = np.sum(torques_of(robot, rows).joints * rows.qd, axis=1)
    rate = (energy(robot, times + STEP) - energy(robot, times - STEP)) / (2 * STEP)
    np.testing.assert_allclose(power, rate, atol=1e-5 * np.abs(power).max())  # of the difference quotients


def test_the_floor_changes_the_momentum_of_the_whole() -> None:
    robot, times = random_robot(3, with_follower=True), np.linspace(0.0, 3.0, 40)
    reaction = torques_of(robot, smooth_motion(robot, times)).base_W
    at = [link_centres(robot, smooth_motion(robot, times + s).q) for s in (-STEP, 0.0, STEP)]
    force, moment, base = np.zeros((40, 3)), np.zeros((40, 3)), robot.X_WB[:3, 3]
    for (mass, R0, c0), (_, R, c), (_, R1, c1) in zip(*at, strict=True):
        pull = mass.mass * ((c1 - 2 * c + c0) / STEP**2 + np.array([0.0, 0.0, GRAVITY]))
        force += pull
        second = 0.5 * np.trace(mass.inertia_B) * np.eye(3) - mass.inertia_B  # of the mass about its centre
        spread = R @ second @ ((R1 - 2 * R + R0) / STEP**2).transpose(0, 2, 1)  # of points with their accelerations
        moment += np.cross(c - base, pull)
        moment += np.stack([spread[:, i, j] - spread[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    np.testing.assert_allclose(reaction[:, :3], force, atol=1e-4 * np.abs(force).max())
    np.testing.assert_allclose(reaction[:, 3:], moment, atol=1e-4 * np.abs(moment).max())


def pendulum(*, mass: float, length: float) -> Robot:
    """A ball on a rod without mass that turns about y and hangs down while it reads zero."""
    ball = LinkInertia(link=0, mass=mass, centre_B=np.array([0.0, 0.0, -length]), inertia_B=np.zeros((3, 3)))
    joints = (joint("a", -1, axis=(0.0, 1.0, 0.0)),)
    model = RobotModel(
        name="p", source="test", joints=joints, flange_link=0, X_BF=np.eye(4), bodies=(), inertias=(ball,)
    )
    return placed("a", model)


def test_a_pendulum_that_falls_freely_takes_no_torque() -> None:
    q = np.linspace(-3.0, 3.0, 25)[:, None]
    falling = JointRows(q=q, qd=np.full_like(q, 1.7), qdd=-GRAVITY / 0.8 * np.sin(q))
    np.testing.assert_allclose(torques_of(pendulum(mass=3.0, length=0.8), falling).joints, 0.0, atol=1e-12)


def test_a_held_pendulum_takes_its_weight_and_its_rod_the_turning() -> None:
    rows = JointRows(q=np.array([[np.pi / 2], [0.0]]), qd=np.array([[0.0], [2.0]]), qdd=np.zeros((2, 1)))
    torques = torques_of(pendulum(mass=3.0, length=0.8), rows)
    np.testing.assert_allclose(np.abs(torques.joints[:, 0]), [3.0 * GRAVITY * 0.8, 0.0], atol=1e-12)
    np.testing.assert_allclose(torques.base_W[:, 2], [3.0 * GRAVITY, 3.0 * (GRAVITY + 0.8 * 4.0)], atol=1e-12)


def test_a_load_on_the_flange_is_a_mass_of_its_link() -> None:
    robot, rng = random_robot(4), np.random.default_rng(1)
    load = CarriedMass(mass=2.5, centre_F=rng.normal(size=3), inertia_F=np.diag([0.1, 0.2, 0.25]))
    on_link = load.on_link(robot.model.flange_link, robot.model.X_BF)
    heavier = replace(robot, model=replace(robot.model, inertias=(*(robot.model.inertias or ()), on_link)))
    rows = random_rows(robot)
    np.testing.assert_allclose(torques_of(robot, rows, (load,)).joints, torques_of(heavier, rows).joints)


def test_a_push_from_outside_is_held_by_virtual_power() -> None:
    robot, rows = random_robot(4), random_rows(random_robot(4))
    wrench = np.random.default_rng(2).normal(size=(len(rows.q), 6))
    chain = ScrewChain(robot)
    pushed = joint_torques(chain, robot.model, rows, wrench_W=wrench)
    free = joint_torques(chain, robot.model, rows)
    power = np.einsum("nkj,nk->nj", chain.flange_screws(rows.q), wrench)
    np.testing.assert_allclose(pushed.joints - free.joints, -power, atol=1e-12)


@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_torques_are_those_of_the_principle_of_d_alembert(with_follower: bool) -> None:
    """The forces that accelerate each mass do the work of the drives when one joint is displaced a little."""
    robot, times = random_robot(11, with_follower=with_follower), np.linspace(0.0, 3.0, 12)
    rows, count = smooth_motion(robot, times), len(robot.model.joints)
    before, now, after = (link_centres(robot, smooth_motion(robot, times + s).q) for s in (-STEP, 0.0, STEP))
    expected = np.zeros((len(times), count))
    for joint_number in range(count):
        moves = [link_centres(robot, rows.q + side * STEP * np.eye(count)[joint_number]) for side in (-1.0, 1.0)]
        for place, (mass, R, c) in enumerate(now):
            (_, R0, c0), (_, R1, c1), (_, Rd, cd), (_, Ru, cu) = (
                before[place],
                after[place],
                moves[0][place],
                moves[1][place],
            )
            force = mass.mass * ((c1 - 2.0 * c + c0) / STEP**2 + np.array([0.0, 0.0, GRAVITY]))
            expected[:, joint_number] += np.sum(force * (cu - cd), axis=1) / (2.0 * STEP)
            second = 0.5 * np.trace(mass.inertia_B) * np.eye(3) - mass.inertia_B  # of the mass about its centre
            pull = (R1 - 2.0 * R + R0) / STEP**2 @ second  # of all its points, and their places with them
            expected[:, joint_number] += np.einsum("nij,nij->n", pull, (Ru - Rd) / (2.0 * STEP))
    np.testing.assert_allclose(torques_of(robot, rows).joints, expected, atol=1e-5 * np.abs(expected).max())
