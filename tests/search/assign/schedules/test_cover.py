"""The choice from all blocks by enumeration of every program: schedules, orders of blocks and ways to do the tasks."""

from dataclasses import replace
from itertools import combinations, permutations, product
from typing import Any

import pytest
from builders.assignments import small_instance
from search.assign.schedules.test_blocks import RULES, partitions

from cellplan.search.assign.problem.instance import Instance, least_transfer
from cellplan.search.assign.problem.rules import TaskRules
from cellplan.search.assign.schedules import cover
from cellplan.search.assign.schedules.blocks import solve_blocks
from cellplan.search.assign.schedules.cover import best_blocks, bound_of_blocks, cover_blocks, possible_blocks
from cellplan.search.assign.schedules.greedy import greedy_schedule
from cellplan.search.assign.schedules.order import Sequencer
from cellplan.search.assign.schedules.schedule import BlockSchedule, in_order, refuse_impossible
from cellplan.search.assign.schedules.transfers import is_possible


def shortest_program(instance: Instance) -> int | None:
    """Steps of the shortest of all programs in blocks, with straight transfers."""
    sequencer, best = Sequencer(instance), None
    if any(task not in instance.options for task in instance.goals):
        return None
    for choices in product(*(instance.options[task] for task in instance.tasks)):
        chosen = dict(zip(instance.tasks, choices, strict=True))
        for split in partitions(instance.tasks):
            for blocks in permutations(map(tuple, split)):
                schedule = BlockSchedule(blocks=blocks, chosen=chosen)
                if not is_possible(instance, schedule):
                    if in_order(blocks, instance.goals) == blocks:
                        break  # in no order
                    continue
                steps = sequencer.sequenced(schedule).steps
                best = steps if best is None else min(best, steps)
    return best


def check(instance: Instance) -> float | None:
    """The share of the shortest program that the bound is; None where there is no program."""
    shortest = shortest_program(instance)
    if shortest is None:
        return None
    answer = cover_blocks(instance, effort=5.0, hint=None)
    assert answer is not None
    assert answer.bound is not None
    assert answer.bound <= shortest
    if answer.schedule is not None:
        refuse_impossible(instance, answer.schedule)
        assert Sequencer(instance).ordered(answer.schedule).steps >= shortest
    return answer.bound / shortest


CASES = {"free": {}, "chained": {"chained": True}, "two ways": {"modes": 2}, "moving": {"columns": 5}} | {
    name: {"rules": rules} for name, rules in RULES.items()
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_no_program_is_shorter_than_the_bound_and_the_bound_is_near(case: dict[str, Any]) -> None:
    pytest.importorskip("ortools")

    share = check(small_instance(1, 4, **case))

    assert share is None or share > 0.6


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_no_program_of_many_instances_is_shorter_than_the_bound(case: dict[str, Any]) -> None:
    pytest.importorskip("ortools")
    shares = [check(small_instance(seed, 4, stations=2 + seed % 2, **case)) for seed in range(2, 12)]

    assert max(share for share in shares if share is not None) > 0.75


@pytest.mark.parametrize("seed", range(4))
def test_all_blocks_are_listed_once(seed: int) -> None:
    """Sets of tasks of robots at one station without a conflict; of a column the whole one."""
    instance = small_instance(seed, 6, stations=3, columns=3)
    keys = [key for key in instance.modes if key[2] not in instance.columns]
    single = [frozenset({key}) for key in keys]
    pairs = [
        frozenset((a, b))
        for a, b in combinations(keys, 2)
        if a[2] == b[2] and a[0] != b[0] and a[1] != b[1] and frozenset((a, b)) not in instance.conflicts
    ]

    blocks = list(possible_blocks(instance))

    assert len(set(blocks)) == len(blocks)
    assert set(blocks) == {*single, *pairs, *instance.columns.values()}


@pytest.mark.parametrize("seed", range(4))
def test_tasks_in_order_and_of_one_robot_share_no_block_and_those_together_all_do(seed: int) -> None:
    rules = TaskRules(same_robot=(("t3", "t4"),), together=(("t0", "t5"),))
    instance = small_instance(seed, 6, chained=True, rules=rules)  # t2 comes after t0, and t1 after t2

    blocks = [{task for task, _, _ in block} for block in possible_blocks(instance)]

    assert not any(
        {"t1", "t2"} <= it or {"t0", "t1"} <= it or {"t0", "t2"} <= it or {"t3", "t4"} <= it for it in blocks
    )
    assert all(("t0" in it) == ("t5" in it) for it in blocks)
    assert {"t1", "t2", "t3", "t4"} <= set().union(*blocks)


@pytest.mark.parametrize("seed", range(4))
def test_no_program_of_tasks_one_after_the_other_is_shorter_than_all_of_them(seed: int) -> None:
    pytest.importorskip("ortools")
    instance = small_instance(seed, 4)
    names = instance.tasks
    in_turn = {
        name: replace(goal, after=names[:place][-1:]) for place, (name, goal) in enumerate(instance.goals.items())
    }
    instance = replace(instance, goals=in_turn)

    bound = bound_of_blocks(instance, least=0, effort=1.0)

    assert bound is not None
    assert bound >= sum(map(instance.steps, names))
    assert bound <= (shortest_program(instance) or bound)


@pytest.mark.parametrize("most", [1, 3, 10])
def test_a_choice_from_few_blocks_proves_no_more_than_one_from_all(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ortools")
    for seed in range(4):
        instance = small_instance(seed, 7, stations=3)
        hint = greedy_schedule(instance)
        whole = cover_blocks(instance, effort=5.0, hint=hint)
        with monkeypatch.context() as patch:
            patch.setattr(cover, "MOST_CHOSEN_FROM", most)
            part = cover_blocks(instance, effort=5.0, hint=hint)

        assert whole is not None
        assert part is not None
        assert whole.is_proved
        assert part.bound <= whole.bound


def test_where_too_many_blocks_are_possible_the_block_model_stands_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ortools")
    instance = small_instance(0, 5)
    least = least_transfer(instance)
    monkeypatch.setattr(cover, "MOST_BLOCKS", 3)

    answer = best_blocks(instance, least=least, effort=5.0)

    assert answer.bound == solve_blocks(instance, least=least, effort=5.0).bound
