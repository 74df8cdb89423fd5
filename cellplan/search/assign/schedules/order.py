"""Order of the blocks, and the modes and directions of their tasks, with the exact times of straight transfers.

For a given order the best modes of all robots are found by dynamic programming over the modes of a block: a transfer
takes as long as its slowest robot, or the part. Transfers that are not free straight cost what they were found to take.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import combinations, pairwise, permutations, product
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.search.assign.problem.goals import TaskGoal
from cellplan.search.assign.problem.instance import COMES, DONE, LEAVES, READY, SIDES, End, Instance, standing
from cellplan.search.assign.problem.table import Key
from cellplan.search.assign.schedules.schedule import BlockSchedule, in_order

MOST_PERMUTED: Final = 7  # stations of which all tours are compared
CROWDED: Final = 10**6  # [steps] more than any cycle that is chosen
TOURS: Final = 4  # shortest ones that are tried
MOST_KNOWN: Final = 200  # pairs of blocks of which the transfers are kept, up to 1.5 MB each

Stop = tuple[int | None, tuple[End | None, ...]]  # station, and the end of each operator's task; None at home
Passed = Mapping[str, Array]  # configurations in [rad] or [m] of the operators that are at via points, shape (n,) each


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Refusal:
    """A transfer that is not free straight."""

    before: Mapping[str, bytes]  # configurations that the robots at fault come from, by robot
    after: Mapping[str, bytes]  # and go to
    stations: tuple[int | None, int | None]
    steps: int  # that it takes instead


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """What the operators may choose in a block."""

    station: int | None  # None at home
    ends: list[list[End | None]]  # by operator; None at home
    leaving: list[Array]  # configurations in which each one leaves the block, shape (K, n) each
    coming: list[Array]  # and comes to it
    longer: Indices  # steps by which the block is longer with joint choices, an axis for each operator

    @classmethod
    def of(cls, instance: Instance, station: int | None, at_work: Mapping[str, str]) -> Self:
        """The choices in a block.

        Args:
            at_work: Tasks by operator.
        """
        ends, leaving, coming = list[list[End | None]](), list[Array](), list[Array]()
        for robot in instance.robots:
            modes = instance.ends(at_work[robot], robot, station) if station is not None and robot in at_work else []
            ends.append([*modes] or [None])
            leaving.append(np.array([end.end for end in modes] or [instance.homes[robot]]))
            coming.append(np.array([end.begin for end in modes] or [instance.homes[robot]]))
        return cls(station=station, ends=ends, leaving=leaving, coming=coming, longer=longer(instance, ends))

    def passing(self, instance: Instance, points: Passed, *, leaves: bool) -> Self:
        """Where the operators stand before the block, or after it, while some of them are at via points."""
        ends = [
            [standing_at(robot, it, points, leaves=leaves) for it in (choices[:1] if robot in points else choices)]
            for robot, choices in zip(instance.robots, self.ends, strict=True)
        ]
        at = [
            np.array([instance.homes[robot] if end is None else end.begin for end in choices])
            for robot, choices in zip(instance.robots, ends, strict=True)
        ]
        none = np.zeros(list(map(len, ends)), dtype=np.int64)
        return type(self)(station=self.station, ends=ends, leaving=at, coming=at, longer=none)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of choices of each operator."""
        return tuple(map(len, self.ends))


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
    _layers: dict[frozenset[Key], Layer] = field(default_factory=dict)
    _passing: dict[tuple[Layer, frozenset[str]], list[Layer]] = field(default_factory=dict)  # before, in and after it
    _known: dict[tuple[Layer, Layer], tuple[int, Indices]] = field(default_factory=dict)  # and refusals in them

    def sequenced(self, schedule: BlockSchedule) -> SequencedBlocks:
        """The blocks in their order with the modes and directions that take least time."""
        layers = [self._at_home]
        for block, cleaned in zip(schedule.blocks, schedule.cleaned(self.instance), strict=True):
            layers += self._around(self._layer(schedule, block), {schedule.chosen[it][0]: it for it in block}, cleaned)
        layers.append(self._at_home)
        cost, back, costs = np.zeros([1] * len(self.instance.robots), dtype=np.int64), [], []
        for before, after in pairwise(layers):
            total = self._transfers(before, after) + np.expand_dims(cost, tuple(range(cost.ndim, 2 * cost.ndim)))
            total = total.reshape(-1, *after.shape)
            cost = np.min(total, axis=0) + after.longer
            back.append(np.argmin(total, axis=0))
            costs.append(cost)
        stops, place, moved = list[Stop](), tuple([0] * len(self.instance.robots)), list[int]()
        for came, cost, (before, after) in zip(back[::-1], costs[::-1], list(pairwise(layers))[::-1], strict=True):
            moved.append(int(cost[place]))
            stops.append((after.station, tuple(it[k] for it, k in zip(after.ends, place, strict=True))))
            place = tuple(int(k) for k in np.unravel_index(came[place], before.shape))
        blocks = [(it, to) for it, to in zip(stops[:0:-1], moved[:0:-1], strict=True) if not side_of(it[1])]
        waits = waits_of(self.instance, schedule, [to for _, to in blocks])
        steps = schedule.work(self.instance) + moved[0] + sum(waits)
        return SequencedBlocks(schedule=schedule, stops=tuple(it for it, _ in blocks), steps=steps, waits=waits)

    def ordered(self, schedule: BlockSchedule) -> SequencedBlocks:
        """The best order found: stations in a short tour, blocks of a station relocated while that saves time."""
        best = min((self.sequenced(tour) for tour in self.tours(schedule)), key=lambda it: it.steps)
        while True:
            trials = (self.sequenced(trial) for trial in self.relocations(best.schedule))
            better = next((trial for trial in trials if trial.steps < best.steps), None)
            if better is None:
                return best
            best = better

    @cached_property
    def _at_home(self) -> Layer:
        return Layer.of(self.instance, None, {})

    def _layer(self, schedule: BlockSchedule, block: Sequence[str]) -> Layer:
        """What the robots may choose in a block."""
        keys = frozenset((task, *schedule.chosen[task]) for task in block)
        if keys not in self._layers:
            at_work = {schedule.chosen[task][0]: task for task in block}
            self._layers[keys] = Layer.of(self.instance, schedule.station_of(block), at_work)
        return self._layers[keys]

    def _around(self, layer: Layer, at_work: Mapping[str, str], cleaned: frozenset[str]) -> list[Layer]:
        """The choices in a block, and at the via points before and after it."""
        if (layer, cleaned) not in self._passing:
            coming, leaving = passes(self.instance, at_work, cleaned)
            self._passing[layer, cleaned] = [
                *(layer.passing(self.instance, points, leaves=False) for points in coming),
                layer,
                *(layer.passing(self.instance, points, leaves=True) for points in leaving),
            ]
        return self._passing[layer, cleaned]

    def _transfers(self, before: Layer, after: Layer) -> Indices:
        """Steps between every joint choice of two layers, shape (*before.shape, *after.shape)."""
        count, steps = self._known.pop((before, after), (0, None))
        if steps is None:
            steps = self._straight(before, after)
        for refusal in self.refusals[count:]:
            if refusal.stations == (before.station, after.station):
                self._refuse(steps, refusal, before, after)
        self._known[before, after] = len(self.refusals), steps
        if len(self._known) > MOST_KNOWN:
            del self._known[next(iter(self._known))]
        return steps

    def _straight(self, before: Layer, after: Layer) -> Indices:
        """Likewise, of transfers that are free straight."""
        steps: Indices = np.zeros((*before.shape, *after.shape), dtype=np.int32)
        firsts, lasts = ([ends[0] for ends in it.ends] for it in (before, after))
        goes_on = side_of(firsts) >= 0 and side_of(lasts) <= 0
        steps += self.instance.station_steps(before.station, after.station) if goes_on else 0
        for axis, robot in enumerate(self.instance.robots):
            table = self.instance.transfer_steps(robot, before.leaving[axis][:, None], after.coming[axis][None])
            first, last = (None if it is None else it.mode.task for it in (firsts[axis], lasts[axis]))
            if first == READY or last == DONE:
                table = np.where(table > 0, CROWDED, 0)  # it stays where it is
            shape = [1] * steps.ndim
            shape[axis], shape[axis + len(before.shape)] = table.shape
            np.maximum(steps, table.reshape(shape), out=steps, casting="same_kind")
        return steps

    def _refuse(self, steps: Indices, refusal: Refusal, before: Layer, after: Layer) -> None:
        """Raise the steps of transfers that are refused, in place."""
        places = [
            np.array(
                [place for place, q in enumerate(at) if ends.get(robot, q.tobytes()) == q.tobytes()], dtype=np.intp
            )
            for layer, ends in ((before.leaving, refusal.before), (after.coming, refusal.after))
            for robot, at in zip(self.instance.robots, layer, strict=True)
        ]
        at = np.ix_(*places)
        steps[at] = np.maximum(steps[at], refusal.steps)

    def relocations(self, schedule: BlockSchedule, *, anywhere: bool = False) -> Iterator[BlockSchedule]:
        """Schedules with one block at another place: of its station, or anywhere, as always where orders count."""
        return relocations(schedule, self.instance.goals, anywhere=anywhere or self.instance.rules.order_counts)

    def tours(self, schedule: BlockSchedule) -> list[BlockSchedule]:
        """The blocks with their stations in the shortest tours; where tasks must follow others, as soon as they may."""
        stations = list(dict.fromkeys(schedule.station_of(block) for block in schedule.blocks))
        if len(stations) > MOST_PERMUTED:
            orders = [self._nearest_first(stations)]
        else:
            orders = sorted(permutations(stations), key=lambda order: (self._length(order), order))
        tours = [schedule] if self.instance.rules.order_counts else list[BlockSchedule]()
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


def passes(
    instance: Instance, at_work: Mapping[str, str], cleaned: Collection[str]
) -> tuple[list[Passed], list[Passed]]:
    """The via points before a block and after it, place by place; operators without one there stand.

    Args:
        at_work: Tasks by operator.
        cleaned: Operators whose tools are cleaned on the way to the block.
    """
    before, after = dict[str, list[Array]](), dict[str, list[Array]]()
    for robot, task in at_work.items():
        goal, home = instance.goals[task], instance.homes[robot]
        service = [instance.rules.services[robot].q] if robot in cleaned else []
        before[robot] = [*service, *(home if it is None else it for it in goal.via_before)]
        after[robot] = [home if it is None else it for it in goal.via_after]
    coming, leaving = (range(max(map(len, it.values()), default=0)) for it in (before, after))
    return (
        [{robot: points[place] for robot, points in before.items() if place < len(points)} for place in coming],
        [{robot: points[: place + 1][-1] for robot, points in after.items() if points} for place in leaving],
    )


def standing_at(robot: str, end: End | None, points: Passed, *, leaves: bool) -> End | None:
    """Where an operator stands before its task or after it: at a via point, or ready or done; None at home."""
    if robot in points:
        return standing(robot, points[robot], LEAVES if leaves else COMES)
    if end is None:
        return None
    return standing(robot, end.end, DONE) if leaves else standing(robot, end.begin, READY)


def all_stops(instance: Instance, sequenced: SequencedBlocks) -> Iterator[Stop]:
    """The stops of a sequence, and before and after them where robots stand while some are at via points."""
    for (station, ends), cleaned in zip(sequenced.stops, sequenced.schedule.cleaned(instance), strict=True):
        at_work = {end.mode.robot: end.mode.task for end in ends if end is not None}
        coming, leaving = passes(instance, at_work, cleaned)
        both = list(zip(instance.robots, ends, strict=True))
        for points in coming:
            yield station, tuple(standing_at(robot, end, points, leaves=False) for robot, end in both)
        yield station, ends
        for points in leaving:
            yield station, tuple(standing_at(robot, end, points, leaves=True) for robot, end in both)


def side_of(ends: Sequence[End | None]) -> int:
    """Whether robots are on their way to a block, -1, or from it, 1; or at work in it or at home, 0."""
    return next((SIDES[end.mode.task] for end in ends if end is not None and end.mode.task in SIDES), 0)


def longer(instance: Instance, ends: Sequence[Sequence[End | None]]) -> Indices:
    """Steps by which a block is longer than it is at least, shape (K, ...), an axis for each robot.

    Choices in which approach and retraction are slow lengthen it where it is retimed; those in which two arcs come too
    near each other beyond any cycle.
    """
    least = [0 if it[0] is None else instance.steps(it[0].mode.task) for it in ends]
    works = [
        steps + np.array([instance.late_steps(end) for end in choices])
        for steps, choices in zip(least, ends, strict=True)
    ]
    extra: Indices = reduce(np.maximum.outer, works) - max(least)
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
    services = instance.rules.services
    for block, steps, cleaned in zip(schedule.blocks, moved, schedule.cleaned(instance), strict=True):
        worked += max((services[robot].steps for robot in cleaned), default=0)
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
