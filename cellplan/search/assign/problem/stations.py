"""Stations: the few poses of the part that are in use, by greedy cover, with the modes that are free of collisions."""

from collections.abc import Collection, Sequence
from itertools import islice
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.search.assign.problem.clearance import AssignmentClearance
from cellplan.search.assign.problem.goals import TaskGoal
from cellplan.search.assign.problem.rules import TaskRules
from cellplan.search.assign.problem.table import Key, ModeTable, TaskMode

MOST_FREE: Final = 2  # free modes of one robot for one task at one station
SECOND: Final = 0.25  # [-] worth of a pose for a task and a robot, over those that they have already and one
WORTHLESS: Final = 0.05  # [-] share of the tasks: a station that is worth less is left out once all tasks are covered
APART: Final = 0.3  # [rad, m] stations nearer than that to a chosen one are left out once all tasks are covered
VAIN: Final = 60  # stations that may turn out to cover none of the tasks that are left before those are given up
DEAR: Final = 10.0  # [-] times the work of all tasks: what a task or a group that is not possible counts
EQUAL: Final = 1e-3  # [-] of work that decides between robots and stations where the load does not

FreeModes = dict[Key, tuple[TaskMode, ...]]


def choose_stations(
    table: ModeTable,
    goals: Sequence[TaskGoal],
    clearance: AssignmentClearance,
    *,
    most: int,
    rules: TaskRules = TaskRules(),  # noqa: B008 - frozen
) -> tuple[tuple[int, ...], FreeModes]:
    """Stations by greedy cover, with the free modes at them.

    First those that cover tasks and shorten the time that all robots together need, as far as loads tell; then those
    that give most tasks further robots and poses.

    Args:
        most: Number of stations at most.
        rules: Groups of tasks that must be possible too.
    """
    cover = _Cover(table, goals, clearance, rules)
    while len(cover.used) < most and (station := cover.least_loaded()) is not None:
        cover.examine(station, only_if_better=True)
    while len(cover.used) < most and (station := cover.worthiest()) is not None:
        cover.examine(station, only_if_better=False)
    return tuple(cover.used), cover.modes


class _Cover:
    """Stations that were chosen, and those that are left."""

    def __init__(
        self, table: ModeTable, goals: Sequence[TaskGoal], clearance: AssignmentClearance, rules: TaskRules
    ) -> None:
        self._table, self._clearance, self._rules = table, clearance, rules
        self._keys: dict[int, list[Key]] = {}
        for key in table.modes:
            self._keys.setdefault(key[2], []).append(key)
        stations = sorted(self._keys)
        is_open = clearance.answers("open stations", str(stations), lambda: [*map(clearance.is_open, stations)])
        self._left = [station for station, it in zip(stations, is_open, strict=True) if it]
        self._robots = sorted({robot for _, robot, _ in table.modes})
        options = [sum(key[0] == goal.name for key in table.modes) for goal in goals]
        order = sorted(range(len(goals)), key=lambda place: (options[place], -goals[place].steps, place))
        self._tasks = [goals[place].name for place in order]  # scarce ones first
        self._steps = np.array([goals[place].steps for place in order], dtype=float)
        self._able = np.zeros((0, len(order), len(self._robots)), dtype=bool)  # at the stations in use
        self._vain = 0
        self.used: list[int] = []
        self.modes = FreeModes()

    def least_loaded(self) -> int | None:
        """The station with which the work takes least time, by loads; None where none makes it shorter."""
        if not self._left or self._vain >= VAIN:
            return None
        loads = self._loads([self._keys[station] for station in self._left])
        best = int(np.argmin(loads))
        return self._left[best] if loads[best] < self._loads([()])[0] else None

    def worthiest(self) -> int | None:
        """The station at which most tasks get further robots or poses; None where it is worth too little."""
        q, count = self._clearance.stations.q, self._able.sum(axis=0)
        apart = [it for it in self._left if all(np.abs(q[it] - q[other]).max() > APART for other in self.used)]
        worth = {
            station: round(float((self._flags(self._keys[station]) * SECOND / (1 + count)).sum()), 6)
            for station in apart
        }
        best = max(worth, key=lambda station: (worth[station], -station), default=None)
        return None if best is None or worth[best] < WORTHLESS * len(self._tasks) else best

    def examine(self, station: int, *, only_if_better: bool) -> None:
        """Take a station, with its free modes; one that makes the work no shorter may be left."""
        self._left.remove(station)
        free = self._free(self._keys[station])
        if not free or (only_if_better and self._loads([free])[0] >= self._loads([()])[0]):
            self._vain += 1
            return
        self._able = np.concatenate([self._able, self._flags(free)[None]])
        self.used.append(station)
        self.modes |= free

    def _flags(self, keys: Collection[Key]) -> Flags:
        """Which tasks which robots can do, shape (tasks, robots)."""
        able = {key[:2] for key in keys}
        return np.array([[(task, robot) in able for robot in self._robots] for task in self._tasks], dtype=bool)

    def _loads(self, trials: Sequence[Collection[Key]]) -> Array:
        """Time of the work with one more station in [steps], what cannot be done counted dearly, shape (K,).

        Each task goes where the busiest robot of a station gets least more to do.

        Args:
            trials: Keys of the modes at that station.
        """
        count, dear = len(trials), DEAR * self._steps.sum()
        flags = np.array([self._flags(keys) for keys in trials])
        able = np.concatenate([np.repeat(self._able[None], count, axis=0), flags[:, None]], axis=1)
        loads = np.zeros((count, able.shape[1], able.shape[3]))
        total = dear * np.array([self._groups_left(keys) for keys in trials], dtype=float)
        rows = np.arange(count)
        for place, steps in enumerate(self._steps):
            longer = loads + steps
            busiest = loads.max(axis=2, keepdims=True)
            more = np.where(able[:, :, place], np.maximum(longer - busiest, 0.0) + EQUAL * longer, np.inf)
            best = more.reshape(count, -1).argmin(axis=1)
            is_done = np.isfinite(more.reshape(count, -1)[rows, best])
            loads.reshape(count, -1)[rows[is_done], best[is_done]] += steps
            total[~is_done] += dear
        return total + loads.max(axis=2).sum(axis=1)

    def _groups_left(self, keys: Collection[Key]) -> float:
        """Groups of tasks that are not possible at the stations in use and one more."""
        if not self._rules.grouped:
            return 0.0
        return self._rules.grouped - self._rules.covered([*self.modes, *keys], self._meet)

    def _meet(self, first: Key, second: Key) -> bool:
        """Whether two tasks at a station in use cannot be done at once."""
        modes = self.modes
        return first in modes and second in modes and self._clearance.meet(modes[first][0], modes[second][0])

    def _free(self, keys: Sequence[Key]) -> FreeModes:
        """The first modes of each task and robot that are free of collisions."""
        modes = [self._table.modes[key] for key in keys]

        def examined() -> list[list[int]]:
            free = ((place for place, it in enumerate(one) if self._clearance.is_free(it)) for one in modes)
            return [list(islice(places, MOST_FREE)) for places in free]

        answer = self._clearance.answers("free modes", str(keys), examined)
        return {
            key: tuple(one[place] for place in places)
            for key, one, places in zip(keys, modes, answer, strict=True)
            if places
        }
