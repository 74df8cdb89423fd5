"""Simulated arms: energy, pendulums, closed forms of controllers, dead zone and play by hand, second opinions."""

import math

import numpy as np
import pytest
from builders.dynamic_robots import random_robot
from builders.scene_builders import joint, placed

from cellplan.errors import InputError
from cellplan.geometry.transforms import pose
from cellplan.model.robot.inertia import CarriedMass, LinkInertia
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.dynamics.arm_dynamics import ArmDynamics
from cellplan.scene.dynamics.joint_controllers import Gains, JointControllers, dead_zone
from cellplan.scene.dynamics.loads import GRAVITY
from cellplan.scene.dynamics.newton_euler import JointRows, joint_torques
from cellplan.scene.dynamics.simulated_arm import SimulatedArm, play
from cellplan.scene.kinematics.screw_chain import ScrewChain

MASS, LENGTH, INERTIA = 2.0, 0.3, 0.05  # [kg], [m] from axis to centre, [kg m^2] about the centre
ABOUT_AXIS = INERTIA + MASS * LENGTH**2


def chain(count, *, upright=False):
    """Links in a row, hanging down from horizontal axes while all joints read zero, or on a table."""
    axis, along = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]) if upright else ([0.0, 1.0, 0.0], [0.0, 0.0, -1.0])
    ends = 2 * LENGTH * np.outer(np.arange(count + 1), along)
    joints = tuple(joint(f"j{i}", i - 1, axis=np.array(axis), point=ends[i]) for i in range(count))
    masses = tuple(
        LinkInertia(link=i, mass=MASS, centre_B=ends[i] + LENGTH * np.array(along), inertia_B=INERTIA * np.eye(3))
        for i in range(count)
    )
    model = RobotModel(
        name="chain",
        source="test",
        joints=joints,
        flange_link=count - 1,
        X_BF=pose(ends[-1]),
        bodies=(),
        inertias=masses,
    )
    return placed("arm", model, base=np.eye(4))


def simulated(robot, *, step=1e-3, friction=0.0, backlash=0.0, at_links=False, **gains):
    """An arm with the same figures for all joints; without gains it moves freely from where it needs no torque."""
    n = len(robot.model.joints)
    figures = {"kp": 0.0, "ki": 0.0, "kd": 0.0, "saturation": np.inf, "dead_zone": 0.0} | gains
    period, feedforward = figures.pop("period", 1e-3), figures.pop("feedforward", "none")
    stated = {name: np.full(n, value) for name, value in figures.items()}
    controllers = JointControllers(
        gains=Gains(joints=robot.model.joint_names, period=period, feedforward=feedforward, **stated),
        dynamics=ArmDynamics(robot, [], np.zeros(n)),
        friction=np.full(n, friction),
    )
    return SimulatedArm(controllers, np.full(n, backlash), step=step, at_links=at_links, place="e.yaml: arm")


def followed(arm, commanded, duration, *, start=None):
    """Positions of the links at every row, the first one included."""
    arm.begin(commanded[0] if start is None else start)
    rows = [arm.output]
    for row in commanded[1:]:
        arm.follow(row, duration)
        rows.append(arm.output)
    return np.array(rows)


@pytest.mark.parametrize("with_follower", [False, True])
def test_accelerations_are_those_that_need_these_torques(with_follower):
    robot = random_robot(3, with_follower=with_follower)
    rng = np.random.default_rng(1)
    q, qd, qdd = rng.normal(size=(3, 5, 6))
    load = CarriedMass(mass=3.0, centre_F=np.array([0.1, 0.0, 0.2]), inertia_F=0.01 * np.eye(3))
    rotors = rng.uniform(0.1, 1.0, 6)
    needed = joint_torques(ScrewChain(robot), robot.model, JointRows(q=q, qd=qd, qdd=qdd), carried=[load]).joints
    dynamics = ArmDynamics(robot, [load], rotors)

    for k in range(5):
        torque = needed[k] + rotors * qdd[k]
        np.testing.assert_allclose(dynamics.torque(q[k], qd[k], qdd[k]), torque, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(dynamics.acceleration(q[k], qd[k], torque), qdd[k], rtol=1e-8, atol=1e-8)


def test_free_motion_conserves_energy():
    arm = simulated(chain(3))
    arm.begin(np.zeros(3))
    arm.qd = np.array([3.0, -2.0, 4.0])
    before, moved = arm.energy, 0.0

    for _ in range(200):
        arm.follow(np.zeros(3), 0.01)
        moved = max(moved, np.ptp(arm.q))

    assert moved > 1.0
    assert arm.energy == pytest.approx(before, abs=1e-6 * 0.5 * ABOUT_AXIS * 9.0)  # of the first joint's own energy


@pytest.mark.parametrize("top", [0.01, 1.5, 3.0])
def test_a_pendulum_swings_with_the_period_of_the_arithmetic_geometric_mean(top):
    natural = math.sqrt(MASS * GRAVITY * LENGTH / ABOUT_AXIS)
    arm = simulated(chain(1))
    arm.begin(np.zeros(1))
    arm.qd = np.array([2.0 * natural * math.sin(0.5 * top)])
    a, g = 1.0, math.cos(0.5 * top)
    for _ in range(20):
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    period = 2.0 * math.pi / (natural * a)

    arm.follow(np.zeros(1), period)

    assert arm.q[0] == pytest.approx(0.0, abs=1e-8 * max(1.0, top))


def test_a_controlled_joint_is_the_closed_form_of_a_sampled_double_integrator():
    kp, ki, kd, T, step = 40.0, 30.0, 4.0, 0.01, 0.2
    arm = simulated(chain(1, upright=True), kp=kp, ki=ki, kd=kd, period=T)
    rows = followed(arm, np.full((301, 1), step), T, start=np.zeros(1))

    # state (q, v, integral, last error) and reference, over one period of held torque
    signal = np.array([-kp - ki * T - kd / T, 0.0, ki, -kd / T, kp + ki * T + kd / T]) / ABOUT_AXIS
    F = np.eye(5)
    F[0] = np.array([1.0, T, 0, 0, 0]) + 0.5 * T**2 * signal
    F[1] = np.array([0, 1.0, 0, 0, 0]) + T * signal
    F[2] = [-T, 0, 1.0, 0, T]
    F[3] = [-1.0, 0, 0, 0, 1.0]
    values, vectors = np.linalg.eig(F)
    weights = np.linalg.solve(vectors, np.array([0, 0, 0, 0, step], dtype=complex))
    expected = [(vectors[0] * values**k @ weights).real for k in range(301)]
    # the reference of the first sample stands at the start of the line from 0 to the step, and is 0 there
    np.testing.assert_allclose(rows[1:, 0], expected[:300], atol=1e-10)
    assert rows[-1, 0] == pytest.approx(step, rel=0.02)


def test_a_saturated_joint_comes_to_its_speed_against_friction():
    limit, friction = 3.0, 0.5
    arm = simulated(chain(1, upright=True), kp=1e6, saturation=limit, friction=friction)
    arm.begin(np.zeros(1))
    arm.follow(np.array([1e3]), 1e-3)  # the first sample is of the start, and moves nothing
    for _ in range(1000):
        arm.follow(np.array([1e3]), 1e-3)

    rate = friction / ABOUT_AXIS
    assert arm.qd[0] == pytest.approx(limit / friction * (1.0 - math.exp(-rate * 1.0)), rel=1e-9)
    assert arm.torque[0] == limit


def test_a_dead_zone_leaves_what_it_swallows():
    np.testing.assert_allclose(dead_zone(np.array([-3.0, -0.5, 0.0, 1.0, 1.25]), np.full(5, 1.0)), [-2, 0, 0, 0, 0.25])

    arm = simulated(chain(1, upright=True), step=2e-3, kp=50.0, kd=10.0, dead_zone=1.0, friction=0.1)
    rows = followed(arm, np.full((2000, 1), 0.3), 2e-3, start=np.zeros(1))

    assert 0.3 - rows[-1, 0] == pytest.approx(1.0 / 50.0, rel=0.05)  # it creeps up to the edge of the zone


def test_play_follows_by_hand():
    drives, outputs = [0.0, 0.01, 0.03, 0.02, -0.01, -0.03, 0.0], [0.0]
    for drive in drives[1:]:
        outputs.append(float(play(np.array([outputs[-1]]), np.array([drive]), np.array([0.04]))[0]))

    np.testing.assert_allclose(outputs, [0.0, 0.0, 0.01, 0.01, 0.01, -0.01, -0.01])


@pytest.mark.parametrize("at_links", [False, True])
def test_play_stays_as_an_error_unless_positions_are_measured_behind_it(at_links):
    arm = simulated(chain(1, upright=True), step=5e-3, kp=20.0, kd=5.0, backlash=0.04, at_links=at_links, friction=2.0)
    rows = followed(arm, np.full((1200, 1), 0.3), 5e-3, start=np.zeros(1))

    assert (arm.output if at_links else arm.q)[0] == pytest.approx(0.3, abs=1e-5)
    assert 0.3 - rows[-1, 0] == pytest.approx(0.0 if at_links else 0.02, abs=1e-5)


def test_half_the_step_gives_the_same_curve():
    curves = [
        followed(
            simulated(chain(2), step=step, kp=150.0, ki=10.0, kd=15.0, dead_zone=1.0, saturation=60.0, friction=0.2),
            np.tile([0.4, -0.6], (500, 1)),
            2e-3,
            start=np.zeros(2),
        )
        for step in (2e-3, 1e-3)
    ]

    assert np.abs(curves[1] - curves[0]).max() < 0.01 * np.ptp(curves[0])


def test_with_the_whole_dynamics_fed_forward_only_the_sampling_is_left():
    errors = []
    for T in (2e-3, 1e-3):
        t = T * np.arange(round(1.0 / T) + 1)
        s = t**3 * (10 - 15 * t + 6 * t**2)
        commanded = np.outer(s, [0.8, -0.5, 0.3])
        arm = simulated(chain(3), step=T, kp=100.0, kd=5.0, period=T, friction=0.3, feedforward="dynamics")
        errors.append(np.abs(followed(arm, commanded, T) - commanded).max())

    assert errors[0] < 0.01  # [rad] of 0.8
    assert errors[1] == pytest.approx(0.5 * errors[0], rel=0.1)  # a delay of some samples


def test_an_arm_at_rest_stays_at_rest():
    arm = simulated(chain(3), kp=100.0, kd=10.0, dead_zone=0.5)
    start = np.array([1.0, 0.4, -0.3])

    rows = followed(arm, np.tile(start, (200, 1)), 1e-3)

    np.testing.assert_allclose(rows, np.tile(start, (200, 1)), atol=1e-12)


def test_a_start_that_cannot_be_held_is_refused():
    arm = simulated(chain(1), kp=100.0, saturation=2.0)

    with pytest.raises(InputError, match=r"^e.yaml: arm.saturation: expected at least 5.884 for joint 'j0', which has"):
        arm.begin(np.array([0.5 * np.pi]))


def test_a_loop_that_is_not_stable_is_refused():
    arm = simulated(chain(1, upright=True), kp=1e6, kd=2e5)

    with pytest.raises(InputError, match=r"^e.yaml: arm: joint 'j0' runs away at 0\.\d+ s: its control loop is not"):
        followed(arm, np.full((1000, 1), 0.1), 1e-3, start=np.zeros(1))
