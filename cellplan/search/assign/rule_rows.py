"""Rows of the block model that keep the rules between tasks."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

from cellplan.search.assign.instance import Instance

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
