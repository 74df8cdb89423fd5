"""Exchanges of tasks between blocks are schedules of the instance that take no longer."""

import pytest
from builders.assignments import small_instance

from cellplan.search.assign.schedules.greedy import greedy_schedule
from cellplan.search.assign.schedules.schedule import refuse_impossible
from cellplan.search.assign.schedules.transfers import exchanges


@pytest.mark.parametrize("chained", [False, True])
def test_exchanges_keep_all_that_a_schedule_has_to_keep(chained: bool) -> None:
    count = 0
    for seed in range(12):
        instance = small_instance(seed, 7, stations=1, chained=chained)
        schedule = greedy_schedule(instance)

        for trial in exchanges(schedule, instance):
            refuse_impossible(instance, trial)
            assert trial.work(instance) <= schedule.work(instance)
            assert trial.chosen == schedule.chosen
            assert sum(a != b for a, b in zip(trial.blocks, schedule.blocks, strict=True)) == 2
            count += 1
    assert count > 5
