"""The instance that a schedule is made for: few stations, the free modes at them, times in whole steps, conflicts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, product
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.straight_time import straight_steps
from cellplan.search.assign.problem.clearance import AssignmentClearance
from cellplan.search.assign.problem.durations import stand_off_steps
from cellplan.search.assign.problem.goals import Stations, TaskGoal
from cellplan.search.assign.problem.rules import TaskRules
from cellplan.search.assign.problem.table import Key, TaskMode

Conflict = frozenset[Key]  # two of task, robot and station that cannot be at work together
EndIdentity = tuple[str, str, bool, bytes]  # task, robot, direction and where it begins


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class End:
    """One way to begin and end a task."""

    mode: TaskMode
    is_reversed: bool
    planned: Array | None = None  # where it leaves the task as it was planned, shape (n,); None where the mode has it

    @property
    def begin(self) -> Array:
        """Configuration in which the robot comes to the task in [rad] or [m], shape (n,)."""
        return self.mode.q[-1 if self.is_reversed else 0]

    @property
    def end(self) -> Array:
        """Configuration in which it leaves the task, shape (n,)."""
        return self.mode.q[0 if self.is_reversed else -1] if self.planned is None else self.planned

    @property
    def identity(self) -> EndIdentity:
        """Task, robot, direction and where it begins: what is planned depends on nothing else."""
        return self.mode.task, self.mode.robot, self.is_reversed, self.begin.tobytes()


COMES: Final = "comes to it"  # at a via point; no task has such a name: names have no spaces
READY: Final = "is ready"  # for its task, while others pass via points before theirs
LEAVES: Final = "leaves it"
DONE: Final = "is done"
SIDES: Final = {COMES: -1, READY: -1, LEAVES: 1, DONE: 1}  # before its task, or after it


def standing(robot: str, q: Array, why: str) -> End:
    """A configuration in which a robot stands before a task or after it."""
    mode = TaskMode(task=why, robot=robot, station=-1, spin=0.0, q=np.stack([q, q]), margin=0.0)
    return End(mode=mode, is_reversed=False)


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
    columns: Mapping[int, frozenset[Key]] = field(default_factory=dict)  # tasks of blocks with moving parts, by station
    planned: Mapping[EndIdentity, Array] = field(default_factory=dict)  # where tools with a free spin leave their tasks

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
            self.with_modes({key: modes for key, modes in self.modes.items() if key[1] != robot}),
            conflicts=frozenset(it for it in self.conflicts if all(key[1] != robot for key in it)),
        )

    def with_modes(self, modes: Mapping[Key, tuple[TaskMode, ...]]) -> Self:
        """The same with other modes, without columns that lack a task then, or have a conflict."""
        whole = {
            station: keys
            for station, keys in self.columns.items()
            if keys <= modes.keys() and not any(it <= keys for it in self.conflicts)
        }
        broken = self.columns.keys() - whole.keys()
        return replace(
            self,
            modes={key: it for key, it in modes.items() if key[2] not in broken},
            used=tuple(it for it in self.used if it not in broken),
            columns=whole,
        )

    def steps(self, task: str) -> int:
        """Whole steps of a task."""
        return self.goals[task].steps

    def late_steps(self, end: End | None) -> int:
        """Steps of a retimed task beyond the least, as its mode is slow in approach and retraction."""
        least = None if end is None or end.mode.task not in self.goals else self.goals[end.mode.task].stand_off_steps
        if end is None or least is None:
            return 0
        return max(0, stand_off_steps(end.mode, self.bounds[end.mode.robot], self.step) - least)

    def ends(self, task: str, robot: str, station: int) -> list[End]:
        """All modes in all directions."""
        ends = [End(mode=mode, is_reversed=it) for mode in self.modes[task, robot, station] for it in mode.directions]
        return [replace(end, planned=self.planned.get(end.identity)) for end in ends] if self.planned else ends

    def of_stops(self, stops: Iterable[Sequence[End | None]]) -> Self:
        """The same with nothing but the modes and directions in some stops."""
        ends = [end for stop in stops for end in stop if end is not None]
        modes = ((end.mode, replace(end.mode, directions=(end.is_reversed,))) for end in ends)
        return self.with_modes({(it.task, it.robot, it.station): (only,) for it, only in modes})

    def transfer_steps(self, robot: str, first: Array, second: Array) -> Indices:
        """Whole steps of straight moves from rest to rest, broadcast over configurations of shape (..., n)."""
        return straight_steps(np.asarray(first), np.asarray(second), self.bounds[robot], self.step)

    def station_steps(self, first: int | None, second: int | None) -> int:
        """Whole steps that the holder takes between two stations; None stands for its home."""
        return 0 if self.stations.holder is None else self._part_steps[first, second]

    @cached_property
    def _part_steps(self) -> dict[tuple[int | None, int | None], int]:
        """Those between all stations in use."""
        holder, used = str(self.stations.holder), list(self.used)
        places: list[int | None] = [None, *used]
        leaves, comes = (np.stack([self.homes[holder], *it[used]]) for it in (self.stations.left, self.stations.q))
        steps = self.transfer_steps(holder, leaves[:, None], comes[None])
        return {(a, b): int(steps[i, k]) for (i, a), (k, b) in product(enumerate(places), repeat=2)}


def with_rules(instance: Instance, rules: TaskRules) -> Instance:
    """The same with rules: robots that can do all tasks of a group, conflicts by heat and of arcs too near."""
    modes = dict(instance.modes)
    for group in rules.same_robot:
        able = set.intersection(*({by for name, by, _ in modes if name == task} for task in group))
        modes = {key: it for key, it in modes.items() if key[0] not in group or key[1] in able}
    apart = {
        frozenset((first, second))
        for first, second in combinations(modes, 2)
        if first[0] != second[0] and first[1] != second[1] and first[2] == second[2]
        if (first[0], second[0]) in rules.lags or _are_crowded(rules, modes, first, second)
    }
    return replace(instance, rules=rules, conflicts=instance.conflicts | apart).with_modes(modes)


def _are_crowded(rules: TaskRules, modes: Mapping[Key, Sequence[TaskMode]], first: Key, second: Key) -> bool:
    """Whether the arcs of two tasks come too near in all directions in which they may be done."""
    a, b = ({it for mode in modes[key] for it in mode.directions} for key in (first, second))
    return all(rules.is_crowded((first[0], second[0]), both) for both in product(a, b))


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


def find_conflicts(modes: Mapping[Key, Sequence[TaskMode]], clearance: AssignmentClearance) -> frozenset[Conflict]:
    """Tasks of two robots at one station that come too near each other, by their best modes."""
    at_station: dict[int, list[Key]] = {}
    for key in modes:
        at_station.setdefault(key[2], []).append(key)
    return frozenset(it for keys in at_station.values() for it in _conflicts_of(keys, modes, clearance))


def _conflicts_of(
    keys: Sequence[Key], modes: Mapping[Key, Sequence[TaskMode]], clearance: AssignmentClearance
) -> list[Conflict]:
    """Likewise, of the tasks at one station."""
    pairs = [(a, b) for a, b in combinations(keys, 2) if a[0] != b[0] and a[1] != b[1]]
    places = clearance.answers(
        "conflicts",
        str(pairs),
        lambda: [place for place, (a, b) in enumerate(pairs) if clearance.meet(modes[a][0], modes[b][0])],
    )
    return [frozenset(pairs[place]) for place in places]
