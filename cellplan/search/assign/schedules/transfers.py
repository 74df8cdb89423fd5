"""Transfers between blocks, certified straight; those that are refused cost what the move in legs takes instead."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, combinations, pairwise, product
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import scene_of_run
from cellplan.geometry.arrays import Array
from cellplan.model.answers import Answers, worked_out
from cellplan.planning.timing.retime import Retimer
from cellplan.planning.transfer.in_legs import least_steps, legs_of
from cellplan.planning.transfer.query import TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.straight_moves import StraightMoves
from cellplan.planning.transfer.straight_time import straight_steps
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.schedules.order import Refusal, SequencedBlocks, Sequencer, Stop, all_stops, side_of
from cellplan.search.assign.schedules.schedule import BlockSchedule, refuse_impossible

MOST_TRIED: Final = 400  # orders of blocks, and tasks exchanged between them
MOST_SETTLED: Final = 30  # choices of modes until no transfer of the best one is newly refused


@dataclass(eq=False)
class TransferCertifier:
    """Certificates of straight transfers, each made once.

    Attributes:
        scene: The scene of the cell.
        home: Stacked homes of all robots in [rad] or [m], shape (nq,).
        retimer: The limits of all joints and the step of the rows.
        answers: What answers for a transfer, or records it.
        examined: Number of transfers that were certified.
    """

    scene: Scene
    home: Array
    retimer: Retimer
    answers: Answers = worked_out
    examined: int = 0
    _known: dict[bytes, Refusal | None] = field(default_factory=dict)
    _timed: set[bytes] = field(default_factory=set)  # those of which the legs are known

    def __post_init__(self) -> None:
        """In transfers no tool is at work."""
        self.scene = scene_of_run(self.scene, ())
        self._moves = StraightMoves(self.scene)

    def settle(
        self, sequencer: Sequencer, schedule: BlockSchedule, *, below: SequencedBlocks | None = None
    ) -> SequencedBlocks:
        """The best modes for an order of blocks in which no transfer is refused any more.

        Args:
            below: Blocks in less time are looked for; as soon as that turns out to be in vain these are the result.
        """
        trials = list[SequencedBlocks]()
        for _ in range(MOST_SETTLED):
            best = sequencer.sequenced(schedule)
            if below is not None and best.steps >= below.steps:
                return below
            refusals = self.refusals(sequencer, best) or self._in_legs(sequencer, best)
            if not refusals:
                return best
            sequencer.refusals += refusals
            trials.append(self._as_known(sequencer, best))
        best = min(trials, key=lambda it: it.steps)
        self._in_legs(sequencer, best)
        return min([self._as_known(sequencer, best), *([below] if below else [])], key=lambda it: it.steps)

    def best(self, sequencer: Sequencer, trials: Sequence[SequencedBlocks]) -> SequencedBlocks:
        """The best of some orders with certified transfers, the shortest with straight ones tried first; shortened."""
        best = self.settle(sequencer, trials[0].schedule)
        for trial in trials[1:]:
            best = self.settle(sequencer, trial.schedule, below=best)
        return self.shortened(sequencer, best, most=MOST_TRIED)

    def shortened(self, sequencer: Sequencer, best: SequencedBlocks, *, most: int) -> SequencedBlocks:
        """Blocks relocated, and tasks exchanged between them, while that shortens the transfers.

        Args:
            most: Number of orders that are tried.
        """
        tried, instance = 0, sequencer.instance
        while True:
            for trial in chain(sequencer.relocations(best.schedule, anywhere=True), exchanges(best.schedule, instance)):
                if tried == most:
                    return best
                tried += 1
                if (settled := self.settle(sequencer, trial, below=best)).steps < best.steps:
                    best = settled
                    break
            else:
                return best

    def refusals(self, sequencer: Sequencer, sequenced: SequencedBlocks) -> list[Refusal]:
        """Transfers of a sequence that are not free straight and were not known to be, with the least they may take."""
        refusals = []
        for query, stations, key in self._transfers(sequencer, sequenced):
            if key not in self._known:
                self._known[key] = self._refusal(sequencer, query, stations)
                refusals += [] if (refusal := self._known[key]) is None else [refusal]
        return refusals

    def _in_legs(self, sequencer: Sequencer, sequenced: SequencedBlocks) -> list[Refusal]:
        """Transfers of a sequence that were refused, once more with what their legs take."""
        refusals = []
        for query, _, key in self._transfers(sequencer, sequenced):
            if (refusal := self._known[key]) is not None and key not in self._timed:
                self._timed.add(key)
                steps = self.answers("legs", key.hex(), partial(self._steps_in_legs, query))
                self._known[key] = timed = replace(refusal, steps=max(steps, refusal.steps))
                refusals += [timed] if steps > refusal.steps else []
        return refusals

    def _as_known(self, sequencer: Sequencer, sequenced: SequencedBlocks) -> SequencedBlocks:
        """A sequence with the steps that it takes by all that is known of its transfers."""
        steps = sequenced.schedule.work(sequencer.instance) + sum(sequenced.waits)
        for query, _, key in self._transfers(sequencer, sequenced):
            refusal = self._known[key]
            steps += max(self._steps_of([query.start, query.goal]), 0 if refusal is None else refusal.steps)
        return replace(sequenced, steps=steps)

    def _transfers(
        self, sequencer: Sequencer, sequenced: SequencedBlocks
    ) -> Iterator[tuple[TransferQuery, tuple[int | None, int | None], bytes]]:
        """Transfers of a sequence with their stations, each with what it is known by."""
        resting: Stop = (None, (None,) * len(sequencer.instance.robots))
        for before, after in pairwise((resting, *all_stops(sequencer.instance, sequenced), resting)):
            start, goal = self._stacked(sequencer, before, leaves=True), self._stacked(sequencer, after, leaves=False)
            query = TransferQuery.of(self.scene, start, goal, seed=0, home=self.home)
            yield query, (before[0], after[0]), np.concatenate([start, goal]).tobytes()

    def _refusal(
        self, sequencer: Sequencer, query: TransferQuery, stations: tuple[int | None, int | None]
    ) -> Refusal | None:
        """The refusal of a transfer; None where it is free straight."""
        start, goal = query.start, query.goal
        self.examined += 1

        def refusing() -> list[str]:
            return sorted(self._moves.refusing(start, goal, query.movers) or ())

        carriers = self.answers("transfer", start.tobytes().hex() + goal.tobytes().hex(), refusing)
        if not carriers:
            return None
        columns = {name: self.scene.cell.columns(name) for name in query.movers if name in carriers}
        ends = {name: (start[at].tobytes(), goal[at].tobytes()) for name, at in columns.items()}
        operators = [name for name in columns if name in sequencer.instance.robots]
        return Refusal(
            before={name: ends[name][0] for name in operators},
            after={name: ends[name][1] for name in operators},
            stations=stations,
            steps=least_steps(query, self.retimer, ends),
        )

    def _steps_of(self, ends: list[Array]) -> int:
        """Steps of straight legs of all robots."""
        at = np.array(ends)
        return int(straight_steps(at[:-1], at[1:], self.retimer.bounds, self.retimer.step).sum())

    def _steps_in_legs(self, query: TransferQuery) -> int:
        """Steps of straight legs in which all robots get there; where there are none, of one after the other."""
        legs = legs_of(query, self.retimer, Tried(), self._moves)
        movers = query.movers
        return self._steps_of(legs or [query.standing(movers[:count]) for count in range(len(movers) + 1)])

    def _stacked(self, sequencer: Sequencer, stop: Stop, *, leaves: bool) -> Array:
        """Stacked configuration in which all robots leave a stop, or come to it, shape (nq,)."""
        (station, ends), q, cell = stop, self.home.copy(), self.scene.cell
        holder = sequencer.instance.stations.holder
        if station is not None and holder is not None:
            stations = sequencer.instance.stations
            q[cell.columns(holder)] = (stations.left if leaves + side_of(ends) > 0 else stations.q)[station]
        for robot, end in zip(sequencer.instance.robots, ends, strict=True):
            if end is not None:
                q[cell.columns(robot)] = end.end if leaves else end.begin
        return q


def exchanges(schedule: BlockSchedule, instance: Instance) -> Iterator[BlockSchedule]:
    """Schedules in which a robot does two of its tasks at one station in each other's block, in no longer time."""
    work = schedule.work(instance)
    for (i, first), (j, second) in combinations(enumerate(schedule.blocks), 2):
        for a, b in product(first, second):
            if schedule.chosen[a] == schedule.chosen[b]:
                blocks = list(schedule.blocks)
                blocks[i], blocks[j] = (
                    tuple({old: new}.get(task, task) for task in block)
                    for block, old, new in ((first, a, b), (second, b, a))
                )
                trial = replace(schedule, blocks=tuple(blocks))
                if trial.work(instance) <= work and is_possible(instance, trial):
                    yield trial


def is_possible(instance: Instance, schedule: BlockSchedule) -> bool:
    """Whether a schedule is one of an instance."""
    try:
        refuse_impossible(instance, schedule)
    except ValueError:
        return False
    return True
