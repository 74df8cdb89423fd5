r"""The block model: which tasks begin together, by which robots and at which stations; for CP-SAT.

Task i is done by robot r at station s where :math:`x_{irs} = 1`. A block is led by its longest task, and the others
join it. The cycle is at least

.. math:: \sum_{i \text{ leads}} (d_i + \tau) + \text{tour of the part}

with the durations d and the least transfer :math:`\tau`. At each station the leaders last as long, and are as many, as
the tasks of any clique, which makes the bound.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Final

from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.problem.table import Key
from cellplan.search.assign.schedules.cliques import cliques_at
from cellplan.search.assign.schedules.rule_rows import add_rest_rows, add_rule_rows, add_service_rows
from cellplan.search.assign.schedules.schedule import BlockSchedule, Choice, in_order
from cellplan.search.assign.schedules.solver import Solved, new_model

HORIZON: Final = 10_000_000  # [steps] no cycle is longer


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockAnswer:
    """What the block model comes to."""

    schedule: BlockSchedule | None  # None where none is found
    bound: int | None  # [steps] no schedule of the instance has a shorter cycle, by the model; None without a solver
    is_proved: bool  # whether none is better by the model
    others: tuple[BlockSchedule, ...] = ()  # nearly as good by the model, the best one first


def solve_blocks(instance: Instance, *, least: int, effort: float, hint: BlockSchedule | None = None) -> BlockAnswer:
    """The schedule with the shortest cycle by the model.

    Args:
        least: Steps that every transfer between two blocks takes at least.
        effort: Work in units of deterministic time, about seconds of one processor.
        hint: A schedule that is known.
    """
    model = _BlockModel(instance, least)
    solved = Solved(model.model, effort, () if hint is None else model.hints(hint))
    schedules = (model.schedule(solved, answer) for answer in range(len(solved.answers)))
    different = list({schedule.identity: schedule for schedule in schedules}.values())
    return BlockAnswer(
        schedule=next(iter(different), None),
        bound=solved.bound,
        is_proved=solved.is_proved,
        others=tuple(different[1:]),
    )


class _BlockModel:
    """The variables and rows of the model."""

    def __init__(self, instance: Instance, least: int) -> None:
        self.instance, self.model = instance, new_model()
        tasks, options = instance.tasks, instance.options
        self._order = {task: (instance.steps(task), task) for task in tasks}
        self.does = {(task, *choice): self._flag() for task in tasks for choice in options[task]}
        self._places: dict[tuple[str, int | str], list[Any]] = {}  # by task and station, and by task and robot
        for (task, robot, at), it in self.does.items():
            self._places.setdefault((task, at), []).append(it)
            self._places.setdefault((task, robot), []).append(it)
        self.leads = {(task, at): self._flag() for task in tasks for at in sorted({at for _, at in options[task]})}
        self.joins = {
            (task, leader): self._flag()
            for task in tasks
            for leader in tasks
            if self._order[task] < self._order[leader]
            and self.instance.stations_of(task) & self.instance.stations_of(leader)
        }
        self._every_task_once()
        self._together()
        self._no_conflicts()
        self._cliques()
        _add_column_rows(self.model, instance, self.does, self.leads)
        self._in_order()
        add_rule_rows(self.model, instance, leads=self.leads, joins=self.joins, done=self._done)
        cost = sum(lead * (instance.steps(task) + least) for (task, _), lead in self.leads.items()) + self._tour(least)
        cleaning, self._within = add_service_rows(self.model, instance, joins=self.joins, done=self._done)
        objective = self.model.new_int_var(0, HORIZON, "")
        self.model.add(objective >= cost + cleaning)
        self.begins = add_rest_rows(
            self.model, instance, leads=self.leads, joins=self.joins, least=least, objective=objective
        )
        self.model.minimize(objective)

    def schedule(self, solved: Solved, answer: int) -> BlockSchedule:
        """The blocks of an answer."""
        chosen: dict[str, Choice] = {task: (robot, at) for task, robot, at in solved.true(self.does, answer)}
        blocks = {leader: [leader] for leader, _ in solved.true(self.leads, answer)}
        for task, leader in solved.true(self.joins, answer):
            blocks[leader].append(task)
        values = solved.answers[answer]
        begins = {task: values[it.index] for task, it in self.begins.items()}
        parts = dict(solved.true(self._within, answer))
        times = {task: (begins.get(task, 0), parts.get(task, 0)) for task in chosen}
        sorted_blocks = sorted(map(tuple, blocks.values()), key=lambda block: times[block[0]])
        ordered = in_order(sorted_blocks, self.instance.goals)
        return BlockSchedule(blocks=ordered or (), chosen=chosen)

    def hints(self, schedule: BlockSchedule) -> list[tuple[Any, bool]]:
        """The values that a schedule has."""
        leader = {task: max(block, key=self._order.__getitem__) for block in schedule.blocks for task in block}
        chosen = schedule.chosen
        hints = [(it, chosen[task] == (robot, at)) for (task, robot, at), it in self.does.items()]
        hints += [(it, leader[task] == other) for (task, other), it in self.joins.items()]
        return [
            *hints,
            *((it, leader[task] == task and chosen[task][1] == at) for (task, at), it in self.leads.items()),
        ]

    def _flag(self) -> Any:
        return self.model.new_bool_var("")

    def _done(self, task: str, place: int | str) -> Any:
        """Whether a task is done at a station, or by a robot."""
        return sum(self._places.get((task, place), ()))

    def _every_task_once(self) -> None:
        """Every task is done once, and leads a block or joins one."""
        for task in self.instance.tasks:
            self.model.add_exactly_one(it for (name, _, _), it in self.does.items() if name == task)
            leads = [it for (name, _), it in self.leads.items() if name == task]
            self.model.add_exactly_one([*leads, *(it for (name, _), it in self.joins.items() if name == task)])
        for (task, station), lead in self.leads.items():
            self.model.add(lead <= self._done(task, station))

    def _together(self) -> None:
        """Tasks of a block are done at one station by different robots."""
        model, robots = self.model, self.instance.robots
        for (task, leader), join in self.joins.items():
            for station in self.instance.stations_of(task) | self.instance.stations_of(leader):
                model.add(self._done(task, station) == self._done(leader, station)).only_enforce_if(join)
            model.add(sum(it for (name, _), it in self.leads.items() if name == leader) == 1).only_enforce_if(join)
            for robot in robots:
                model.add(self._done(task, robot) + self._done(leader, robot) <= 1).only_enforce_if(join)
        for first, second, joins in self._joining_pairs():
            for robot in robots:
                model.add(self._done(first, robot) + self._done(second, robot) <= 1).only_enforce_if(*joins)

    def _joining_pairs(self) -> list[tuple[str, str, tuple[Any, Any]]]:
        """Two tasks that may join one leader, and the literals of both."""
        by_leader: dict[str, list[str]] = {}
        for task, leader in self.joins:
            by_leader.setdefault(leader, []).append(task)
        return [
            (first, second, (self.joins[first, leader], self.joins[second, leader]))
            for leader, tasks in by_leader.items()
            for first, second in combinations(tasks, 2)
        ]

    def _no_conflicts(self) -> None:
        """Two tasks with a conflict are not in one block."""
        shared: dict[frozenset[str], list[tuple[Any, ...]]] = {}
        for pair, join in self.joins.items():
            shared.setdefault(frozenset(pair), []).append((join,))
        for first, second, joins in self._joining_pairs():
            shared.setdefault(frozenset((first, second)), []).append(joins)
        for conflict in sorted(self.instance.conflicts, key=sorted):
            keys = sorted(conflict)
            if all(key in self.does for key in keys):
                for joins in shared.get(frozenset(key[0] for key in keys), ()):
                    self.model.add_bool_or(*(self.does[key].negated() for key in keys), *(it.negated() for it in joins))

    def _cliques(self) -> None:
        """The leaders at a station last at least as long, and are as many, as the tasks of any clique."""
        steps = self.instance.steps
        for station in self.instance.used:
            leads = [(task, it) for (task, at), it in self.leads.items() if at == station]
            alone = [[(task, robot)] for task, robot, at in self.does if at == station]
            for clique in [*cliques_at(self.instance, station), *alone]:
                done = [(task, self.does[task, robot, station]) for task, robot in clique]
                self.model.add(
                    sum(it * steps(task) for task, it in leads) >= sum(it * steps(task) for task, it in done)
                )
                self.model.add(sum(it for _, it in leads) >= sum(it for _, it in done))

    def _in_order(self) -> None:
        """Tasks come in later blocks than those that they must follow."""
        tasks = self.instance.tasks
        pairs = [(task, first) for task in tasks for first in self.instance.goals[task].after if first in tasks]
        if not pairs:
            return
        place = {task: self.model.new_int_var(0, len(tasks) - 1, "") for task in tasks}
        for task, first in pairs:
            self.model.add(place[task] > place[first])
        for (task, leader), join in self.joins.items():
            self.model.add(place[task] == place[leader]).only_enforce_if(join)

    def _tour(self, least: int) -> Any:
        """Steps of the part from home over all stations in use and back, beyond the transfers that are counted."""
        instance, used = self.instance, {station: self._flag() for station in self.instance.used}
        for (_, _, station), it in self.does.items():
            self.model.add_implication(it, used[station])
            if station in instance.columns:  # where none is done there, its two ends are no short cut
                self.model.add_implication(used[station], it)
        places: Sequence[int | None] = (None, *instance.used)
        arcs, cost = [(place, place, used[at].negated()) for place, at in enumerate(places) if at is not None], []
        for i, first in enumerate(places):
            for j, second in enumerate(places):
                if i != j:
                    goes = self._flag()
                    arcs.append((i, j, goes))
                    counted = 0 if second is None else least  # one of the transfers of the blocks is that of the part
                    cost.append(goes * max(instance.station_steps(first, second) - counted, 0))
        self.model.add_circuit(arcs)
        return sum(cost)


def _add_column_rows(model: Any, instance: Instance, does: Mapping[Key, Any], leads: Mapping[Any, Any]) -> None:
    """The tasks of a column are done in one block, all or none."""
    for station, keys in instance.columns.items():
        first, *others = sorted(keys)
        for key in others:
            model.add(does[key] == does[first])
        model.add(sum(it for (_, at), it in leads.items() if at == station) <= 1)
