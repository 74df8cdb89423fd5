"""Recording of a study while it runs: each trial in its place, the best so far, and what is said about it."""

from collections.abc import Callable, Iterable

from cellplan.model.progress import Progress
from cellplan.study.interruptions import deferred_interruptions
from cellplan.study.journal import Journal
from cellplan.study.running import RunningState, seconds_since
from cellplan.study.status import Best, StudyStatus
from cellplan.study.trial import StudyTrial, TrialOutcome, Variant

Again = Callable[[Variant], TrialOutcome]  # works out a trial a second time


class Recorder:
    """Records trials in their order, those that end before others meanwhile beside the journal."""

    def __init__(
        self,
        journal: Journal,
        state: RunningState,
        progress: Progress,
        *,
        compared: Best | None,
        enough: Callable[[StudyTrial], bool] | None,
        noun: str,
    ) -> None:
        """Begin with what the journal holds.

        Args:
            compared: What makes one trial better than another; None for nothing.
            enough: Whether a trial ends the study; None for never.
        """
        self.journal, self._state, self._progress = journal, state, progress
        self._compared, self._enough, self._noun = compared, enough, noun
        self._best: StudyTrial | None = None  # of those in the journal
        self._is_enough = False
        for trial in journal.trials:
            self._count(trial)

    @property
    def done(self) -> int:
        """Number of trials that are recorded."""
        return len(self.journal.trials) + len(self.journal.ahead)

    def is_enough(self) -> bool:
        """Whether a recorded trial ends the study."""
        return self._is_enough

    @property
    def seconds(self) -> float:
        """Time since the study was begun or continued, in s."""
        return seconds_since(self._state)

    def add(self, variant: Variant, outcome: TrialOutcome, again: Again | None) -> None:
        """Record a trial, in its place once those before it are there.

        Args:
            again: Works out a trial that counts again, so that its figures are those of this machine; None where they
                are anyway.
        """
        trial = StudyTrial(variant=variant, outcome=outcome)
        if variant.number == len(self.journal.trials):
            self._append(trial, again)
            self.follow(again)
        else:
            with deferred_interruptions():
                self.journal.park(trial)
        self._report()

    def follow(self, again: Again | None) -> None:
        """Record in their place the trials that have waited for those before them."""
        while not self.is_enough() and (trial := self.journal.ahead.get(len(self.journal.trials))) is not None:
            self._append(trial, again)

    def keep(self, arrived: Iterable[tuple[Variant, TrialOutcome]]) -> None:
        """Record outcomes that came while the study was interrupted."""
        for variant, outcome in arrived:
            if variant.number >= len(self.journal.trials) and variant.number not in self.journal.ahead:
                self.journal.park(StudyTrial(variant=variant, outcome=outcome))

    def _append(self, trial: StudyTrial, again: Again | None) -> None:
        if again is not None and self._counts(trial):
            trial = StudyTrial(variant=trial.variant, outcome=again(trial.variant))
        with deferred_interruptions():
            self.journal.append(trial)
        self._count(trial)

    def _counts(self, trial: StudyTrial) -> bool:
        """Whether a trial would be the best or end the study."""
        best = self._compared.better(trial, self._best) if self._compared else None
        return best is trial or (self._enough is not None and self._enough(trial))

    def _count(self, trial: StudyTrial) -> None:
        if self._compared is not None:
            self._best = self._compared.better(trial, self._best)
        self._is_enough = self._is_enough or (self._enough is not None and self._enough(trial))

    def _report(self) -> None:
        """Say how far the study is."""
        state = self._state
        status = StudyStatus.of(self.done, self._best, self._compared, state, is_running=True)
        shares = [self.done / state.trials] if state.trials else []
        if state.budget:
            shares.append(self.seconds / state.budget)
        self._progress(status.text(self._noun), min(1.0, max(shares, default=0.0)))
