"""Base reactions by the balance of momentum of all masses, which knows neither joints nor recursions."""

from dataclasses import replace

import numpy as np
import pytest
from builders.dynamic_robots import random_robot
from builders.scene_builders import make_cell, pose

from cellplan.geometry.arrays import Array
from cellplan.measures.accelerations import point_accelerations
from cellplan.measures.torques import robot_torques, standing_reactions
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.base_reaction import BaseReaction, PeakLoad, largest_reactions
from cellplan.scene.kinematics.screw_chain import ScrewChain

G = np.array([0.0, 0.0, -9.80665])
STEP = 1e-3
TIMES = STEP * np.arange(401)


def swing(robot: Robot) -> Array:
    """All joints from rest to rest, each in its way, shape (401, n)."""
    count, u = len(robot.model.joints), TIMES / TIMES[-1]
    ease = u**3 * (10.0 - u * (15.0 - 6.0 * u))
    return np.sin(np.outer(ease, np.linspace(0.5, 1.5, count)))


def momentum(robot: Robot, q: Array) -> tuple[Array, Array]:
    """Momentum and angular momentum about the origin of the base, without the tool, at the middles of steps."""
    D = ScrewChain(robot).link_displacements(q)
    linear, turning = np.zeros((2, len(q) - 1, 3))
    for mass in robot.model.inertias or ():
        R = D[:, mass.link + 1, :3, :3]
        c = R @ mass.centre_B + D[:, mass.link + 1, :3, 3] - robot.X_WB[:3, 3]
        speed, middle = np.diff(c, axis=0) / STEP, 0.5 * (c[1:] + c[:-1])
        spin = np.diff(R, axis=0) @ (0.5 * (R[1:] + R[:-1])).transpose(0, 2, 1) / STEP
        omega = 0.5 * np.stack(
            [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]], axis=1
        )
        inertia = 0.5 * (
            R[1:] @ mass.inertia_B @ R[1:].transpose(0, 2, 1) + R[:-1] @ mass.inertia_B @ R[:-1].transpose(0, 2, 1)
        )
        linear += mass.mass * speed
        turning += np.cross(middle, mass.mass * speed) + (inertia @ omega[..., None])[..., 0]
    return linear, turning


def reaction_of(robot: Robot, q: Array, acting: Array | None = None) -> BaseReaction:
    reaction = robot_torques(make_cell(robot), robot, TIMES, q, point_accelerations(TIMES, q), acting).reaction
    assert reaction is not None
    return reaction


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_base_gives_what_momentum_gains_and_gravity_takes(seed: int) -> None:
    robot = random_robot(seed, with_follower=True)
    q = swing(robot)
    linear, turning = momentum(robot, q)
    D = ScrewChain(robot).link_displacements(q)
    masses = robot.model.inertias or ()
    pull = sum(
        (
            np.cross(
                D[:, it.link + 1, :3, :3] @ it.centre_B + D[:, it.link + 1, :3, 3] - robot.X_WB[:3, 3], it.mass * G
            )
            for it in masses
        ),
        np.zeros((len(q), 3)),
    )
    weight = sum(it.mass for it in masses) * G
    force, moment = np.diff(linear, axis=0) / STEP - weight, np.diff(turning, axis=0) / STEP - pull[1:-1]

    reaction = reaction_of(robot, q)

    assert reaction.weight == pytest.approx(-weight[2])
    assert reaction.vertical.size == pytest.approx(np.abs(force[:, 2]).max(), rel=1e-3)
    assert reaction.horizontal.size == pytest.approx(np.linalg.norm(force[:, :2], axis=1).max(), rel=1e-3)
    assert reaction.tilting.size == pytest.approx(np.linalg.norm(moment[:, :2], axis=1).max(), rel=1e-3)
    assert reaction.turning.size == pytest.approx(np.abs(moment[:, 2]).max(), rel=1e-3)
    assert reaction.tilting_at_rest.size == pytest.approx(np.linalg.norm(pull[:, :2], axis=1).max(), rel=1e-6)
    assert abs(reaction.vertical.at_s - TIMES[1 + np.abs(force[:, 2]).argmax()]) <= 2.0 * STEP


def test_at_rest_the_base_holds_the_weight_with_the_tool_and_nothing_else() -> None:
    robot = random_robot(4)
    tool = Tool(X_FT=np.eye(4), bodies=(), mass=3.0)
    bare, loaded = (replace(robot, tool=it) for it in (robot.tool, tool))
    q = {robot.name: np.zeros(len(robot.model.joints))}
    (light,), (heavy,) = (standing_reactions(make_cell(it), q) for it in (bare, loaded))
    assert heavy.weight - light.weight == pytest.approx(3.0 * 9.80665)
    assert heavy.vertical.size == pytest.approx(heavy.weight)
    assert heavy.horizontal.size == pytest.approx(0.0, abs=1e-9)
    assert heavy.turning.size == pytest.approx(0.0, abs=1e-9)
    assert heavy.tilting == heavy.tilting_at_rest


def test_without_a_mass_of_the_tool_or_of_links_nothing_is_said() -> None:
    robot = random_robot(5)
    unknown = replace(robot, tool=Tool(X_FT=pose((0.0, 0.0, 0.1)), bodies=(), mass=None))
    weightless = replace(robot, model=replace(robot.model, inertias=None))
    for silent in (weightless, unknown):
        q = {robot.name: np.zeros(len(robot.model.joints))}
        assert not list(standing_reactions(make_cell(silent), q))


def test_of_several_phases_the_largest_values_stay_with_their_times() -> None:
    def reaction(robot: str, size: float, at_s: float) -> BaseReaction:
        peak = PeakLoad(size, at_s)
        return BaseReaction(
            robot=robot, weight=1.0, vertical=peak, horizontal=peak, tilting=peak, turning=peak, tilting_at_rest=peak
        )

    largest = largest_reactions([reaction("a", 3.0, 0.5), reaction("b", 9.0, 0.1), reaction("a", 4.0, 0.2)])
    assert largest["a"].horizontal == (4.0, 0.2)
    assert largest["b"].turning == (9.0, 0.1)


def test_what_a_process_exerts_goes_through_the_base_to_the_floor() -> None:
    """At rest the floor holds against it: the opposite force, and its moment about the origin of the base."""
    robot = random_robot(4)
    q = np.tile(swing(robot)[:1], (len(TIMES), 1))
    force, moment = np.array([300.0, -200.0, 500.0]), np.array([10.0, 20.0, 30.0])  # about the world origin

    idle, pressed = reaction_of(robot, q), reaction_of(robot, q, np.tile([*force, *moment], (len(TIMES), 1)))

    assert pressed.vertical.size == pytest.approx(abs(idle.weight - force[2]))
    assert pressed.horizontal.size == pytest.approx(np.hypot(*force[:2]))
    about_base = moment - np.cross(robot.X_WB[:3, 3], force)
    assert pressed.turning.size == pytest.approx(abs(about_base[2]))
    assert pressed.tilting_at_rest.size == pytest.approx(idle.tilting.size)
