"""More modes of what a schedule chose, at finer turns of the tools, so that transfers get shorter.

A tool with a free spin leaves its task at another turn than that of its mode. Where, is known once the task was
planned; then the modes are chosen again, until those of the shortest sequence were all planned.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.assign.problem.clearance import AssignmentClearance
from cellplan.search.assign.problem.goals import Stations
from cellplan.search.assign.problem.instance import EndIdentity, Instance
from cellplan.search.assign.problem.table import Key, ModeSearch, TaskMode
from cellplan.search.assign.schedules.order import Refusal, SequencedBlocks, Sequencer
from cellplan.search.assign.schedules.transfers import TransferCertifier

FINER: Final = 2  # turns of the tool for one that was compared before
CHOICES: Final = 600  # of modes and directions of all robots in a block together
MOST_TRIED: Final = 60  # orders of the blocks, with these modes
TRIES: Final = 24  # sequences of which robots meet in a block or end elsewhere, until the best one is kept

PlannedEnds = Callable[[Instance, SequencedBlocks], Mapping[EndIdentity, Array]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Refinement:
    """Finer modes of one cell."""

    search: ModeSearch  # what the modes so far were looked for among
    clearance: AssignmentClearance
    certifier: TransferCertifier
    planned_ends: PlannedEnds  # where the robots leave the tasks of a sequence as they are planned

    def shortened(self, best: SequencedBlocks, sequencer: Sequencer) -> tuple[SequencedBlocks, Instance]:
        """The same tasks of the same robots with more modes, and the instance that has them.

        Args:
            best: Blocks with certified transfers.
            sequencer: By which they were sequenced.
        """
        best, instance = self._as_planned(best, self._with_more_modes(sequencer.instance, best), sequencer.refusals)
        for _ in range(TRIES):
            finer = Sequencer(instance, refusals=sequencer.refusals)
            shorter = self.certifier.shortened(finer, self.certifier.settle(finer, best.schedule), most=MOST_TRIED)
            if shorter.steps >= best.steps:
                break
            if met := self._met(instance, shorter):
                instance = replace(instance, modes={**instance.modes, **met})
                continue
            planned, learned = self._as_planned(shorter, instance, sequencer.refusals)
            best = min(best, planned, key=lambda it: it.steps)
            if learned is instance:
                break
            instance = learned
        return best, instance

    def _as_planned(
        self, sequenced: SequencedBlocks, instance: Instance, refusals: list[Refusal]
    ) -> tuple[SequencedBlocks, Instance]:
        """A sequence with the ends of its tasks as they are planned, and the instance that has them."""
        planned = self.planned_ends(instance, sequenced)
        if not planned:
            return sequenced, instance
        instance = replace(instance, planned={**instance.planned, **planned})
        only = Sequencer(instance.of_stops(it for _, it in sequenced.stops), refusals=refusals)
        return self.certifier.settle(only, sequenced.schedule), instance

    def _with_more_modes(self, instance: Instance, best: SequencedBlocks) -> Instance:
        """The instance with more modes of every task that is done, free of collisions."""
        most = max(1, int(CHOICES ** (1.0 / len(instance.robots))) // 2)
        modes = dict(instance.modes)
        for task, (robot, station) in best.schedule.chosen.items():
            key = task, robot, station
            if station in instance.columns:
                continue
            more = list(modes[key])
            for mode in self._finer(key):
                is_new = all(np.abs(mode.q[0] - other.q[0]).max() > 0.0 for other in more)
                if len(more) < most and is_new and self.clearance.is_free(mode):
                    more.append(mode)
            modes[key] = tuple(more)
        return replace(instance, modes=modes)

    def _finer(self, key: Key) -> list[TaskMode]:
        """Modes of one robot for one task at one station at finer turns of the tool, largest margins first."""
        (task, robot, station), search = key, self.search
        goals = [replace(goal, robots=(robot,)) for goal in search.goals if goal.name == task]
        every = search.stations
        count = FINER * len(search.spins) if len(search.spins) > 1 else 1
        table = replace(
            search,
            goals=goals,
            stations=Stations(holder=every.holder, q=every.q[[station]], X_WP=every.X_WP[[station]]),
            spins=np.linspace(0.0, 2.0 * np.pi, count, endpoint=False),
        ).table()
        return [replace(mode, station=station) for mode in table.modes.get((task, robot, 0), ())]

    def _met(self, instance: Instance, sequenced: SequencedBlocks) -> dict[Key, tuple[TaskMode, ...]]:
        """Modes that are left of tasks whose robots would come too near each other in a block."""
        left: dict[Key, tuple[TaskMode, ...]] = {}
        for station, ends in sequenced.stops:
            modes = [end.mode for end in ends if end is not None and station not in instance.columns]
            for first, second in combinations(modes, 2):
                if self.clearance.meet(first, second):
                    for mode in (first, second):
                        key = mode.task, mode.robot, mode.station
                        others = tuple(it for it in left.get(key, instance.modes[key]) if it is not mode)
                        left |= {key: others} if others else {}
        return left
