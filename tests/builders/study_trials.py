"""Trials of studies whose evaluation is a formula or an accident, and an executor that evaluates in this process."""

import ctypes
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellplan.errors import NotFiniteError, StudyStoppedError
from cellplan.study.status import Best
from cellplan.study.study import Study
from cellplan.study.trial import StudyTrial, TrialOutcome, TrialStatus, Variant
from cellplan.study.workers import evaluated

HEADER = {"kind": "try", "seed": 3}
SIZE = 4


class InThisProcess(Executor):
    """Evaluates at once, without a process of its own."""

    count = 1

    def __init__(self, _count: int = 1) -> None:
        self.numbers: list[int] = []

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        evaluate, variant, _ = arguments
        self.numbers.append(variant.number)
        future: Future[Any] = Future()
        try:
            future.set_result(evaluated(evaluate, variant))
        except Exception as error:  # noqa: BLE001 - as an executor does
            future.set_exception(error)
        return future


def product(variant: Variant) -> TrialOutcome:
    """A figure that can be computed by hand; odd numbers fail."""
    x, y = variant.values["x"], variant.values["y"]
    assert isinstance(x, int)
    assert isinstance(y, float)
    status = TrialStatus.FAILED if x % 2 else TrialStatus.PASSED
    return TrialOutcome(status=status, reason="odd" if x % 2 else "", figures={"product": x * y})


def product_until_5(variant: Variant) -> TrialOutcome:
    """As ``product``; the disk is full from number 5 on."""
    if variant.number == 5:
        raise StudyStoppedError("no more")
    return product(variant)


def not_finite_at_5(variant: Variant) -> TrialOutcome:
    """As ``product``; a figure that number 5 compares is no number."""
    if variant.number == 5:
        raise NotFiniteError("table/turn: expected a finite speed in the search, got nan")
    return product(variant)


def halved(variant: Variant) -> TrialOutcome:
    """A figure below that of the trial it begins with; those whose number ends in 7 fail."""
    number, base = variant.number, variant.values["base"]
    assert isinstance(base, float)
    if number % 10 == 7:
        return TrialOutcome(status=TrialStatus.FAILED, reason="seven", figures={"length": 0.0})
    return TrialOutcome(status=TrialStatus.PASSED, figures={"length": base * (1.0 - 0.1 / (1 + number % 5))})


def accident(variant: Variant) -> TrialOutcome:
    """As ``halved``, but some end their process, raise an error or never end."""
    number = variant.number
    if number == 1:
        raise ValueError("no good")
    if number == 2:
        os._exit(5)
    if number == 4:
        raise MemoryError
    if number == 5:
        ctypes.string_at(0)
    if number == 6:
        threading.Event().wait()
    return TrialOutcome(status=TrialStatus.PASSED, figures={"length": float("nan")}) if number == 8 else halved(variant)


def from_the_best(finished: Sequence[StudyTrial]) -> list[dict[str, object]]:
    """Trials of a round that begin with the best one of the rounds before."""
    best = Best("length").of(finished)
    length = best.outcome.figures["length"] if best else 1.0
    return [{"base": length, "place": (place, 1)} for place in range(SIZE)]


def rounds(folder: Path, **changed: Any) -> Study:
    """A study in rounds of four."""
    given: dict[str, Any] = {"header": HEADER, "size": SIZE, "propose": from_the_best, "best": Best("length")}
    return Study(folder=folder, **{**given, **changed})


@dataclass(frozen=True)
class Killer:
    """As ``halved``; trial 5 kills the parent of its process first, unless the mark is there.

    Attributes:
        mark: File that is made then.
    """

    mark: Path

    def __call__(self, variant: Variant) -> TrialOutcome:
        if variant.number == 5 and not self.mark.exists():
            self.mark.touch()
            os.kill(os.getppid(), signal.SIGKILL)
        return halved(variant)


@dataclass(frozen=True)
class Wrong:
    """As ``halved``, but with a figure that is too good in every process that was not started by a given one.

    Attributes:
        honest: Number of the process.
    """

    honest: int

    def __call__(self, variant: Variant) -> TrialOutcome:
        right = halved(variant)
        if os.getppid() == self.honest or right.status is not TrialStatus.PASSED:
            return right
        return TrialOutcome(status=TrialStatus.PASSED, figures={"length": 0.001 * variant.number})


@dataclass(frozen=True)
class Noted:
    """As ``halved`` after some work, more for some than for others; leaves the number of its process in a folder.

    Attributes:
        pids: The folder.
    """

    pids: Path

    def __call__(self, variant: Variant) -> TrialOutcome:
        (self.pids / str(os.getpid())).touch()
        assert sum(range(20_000 * (1 + 9 * (variant.number % 4 == 0)))) > 0
        return halved(variant)
