"""One run of a study: round after round, until the number of trials, the budget or the search itself ends it."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass
from enum import StrEnum

from cellplan.study.record import Recorder
from cellplan.study.run import Flight
from cellplan.study.trial import StudyTrial, TrialOutcome, Variant
from cellplan.study.workers import Evaluate, Limits, Workers

Propose = Callable[[Sequence[StudyTrial]], Sequence[Mapping[str, object]]]


class StoppedBy(StrEnum):
    """Why a study has ended."""

    TRIALS = "trials"
    BUDGET = "budget"
    ENOUGH = "enough"
    SEARCH = "search"  # there is nothing more to try


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Where a study ends, unless it ends by itself.

    Attributes:
        trials: Number of trials; None for no limit.
        seconds: Budget: no round is begun that would end later if it took as long as the one before; one is always
            worked out. None for no limit.
    """

    trials: int | None = None
    seconds: float | None = None


class Crew(ExitStack):
    """What works out the trials of a study, for a ``with`` statement.

    Processes start with the first trial; at the end they are ended, and what has not begun is cancelled.
    """

    def __init__(self, evaluate: Evaluate, workers: int | Executor, limits: Limits, size: int) -> None:
        """Prepare for a number of processes, or for an executor, which stays open."""
        super().__init__()
        self._evaluate, self._workers, self._limits, self._size = evaluate, workers, limits, size
        self._flights: dict[str, Flight] = {}

    @property
    def flight(self) -> Flight:
        """The trials under way."""
        if "all" not in self._flights:
            workers = self._workers
            self._begin("all", Workers(min(workers, self._size)) if isinstance(workers, int) else workers)
        return self._flights["all"]

    @property
    def again(self) -> Callable[[Variant], TrialOutcome] | None:
        """What works out a trial a second time on this machine; None where the first time was on it."""
        return self._again if getattr(self._workers, "is_remote", False) else None

    def arrived(self) -> list[tuple[Variant, TrialOutcome]]:
        """Outcomes that have come and were perhaps not taken, when the study is interrupted."""
        return self._flights["all"].arrived() if "all" in self._flights else []

    def _again(self, variant: Variant) -> TrialOutcome:
        if "again" not in self._flights:
            self._begin("again", Workers(1))
        ((_, outcome),) = self._flights["again"].outcomes([variant])
        return outcome

    def _begin(self, name: str, executor: Executor) -> None:
        if executor is not self._workers:
            self.enter_context(executor)
        self._flights[name] = Flight(self._evaluate, executor, self._limits)
        self.callback(self._flights[name].cancel)


def run_rounds(propose: Propose, size: int, stop: Stop, record: Recorder, crew: Crew) -> StoppedBy:
    """Work out round after round; why the study has ended."""
    number, last = 0, 0.0
    while True:
        begin = number * size
        if stop.trials is not None and begin >= stop.trials:
            return StoppedBy.TRIALS
        is_new = begin >= record.done
        if is_new and number > 0 and stop.seconds is not None and record.seconds + last > stop.seconds:
            return StoppedBy.BUDGET
        began = time.monotonic()
        values = propose(record.journal.trials[:begin])[:size]
        variants = [
            Variant(begin + k, json.loads(json.dumps(dict(values_of_variant))))
            for k, values_of_variant in enumerate(values)
        ]
        _run_round(
            [variant for variant in variants if stop.trials is None or variant.number < stop.trials], record, crew
        )
        if record.is_enough():
            record.journal.ahead.clear()
            return StoppedBy.ENOUGH
        if len(values) < size:
            return StoppedBy.SEARCH
        last = time.monotonic() - began
        number += 1


def _run_round(variants: Sequence[Variant], record: Recorder, crew: Crew) -> None:
    """Work out and record those variants of a round that are not recorded yet, until one ends the study."""
    record.journal.require(variants)
    record.follow(crew.again)
    known, ahead = len(record.journal.trials), record.journal.ahead
    left = [variant for variant in variants if variant.number >= known and variant.number not in ahead]
    if left and not record.is_enough():
        for variant, outcome in crew.flight.outcomes(left):
            record.add(variant, outcome, crew.again)
            if record.is_enough():
                return
