"""Running of trials on an executor, each in a child process."""

import json
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Final

from cellplan.errors import StudyStoppedError
from cellplan.study.interruptions import deferred_interruptions, is_one_done, result_of
from cellplan.study.trial import TrialOutcome, Variant
from cellplan.study.workers import Evaluate, Limits, Lost, Workers, crashed, outcome_in_child, packed

BEGUN: Final = 256  # trials that are begun at once on an executor of the caller
SURE: Final = 2  # ends of its process, the last one alone, after which a trial is the culprit


class Flight:
    """Trials under way.

    A trial whose process ended or took too long is repeated when no other is under way, so that what others do to the
    machine decides nothing; what happens again is its outcome.
    """

    def __init__(self, evaluate: Evaluate, executor: Executor, limits: Limits) -> None:
        """Begin with none."""
        self._evaluate, self._executor, self._limits = packed(evaluate), executor, limits
        self._slots: int = getattr(executor, "count", BEGUN)
        self._waiting: deque[Variant] = deque()
        self._lost: deque[Variant] = deque()
        self._losses: Counter[int] = Counter()
        self._flying: dict[Future[str | Lost], Variant] = {}
        self._is_alone = False

    def outcomes(self, variants: Iterable[Variant]) -> Iterator[tuple[Variant, TrialOutcome]]:
        """Variants and their outcomes, in the order in which these come.

        Raises:
            StudyStoppedError: The executor answers for none of them within the time after which each is ended.
        """
        self._waiting.extend(variants)
        longest = self._limits.longest
        while self._waiting or self._lost or self._flying:
            with deferred_interruptions():
                self._fill()
            if not is_one_done(self._flying, longest):
                raise StudyStoppedError(
                    f"no trial has ended for {longest:g} s, longer than one may take: what works them out does not "
                    "answer; --resume goes on from what is recorded"
                )
            yield from self.ended()

    def ended(self) -> Iterator[tuple[Variant, TrialOutcome]]:
        """Those whose outcomes have come, without waiting for others."""
        with deferred_interruptions():
            done = [future for future in self._flying if future.done()]
        for future in sorted(done, key=lambda future: self._flying[future].number):
            outcome = self._outcome(self._flying[future], result_of(future, 0.0))
            if outcome is not None:
                yield self._flying[future], outcome
            del self._flying[future]

    def arrived(self) -> list[tuple[Variant, TrialOutcome]]:
        """Outcomes that have come and were perhaps not taken, when the study is interrupted."""
        done = [future for future in self._flying if future.done() and not future.cancelled()]
        answers = [
            (self._flying[future], future.result(timeout=0)) for future in done if future.exception(timeout=0) is None
        ]
        return [(variant, self._read(answer)) for variant, answer in answers if isinstance(answer, str)]

    def cancel(self) -> None:
        """Give up what has not begun."""
        self._waiting.clear()
        self._lost.clear()
        for future in self._flying:
            future.cancel()
        self._flying.clear()

    def _fill(self) -> None:
        """Begin as many trials as the executor takes; one that was lost only by itself."""
        if self._lost:
            if not self._flying:
                self._begin(self._lost.popleft(), alone=True)
            return
        while self._waiting and len(self._flying) < self._slots:
            self._begin(self._waiting.popleft(), alone=self._slots == 1)

    def _begin(self, variant: Variant, *, alone: bool) -> None:
        self._is_alone = alone
        self._flying[self._executor.submit(outcome_in_child, self._evaluate, variant, self._limits)] = variant

    def _outcome(self, variant: Variant, answer: str | Lost) -> TrialOutcome | None:
        """The outcome of an answer; None when the trial is to be repeated."""
        if isinstance(answer, str):
            return self._read(answer)
        self._losses[variant.number] += 1
        if self._is_alone and (answer.is_late or self._losses[variant.number] >= SURE):
            return crashed(answer.reason)
        self._lost.append(variant)
        return None

    @staticmethod
    def _read(answer: str) -> TrialOutcome:
        return TrialOutcome.from_record(json.loads(answer))


@contextmanager
def outcomes(
    variants: Sequence[Variant], evaluate: Evaluate, workers: int | Executor
) -> Iterator[Iterator[TrialOutcome]]:
    """Outcomes in the order of the variants, for a ``with`` statement; one worker is this process itself.

    Args:
        workers: Number of processes; or an executor, which stays open.
    """
    if isinstance(workers, Executor):
        yield _in_order(Flight(evaluate, workers, Limits()).outcomes(variants))
    elif min(workers, len(variants)) <= 1:
        yield (evaluate(variant) for variant in variants)
    else:
        with Workers(min(workers, len(variants))) as executor:
            yield _in_order(Flight(evaluate, executor, Limits()).outcomes(variants))


def _in_order(outcomes: Iterator[tuple[Variant, TrialOutcome]]) -> Iterator[TrialOutcome]:
    """Outcomes by the numbers of their variants, which begin with 0."""
    early: dict[int, TrialOutcome] = {}
    following = 0
    for variant, outcome in outcomes:
        early[variant.number] = outcome
        while following in early:
            yield early.pop(following)
            following += 1
