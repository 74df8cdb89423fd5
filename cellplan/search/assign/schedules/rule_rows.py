"""Rows of the block model that keep the rules between tasks."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

from cellplan.search.assign.problem.instance import Instance

Literals = Mapping[tuple[str, Any], Any]


def add_rule_rows(
    model: Any, instance: Instance, *, leads: Literals, joins: Literals, done: Callable[[str, int | str], Any]
) -> None:
    """One robot does the tasks of the same robot; those that are done together lead and join blocks alike.

    Args:
        leads: Whether a task leads a block at a station.
        joins: Whether a task joins a block that another one leads.
        done: Whether a task is done by a robot.
    """
    rules = instance.rules
    for group in rules.same_robot:
        for first, second in pairwise(group):
            for robot in instance.robots:
                model.add(done(first, robot) == done(second, robot))
    for group in rules.together:
        longest = max(group, key=lambda task: (instance.steps(task), task))
        leading = sum(it for (name, _), it in leads.items() if name == longest)
        for task in (name for name in group if name != longest):
            model.add(sum(it for (name, _), it in leads.items() if name == task) == 0)
            model.add(leading == joins.get((task, longest), 0))
            for leader in (it for it in instance.tasks if it != longest):
                both = [joins[it, leader] for it in (task, longest) if (it, leader) in joins]
                if both:
                    model.add(both[0] == (both[1] if len(both) > 1 else 0))


def add_service_rows(
    model: Any, instance: Instance, *, joins: Literals, done: Callable[[str, int | str], Any]
) -> tuple[Any, dict[tuple[str, int], Any]]:
    """Services split the blocks into parts in which no robot does more tasks than between two of its services.

    There are no more parts than tasks fill intervals: at each service some robot has done as many as it may.

    Returns:
        Steps that the services take at least, and whether a task is done in a part; none without services.
    """
    services, tasks = instance.rules.services, instance.tasks
    last = (len(tasks) - 1) // min((it.most for it in services.values()), default=len(tasks))
    if last <= 0:
        return 0, {}
    within = {(task, part): model.new_bool_var("") for task in tasks for part in range(last + 1)}
    begun = [model.new_bool_var("") for _ in range(last)]
    parts = {task: sum(part * within[task, part] for part in range(last + 1)) for task in tasks}
    for task in tasks:
        model.add_exactly_one(within[task, part] for part in range(last + 1))
        for part, begins in enumerate(begun, start=1):
            model.add_implication(within[task, part], begins)
        for first in (it for it in instance.goals[task].after if it in parts):
            model.add(parts[task] >= parts[first])
    for earlier, later in pairwise(begun):
        model.add_implication(later, earlier)
    for (task, leader), join in joins.items():
        model.add(parts[task] == parts[leader]).only_enforce_if(join)
    for robot, service in services.items():
        model.add(sum(done(task, robot) for task in tasks) <= service.most * (1 + sum(begun)))
        for part in range(last + 1):
            both = [(model.new_bool_var(""), done(task, robot), within[task, part]) for task in tasks]
            for it, is_done, is_within in both:
                model.add(it >= is_done + is_within - 1)
            model.add(sum(it for it, _, _ in both) <= service.most)
    return sum(begun) * min(it.steps for it in services.values()), within


def add_rest_rows(
    model: Any, instance: Instance, *, leads: Literals, joins: Literals, least: int, objective: Any
) -> dict[str, Any]:
    """Blocks follow one another, later where the part must cool, and the cycle lasts to the end of the last one.

    Args:
        least: Steps that every transfer between two blocks takes at least.
        objective: Steps of the cycle.

    Returns:
        The begin of the block of each task, less a transfer; none where nothing must cool.
    """
    lags, tasks = instance.rules.lags, instance.tasks
    if not lags:
        return {}
    horizon = sum(instance.steps(task) + least for task in tasks) + sum(lags.values())
    begins = {task: model.new_int_var(0, horizon, "") for task in tasks}
    sizes = {task: instance.steps(task) + least for task in tasks}
    model.add_no_overlap(
        [
            model.new_optional_fixed_size_interval_var(begins[task], sizes[task], lead, "")
            for (task, _), lead in leads.items()
        ]
    )
    for (task, leader), join in joins.items():
        model.add(begins[task] == begins[leader]).only_enforce_if(join)
    for task in tasks:
        model.add(objective >= begins[task] + sizes[task])
        for first in (it for it in instance.goals[task].after if it in begins):
            model.add(begins[task] >= begins[first] + sizes[first])
    for first, later in (pair for pair in lags if pair[0] < pair[1] and begins.keys() >= {*pair}):
        comes_first = model.new_bool_var("")
        model.add(begins[later] >= begins[first] + lags[first, later]).only_enforce_if(comes_first)
        model.add(begins[first] >= begins[later] + lags[later, first]).only_enforce_if(comes_first.negated())
    return begins
