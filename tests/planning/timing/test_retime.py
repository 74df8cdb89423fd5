"""Retiming of joint paths, against closed forms, against another program for it, and by what it must leave alone."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.geometry.transforms import Array
from cellplan.model.motion.joint_path import JointPath
from cellplan.planning.timing.path_length import stretches
from cellplan.planning.timing.retime import JointLimitsInTime, RetimedPath, Retimer

JOINTS, WAVES, DEGREE = 24, 5, 8


def rest_to_rest(tau: Array) -> Array:
    return tau**3 * (10.0 - tau * (15.0 - 6.0 * tau))


def straight(tau: Array) -> Array:
    return tau


def path_of(
    q: Callable[[Array], Array], *, law: Callable[[Array], Array] = rest_to_rest, pieces: int = 30
) -> JointPath:
    """The path q(u), u from 0 to 1, gone along in 3 s by a law."""
    breaks = np.linspace(0.0, 3.0, pieces + 1)
    at = [begin + (end - begin) * chebyshev(DEGREE).nodes for begin, end in pairwise(breaks)]
    nodes = [q(law(times / 3.0)).T for times in at]
    return JointPath(nodes[0][:, 0], breaks, nodes)


def shares(bounds: JointLimitsInTime, q: Array, step: float) -> tuple[float, float, float]:
    """Largest velocity, acceleration and jerk in rows, with rest before and after them, in shares of the limits."""
    velocity = np.diff(q, axis=0) / step
    rest = np.zeros((1, q.shape[1]))
    acceleration = np.diff(np.concatenate([rest, velocity, rest]), axis=0) / step
    jerk = np.diff(np.concatenate([rest, acceleration, rest]), axis=0) / step
    return (
        float((np.abs(velocity) / bounds.velocity).max()),
        float((np.abs(acceleration) / bounds.acceleration).max()),
        float((np.abs(jerk) / bounds.jerk).max()),
    )


def retimed(path: JointPath, bounds: JointLimitsInTime, *, step: float, feed_share: float = 0.0) -> RetimedPath:
    def slower(sigma: Array, q: Array) -> float:
        velocity, acceleration, jerk = shares(bounds, q, step)
        feed = feed_share * float(np.diff(sigma).max()) / step
        return max(velocity, acceleration**0.5, jerk ** (1 / 3), feed)

    retimed_motion = Retimer(
        bounds=bounds, step=step, feed_share=lambda sigma: np.full(len(sigma), feed_share), slower=slower
    ).fastest(path)
    assert slower(retimed_motion.sigma, path.at(retimed_motion.sigma)) <= 1.0
    return retimed_motion


def bounds_of(velocity: float, acceleration: float, jerk: float = np.inf, joints: int = 1) -> JointLimitsInTime:
    return JointLimitsInTime(
        velocity=np.full(joints, velocity), acceleration=np.full(joints, acceleration), jerk=np.full(joints, jerk)
    )


def line(u: Array) -> Array:
    return 2.0 * u[:, None]


@pytest.mark.parametrize(
    ("velocity", "acceleration", "seconds"),
    [(1.0, 2.0, 2.5), (10.0, 2.0, 2.0), (2.0, 1e6, 1.01)],
    ids=["trapezoid", "bang-bang", "velocity alone"],
)
def test_a_joint_on_a_straight_line_takes_the_time_of_the_closed_form(
    velocity: float, acceleration: float, seconds: float
) -> None:
    motion = retimed(path_of(line), bounds_of(velocity, acceleration), step=0.01)
    assert 0.0 <= 0.01 * motion.steps - seconds <= 0.011


@pytest.mark.parametrize("law", [rest_to_rest, straight])
def test_the_nominal_law_of_the_path_does_not_matter(law: Callable[[Array], Array]) -> None:
    assert retimed(path_of(line, law=law), bounds_of(1.0, 2.0), step=0.01).steps in {250, 251}


def test_a_feed_bounds_the_speed_of_the_nominal_time() -> None:
    motion = retimed(path_of(line, law=straight), bounds_of(1e3, 1e4), step=0.01, feed_share=1.5)
    assert 4.5 <= 0.01 * motion.steps <= 4.53  # 3 s of nominal time at 2/3 of its speed, and the ramps


def test_a_limit_of_jerk_costs_the_time_of_one_window() -> None:
    """From rest to rest without a limit of speed: an acceleration that changes evenly, four times the same change."""
    least = (32.0 * 2.0 / 40.0) ** (1 / 3)
    motion = retimed(path_of(line), bounds_of(1e3, 100.0, jerk=40.0), step=0.01)
    assert least <= 0.01 * motion.steps
    limited = retimed(path_of(line), bounds_of(1.0, 2.0, jerk=40.0), step=0.01)
    assert 0.01 * limited.steps == pytest.approx(2.5 + 2.0 / 40.0, rel=0.03)


def test_every_rest_of_all_joints_is_a_row_and_a_corner_becomes_one() -> None:
    corner = path_of(lambda u: np.stack([np.minimum(u, 0.5), np.maximum(u, 0.5)], axis=1), law=straight)
    both = bounds_of(1.0, 2.0, joints=2)
    motion = retimed(corner, both, step=0.01)
    assert len(motion.motions) == 2
    assert np.abs(motion.sigma - 1.5).min() < 1e-12
    assert 200 <= motion.steps <= 202  # 0.5 rad from rest to rest twice: one second each


def test_while_no_joint_moves_no_time_passes() -> None:
    nodes = [np.array([[0.0, 0.0]]), np.array([[0.0, 1.0]]), np.array([[1.0, 1.0]])]
    waits = JointPath(np.zeros(1), np.array([0.0, 1.0, 2.0, 3.0]), nodes)
    assert retimed(waits, bounds_of(1.0, 1.0), step=0.01).steps in {200, 201}
    rests = JointPath(np.zeros(1), np.array([0.0, 1.0]), nodes[:1])
    assert retimed(rests, bounds_of(1.0, 1.0), step=0.01).sigma.tolist() == [0.0, 1.0]


def test_a_stretch_shorter_than_a_row_is_gone_through_too() -> None:
    """A corner 4 ms before the end, and rows 10 ms apart."""
    breaks = np.array([0.0, 2.996, 3.0])
    nodes = [np.array([[0.0, 0.7], [0.0, 0.0]]), np.array([[0.7, 0.7], [0.0, 1e-3]])]
    motion = retimed(JointPath(np.zeros(2), breaks, nodes), bounds_of(1.0, 2.0, joints=2), step=0.01)
    assert len(motion.motions) == 2
    assert motion.counts[1] == pytest.approx(2.0 * (1e-3 / 2.0) ** 0.5 / 0.01, abs=1.0)


def test_a_slower_motion_takes_exactly_the_steps_that_it_is_given() -> None:
    corner = path_of(lambda u: np.stack([np.minimum(u, 0.5), np.maximum(u, 0.5)], axis=1), law=straight)
    motion = retimed(corner, bounds_of(1.0, 2.0, joints=2), step=0.01)
    for steps in (202, 203, 333):
        slower = motion.lasting(steps)
        assert (slower.steps, len(slower.sigma)) == (steps, steps + 1)
        assert np.all(np.diff(slower.sigma) > 0.0)


def wave(seed: int) -> tuple[Callable[[Array], Array], JointLimitsInTime]:
    rng = np.random.default_rng(seed)
    number = np.arange(1, WAVES + 1)
    size, phase = rng.normal(size=(JOINTS, WAVES)) * 0.5 / number, rng.uniform(0, 2 * np.pi, (JOINTS, WAVES))
    bounds = JointLimitsInTime(
        velocity=rng.uniform(1.5, 5.0, JOINTS),
        acceleration=rng.uniform(6.0, 25.0, JOINTS),
        jerk=np.full(JOINTS, np.inf),
    )
    return lambda u: (size * np.sin(np.pi * number * u[:, None, None] + phase)).sum(-1), bounds


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 10))])
def test_durations_agree_with_toppra_when_both_keep_the_limits(seed: int) -> None:
    algorithm = pytest.importorskip("toppra.algorithm")
    import toppra
    from toppra import constraint

    q, bounds = wave(seed)
    step = 0.02
    ours = retimed(path_of(q), bounds, step=step)
    limits = [np.stack([-entry, entry], axis=1) for entry in (bounds.velocity, bounds.acceleration)]
    u = np.linspace(0.0, 1.0, 201)
    theirs = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(limits[0]),
            constraint.JointAccelerationConstraint(
                limits[1], discretization_scheme=constraint.DiscretizationType.Interpolation
            ),
        ],
        toppra.SplineInterpolator(u, q(u)),
        gridpoints=np.linspace(0.0, 1.0, 401),
        solver_wrapper="seidel",
        parametrizer="ParametrizeConstAccel",
    ).compute_trajectory(0, 0)
    count = int(np.ceil(theirs.duration / step))
    while max(shares(bounds, theirs(np.linspace(0.0, theirs.duration, count + 1)), step)[:2]) > 1.0:
        count += 1
    assert ours.steps == pytest.approx(count, rel=0.01)


def test_the_joints_of_different_kinds_are_added_in_shares_of_their_speeds() -> None:
    result = stretches(path_of(lambda u: np.stack([0.3 * u, 4.0 * u], axis=1)), np.array([0.1, 2.0]))
    assert len(result) == 1
    assert result[0].length == pytest.approx(np.hypot(3.0, 2.0), rel=1e-12)
    lengths = np.linspace(0.0, result[0].length, 7)
    joints = result[0].path.at(result[0].at(lengths))
    assert joints == pytest.approx(np.outer(np.linspace(0.0, 1.0, 7), [0.3, 4.0]), abs=1e-11)
