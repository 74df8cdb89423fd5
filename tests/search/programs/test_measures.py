"""Measures of a point: what the clock of its nodes changes and what it does not, and what counts as kept."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from builders.toy_problem import DEMAND, TIMES, Toy

from cellplan.geometry.arrays import Array
from cellplan.model.robot.robot import JointLimits
from cellplan.search.programs.measures import IN_RESERVE, LENGTH, SHARE, MeasureKind, Measures, key_nodes
from cellplan.search.programs.objective import CycleTiming, Demands, Effort, Objective, Reserve
from cellplan.search.programs.problem import Point

START = np.zeros(2)
EFFORT = Effort(within=20.0, reserve=Reserve())
LIMITED = replace(Toy(), acceleration=np.array([1.0, 2.0]))


@dataclass(frozen=True)
class Faster(Toy):
    """The toy with other limits of speed."""

    faster: float = 1.0

    @property
    def limits(self) -> JointLimits:
        limits = super().limits
        return replace(limits, velocity=self.faster * limits.velocity)


def at(x: Array, *, slower: float = 1.0, toy: Toy = LIMITED) -> tuple[Toy, Point]:
    """A point whose nodes last so many times as long."""
    point = toy.evaluate(x, START)
    assert point is not None
    later = replace(toy, times=slower * TIMES)
    return later, replace(point, qd=point.qd / slower, qdd=point.qdd / slower**2)


def demands_of(objective: Objective = Objective.CYCLE, **more: object) -> Demands:
    return Demands(objective=objective, margin=np.zeros(2), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("timing", list(CycleTiming))
@pytest.mark.parametrize("slower", [0.5, 3.0])
def test_the_shortest_cycle_does_not_depend_on_how_fast_the_nodes_are_passed(
    timing: CycleTiming, slower: float
) -> None:
    x, demands = np.array([1.4, 4.5]), demands_of(timing=timing)
    plain, other = (Measures.of(*at(x, slower=k), demands, EFFORT) for k in (1.0, slower))

    load = max(float(plain.speeds.value.max()), float(np.sqrt(plain.accelerations.value.max())))
    assert load == pytest.approx(plain.factor, rel=1e-9)
    assert other.cycle == pytest.approx(plain.cycle, rel=1e-9)
    assert other.factor * slower == pytest.approx(plain.factor, rel=1e-9)
    assert other.span == pytest.approx(slower * plain.span, rel=1e-9)
    assert other.missed(*_of(slower), EFFORT.reserve).violation == plain.missed(*_of(1.0), EFFORT.reserve).violation


def _of(slower: float) -> tuple[Toy, Demands]:
    return replace(LIMITED, times=slower * TIMES), demands_of()


@pytest.mark.parametrize("timing", list(CycleTiming))
def test_limits_that_are_higher_shorten_the_cycle_by_their_power(timing: CycleTiming) -> None:
    """Speeds alone: as the limits; accelerations alone: as their root."""
    x, demands = np.array([1.4, 4.5]), demands_of(timing=timing)
    bound_by = {1.0: np.full(2, np.inf), 0.5: np.full(2, 1e-3)}  # so low that no joint comes to its top speed
    for power, acceleration in bound_by.items():
        cycles = []
        for factor in (1.0, 4.0):
            toy = Faster(acceleration=factor * acceleration, faster=factor)
            measures = Measures.of(*at(x, toy=toy), demands, EFFORT)
            loads = {1.0: measures.speeds.value, 0.5: np.sqrt(measures.accelerations.value)}
            assert loads[power].max() == pytest.approx(measures.factor, rel=1e-9)
            cycles.append(measures.cycle)
        assert cycles[0] / cycles[1] == pytest.approx(4.0**power, rel=1e-6)


@pytest.mark.parametrize("gap", [-0.004, 0.001, 0.0014, 0.004])
def test_half_of_the_reserve_counts_as_kept_and_costs_little(gap: float) -> None:
    toy, point = at(np.array([1.0, 1.0 + DEMAND + gap]), toy=Toy())
    least = EFFORT.reserve.distance

    missed = Measures.of(toy, point, demands_of(), EFFORT).missed(toy, demands_of(), EFFORT.reserve)

    beyond = max(least - gap, 0.0) / LENGTH
    allowed = 0.5 * least / LENGTH
    assert missed.violation == pytest.approx(max(beyond - allowed, 0.0), abs=1e-9)
    assert missed.cost(7.0) == pytest.approx(7.0 * (missed.violation + IN_RESERVE * min(beyond, allowed)), abs=1e-9)


def test_a_duration_is_missed_by_its_share_whatever_the_nodes_last() -> None:
    x = np.array([1.0, 4.5])
    for slower in (1.0, 2.5):
        toy, point = at(x, slower=slower, toy=Toy())
        short = demands_of(Objective.CHANGE, duration=7.5)  # the shortest cycle is 2 (6 - 2 x0) s
        measures = Measures.of(toy, point, short, EFFORT)
        loads = measures.missed(toy, short, EFFORT.reserve).violations[-4:]
        expected = np.array([2.0, 8.0, 0.0, 0.0]) / 7.5 * (1.0 + EFFORT.reserve.time) - 1.0
        np.testing.assert_allclose(loads, expected / SHARE, rtol=1e-9)
        assert measures.objective(toy, short) == pytest.approx(0.5 * 2.0)  # cost of the change of x0
        for share, is_kept in ((0.6, True), (0.4, False)):
            almost = demands_of(Objective.CHANGE, duration=8.0 * (1.0 + share * EFFORT.reserve.time))
            missed = Measures.of(toy, point, almost, EFFORT).missed(toy, almost, EFFORT.reserve)
            assert (missed.violation == 0.0) is is_kept


def test_distances_are_asked_at_even_times_and_at_those_that_are_named() -> None:
    nodes = key_nodes(Toy(), replace(EFFORT, keys=5, also_at=(0.31, 1.99)))

    assert nodes.tolist() == [0, 6, 10, 20, 30, 40]


def test_values_that_were_not_measured_are_no_numbers() -> None:
    toy, point = at(np.array([1.0, 4.5]), toy=Toy())
    measures = Measures.of(toy, point, demands_of(), EFFORT)

    values = measures.values(MeasureKind.DISTANCE, np.array([0, 0]), np.array([measures.distances.nodes[0], 3]))

    assert values[0] == pytest.approx(DEMAND - 3.5)
    assert np.isnan(values[1])
