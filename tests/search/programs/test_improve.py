"""Local optimisation by optima in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from builders.toy_problem import DEMAND, Toy

from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort, Objective, Reserve
from cellplan.search.programs.problem import Point

EXACT = Effort(
    iterations=40, within=20.0, least_gain=1e-7, reserve=Reserve(margin=0.0, distance=0.0, within_robot=0.0, time=0.0)
)
NONE = np.zeros(2)
TOY = Toy()


def improved(toy: Toy, demands: Demands, effort: Effort = EXACT) -> Improved:
    improvement = improve(toy, toy.given, NONE, demands, effort)
    assert improvement is not None
    return improvement


def test_shortest_cycle_is_where_both_joints_are_equally_fast() -> None:
    improvement = improved(TOY, Demands(objective=Objective.CYCLE, margin=NONE))
    assert improvement.is_conforming
    assert improvement.x[0] == pytest.approx(2.0, abs=1e-6)
    assert improvement.cycle == pytest.approx(4.0, abs=1e-6)
    assert improvement.x[1] - improvement.x[0] ** 2 >= DEMAND


def test_margins_bind() -> None:
    near = replace(TOY, upper_limit=3.9)
    improvement = improved(near, Demands(objective=Objective.CYCLE, margin=np.array([0.4, 0.0])))
    assert improvement.is_conforming
    assert improvement.x[0] == pytest.approx(1.75, abs=1e-6)
    assert improvement.cycle == pytest.approx(5.0, abs=1e-5)


def test_bodies_bind() -> None:
    near = replace(TOY, upper=np.array([10.0, 2.66]), given=np.array([0.5, 0.0]))
    improvement = improved(near, Demands(objective=Objective.CYCLE, margin=NONE))
    assert improvement.is_conforming
    np.testing.assert_allclose(improvement.x, [1.6, 2.66], atol=1e-5)
    more = improved(near, Demands(objective=Objective.CYCLE, margin=NONE, clearance=0.31))
    np.testing.assert_allclose(more.x, [1.5, 2.66], atol=1e-5)


def test_singular_values_bind() -> None:
    least = Demands(objective=Objective.CHANGE, margin=NONE, duration=5.0, singular=np.array([2.45]))
    effort = replace(EXACT, reserve=replace(EXACT.reserve, singular=0.0))
    improvement = improved(TOY, least, effort)
    assert improvement.is_conforming
    np.testing.assert_allclose(improvement.x, [1.75, 4.9], atol=1e-6)
    assert improved(TOY, replace(least, singular=np.zeros(1)), effort).x[1] == TOY.given[1]


def test_accelerations_bind() -> None:
    slow = replace(TOY, acceleration=np.array([np.pi / 4.0, np.inf]))
    improvement = improved(slow, Demands(objective=Objective.CYCLE, margin=NONE))
    root = 0.5 * (np.sqrt(13.0) - 1.0)  # where the acceleration of the one asks for as much as the other's speed
    assert improvement.x[0] == pytest.approx(root**2, abs=1e-5)
    assert improvement.cycle == pytest.approx(4.0 * root, abs=1e-5)


def test_conforming_stops_where_all_is_kept() -> None:
    improvement = improved(TOY, Demands(objective=Objective.CONFORMING, margin=NONE, duration=5.0))
    assert improvement.is_conforming
    assert improvement.cycle <= 5.0 + 1e-9
    assert len(improvement.history) <= 4


def test_least_change_moves_what_it_must() -> None:
    improvement = improved(TOY, Demands(objective=Objective.CHANGE, margin=NONE, duration=5.0))
    assert improvement.is_conforming
    np.testing.assert_allclose(improvement.x, [1.75, TOY.given[1]], atol=1e-6)
    assert improvement.objective == pytest.approx(1.25 * 2.0, abs=1e-6)


def test_widest_clearance_at_a_duration() -> None:
    improvement = improved(TOY, Demands(objective=Objective.CLEARANCE, margin=NONE, duration=5.0))
    assert improvement.is_conforming
    np.testing.assert_allclose(improvement.x, [1.75, 10.0], atol=1e-5)
    assert improvement.objective == pytest.approx(-(10.0 - 1.75**2 - DEMAND), abs=1e-5)


def test_rows_ask_for_room() -> None:
    near = replace(TOY, upper_limit=3.5)
    effort = replace(EXACT, reserve=Reserve(margin=0.02, distance=0.0, within_robot=0.0, time=0.0))
    improvement = improved(near, Demands(objective=Objective.CYCLE, margin=NONE), effort)
    assert improvement.x[0] == pytest.approx(1.74, abs=1e-3)


def test_what_cannot_be_kept_is_missed_least() -> None:
    narrow = replace(TOY, upper_limit=1.0, lower=np.array([0.9, -5.0]), given=np.array([2.0, 9.0]))
    improvement = improved(narrow, Demands(objective=Objective.CYCLE, margin=NONE))
    assert not improvement.is_conforming
    assert improvement.x[0] == pytest.approx(0.9, abs=1e-6)
    assert improvement.violation == pytest.approx(0.8 / 0.01, rel=1e-6)


def test_steps_without_a_motion_are_refused() -> None:
    short = replace(TOY, reaches=1.3)
    improvement = improved(short, Demands(objective=Objective.CYCLE, margin=NONE))
    assert improvement.x[0] == pytest.approx(1.3, abs=0.02)
    assert any(not entry.is_taken for entry in improvement.history)
    beyond = replace(TOY, given=np.array([9.5, 0.0]))
    assert improve(beyond, beyond.given, NONE, Demands(objective=Objective.CYCLE, margin=NONE), EXACT) is None


def test_equal_input_gives_equal_bytes() -> None:
    demands = Demands(objective=Objective.CYCLE, margin=NONE)
    one, two = improved(TOY, demands), improved(TOY, demands)
    assert one.x.tobytes() == two.x.tobytes()
    assert one.history == two.history


def test_objectives_at_a_duration_need_one() -> None:
    with pytest.raises(ValueError, match="demands: the objective 'change' needs a duration"):
        Demands(objective=Objective.CHANGE, margin=NONE)


def test_where_nodes_are_dense_nothing_between_them_counts() -> None:
    speeds = np.array([[0.0, 0.0], [0.9, 0.7], [0.8, 0.7], [0.0, 0.0]])
    point = Point(x=np.array([0.5, 4.5]), start=NONE, q=0.0 * speeds, qd=speeds, qdd=0.0 * speeds)
    demands, sparse = Demands(objective=Objective.CYCLE, margin=NONE), Toy(times=np.array([0.0, 0.5, 1.0, 2.0]))

    measured = [Measures.of(replace(sparse, is_dense=entry), point, demands, EXACT) for entry in (False, True)]

    np.testing.assert_array_equal(measured[1].speeds.value, speeds / sparse.limits.velocity)
    assert np.all(measured[0].speeds.value.max(axis=0) > measured[1].speeds.value.max(axis=0))
