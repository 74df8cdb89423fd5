"""Modes along an order of blocks by enumeration, and straight times by the planner of transfer moves."""

from dataclasses import replace
from itertools import combinations, pairwise, permutations, product

import numpy as np
import pytest
from builders.assignments import STEP, small_instance

from cellplan.geometry.arrays import Array
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.straight_time import straight_steps
from cellplan.search.assign.problem.durations import with_stand_offs
from cellplan.search.assign.problem.instance import End, Instance, least_transfer, with_rules
from cellplan.search.assign.problem.rules import TaskRules
from cellplan.search.assign.schedules.greedy import greedy_schedule
from cellplan.search.assign.schedules.order import Refusal, Sequencer, relocations
from cellplan.search.assign.schedules.schedule import BlockSchedule, in_order


def steps_of(instance: Instance, schedule: BlockSchedule, picked: dict[str, End]) -> int:
    """Steps from home to home with given modes, each leg of a transfer as slow as its slowest robot or the part."""
    total, at, station, before = 0, dict(instance.homes), None, ()
    for block in (*schedule.blocks, ()):
        total += max((steps_with(instance, picked[task]) for task in block), default=0)
        here = schedule.station_of(block) if block else None
        goals = {robot: instance.homes[robot] for robot in instance.robots}
        goals |= {schedule.chosen[task][0]: picked[task].begin for task in block}
        legs = [(leg, station) for leg in over(instance, schedule, before, at, is_after=True)]
        legs += [(leg, here) for leg in over(instance, schedule, block, goals, is_after=False)]
        for goal, place in (*legs, (goals, here)):
            moves = [int(instance.transfer_steps(robot, at[robot], q)) for robot, q in goal.items()]
            total += max([*moves, instance.station_steps(station, place) if place != station else 0])
            at, station = goal, place
        at, before = goals | {schedule.chosen[task][0]: picked[task].end for task in block}, block
    return total


def over(
    instance: Instance, schedule: BlockSchedule, block: tuple[str, ...], q: dict[str, Array], *, is_after: bool
) -> list[dict[str, Array]]:
    """Where all robots stand while those of a block are at their via points: at the last one, or where they go."""
    legs = list[dict[str, Array]]()
    for place in range(3):
        leg = dict(legs[-1] if legs and is_after else {name: q[name] for name in instance.robots})
        for task in block:
            goal, robot = instance.goals[task], schedule.chosen[task][0]
            points = goal.via_after if is_after else goal.via_before
            if place < len(points):
                leg[robot] = instance.homes[robot] if (point := points[place]) is None else point
        legs.append(leg)
    most = max(
        (len(getattr(instance.goals[it], f"via_{'after' if is_after else 'before'}")) for it in block), default=0
    )
    return legs[:most]


def steps_with(instance: Instance, end: End) -> int:
    """Steps of a task by a mode."""
    goal = instance.goals[end.mode.task]
    if goal.stand_off_steps is None:
        return goal.steps
    process = replace(goal, steps=goal.steps - goal.stand_off_steps)
    key = end.mode.task, end.mode.robot, end.mode.station
    return with_stand_offs(process, {key: [end.mode]}, instance.bounds, instance.step).steps


@pytest.mark.parametrize("kind", ["as written", "retimed", "via points", "planned ends"])
@pytest.mark.parametrize("seed", range(4))
def test_no_choice_of_modes_is_faster(seed: int, kind: str) -> None:
    instance = small_instance(seed, 5, modes=2)
    if kind == "via points":
        a, b, c = np.array([[0.7, -0.4], [-0.6, 0.2], [1.0, 0.9]])
        points = {
            "t0": ((None, a), (b,)),
            "t1": ((), (c, None)),
            "t2": ((c,), ()),
            "t3": ((), ()),
            "t4": ((a, b), (c,)),
        }
        stated = {
            name: replace(goal, via_before=points[name][0], via_after=points[name][1])
            for name, goal in instance.goals.items()
        }
        instance = replace(instance, goals=stated)
    if kind == "retimed":
        timed = {
            name: with_stand_offs(goal, instance.modes, instance.bounds, instance.step)
            for name, goal in instance.goals.items()
        }
        instance = replace(instance, goals=timed)
    if kind == "planned ends":
        rng = np.random.default_rng(seed)
        every_end = (end for key in instance.modes for end in instance.ends(*key))
        instance = replace(instance, planned={it.identity: rng.uniform(-1.0, 1.0, 2) for it in every_end})
    schedule = greedy_schedule(instance)

    sequenced = Sequencer(instance).sequenced(schedule)

    ends = [instance.ends(task, *schedule.chosen[task]) for task in instance.tasks]
    every = (dict(zip(instance.tasks, choice, strict=True)) for choice in product(*ends))
    picked = {end.mode.task: end for _, stop in sequenced.stops for end in stop if end is not None}
    assert sequenced.steps == min(steps_of(instance, schedule, choice) for choice in every)
    assert sequenced.steps == steps_of(instance, schedule, picked)
    assert Sequencer(instance.of_stops(it for _, it in sequenced.stops)).sequenced(schedule).steps == sequenced.steps


def test_a_refused_transfer_is_avoided_or_costs_what_it_takes() -> None:
    instance = small_instance(1, 5, modes=2)
    schedule, sequencer = greedy_schedule(instance), Sequencer(instance)
    before = sequencer.sequenced(schedule)
    end = next(end for end in before.stops[0][1] if end is not None)
    robot = end.mode.robot

    sequencer.refusals.append(
        Refusal(
            before={robot: instance.homes[robot].tobytes()},
            after={robot: end.begin.tobytes()},
            stations=(None, before.stops[0][0]),
            steps=10_000,
        )
    )
    after = sequencer.sequenced(schedule)

    assert before.steps <= after.steps < 10_000
    assert all(other is None or other.begin is not end.begin for other in after.stops[0][1])


@pytest.mark.parametrize("jerk", [np.inf, 40.0, 4000.0])
def test_steps_of_many_moves_are_those_of_each_alone_and_grow_with_its_length(jerk: float) -> None:
    rng = np.random.default_rng(4)
    bounds = JointLimitsInTime(velocity=rng.uniform(1, 4, 6), acceleration=rng.uniform(3, 20, 6), jerk=np.full(6, jerk))
    moves = rng.normal(size=(40, 6)) * rng.choice([0.01, 0.3, 2.0], (40, 1))

    rest = np.zeros(6)
    steps = straight_steps(rest, moves, bounds, STEP)

    assert steps.tolist() == [int(straight_steps(rest, move, bounds, STEP)) for move in moves]
    assert np.all(straight_steps(-moves, moves, bounds, STEP) >= steps)
    assert np.all(steps * STEP >= (np.abs(moves) / bounds.velocity).max(axis=1))
    assert straight_steps(moves, moves, bounds, STEP).tolist() == [0] * 40


def test_relocated_blocks_stay_at_their_stations_and_in_order() -> None:
    instance = small_instance(3, 8, chained=True)
    schedule = greedy_schedule(instance)

    for trial in relocations(schedule, instance.goals):
        assert sorted(trial.blocks) == sorted(schedule.blocks)
        assert in_order(trial.blocks, instance.goals) == trial.blocks
        assert [trial.station_of(it) for it in trial.blocks] == [schedule.station_of(it) for it in schedule.blocks]


@pytest.mark.parametrize("seed", range(3))
def test_no_transfer_is_shorter_than_the_least_one(seed: int) -> None:
    instance = small_instance(seed, 7, modes=2, stations=3)
    sequenced = Sequencer(instance).sequenced(greedy_schedule(instance))
    at, least = dict(instance.homes), least_transfer(instance)

    for (first, _), (station, ends) in pairwise([(None, ()), *sequenced.stops]):
        goals = {
            robot: instance.homes[robot] if end is None else end.begin for robot, end in zip("ab", ends, strict=True)
        }
        moves = [int(instance.transfer_steps(robot, at[robot], goal)) for robot, goal in goals.items()]
        assert max([*moves, instance.station_steps(first, station)]) >= least
        at = {robot: goals[robot] if end is None else end.end for robot, end in zip("ab", ends, strict=True)}


@pytest.mark.parametrize("seed", range(4))
def test_between_blocks_the_part_has_cooled_and_no_order_found_is_longer_than_as_it_was(seed: int) -> None:
    """Begins of blocks from the moves and waits of a sequence, against each rest between its tasks."""
    rests = {("t0", "t1"): 150, ("t1", "t0"): 160, ("t2", "t3"): 120, ("t3", "t2"): 120}
    instance = small_instance(seed, 6, rules=TaskRules(lags=rests))
    schedule, sequencer = greedy_schedule(instance), Sequencer(instance)

    sequenced = sequencer.sequenced(schedule)

    free = Sequencer(small_instance(seed, 6)).sequenced(schedule)
    assert sequenced.steps == free.steps + sum(sequenced.waits)
    assert sequencer.ordered(schedule).steps <= sequenced.steps
    begins, worked = dict[str, int](), 0
    for block, wait in zip(schedule.blocks, sequenced.waits, strict=True):
        worked += wait
        begins |= dict.fromkeys(block, worked)  # without the moves, which add to each rest
        worked += max(instance.steps(task) for task in block)
    moves = sequenced.steps - schedule.work(instance) - sum(sequenced.waits)
    for (first, later), lag in rests.items():
        if begins[later] > begins[first]:
            assert begins[later] - begins[first] + moves >= lag
    assert any(sequenced.waits) or sequencer.ordered(schedule).steps == sequenced.steps


@pytest.mark.parametrize("seed", range(4))
def test_directions_in_which_arcs_come_too_near_are_not_chosen(seed: int) -> None:
    """The best of all other choices of directions, by enumeration."""
    names = [f"t{k}" for k in range(4)]
    rules = TaskRules(crowded={pair: frozenset({(False, False), (True, True)}) for pair in permutations(names, 2)})
    free = small_instance(seed, 4)
    both = {key: tuple(replace(it, directions=(False, True)) for it in modes) for key, modes in free.modes.items()}
    instance = with_rules(replace(free, modes=both), rules)
    schedule = greedy_schedule(instance)

    sequenced = Sequencer(instance).sequenced(schedule)

    ends = [instance.ends(task, *schedule.chosen[task]) for task in instance.tasks]
    every = (dict(zip(instance.tasks, choice, strict=True)) for choice in product(*ends))
    allowed = [
        it
        for it in every
        if all(it[a].is_reversed != it[b].is_reversed for block in schedule.blocks for a, b in combinations(block, 2))
    ]
    assert instance.conflicts == free.conflicts
    assert sequenced.steps == min(steps_of(instance, schedule, it) for it in allowed)
