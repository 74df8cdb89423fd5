"""Speed bounds: joints at their bounds can always stop in time, and the bounds never contradict each other."""

from dataclasses import replace

import numpy as np
import pytest
from builders.planar_arm import START, planar_arm_cell
from hypothesis import given
from hypothesis import strategies as st

from cellplan.errors import StartOutsideLimitsError
from cellplan.model.settings.solver import QuadraticProgramEntry
from cellplan.planning.methods.support.speed_bounds import JointBounds, braking_speed


def stopping_distance(v, a, dt):
    """Added up step by step."""
    distance = 0.0
    while v > 0.0:
        distance += v * dt
        v -= a * dt
    return distance


@given(margin=st.floats(1e-6, 3.0), a=st.floats(0.1, 100.0), dt=st.sampled_from([1e-3, 2e-3, 0.01, 0.05]))
def test_braking_speed_stops_exactly_at_the_limit(margin, a, dt):
    v = float(braking_speed(np.array([margin]), np.array([a]), dt)[0])
    assert stopping_distance(v, a, dt) == pytest.approx(margin, rel=1e-9)  # some thousand additions


def test_braking_speed_becomes_the_root_law_for_short_steps():
    v = braking_speed(np.array([0.5]), np.array([4.0]), 1e-6)
    assert v[0] == pytest.approx(np.sqrt(2 * 4.0 * 0.5), rel=1e-5)  # of first order in the step


def test_without_an_acceleration_limit_a_joint_may_reach_its_limit_in_one_step():
    v = braking_speed(np.array([0.5, np.inf, 0.0]), np.array([np.inf, 2.0, 3.0]), 0.01)
    np.testing.assert_array_equal(v, [50.0, np.inf, 0.0])


@given(seed=st.integers(0, 10_000), dt=st.sampled_from([1e-4, 1e-3, 0.02, 0.1]))
def test_bounds_kept_once_can_be_kept_for_ever(seed, dt):
    """Speeds drawn anywhere between the bounds, often at their ends, for 300 steps."""
    rng = np.random.default_rng(seed)
    a, top = rng.uniform(0.5, 50.0, 4), rng.uniform(0.1, 5.0, 4)
    limits = {
        f"q{i + 1}": {"acceleration": a[i], "velocity": top[i], "lower": START[i] - 0.3, "upper": START[i] + 0.2}
        for i in range(4)
    }
    joint_bounds = JointBounds(planar_arm_cell(limits=limits))
    q, speeds = START.copy(), np.zeros(4)
    for _ in range(300):
        bounds = joint_bounds.at(q, speeds, dt)
        assert np.all(bounds.lower <= bounds.upper)
        share = np.clip(rng.uniform(-1.0, 2.0, 4), 0.0, 1.0)
        new = np.clip(bounds.lower + share * (bounds.upper - bounds.lower), bounds.lower, bounds.upper)
        assert np.all(np.abs(new - speeds) <= a * dt)
        assert np.all(np.abs(new) <= top)
        q, speeds = q + new * dt, new
        assert np.all((q >= START - 0.3) & (q <= START + 0.2))


def test_a_joint_at_its_limit_may_only_leave_it():
    cell = planar_arm_cell(limits={"q2": {"upper": START[1]}})
    bounds = JointBounds(cell).at(START, np.zeros(4), 1e-3)
    assert bounds.upper[1] == 0.0
    assert bounds.lower[1] < 0.0


def test_ramp_stands_in_for_acceleration_limits_that_are_not_known():
    cell = planar_arm_cell(limits={"q1": {"acceleration": 7.0, "velocity": 2.0}, "q2": {"velocity": 3.0}})
    cell = replace(cell, solver=cell.solver.changed(quadratic_program=QuadraticProgramEntry(ramp_s=0.5)))
    bounds = JointBounds(cell).at(np.zeros(4), np.zeros(4), 1e-3)
    np.testing.assert_allclose(bounds.upper[:2], [7e-3, 6e-3], rtol=1e-6)  # room for rounding on the way to the table


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"upper": 0.5}, r"joint 'arm/q2' starts at 30 deg, outside its limits -180 \.\. 28\.6479 deg: quadratic"),
        ({"upper": float("nan")}, r"joint 'arm/q2' starts at 30 deg"),
    ],
)
def test_a_start_outside_the_limits_is_refused_by_name(change, message):
    with pytest.raises(StartOutsideLimitsError, match=message):
        JointBounds(planar_arm_cell(limits={"q2": change})).refuse_outside(START)
