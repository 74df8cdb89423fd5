"""The instance that a schedule is made for: few stations, the free modes at them, times in whole steps, conflicts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.straight_time import straight_steps
from cellplan.search.assign.clearance import AssignmentClearance
from cellplan.search.assign.goals import Stations, TaskGoal
from cellplan.search.assign.rules import TaskRules
from cellplan.search.assign.table import Key, ModeTable, TaskMode

MOST_MODES: Final = 2  # free modes of one robot for one task at one station
SECOND: Final = 0.25  # [-] worth of a further robot for a task that another one can do already, over their number
WORTHLESS: Final = 0.05  # [-] share of the tasks: a station that is worth less is left out once all tasks are covered
APART: Final = 0.3  # [rad, m] stations nearer than that to a chosen one are left out once all tasks are covered

Conflict = frozenset[Key]  # two of task, robot and station that cannot be at work together


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class End:
    """One way to begin and end a task."""

    mode: TaskMode
    is_reversed: bool

    @property
    def begin(self) -> Array:
        """Configuration in which the robot comes to the task in [rad] or [m], shape (n,)."""
        return self.mode.q[-1 if self.is_reversed else 0]

    @property
    def end(self) -> Array:
        """Configuration in which it leaves the task, shape (n,)."""
        return self.mode.q[0 if self.is_reversed else -1]


@dataclass(eq=False, kw_only=True)
class Instance:
    """What a schedule is made for."""

    goals: Mapping[str, TaskGoal]  # by task
    robots: tuple[str, ...]  # operators
    modes: Mapping[Key, tuple[TaskMode, ...]]  # free ones, at the stations in use
    stations: Stations
    used: tuple[int, ...]  # stations in use
    conflicts: frozenset[Conflict]
    homes: Mapping[str, Array]  # configurations in [rad] or [m] by robot, the holder's among them, shape (n,) each
    bounds: Mapping[str, JointLimitsInTime]  # limits of the joints by robot, likewise
    step: float  # time between two rows in [s]
    rules: TaskRules = TaskRules()  # noqa: RUF009 - frozen

    @cached_property
    def tasks(self) -> tuple[str, ...]:
        """Tasks that some robot can do at a station in use."""
        able = {task for task, _, _ in self.modes}
        return tuple(name for name in self.goals if name in able)

    @cached_property
    def options(self) -> dict[str, list[tuple[str, int]]]:
        """Robots and stations of each task."""
        return {
            task: [(robot, at) for robot in self.robots for at in self.used if (task, robot, at) in self.modes]
            for task in self.tasks
        }

    def stations_of(self, task: str) -> set[int]:
        """Stations at which a task can be done."""
        return {station for _, station in self.options[task]}

    def without(self, robot: str) -> Self:
        """The same with a robot that does no task."""
        return replace(
            self,
            modes={key: modes for key, modes in self.modes.items() if key[1] != robot},
            conflicts=frozenset(it for it in self.conflicts if all(key[1] != robot for key in it)),
        )

    def steps(self, task: str) -> int:
        """Whole steps of a task."""
        return self.goals[task].steps

    def ends(self, task: str, robot: str, station: int) -> list[End]:
        """All modes in all directions."""
        return [End(mode=mode, is_reversed=it) for mode in self.modes[task, robot, station] for it in mode.directions]

    def transfer_steps(self, robot: str, first: Array, second: Array) -> Indices:
        """Whole steps of straight moves from rest to rest, broadcast over configurations of shape (..., n)."""
        return straight_steps(np.asarray(first), np.asarray(second), self.bounds[robot], self.step)

    def station_steps(self, first: int | None, second: int | None) -> int:
        """Whole steps that the holder takes between two stations; None stands for its home."""
        holder = self.stations.holder
        if holder is None:
            return 0
        a, b = (self.homes[holder] if it is None else self.stations.q[it] for it in (first, second))
        return int(self.transfer_steps(holder, a, b))


def with_rules(instance: Instance, rules: TaskRules) -> Instance:
    """The same with rules between tasks; tasks of one robot keep the modes of robots that can do all of them."""
    modes = dict(instance.modes)
    for group in rules.same_robot:
        able = set.intersection(*({by for name, by, _ in modes if name == task} for task in group))
        modes = {key: it for key, it in modes.items() if key[0] not in group or key[1] in able}
    return replace(instance, modes=modes, rules=rules)


def least_transfer(instance: Instance) -> int:
    """Steps that every transfer to a block takes at least: from task to task, from home, or of the part."""
    shortest = [
        int(instance.transfer_steps(robot, instance.homes[robot], end.begin))
        for task, robot, station in instance.modes
        for end in instance.ends(task, robot, station)
    ]
    for robot in instance.robots:
        for station in instance.used:
            tasks = [task for task, by, at in instance.modes if (by, at) == (robot, station)]
            ends = [(place, end) for place, task in enumerate(tasks) for end in instance.ends(task, robot, station)]
            if len(tasks) > 1:
                leaves, comes = (np.array([getattr(end, side) for _, end in ends]) for side in ("end", "begin"))
                steps = instance.transfer_steps(robot, leaves[:, None], comes[None])
                places = np.array([place for place, _ in ends])
                shortest.append(int(steps[places[:, None] != places[None]].min()))
    shortest += [instance.station_steps(a, b) for a in instance.used for b in instance.used if a != b]
    return min(shortest)


def choose_stations(
    table: ModeTable,
    goals: Sequence[TaskGoal],
    clearance: AssignmentClearance,
    *,
    most: int,
    rules: TaskRules = TaskRules(),  # noqa: B008 - frozen
) -> tuple[tuple[int, ...], dict[Key, tuple[TaskMode, ...]]]:
    """Stations by greedy cover, with the free modes at them.

    A station is worth most where tasks can be done that none of those chosen has a mode for, then where further robots
    can do them.

    Args:
        most: Number of stations at most.
        rules: Groups of tasks that must be possible too.
    """

    def meet(first: Key, second: Key) -> bool:
        return first in modes and second in modes and clearance.meet(modes[first][0], modes[second][0])

    at_station: dict[int, list[Key]] = {}
    for key in table.modes:
        at_station.setdefault(key[2], []).append(key)
    candidates = {station for station in sorted(at_station) if clearance.is_open(station)}
    able: dict[str, int] = dict.fromkeys((goal.name for goal in goals), 0)
    used, modes = list[int](), dict[Key, tuple[TaskMode, ...]]()
    while candidates and len(used) < most:
        worth = {station: _worth(at_station[station], able) for station in sorted(candidates)}
        covered = rules.covered(modes, meet)
        for station in worth if covered < rules.grouped else ():
            worth[station] += rules.covered([*modes, *at_station[station]], meet) - covered
        best = max(worth, key=lambda station: (worth[station], -station))
        if worth[best] < WORTHLESS * len(goals) and all(able.values()):
            break
        candidates.discard(best)
        here = {key: free for key in at_station[best] if (free := _free(table.modes[key], clearance))}
        if here:
            used.append(best)
            modes |= here
        for task, _, _ in here:
            able[task] += 1
        if all(able.values()):
            q = clearance.stations.q
            candidates = {it for it in candidates if np.abs(q[it] - q[best]).max() > APART}
    return tuple(used), modes


def _worth(keys: Sequence[Key], able: Mapping[str, int]) -> float:
    """What the modes at a station add to robots that are able to do each task."""
    robots: dict[str, int] = {}
    for task, _, _ in keys:
        robots[task] = robots.get(task, 0) + 1
    worth = ((1.0 if able[task] == 0 else SECOND / (1 + able[task])) + 0.01 * count for task, count in robots.items())
    return round(sum(worth), 6)


def _free(modes: Sequence[TaskMode], clearance: AssignmentClearance) -> tuple[TaskMode, ...]:
    """The first modes that are free of collisions."""
    free: list[TaskMode] = []
    for mode in modes:
        if len(free) < MOST_MODES and clearance.is_free(mode):
            free.append(mode)
    return tuple(free)


def find_conflicts(modes: Mapping[Key, Sequence[TaskMode]], clearance: AssignmentClearance) -> frozenset[Conflict]:
    """Tasks of two robots at one station that come too near each other, by their best modes."""
    at_station: dict[int, list[Key]] = {}
    for key in modes:
        at_station.setdefault(key[2], []).append(key)
    return frozenset(
        frozenset((first, second))
        for keys in at_station.values()
        for first, second in combinations(keys, 2)
        if first[0] != second[0] and first[1] != second[1] and clearance.meet(modes[first][0], modes[second][0])
    )
