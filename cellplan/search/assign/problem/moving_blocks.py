r"""Moving blocks: the holder's last joint turns the part while tools that hardly move work on it, several at a time.

A path is coaxial with that joint where a tool that stands still follows it while the joint turns: the tool poses
:math:`X_{PT}(s) = M(\varphi(s))^{-1} X_{PT}(0)` with the motion M of the part by an angle of the joint. Tasks whose
angles are the same at all times can share one turn of the part. What is chosen here are candidates: how arms and holder
really move follows from their redundancy.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import inverse, rotation_vector
from cellplan.model.cell.cell import Cell
from cellplan.search.assign.problem.clearance import ScenesByRobot
from cellplan.search.assign.problem.goals import Stations, TaskGoal
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.problem.table import MARGIN, Key, ModeSearch, TaskMode

OFF_AXIS: Final = 2e-3  # [m] that a coaxial path is beside the one that the turn gives
OFF_TURN: Final = float(np.radians(2.0))  # [rad] likewise of its orientations, and of angles of tasks in one block
LEAST_TURN: Final = float(np.radians(5.0))  # a shorter one is no arc
MOST_BEGINS: Final = 24  # of one task in one direction, those with short moves of the part first
MOST_FREE: Final = 2  # modes of one robot for one task and direction at one begin


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MovingMode:
    """A mode of a coaxial task, and the holder meanwhile."""

    mode: TaskMode  # as if the tool stood still; its station is the place of the begin among those that are compared
    holder_q: Array  # configurations of the holder in [rad] or [m], in the order of time, shape (S + 2, n)
    steps: int  # of the task

    @property
    def is_reversed(self) -> bool:
        """Whether the task is done from its end to its begin."""
        return self.mode.directions == (True,)

    @property
    def q(self) -> Array:
        """Configurations of the robot in the order of time, shape (S + 2, n)."""
        return self.mode.q[::-1] if self.is_reversed else self.mode.q


Candidate = tuple[MovingMode, ...]  # of different tasks and robots


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Column:
    """A block in which the part moves, ready made: how its robots and the holder move in it."""

    modes: tuple[TaskMode, ...]  # one for each of its tasks
    begin: Array  # configuration of the holder at its begin in [rad] or [m], shape (n,)
    end: Array  # and at its end
    X_WP: Array  # the part at its begin, shape (4, 4)

    def at_station(self, station: int) -> dict[Key, tuple[TaskMode, ...]]:
        """Its modes as those of a station."""
        return {(it.task, it.robot, station): (replace(it, station=station),) for it in self.modes}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MovingBlockSearch:
    """What moving blocks are looked for among."""

    cell: Cell
    goals: Sequence[TaskGoal]
    stations: Stations  # in which a block may begin
    spins: Array  # turns of the tool about its axis beside those of the tasks in [rad], shape (S,)
    scenes: ScenesByRobot
    home: Array  # stacked homes of all robots in [rad] or [m], shape (nq,)
    conflict: float  # distance in [m] that two robots at work are to keep

    def candidates(self) -> list[Candidate]:
        """Candidates of all sets of tasks, those with many tasks and short moves of the part first."""
        at_begin: dict[int, list[MovingMode]] = {}
        for option in self._options():
            at_begin.setdefault(option.mode.station, []).append(option)
        every = [it for options in at_begin.values() for it in self._sets(options)]
        return sorted(every, key=self._rank)

    def meet(self, candidate: Candidate) -> bool:
        """Whether two robots come too near each other at the same time."""
        for first, second in combinations(candidate, 2):
            scene = self.scenes.between[tuple(sorted((first.mode.robot, second.mode.robot)))]
            if len(scene.near(self._stacked(first, second), self.conflict).rows):
                return True
        return False

    def _options(self) -> Iterator[MovingMode]:
        """Modes of all coaxial tasks in both directions, the first free ones of each robot at each begin."""
        for goal in self.goals:
            angles = None if goal.is_mirrored else joint_angles(self.cell, goal)
            if angles is None:
                continue
            yield from self._free(replace(goal, is_reversible=False), angles)
            if goal.is_reversible:
                yield from self._free(replace(goal, is_reversible=False, is_mirrored=True), angles - angles[-1])

    def _free(self, goal: TaskGoal, angles: Array) -> Iterator[MovingMode]:
        """Free modes of a task in one direction.

        Args:
            angles: Of the last joint from the begin on, at the poses of the goal, shape (S + 2,).
        """
        begins, model = self.stations.q, self.cell.robot(str(self.stations.holder)).model
        rows = np.repeat(begins[:, None], len(angles), axis=1)
        rows[:, :, -1] += angles
        last = rows[:, :, -1]
        places = np.flatnonzero(np.all((last >= model.lower[-1] + MARGIN) & (last <= model.upper[-1] - MARGIN), axis=1))
        if not places.size:
            return
        X_WP = Stations.of(self.cell, rows[places].reshape(-1, begins.shape[1])).X_WP
        moving = Stations(
            holder=self.stations.holder, q=begins[places], X_WP=X_WP.reshape(len(places), len(angles), 4, 4)
        )
        table = ModeSearch(cell=self.cell, goals=[goal], stations=moving, spins=self.spins).table()
        home = self.home[self.cell.columns(str(moving.holder))]
        moves = np.abs(rows[places][:, [0, -1]] - home).max(axis=2).sum(axis=1)
        able = sorted({at for _, _, at in table.modes}, key=lambda at: (round(float(moves[at]), 6), at))[:MOST_BEGINS]
        for (_, _, at), modes in table.modes.items():
            if at not in able:
                continue
            holder_q = rows[places[at]]
            options = (
                MovingMode(
                    mode=replace(mode, station=int(places[at])),
                    holder_q=holder_q[::-1] if goal.is_mirrored else holder_q,
                    steps=goal.steps,
                )
                for mode in modes
            )
            free = (it for it in options if self._is_free(it))
            yield from (it for it, _ in zip(free, range(MOST_FREE), strict=False))

    def _is_free(self, option: MovingMode) -> bool:
        """Whether the arm keeps its distance from all but the other arms at work."""
        scene, demands = self.scenes.alone[option.mode.robot]
        near = scene.near(self._stacked(option), float(demands.max(initial=0.0)))
        return bool(np.all(near.distances >= demands[near.rows]))

    def _stacked(self, *options: MovingMode) -> Array:
        """Stacked configurations at the same times, all other robots at home, shape (S + 2, nq)."""
        q = np.tile(self.home, (len(options[0].q), 1))
        q[:, self.cell.columns(str(self.stations.holder))] = options[0].holder_q
        for option in options:
            q[:, self.cell.columns(option.mode.robot)] = option.q
        return q

    def _sets(self, options: Sequence[MovingMode]) -> Iterator[Candidate]:
        """All sets of modes with one begin that can be done together as far as tasks, robots and angles tell."""
        by_task: dict[str, list[MovingMode]] = {}
        for option in options:
            by_task.setdefault(option.mode.task, []).append(option)
        after = {goal.name: goal.after for goal in self.goals}
        for size in range(1, len(self.scenes.alone) + 1):
            for tasks in combinations(by_task, size):
                if not any(other in after[task] for task in tasks for other in tasks):
                    yield from filter(_go_together, product(*(by_task[task] for task in tasks)))

    def _rank(self, candidate: Candidate) -> tuple[float, ...]:
        """Many tasks first, then short moves of the part from home and back, then large margins to joint limits."""
        home = self.home[self.cell.columns(str(self.stations.holder))]
        rows = candidate[0].holder_q
        moves = sum(float(np.abs(rows[end] - home).max()) for end in (0, -1))
        return -len(candidate), round(moves, 6), -round(min(it.mode.margin for it in candidate), 6)


def with_columns(instance: Instance, columns: Sequence[Column]) -> Instance:
    """The instance with columns, each of them at a station of its own, which the holder leaves where the block ends."""
    if not columns:
        return instance
    every, first = instance.stations, len(instance.stations.q)
    begins = np.array([column.begin for column in columns])
    stations = replace(
        every,
        q=np.concatenate([every.q, begins]),
        X_WP=np.concatenate([every.X_WP, [column.X_WP for column in columns]]),
        q_end=np.concatenate([every.left, [column.end for column in columns]]),
    )
    modes = [column.at_station(first + place) for place, column in enumerate(columns)]
    return replace(
        instance,
        stations=stations,
        modes={key: it for part in (instance.modes, *modes) for key, it in part.items()},
        used=(*instance.used, *range(first, first + len(columns))),
        columns={first + place: frozenset(part) for place, part in enumerate(modes)},
    )


def joint_angles(cell: Cell, goal: TaskGoal) -> Array | None:
    """Angles of the last joint of the holder at which a tool that stands still follows a path, from its start on.

    They belong to the poses of the goal, shape (S + 2,). None where the path is not coaxial with the joint.
    """
    holder = cell.robot(cell.part.held_by[0].robot)
    if not holder.model.joints[-1].is_revolute:
        return None
    X_PT = goal.X_PT[1:-1]
    unit = _moved_part(cell, np.ones(1))[0, :3, :3]
    axis = rotation_vector(unit)
    turns = rotation_vector(X_PT[1:, :3, :3] @ np.swapaxes(X_PT[:-1, :3, :3], 1, 2))
    angles: Array = np.concatenate([[0.0], -np.cumsum(turns @ axis)])
    error = inverse(X_PT) @ inverse(_moved_part(cell, angles)) @ X_PT[0]
    is_off = np.abs(error[:, :3, 3]).max() > OFF_AXIS or np.abs(rotation_vector(error[:, :3, :3])).max() > OFF_TURN
    if is_off or np.abs(angles).max() < LEAST_TURN:
        return None
    return np.concatenate([angles[:1], angles, angles[-1:]])


def _moved_part(cell: Cell, angles: Array) -> Array:
    """The part after its holder turned its last joint, seen from the part before, shape (N, 4, 4)."""
    q = np.zeros((len(angles) + 1, len(cell.robot(cell.part.held_by[0].robot).model.joints)))
    q[1:, -1] = angles
    X_WP = Stations.of(cell, q).X_WP
    return inverse(X_WP[0]) @ X_WP[1:]


def _go_together(candidate: Candidate) -> bool:
    """Whether different robots do tasks of the same time while the part turns alike."""
    first = candidate[0]
    return len({it.mode.robot for it in candidate}) == len(candidate) and all(
        it.steps == first.steps
        and len(it.holder_q) == len(first.holder_q)
        and np.abs(it.holder_q - first.holder_q).max() <= OFF_TURN
        for it in candidate
    )
