"""Motions within limits of torque, against closed forms of arms with one joint and by the energy of a pendulum."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.planning.timing.retime import JointLimitsInTime, RetimedPath, Retimer
from cellplan.planning.timing.torque_limits import TorqueLimits
from cellplan.scene.dynamics.newton_euler import JointRows
from tests.planning.timing.test_retime import bounds_of, path_of

MASS, G = 3.0, 9.81  # [kg], [m/s^2]
Equations = Callable[[Array, Array, Array], Array]  # positions, speeds and accelerations -> torques


def lift(q: Array, qd: Array, qdd: Array) -> Array:
    """A mass that is lifted."""
    return MASS * (qdd + G)


def pendulum(q: Array, qd: Array, qdd: Array) -> Array:
    """A point mass on a rod of 1 m; q from the horizontal."""
    return MASS * (qdd + G * np.cos(q))


def flat_elbow(q: Array, qd: Array, qdd: Array) -> Array:
    """Two rods of 1 m on a table, each with a mass of 1 kg at its end, by Lagrange's equations."""
    c, s = np.cos(q[:, 1]), np.sin(q[:, 1])
    first = (3.0 + 2.0 * c) * qdd[:, 0] + (1.0 + c) * qdd[:, 1] - s * (2.0 * qd[:, 0] + qd[:, 1]) * qd[:, 1]
    second = (1.0 + c) * qdd[:, 0] + qdd[:, 1] + s * qd[:, 0] ** 2
    return np.stack([first, second], axis=1)


def limits_of(torques: Equations, *largest: float) -> TorqueLimits:
    """The limits of an arm by its equations of motion; a wrench pushes its joints by its first components."""

    def pushed(rows: JointRows, wrench: Array | None) -> Array:
        push = 0.0 if wrench is None else wrench[:, : len(largest)]
        return torques(rows.q, rows.qd, rows.qdd) - push

    return TorqueLimits(columns=slice(0, len(largest)), torques=pushed, largest=np.array(largest), cycle=1.0)


def retimed(
    limits: TorqueLimits, q: Callable[[Array], Array], *, step: float, bounds: JointLimitsInTime
) -> tuple[RetimedPath, Array]:
    """The fastest motion and its rows; torques count in these too."""
    path = path_of(q)

    def slower(sigma: Array, q: Array) -> float:
        return float(limits.in_rows(np.arange(len(q)) * step, q, sigma=sigma)[1].max())

    motion = Retimer(
        bounds=replace(bounds, torques=(limits,)), step=step, feed_share=lambda at: np.zeros(len(at)), slower=slower
    ).fastest(path)
    rows = path.at(motion.sigma)
    assert slower(motion.sigma, rows) <= 1.0
    return motion, rows


def along(first: float, last: float) -> Callable[[Array], Array]:
    return lambda u: first + (last - first) * u[:, None]


def test_a_mass_without_gravity_takes_the_time_of_a_double_integrator() -> None:
    limits = limits_of(lambda q, qd, qdd: MASS * qdd, 6.0)
    motion, _ = retimed(limits, along(0.0, 2.0), step=0.002, bounds=bounds_of(100.0, np.inf))
    assert 0.002 * motion.steps == pytest.approx(2.0 * np.sqrt(2.0 * MASS / 6.0), abs=0.004)


@pytest.mark.parametrize("course", [along(0.0, 1.0), along(1.0, 0.0)], ids=["up", "down"])
def test_a_lifted_mass_is_pushed_with_what_gravity_leaves(course: Callable[[Array], Array]) -> None:
    force = 45.0
    motion, _ = retimed(limits_of(lift, force), course, step=0.002, bounds=bounds_of(100.0, np.inf))
    up, down = force / MASS - G, force / MASS + G
    assert 0.002 * motion.steps == pytest.approx(np.sqrt(2.0 * (1.0 / up + 1.0 / down)), abs=0.004)


def test_a_pendulum_gains_and_loses_its_energy_by_the_full_torque() -> None:
    first, last, torque = -0.9, 1.4, 40.0
    motion, _ = retimed(limits_of(pendulum, torque), along(first, last), step=0.002, bounds=bounds_of(100.0, np.inf))
    q = np.linspace(first, last, 200_001)
    gained = torque * (q - first) - MASS * G * (np.sin(q) - np.sin(first))
    lost = torque * (last - q) + MASS * G * (np.sin(last) - np.sin(q))
    speed = np.sqrt(2.0 * np.minimum(gained, lost) / MASS)
    middle = 0.5 * (speed[1:] + speed[:-1])
    seconds = float((np.diff(q) / middle).sum())
    assert 0.002 * motion.steps == pytest.approx(seconds, rel=0.005)


def test_torques_of_an_elbow_are_those_of_lagrange_along_any_speed() -> None:
    limits, rng = limits_of(flat_elbow, 20.0, 8.0), np.random.default_rng(5)
    q, first, second = rng.normal(size=(3, 50, 2))
    u, x = rng.normal(size=(50, 1)), rng.uniform(size=(50, 1))
    loads = limits.along(q, first, second, sigma=np.zeros(50))
    torques = flat_elbow(q, first * np.sqrt(x), first * u + second * x)
    np.testing.assert_allclose(loads.along * u + loads.bent * x, torques / [20.0, 8.0], atol=1e-13)


def test_a_limit_of_torque_binds_somewhere_and_holds_in_every_row() -> None:
    limits, step = limits_of(flat_elbow, 20.0, 8.0), 0.002
    wave = lambda u: np.stack([1.5 * u, 2.0 * np.sin(2.0 * np.pi * u)], axis=1)  # noqa: E731
    _, rows = retimed(limits, wave, step=step, bounds=bounds_of(100.0, np.inf, joints=2))
    padded = np.concatenate([rows[:1], rows, rows[-1:]])
    torques = flat_elbow(rows, (padded[2:] - padded[:-2]) / (2.0 * step), np.diff(padded, 2, axis=0) / step**2)
    share = (np.abs(torques) / [20.0, 8.0]).max(axis=1)
    assert share.max() <= 1.0
    assert np.median(share) > 0.9  # the fastest motion is at a limit nearly everywhere


def test_a_push_of_a_process_leaves_less_or_more_of_the_limit_as_gravity_does() -> None:
    """Pushed up by 10 N, a mass is lifted as if the limit were as much larger upwards and smaller downwards."""
    pushed = replace(limits_of(lift, 45.0), wrench=lambda sigma, q: np.tile(10.0 * np.eye(6)[0], (len(q), 1)))
    motion, _ = retimed(pushed, along(0.0, 1.0), step=0.002, bounds=bounds_of(100.0, np.inf))
    up, down = 55.0 / MASS - G, 35.0 / MASS + G
    assert 0.002 * motion.steps == pytest.approx(np.sqrt(2.0 * (1.0 / up + 1.0 / down)), abs=0.004)


def test_a_limit_of_torque_that_never_binds_changes_nothing() -> None:
    bounds = bounds_of(1.0, 2.0)
    free = Retimer(bounds=bounds, step=0.01, feed_share=lambda at: np.zeros(len(at)), slower=lambda at, q: 1.0)
    plenty = replace(free, bounds=replace(bounds, torques=(limits_of(pendulum, 1e9),)))
    path = path_of(along(0.0, 2.0))
    np.testing.assert_array_equal(plenty.fastest(path).sigma, free.fastest(path).sigma)


def test_in_slow_motion_gravity_stays_and_the_motion_takes_up_less() -> None:
    limits = limits_of(lift, 45.0)
    q, u = np.zeros((1, 1)), np.ones((1, 1))
    full, half = (it.along(q, u, 0.0 * u, sigma=np.zeros(1)) for it in (limits, limits.in_slow_motion(0.5)))
    np.testing.assert_allclose(half.top, 0.25 * full.top)
    np.testing.assert_allclose(full.top * 45.0, 45.0 - MASS * G)
    np.testing.assert_allclose(full.bottom * 45.0, 45.0 + MASS * G)


def test_where_a_joint_cannot_hold_its_load_at_rest_only_pushes_back_ask_for_time() -> None:
    """The limit is 1 N below the weight; the joint without a limit asks for nothing."""
    limits, step = limits_of(lift, MASS * G - 1.0, np.inf), 0.01
    rows = np.array([0.0, 0.0, -10.0, -20.0, -20.0])[:, None] * step**2  # 10 m/s^2 downwards, then as much upwards
    shares, factors = limits.in_rows(step * np.arange(5), np.tile(rows, (1, 2)))
    np.testing.assert_allclose(shares, [MASS * (G + 10.0) / (MASS * G - 1.0), 0.0])
    np.testing.assert_allclose(factors, [np.sqrt(10.0 * MASS / (2.0 * MASS * G - 1.0)), 0.0])


def test_limits_follow_their_joints_into_a_part_of_the_configurations() -> None:
    bounds = bounds_of(1.0, np.inf, joints=4)
    torques = tuple(replace(limits_of(flat_elbow, 1.0, 1.0), columns=columns) for columns in (slice(0, 2), slice(2, 4)))
    (only,) = replace(bounds, torques=torques).of(slice(2, 4)).torques
    assert only.columns == slice(0, 2)
