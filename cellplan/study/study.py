"""Study: trials in rounds of a fixed size, in a folder of their own, begun anew or continued."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from cellplan.model.progress import Progress, silent
from cellplan.study.folder import prepare_folder
from cellplan.study.journal import Journal
from cellplan.study.run import Flight, deferred_interruptions
from cellplan.study.running import RunningState, running, seconds_since
from cellplan.study.status import Best, StudyStatus
from cellplan.study.trial import Trial
from cellplan.study.variants import Variant
from cellplan.study.workers import Evaluate, Limits, Workers

Propose = Callable[[Sequence[Trial]], Sequence[Mapping[str, object]]]


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """What a study has come to.

    Attributes:
        trials: All trials as plain data, in their order; their number repeats the study byte for byte.
        rounds: Number of whole rounds.
        stopped_by: Why it has ended.
    """

    trials: list[dict[str, Any]]
    rounds: int
    stopped_by: StoppedBy


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What is tried and where it is recorded.

    Trial i depends on the header, on i and on the trials of finished rounds, and on nothing else: not on the number of
    workers, not on which trial ends first, not on interruptions. A shorter study is a prefix of a longer one.

    Attributes:
        folder: Folder of the study; an earlier study there is replaced, or continued.
        header: What the study is about, as plain data, without what only ends it: an earlier study with another header
            is not continued.
        size: Number of trials in a round.
        propose: Values of the trials of the next round, plain data, from all trials of the rounds before. Fewer than
            ``size`` make the last round, none end the study.
        best: What makes one trial better than another; part of the header. None for nothing.
        enough: Whether a trial ends the study; the trials after it do not count. None for never.
        noun: What a trial is called in texts.
    """

    folder: Path
    header: Mapping[str, Any]
    size: int
    propose: Propose
    best: Best | None = None
    enough: Callable[[Trial], bool] | None = None
    noun: str = "trial"

    @classmethod
    def of_variants(cls, folder: Path, header: Mapping[str, Any], variants: Sequence[Variant]) -> Self:
        """A study of one round with given variants, numbered from 0."""

        def propose(finished: Sequence[Trial]) -> Sequence[Mapping[str, object]]:
            return [] if finished else [variant.values for variant in variants]

        return cls(folder=folder, header=header, size=max(1, len(variants)), propose=propose, noun="variant")

    def run(
        self,
        evaluate: Evaluate,
        *,
        workers: int | Executor = 1,
        stop: Stop = Stop(),
        limits: Limits = Limits(),  # noqa: B008 - frozen
        resume: bool = False,
        progress: Progress = silent,
    ) -> Finished:
        """Evaluate trials and record each as soon as it has ended.

        A trial whose evaluation raises an error, ends its process or takes too long has the status ``crashed``.

        Args:
            evaluate: Outcome of a variant, whose values are those proposed; sent to worker processes, so it must be
                picklable. It may keep in itself what it has read, but nothing that changes a later outcome.
            workers: Number of processes; or an executor, which stays open, such as ``Workers`` begun earlier.
            stop: Where the study ends.
            limits: Those of each trial.
            resume: Whether trials that the folder holds already are not evaluated again.
            progress: Called with one line about the study and the fraction done.

        Raises:
            InputError: The folder cannot be used, or holds another study that is to be continued.
            StudyStoppedError: No further trial can be worked out or recorded.
            KeyboardInterrupt: It was interrupted; says how many trials are recorded.
        """
        best = {"round_size": self.size, "best": self.best.record} if self.best else {}
        prepare_folder(self.folder, resume=resume)
        journal = Journal(self.folder, {**self.header, **best}, resume=resume)
        state = RunningState(
            began=time.time(),
            done_before=len(journal.trials) + len(journal.ahead),
            trials=stop.trials if self.best else self.size,
            budget=stop.seconds,
        )
        with running(self.folder, state), journal, ExitStack() as opened:
            session = _Session(self, journal, state, progress)
            try:
                return session.run(lambda: session.flight(evaluate, workers, limits, opened), stop)
            except KeyboardInterrupt:
                session.keep_arrived()
                done = f"{session.done} of {state.trials}" if state.trials is not None else f"{session.done}"
                raise KeyboardInterrupt(
                    f"interrupted: {done} {self.noun}s are recorded in {self.folder}; --resume goes on from there"
                ) from None


class _Session:
    """One run of a study."""

    def __init__(self, study: Study, journal: Journal, state: RunningState, progress: Progress) -> None:
        self._study, self._journal, self._state, self._progress = study, journal, state, progress
        self._flight: Flight | None = None
        self._is_enough = False
        self._best: Trial | None = None
        for trial in (*journal.trials, *journal.ahead.values()):
            self._compare(trial)

    @property
    def done(self) -> int:
        """Number of trials that are recorded."""
        return len(self._journal.trials) + len(self._journal.ahead)

    def flight(self, evaluate: Evaluate, workers: int | Executor, limits: Limits, opened: ExitStack) -> Flight:
        """What runs the trials, made when the first is to be run."""
        if self._flight is None:
            count = min(workers, self._study.size) if isinstance(workers, int) else 0
            executor = workers if isinstance(workers, Executor) else opened.enter_context(Workers(count))
            self._flight = Flight(evaluate, executor, limits)
            opened.callback(self._flight.cancel)
        return self._flight

    def run(self, flight: Callable[[], Flight], stop: Stop) -> Finished:
        """Round after round until the study ends."""
        number, stopped_by, last = 0, None, 0.0
        while stopped_by is None:
            begin = number * self._study.size
            if stop.trials is not None and begin >= stop.trials:
                stopped_by = StoppedBy.TRIALS
            elif 0 < begin >= self.done and self._is_over(stop, last):
                stopped_by = StoppedBy.BUDGET
            else:
                began = time.monotonic()
                stopped_by = self._round(begin, flight, stop)
                last = time.monotonic() - began
                number += 1
        trials = [trial.record for trial in self._journal.trials[: stop.trials]]
        return Finished(trials=trials, rounds=len(trials) // self._study.size, stopped_by=stopped_by)

    def _round(self, begin: int, flight: Callable[[], Flight], stop: Stop) -> StoppedBy | None:
        """One round; why the study ends with it, or None."""
        values = self._study.propose(self._journal.trials[:begin])[: self._study.size]
        variants = [Variant(begin + k, json.loads(json.dumps(dict(each)))) for k, each in enumerate(values)]
        if stop.trials is not None:
            variants = [variant for variant in variants if variant.number < stop.trials]
        self._journal.require(variants)
        for trial in self._journal.trials[begin : begin + self._study.size]:
            self._is_enough = self._is_enough or self._ends(trial)
        left = variants[max(0, len(self._journal.trials) - begin) :]
        left = [variant for variant in left if variant.number not in self._journal.ahead]
        self._follow()
        if left and not self._is_enough:
            self._evaluate(flight(), left)
        if self._is_enough:
            self._journal.ahead.clear()
            return StoppedBy.ENOUGH
        return StoppedBy.SEARCH if len(values) < self._study.size else None

    def _evaluate(self, flight: Flight, variants: Sequence[Variant]) -> None:
        """Evaluate and record variants until one ends the study."""
        for variant, outcome in flight.outcomes(variants):
            self._record(Trial(variant=variant, outcome=outcome))
            if self._is_enough:
                return

    def keep_arrived(self) -> None:
        """Record the outcomes that have come when the study is interrupted."""
        for variant, outcome in self._flight.arrived() if self._flight else ():
            if variant.number >= len(self._journal.trials) and variant.number not in self._journal.ahead:
                self._record(Trial(variant=variant, outcome=outcome))

    def _record(self, trial: Trial) -> None:
        """Record a trial, in its place once those before it are there."""
        with deferred_interruptions():
            if trial.variant.number == len(self._journal.trials):
                self._append(trial)
                self._follow()
            else:
                self._journal.park(trial)
        self._compare(trial)
        self._report()

    def _follow(self) -> None:
        """Record in their place the trials that have waited for those before them."""
        while not self._is_enough and (trial := self._journal.ahead.get(len(self._journal.trials))) is not None:
            self._append(trial)

    def _append(self, trial: Trial) -> None:
        self._journal.append(trial)
        self._is_enough = self._ends(trial)

    def _ends(self, trial: Trial) -> bool:
        return self._study.enough is not None and self._study.enough(trial)

    def _is_over(self, stop: Stop, last: float) -> bool:
        """Whether a round that takes as long as the last one would end after the budget."""
        return stop.seconds is not None and seconds_since(self._state) + last > stop.seconds

    def _report(self) -> None:
        """Say how far the study is."""
        state = self._state
        status = StudyStatus.of(self.done, self._best, self._study.best, state, is_running=True)
        shares = [self.done / state.trials] if state.trials else []
        if state.budget:
            shares.append(seconds_since(state) / state.budget)
        self._progress(status.text(self._study.noun), min(1.0, max(shares, default=0.0)))

    def _compare(self, trial: Trial) -> None:
        if self._study.best is not None:
            self._best = self._study.best.better(trial, self._best)
