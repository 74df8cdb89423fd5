"""Order of the blocks, and the modes and directions of their tasks, with the exact times of straight transfers.

For a given order the best modes of all robots are found by dynamic programming over the modes of a block: a transfer
takes as long as its slowest robot, or the part. Transfers that are not free straight cost what they were found to take.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise, permutations, product
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.search.assign.goals import TaskGoal
from cellplan.search.assign.instance import End, Instance
from cellplan.search.assign.schedule import BlockSchedule, in_order

MOST_PERMUTED: Final = 7  # stations of which all tours are compared
CROWDED: Final = 10**6  # [steps] more than any cycle that is chosen
TOURS: Final = 4  # shortest ones that are tried

Layer = tuple[int | None, list[list[End | None]]]  # station, and the ends that each operator may choose
Stop = tuple[int | None, tuple[End | None, ...]]  # station, and the end of each operator's task; None at home


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Refusal:
    """A transfer that is not free straight."""

    before: Mapping[str, bytes]  # configurations that the robots at fault come from, by robot
    after: Mapping[str, bytes]  # and go to
    stations: tuple[int | None, int | None]
    steps: int  # that it takes instead


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SequencedBlocks:
    """Blocks in their order with a mode of every task."""

    schedule: BlockSchedule
    stops: tuple[Stop, ...]  # one for each block
    steps: int  # from home to home
    waits: tuple[int, ...] = ()  # steps for which all robots stand before each block, as the part must cool


def order_values(sequenced: SequencedBlocks, step: float) -> dict[str, object]:
    """Orders of the robots, and the marks at which all of them stand while the part cools, by address in a cell file.

    Args:
        step: Time between two rows in [s].
    """
    chosen = sequenced.schedule.chosen
    orders: dict[str, list[str]] = {robot: [] for robot, _ in chosen.values()}
    marks = list[dict[str, object]]()
    for number, (block, wait) in enumerate(zip(sequenced.schedule.blocks, sequenced.waits, strict=True), start=1):
        if wait:
            marks.append({"name": f"rest-{number}", "dwell_s": round(wait * step, 9)})
            for order in orders.values():
                order.append(f"rest-{number}")
        for task in block:
            orders[chosen[task][0]].append(task)
    values: dict[str, object] = {f"robots.{robot}.order": order for robot, order in orders.items()}
    return values | ({"program.marks": marks} if marks else {})


@dataclass(eq=False)
class Sequencer:
    """Times of blocks in an order.

    Attributes:
        refusals: Transfers that are known not to be free straight.
    """

    instance: Instance
    refusals: list[Refusal] = field(default_factory=list)

    def sequenced(self, schedule: BlockSchedule) -> SequencedBlocks:
        """The blocks in their order with the modes and directions that take least time."""
        layers = [(None, self._at_home()), *self._layers(schedule), (None, self._at_home())]
        cost, back, costs = np.zeros([1] * len(self.instance.robots), dtype=np.int64), [], []
        for before, after in pairwise(layers):
            cost, came = self._step(cost, before, after)
            cost += crowding(self.instance, after[1])
            back.append(came)
            costs.append(cost)
        stops, place, moved = list[Stop](), tuple([0] * len(self.instance.robots)), list[int]()
        for came, cost, (station, ends) in zip(reversed(back), reversed(costs), reversed(layers[1:]), strict=True):
            moved.append(int(cost[place]))
            stops.append((station, tuple(choices[k] for choices, k in zip(ends, place, strict=True))))
            shape = tuple(map(len, layers[len(back) - len(stops)][1]))
            place = tuple(int(k) for k in np.unravel_index(came[place], shape))
        waits = waits_of(self.instance, schedule, moved[:0:-1])
        steps = schedule.work(self.instance) + moved[0] + sum(waits)
        return SequencedBlocks(schedule=schedule, stops=tuple(reversed(stops[1:])), steps=steps, waits=waits)

    def ordered(self, schedule: BlockSchedule) -> SequencedBlocks:
        """The best order found: stations in a short tour, blocks of a station relocated while that saves time."""
        best = min((self.sequenced(tour) for tour in self.tours(schedule)), key=lambda it: it.steps)
        while True:
            trials = (self.sequenced(trial) for trial in self.relocations(best.schedule))
            better = next((trial for trial in trials if trial.steps < best.steps), None)
            if better is None:
                return best
            best = better

    def _at_home(self) -> list[list[End | None]]:
        return [[None] for _ in self.instance.robots]

    def _layers(self, schedule: BlockSchedule) -> Iterator[Layer]:
        """Station of each block, and the ends that each operator may have; None at home."""
        for block in schedule.blocks:
            at_work = {schedule.chosen[task][0]: task for task in block}
            station = schedule.station_of(block)
            ends: list[list[End | None]] = []
            for robot in self.instance.robots:
                task = at_work.get(robot)
                ends.append([None] if task is None else [*self.instance.ends(task, robot, station)])
            yield station, ends

    def _step(self, cost: Indices, before: Layer, after: Layer) -> tuple[Indices, Indices]:
        """Least steps up to every joint choice of a layer, and the choice before it, flattened."""
        (first, starts), (second, goals) = before, after
        shape, rows = tuple(map(len, goals)), cost.size
        total = np.full((rows, *shape), self.instance.station_steps(first, second), dtype=np.int64)
        places = np.unravel_index(np.arange(rows), cost.shape)
        for axis, robot in enumerate(self.instance.robots):
            a = np.array([self._leaving(robot, it) for it in starts[axis]])
            b = np.array([self._coming(robot, it) for it in goals[axis]])
            table = self.instance.transfer_steps(robot, a[:, None], b[None])
            view = [1] * len(shape)
            view[axis] = shape[axis]
            total = np.maximum(total, table[places[axis]].reshape(rows, *view))
        for refusal in self.refusals:
            if refusal.stations == (first, second):
                self._refuse(total, places, refusal, starts, goals)
        total += cost.reshape(rows, *([1] * len(shape)))
        came = np.argmin(total, axis=0)
        return np.min(total, axis=0), came

    def _refuse(
        self,
        total: Indices,
        places: Sequence[Indices],
        refusal: Refusal,
        starts: Sequence[Sequence[End | None]],
        goals: Sequence[Sequence[End | None]],
    ) -> None:
        """Raise the steps of transfers that are refused, in place."""
        rows, columns = np.ones(len(total), dtype=bool), np.ones(total.shape[1:], dtype=bool)
        for axis, robot in enumerate(self.instance.robots):
            if robot not in refusal.before:
                continue
            leaves = np.array([self._leaving(robot, it).tobytes() == refusal.before[robot] for it in starts[axis]])
            comes = np.array([self._coming(robot, it).tobytes() == refusal.after[robot] for it in goals[axis]])
            rows &= leaves[places[axis]]
            view = [1] * columns.ndim
            view[axis] = len(comes)
            columns &= comes.reshape(view)
        is_refused: Flags = rows.reshape(-1, *([1] * columns.ndim)) & columns
        total[is_refused] = np.maximum(total[is_refused], refusal.steps)

    def _leaving(self, robot: str, end: End | None) -> Array:
        return self.instance.homes[robot] if end is None else end.end

    def _coming(self, robot: str, end: End | None) -> Array:
        return self.instance.homes[robot] if end is None else end.begin

    def relocations(self, schedule: BlockSchedule) -> Iterator[BlockSchedule]:
        """Schedules with one block at another place: of its station, or anywhere that may hide a rest of the part."""
        return relocations(schedule, self.instance.goals, anywhere=bool(self.instance.rules.lags))

    def tours(self, schedule: BlockSchedule) -> list[BlockSchedule]:
        """The blocks with their stations in the shortest tours; where tasks must follow others, as soon as they may."""
        stations = list(dict.fromkeys(schedule.station_of(block) for block in schedule.blocks))
        if len(stations) > MOST_PERMUTED:
            orders = [self._nearest_first(stations)]
        else:
            orders = sorted(permutations(stations), key=lambda order: (self._length(order), order))
        tours = [schedule] if self.instance.rules.lags else list[BlockSchedule]()
        for order in orders:
            blocks = sorted(schedule.blocks, key=lambda block: order.index(schedule.station_of(block)))
            if (ordered := in_order(blocks, self.instance.goals)) is not None and len(tours) < TOURS:
                tours.append(replace(schedule, blocks=ordered))
        return tours

    def _length(self, order: Sequence[int]) -> int:
        """Steps of the part over stations in an order, from home and back."""
        places = [None, *order, None]
        return sum(self.instance.station_steps(a, b) for a, b in pairwise(places))

    def _nearest_first(self, stations: Sequence[int]) -> tuple[int, ...]:
        """Stations, each the nearest to the one before."""
        order, left = list[int](), set(stations)
        while left:
            last = order[-1] if order else None
            order.append(min(left, key=lambda it: (self.instance.station_steps(last, it), it)))
            left.discard(order[-1])
        return tuple(order)


def crowding(instance: Instance, ends: Sequence[Sequence[End | None]]) -> Indices:
    """Steps that keep joint choices out in which two arcs come too near, shape (K, ...), an axis for each robot."""
    extra = np.zeros(list(map(len, ends)), dtype=np.int64)
    for a, b in combinations(range(len(ends)), 2) if instance.rules.crowded else ():
        for (i, first), (k, second) in product(enumerate(ends[a]), enumerate(ends[b])):
            if first is None or second is None:
                continue
            tasks = first.mode.task, second.mode.task
            if instance.rules.is_crowded(tasks, (first.is_reversed, second.is_reversed)):
                index: list[int | slice] = [slice(None)] * len(ends)
                index[a], index[b] = i, k
                extra[tuple(index)] = CROWDED
    return extra


def waits_of(instance: Instance, schedule: BlockSchedule, moved: Sequence[int]) -> tuple[int, ...]:
    """Steps for which all robots stand before each block, until the part has cooled where it goes on.

    Args:
        moved: Steps of the transfers up to each block.
    """
    begins, waits, worked = dict[str, int](), list[int](), 0
    for block, steps in zip(schedule.blocks, moved, strict=True):
        begin = steps + worked + sum(waits)
        lags = (it for it in instance.rules.lags.items() if it[0][0] in begins and it[0][1] in block)
        waits.append(max([0, *(begins[first] + lag - begin for (first, _), lag in lags)]))
        begins |= dict.fromkeys(block, begin + waits[-1])
        worked += max(instance.steps(task) for task in block)
    return tuple(waits)


def relocations(
    schedule: BlockSchedule, goals: Mapping[str, TaskGoal], *, anywhere: bool = False
) -> Iterator[BlockSchedule]:
    """Schedules in which one block is at another place, among those of its station or anywhere."""
    stations = [schedule.station_of(block) for block in schedule.blocks]
    for source, station in enumerate(stations):
        for target, other in enumerate(stations):
            if source != target and (anywhere or station == other):
                blocks = list(schedule.blocks)
                blocks.insert(target, blocks.pop(source))
                if in_order(blocks, goals) == tuple(blocks):
                    yield replace(schedule, blocks=tuple(blocks))
