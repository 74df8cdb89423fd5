"""Retimed motions of sequential programs by closed forms, the product's own retimer and toppra."""

from dataclasses import replace

import numpy as np
import pytest
from builders.toy_problem import LAW, LAW_D, LAW_DD, TIMES, Toy

from cellplan.geometry.arrays import Array
from cellplan.planning.timing.speed_profile import fastest_profile
from cellplan.search.programs.explain import explain
from cellplan.search.programs.improve import improve
from cellplan.search.programs.measures import MeasureKind, Measures
from cellplan.search.programs.objective import CycleTiming, Demands, Effort, Objective, Reserve
from cellplan.search.programs.pace import Pace
from cellplan.search.programs.problem import Point
from cellplan.search.programs.rows import Linear

EXACT = Effort(iterations=60, within=20.0, least_gain=1e-7, reserve=Reserve(margin=0.0, distance=0.0, time=0.0))
NONE = np.zeros(2)
DEMANDS = Demands(objective=Objective.CYCLE, margin=NONE, timing=CycleTiming.RETIMED)
STEP = 1e-6


def at(toy: Toy, x0: float) -> Point:
    point = toy.evaluate(np.array([x0, 4.5]), NONE)
    assert point is not None
    return point


def bent(toy: Toy, amount: float) -> Point:
    """A path that is an arc of an ellipse, passed by the law of the toy."""
    u, du, ddu = (amount * law / TIMES[-1] for law in (LAW, LAW_D, LAW_DD))
    q = np.stack([np.sin(u), 0.4 * np.cos(u)], axis=1)
    qd = np.stack([np.cos(u), -0.4 * np.sin(u)], axis=1)
    qdd = qd * ddu[:, None] - q * (du**2)[:, None]
    return Point(x=toy.given, start=NONE, q=q, qd=qd * du[:, None], qdd=qdd)


@pytest.mark.parametrize(("limit", "expected"), [(0.5, 4.0 * np.sqrt(2.0)), (8.0, 2.25)])
def test_one_joint_speeds_up_as_long_as_it_can(limit: float, expected: float) -> None:
    one = replace(Toy(), acceleration=np.array([limit, np.inf]))  # 4 rad at 2 rad/s; the other turns by half of it
    pace = Pace.of(one, at(one, 2.0))
    assert pace.seconds == pytest.approx(expected, rel=2e-3)
    assert pace.shares.sum() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("limit", [0.3, 1.0, 4.0])
def test_curved_paths_agree_with_the_retimer_of_programs(limit: float) -> None:
    toy = replace(Toy(), acceleration=np.array([limit, 0.5 * limit]))
    pace = Pace.of(toy, bent(toy, 2.0))
    u = np.linspace(0.0, 2.0, 4001)
    slopes = np.stack([np.cos(u), -0.4 * np.sin(u)], axis=1)
    fine = fastest_profile(
        u, slopes, velocity=toy.limits.velocity, acceleration=toy.acceleration, highest=np.full(len(u), np.inf)
    )
    assert pace.seconds == pytest.approx(fine.duration, rel=0.01)


def test_curved_paths_agree_with_toppra() -> None:
    algorithm = pytest.importorskip("toppra.algorithm")
    import toppra
    from toppra import constraint

    toy = replace(Toy(), acceleration=np.array([1.0, 0.5]))
    u = np.linspace(0.0, 2.0, 201)
    limits = [np.stack([-entry, entry], axis=1) for entry in (toy.limits.velocity, toy.acceleration)]
    theirs = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(limits[0]),
            constraint.JointAccelerationConstraint(
                limits[1], discretization_scheme=constraint.DiscretizationType.Interpolation
            ),
        ],
        toppra.SplineInterpolator(u, np.stack([np.sin(u), 0.4 * np.cos(u)], axis=1)),
        gridpoints=np.linspace(0.0, 2.0, 401),
        solver_wrapper="seidel",
        parametrizer="ParametrizeConstAccel",
    ).compute_trajectory(0, 0)
    assert Pace.of(toy, bent(toy, 2.0)).seconds == pytest.approx(theirs.duration, rel=0.01)


def test_loads_reach_their_limits_and_stay_within() -> None:
    toy = replace(Toy(), acceleration=np.array([1.0, 0.5]))
    point = bent(toy, 2.0)
    pace = Pace.of(toy, point)
    loads = np.abs(pace.loads(point.qd, point.qdd, pace.squares)).max(axis=1)
    assert loads.max() <= 1.0 + 1e-9
    assert loads[pace.places(pace.squares).is_speed == 0].max() == pytest.approx(1.0, abs=1e-9)


def test_derivatives_of_loads_are_those_of_differences() -> None:
    toy = replace(Toy(), acceleration=np.array([1.0, 0.5]))
    point, rng = bent(toy, 2.0), np.random.default_rng(3)
    pace = Pace.of(toy, point)
    by = rng.normal(size=(2, *point.qd.shape, 3))
    rows, joints = (part.astype(np.intp) for part in np.indices((len(pace.places(pace.squares).at), 2)).reshape(2, -1))
    slopes = pace.derivatives(pace.shapes(point.qd, point.qdd), pace.shapes(*by), rows, joints)
    z = rng.normal(size=slopes.shape[1])
    sides = []
    for sign in (STEP, -STEP):
        squares = pace.squares.copy()
        squares[pace.inner] *= 1.0 + sign * z[3:]
        moved = [part + sign * change @ z[:3] for part, change in zip((point.qd, point.qdd), by, strict=True)]
        sides.append(pace.loads(moved[0], moved[1], squares)[rows, joints])
    np.testing.assert_allclose(slopes @ z, (sides[0] - sides[1]) / (2.0 * STEP), rtol=1e-6, atol=1e-6)


def cycle_of(x0: float, limit: float) -> float:
    """Shortest time along the straight path of the toy, where only the first joint has a limit of acceleration."""
    speed, change = min(1.0 / x0, 1.0 / (6.0 - 2.0 * x0)), limit / (2.0 * x0)
    return float(1.0 / speed + speed / change)


@pytest.mark.parametrize(("limit", "best"), [(4.0, 2.0), (1.0, 3.0 - np.sqrt(1.5))])
def test_shortest_retimed_cycle(limit: float, best: float) -> None:
    toy = replace(Toy(), acceleration=np.array([limit, np.inf]))
    improvement = improve(toy, toy.given, NONE, DEMANDS, EXACT)
    assert improvement is not None
    assert improvement.is_conforming
    assert improvement.x[0] == pytest.approx(best, abs=0.02)
    assert improvement.cycle == pytest.approx(cycle_of(best, limit), rel=3e-3)


def test_multipliers_are_the_derivative_of_the_retimed_cycle() -> None:
    toy = replace(Toy(), acceleration=np.array([1.0, np.inf]))
    explanation = explain(toy, at(toy, 1.0), DEMANDS, EXACT)
    assert explanation is not None
    assert explanation.by_variable[0] == pytest.approx(-1.25, abs=0.02)
    assert sum(entry.share for entry in explanation.binding) == pytest.approx(1.0, abs=0.01)
    assert {entry.kind for entry in explanation.binding} == {MeasureKind.SPEED, MeasureKind.ACCELERATION}


def test_a_duration_is_kept_by_a_retimed_motion() -> None:
    toy = replace(Toy(), acceleration=np.array([1.0, np.inf]))
    demands = Demands(objective=Objective.CHANGE, margin=NONE, duration=4.5, timing=CycleTiming.RETIMED)
    improvement = improve(toy, toy.given, NONE, demands, EXACT)
    assert improvement is not None
    assert improvement.is_conforming
    assert improvement.cycle == pytest.approx(4.5, rel=1e-3)
    assert cycle_of(float(improvement.x[0]), 1.0) == pytest.approx(4.5, rel=5e-3)


def test_steps_of_rows_show_how_they_bend() -> None:
    toy = replace(Toy(), acceleration=np.array([1.0, np.inf]))
    here = Measures.of(toy, at(toy, 1.0), DEMANDS, EXACT)
    assert here.pace is not None
    box = np.full(2 + len(here.pace.inner), 0.5)
    z: Array = np.concatenate([[1e-4, 0.0], np.full(len(box) - 2, 1e-4)])
    there = Measures.of(toy, at(toy, 1.0 + 0.5e-4), DEMANDS, EXACT)
    for rows in Linear.of(toy, here).rows(DEMANDS, EXACT.reserve, box):
        if rows.kind in (MeasureKind.SPEED, MeasureKind.ACCELERATION):
            assert np.abs(rows.bends(here, there, z)).max() < 1e-7
