"""The block model by enumeration of every schedule, and schedules without a solver beside it."""

from collections.abc import Iterator
from functools import cache
from itertools import pairwise, permutations, product

import numpy as np
import pytest
from builders.assignments import small_instance

from cellplan.errors import NoSolutionError
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.problem.rules import ServiceRule, TaskRules
from cellplan.search.assign.schedules.blocks import solve_blocks
from cellplan.search.assign.schedules.cliques import cliques_at, excludes
from cellplan.search.assign.schedules.greedy import greedy_schedule, improved
from cellplan.search.assign.schedules.order import Sequencer, waits_of
from cellplan.search.assign.schedules.schedule import BlockSchedule, in_order, refuse_impossible

LEAST = 5  # [steps] of a transfer


def partitions(tasks: tuple[str, ...]) -> Iterator[list[list[str]]]:
    """All ways to split tasks into blocks."""
    if not tasks:
        yield []
        return
    first, *rest = tasks
    for blocks in partitions(tuple(rest)):
        yield [[first], *blocks]
        for place in range(len(blocks)):
            yield [*blocks[:place], [first, *blocks[place]], *blocks[place + 1 :]]


def is_schedule(instance: Instance, schedule: BlockSchedule) -> bool:
    try:
        refuse_impossible(instance, schedule)
    except ValueError:
        return False
    return True


def model_cycle(instance: Instance, schedule: BlockSchedule) -> int:
    """Blocks, a least transfer for each, and the shortest tour of the part beyond the transfers that are counted."""
    stations = {schedule.station_of(block) for block in schedule.blocks}
    tours = []
    for order in permutations(sorted(stations)):
        places = [None, *order]
        steps = sum(max(instance.station_steps(a, b) - LEAST, 0) for a, b in pairwise(places))
        tours.append(steps + instance.station_steps(places[-1], None))
    work = sum(max(instance.steps(task) for task in block) for block in schedule.blocks)
    cost = work + LEAST * len(schedule.blocks) + min(tours)
    if instance.rules.services:
        return cost + fewest_services(instance, schedule) * min(it.steps for it in instance.rules.services.values())
    if not instance.rules.lags:
        return cost
    orders = (BlockSchedule(blocks=it, chosen=schedule.chosen) for it in permutations(schedule.blocks))
    allowed = [it for it in orders if in_order(it.blocks, instance.goals) == it.blocks]
    moved = [LEAST * (place + 1) for place in range(len(schedule.blocks))]
    waits = min(sum(waits_of(instance, it, moved)) for it in allowed)
    return max(cost, work + moved[-1] + waits)


def fewest_services(instance: Instance, schedule: BlockSchedule) -> int:
    """Times at which all tools are cleaned, each as late as possible, in the order of blocks that needs fewest."""
    counts = []
    for order in permutations(schedule.blocks):
        if in_order(order, instance.goals) != order:
            continue
        times, since = 0, dict.fromkeys(instance.robots, 0)
        for block in order:
            robots = {schedule.chosen[task][0] for task in block}
            limits = {name: it.most for name, it in instance.rules.services.items() if name in robots}
            if any(since[name] + 1 > most for name, most in limits.items()):
                times, since = times + 1, dict.fromkeys(instance.robots, 0)
            for name in robots:
                since[name] += 1
        counts.append(times)
    return min(counts)


def best_by_enumeration(instance: Instance) -> int | None:
    best = 10**9
    if any(task not in instance.options for task in instance.goals):
        return None
    for choices in product(*(instance.options[task] for task in instance.tasks)):
        chosen = dict(zip(instance.tasks, choices, strict=True))
        for split in partitions(instance.tasks):
            blocks = in_order([tuple(block) for block in split], instance.goals)
            schedule = None if blocks is None else BlockSchedule(blocks=blocks, chosen=chosen)
            if schedule is not None and is_schedule(instance, schedule):
                best = min(best, model_cycle(instance, schedule))
    return best if best < 10**9 else None


@pytest.mark.parametrize(("seed", "chained"), [(0, False), (1, False), (2, True), (3, True)])
def test_the_model_is_as_good_as_enumeration(seed: int, chained: bool) -> None:
    pytest.importorskip("ortools")
    instance = small_instance(seed, 4, chained=chained)

    answer = solve_blocks(instance, least=LEAST, effort=10.0)

    assert answer.schedule is not None
    refuse_impossible(instance, answer.schedule)
    assert answer.is_proved
    assert answer.bound == model_cycle(instance, answer.schedule) == best_by_enumeration(instance)


@pytest.mark.parametrize(
    "rules",
    [pytest.param(TaskRules(), marks=pytest.mark.slow), TaskRules(together=(("t0", "t1"),))],
    ids=["free", "together"],
)
def test_with_moving_parts_the_model_is_as_good_as_enumeration_and_some_columns_pay(rules: TaskRules) -> None:
    """Columns are blocks of one or two tasks that begin and end at different configurations of the holder."""
    pytest.importorskip("ortools")
    shorter = 0
    for seed in range(6):
        instance = small_instance(seed, 4, chained=seed % 5 == 4, rules=rules, columns=5)

        answer, best = solve_blocks(instance, least=LEAST, effort=10.0), best_by_enumeration(instance)

        if best is None:
            assert answer.schedule is None
            continue
        assert answer.schedule is not None
        refuse_impossible(instance, answer.schedule)
        assert answer.is_proved
        assert answer.bound == model_cycle(instance, answer.schedule) == best
        at_rest = best_by_enumeration(small_instance(seed, 4, chained=seed % 5 == 4, rules=rules))
        assert at_rest is None or best <= at_rest
        shorter += at_rest is None or best < at_rest
    assert shorter > 0


@pytest.mark.parametrize("seed", range(8))
def test_exchanges_keep_columns_whole(seed: int) -> None:
    """Where tasks can be done on a moving part alone, the greedy schedule takes columns that have each of them once."""
    instance = small_instance(seed, 6, columns=5)
    moving = {task for keys in instance.columns.values() for task, _, _ in keys}
    only = instance.with_modes(
        {key: it for key, it in instance.modes.items() if key[2] in instance.columns or key[0] not in moving}
    )

    for it in (instance, only):
        try:
            greedy = greedy_schedule(it)
        except NoSolutionError:
            assert it is only
            continue
        refuse_impossible(it, greedy)
        refuse_impossible(it, improved(it, greedy))
        assert Sequencer(it).ordered(greedy).steps <= Sequencer(it).sequenced(greedy).steps
    assert all(robot != "a" for keys in instance.without("a").columns.values() for _, robot, _ in keys)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(4, 154, 15))
def test_one_hundred_and_fifty_more_are_as_good_as_enumeration(first: int) -> None:
    """Four tasks at two or three stations, some in a given order; every fifteenth has five."""
    pytest.importorskip("ortools")
    for seed in range(first, first + 15):
        count = 5 if seed == first else 4
        instance = small_instance(seed, count, stations=2 + (seed % 2) * (count == 4), chained=seed % 4 == 3)

        answer = solve_blocks(instance, least=LEAST, effort=10.0)

        assert answer.schedule is not None
        refuse_impossible(instance, answer.schedule)
        assert answer.is_proved
        assert answer.bound == model_cycle(instance, answer.schedule) == best_by_enumeration(instance)


def lags(*pairs: tuple[str, str], steps: int) -> dict[tuple[str, str], int]:
    """Rests of the part, longer in one direction."""
    return {(a, b): steps + 7 * (a > b) for pair in pairs for a, b in (pair, pair[::-1])}


def cleaning(most: int, steps: int = 30) -> ServiceRule:
    return ServiceRule(q=np.array([0.5, -0.5]), steps=steps, most=most)


RULES = {
    "rest": TaskRules(lags=lags(("t0", "t1"), steps=110)),
    "rests of all": TaskRules(lags=lags(("t0", "t1"), ("t1", "t2"), ("t2", "t3"), ("t0", "t3"), steps=90)),
    "rest and together": TaskRules(lags=lags(("t0", "t1"), steps=140), together=(("t1", "t3"),)),
    "arcs": TaskRules(crowded={pair: frozenset({(False, False)}) for pair in permutations(("t0", "t2", "t3"), 2)}),
    "same robot": TaskRules(same_robot=(("t0", "t1", "t3"),)),
    "together": TaskRules(together=(("t1", "t3"),)),
    "service": TaskRules(services={"a": cleaning(1), "b": cleaning(2)}),
    "both": TaskRules(same_robot=(("t0", "t3"),), together=(("t2", "t3"),)),
}


@cache
def best_without_rules(seed: int) -> int | None:
    return best_by_enumeration(small_instance(seed, 4, chained=seed % 4 == 3))


@pytest.mark.slow
@pytest.mark.parametrize("rules", RULES.values(), ids=RULES)
def test_with_rules_the_model_is_as_good_as_enumeration_and_some_rules_bind(rules: TaskRules) -> None:
    """An instance that no schedule keeps is found to be one by the model, by enumeration and without a solver."""
    pytest.importorskip("ortools")
    binding = 0
    for seed in range(8):
        instance = small_instance(seed, 4, chained=seed % 4 == 3, rules=rules)

        answer, best = solve_blocks(instance, least=LEAST, effort=10.0), best_by_enumeration(instance)

        if best is None:
            assert answer.schedule is None
            with pytest.raises(NoSolutionError, match="no choice of robots"):
                greedy_schedule(instance)
            continue
        assert answer.schedule is not None
        refuse_impossible(instance, answer.schedule)
        assert answer.is_proved
        assert answer.bound == model_cycle(instance, answer.schedule) == best
        free = best_without_rules(seed)
        assert free is not None
        assert free <= best
        binding += free < best
        refuse_impossible(instance, greedy_schedule(instance))
    assert binding > 1


@pytest.mark.parametrize("rules", [*RULES.values(), TaskRules()], ids=[*RULES, "none"])
@pytest.mark.parametrize("seed", range(8))
def test_exchanges_keep_schedules_possible_and_never_make_them_longer(rules: TaskRules, seed: int) -> None:
    instance = small_instance(seed, 9, stations=3, chained=seed % 2 == 0, rules=rules)
    if any(task not in instance.options for group in (*rules.same_robot, *rules.together) for task in group):
        return

    try:
        greedy = greedy_schedule(instance)
    except NoSolutionError:
        return
    exchanged = improved(instance, greedy)

    refuse_impossible(instance, greedy)
    refuse_impossible(instance, exchanged)
    assert exchanged.work(instance) <= greedy.work(instance)


@pytest.mark.parametrize("seed", range(4))
def test_two_of_a_clique_are_never_at_work_together(seed: int) -> None:
    instance = small_instance(seed, 8)

    for station in instance.used:
        for clique in cliques_at(instance, station):
            assert all(excludes(instance, station, a, b) for a in clique for b in clique if a != b)
            assert len(clique) > 1


@pytest.mark.parametrize(
    "rules", [TaskRules(), RULES["rests of all"], RULES["service"]], ids=["free", "rests", "service"]
)
@pytest.mark.parametrize("seed", range(3))
def test_the_bound_is_below_every_sequence_of_blocks(seed: int, rules: TaskRules) -> None:
    pytest.importorskip("ortools")
    instance = small_instance(seed, 6, modes=2, rules=rules)
    sequencer = Sequencer(instance)

    answer = solve_blocks(instance, least=0, effort=5.0)

    for schedule in (greedy_schedule(instance), improved(instance, greedy_schedule(instance)), answer.schedule):
        assert schedule is not None
        assert sequencer.ordered(schedule).steps >= answer.bound


@pytest.mark.parametrize("seed", range(4))
def test_services_come_before_a_task_too_many_and_take_their_time_and_two_transfers(seed: int) -> None:
    """The sequence with the straight transfers over the place of service, worked out once more block by block."""
    instance = small_instance(seed, 7, modes=2, rules=TaskRules(services={"a": cleaning(2), "b": cleaning(2, 40)}))
    sequencer = Sequencer(instance)
    sequenced = sequencer.sequenced(improved(instance, greedy_schedule(instance)))
    schedule, steps = sequenced.schedule, 0
    since, q, station = dict.fromkeys(instance.robots, 0), dict(instance.homes), None

    def go(to: dict[str, np.ndarray]) -> int:
        """Steps until all are there."""
        taken = max(int(instance.transfer_steps(name, q[name], to[name])) for name in instance.robots)
        q.update(to)
        return taken

    cleaned = 0
    for block, (at, ends), robots in zip(schedule.blocks, sequenced.stops, schedule.cleaned(instance), strict=True):
        begins = {
            name: instance.homes[name] if end is None else end.begin
            for name, end in zip(instance.robots, ends, strict=True)
        }
        over = {name: np.array([0.5, -0.5]) if name in robots else begins[name] for name in instance.robots}
        steps += max(go(over), instance.station_steps(station, at))
        if robots:
            cleaned += 1
            steps += max(instance.rules.services[name].steps for name in robots) + go(begins)
        steps += max(instance.steps(task) for task in block)
        for name, end in zip(instance.robots, ends, strict=True):
            if end is not None:
                since[name] = 1 + (0 if name in robots else since[name])
                q[name] = end.end
        assert max(since.values()) <= 2
        station = at
    steps += max(go(dict(instance.homes)), instance.station_steps(station, None))

    assert cleaned
    assert sequenced.steps == steps
