"""Study: trials in rounds of a fixed size, in a folder of their own, begun anew or continued."""

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from cellplan.model.progress import Progress, silent
from cellplan.study.folder import prepare_folder, refuse_unless_study
from cellplan.study.journal import Journal
from cellplan.study.record import Recorder
from cellplan.study.running import RunningState, running
from cellplan.study.session import Crew, Propose, Stop, StoppedBy, run_rounds
from cellplan.study.status import Best
from cellplan.study.trial import StudyTrial, Variant
from cellplan.study.workers import Evaluate, Limits

__all__ = ["Finished", "Stop", "StoppedBy", "Study"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """What a study has come to."""

    trials: tuple[StudyTrial, ...]  # in their order; their number repeats the study byte for byte
    rounds: int  # number of whole rounds
    stopped_by: StoppedBy  # why it has ended


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What is tried and where it is recorded.

    Trial i depends on the header, on i and on the trials of finished rounds, and on nothing else: not on the number of
    workers, not on which trial ends first, not on interruptions. A shorter study is a prefix of a longer one.

    Attributes:
        propose: Values of the trials of the next round, plain data, from all trials of the rounds before. Fewer than
            ``size`` make the last round, none end the study.
    """

    folder: Path  # folder of the study; an earlier study there is replaced, or continued
    header: Mapping[str, Any]  # what it is about, in plain data; one with another header is not continued
    size: int  # number of trials in a round
    propose: Propose
    best: Best | None = None  # what makes one trial better than another; part of the header. None for nothing
    enough: Callable[[StudyTrial], bool] | None = None  # whether a trial ends the study, so later ones do not count
    noun: str = "trial"  # what a trial is called in texts
    total: int | None = None  # number of trials, all in one round; None where rounds are proposed

    @classmethod
    def of_variants(cls, folder: Path, header: Mapping[str, Any], variants: Sequence[Variant]) -> Self:
        """A study of one round with given variants, numbered from 0."""

        def propose(finished: Sequence[StudyTrial]) -> Sequence[Mapping[str, object]]:
            return [] if finished else [variant.values for variant in variants]

        count = len(variants)
        return cls(folder=folder, header=header, size=max(1, count), propose=propose, noun="variant", total=count)

    def run(
        self,
        evaluate: Evaluate,
        *,
        workers: int | Executor = 1,
        stop: Stop = Stop(),  # noqa: B008 - frozen
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

        Raises:
            InputError: The folder cannot be used, or holds another study that is to be continued.
            StudyStoppedError: No further trial can be worked out or recorded.
            KeyboardInterrupt: It was interrupted; says how many trials are recorded.
        """
        prepare_folder(self.folder, resume=resume)
        journal = Journal(self.folder, self._whole_header, resume=resume)
        state = RunningState(
            began=time.time(),
            done_before=len(journal.trials) + len(journal.ahead),
            trials=stop.trials if stop.trials is not None else self.total,
            budget=stop.seconds,
        )
        record = Recorder(journal, state, progress, compared=self.best, enough=self.enough, noun=self.noun)
        with running(self.folder, state), journal, Crew(evaluate, workers, limits, self.size) as crew:
            try:
                stopped_by = run_rounds(self.propose, self.size, stop, record, crew)
            except KeyboardInterrupt:
                record.keep(crew.arrived())
                done = f"{record.done} of {state.trials}" if state.trials is not None else f"{record.done}"
                raise KeyboardInterrupt(
                    f"interrupted: {done} {self.noun}s are recorded in {self.folder}; --resume goes on from there"
                ) from None
        trials = tuple(journal.trials[: stop.trials])
        return Finished(trials=trials, rounds=len(trials) // self.size, stopped_by=stopped_by)

    def refuse(self, *, resume: bool) -> None:
        """Refuse a folder that the study cannot be written to; call it early, before any long work."""
        refuse_unless_study(self.folder)
        Journal(self.folder, self._whole_header, resume=resume)

    @property
    def _whole_header(self) -> dict[str, Any]:
        """The header with what makes the rounds."""
        if self.total is not None:
            return dict(self.header)
        return {**self.header, "round_size": self.size, "best": self.best.record if self.best else None}
