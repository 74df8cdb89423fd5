"""Trials of studies whose evaluation is a formula or an accident, and an executor that evaluates in this process."""

import ctypes
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

from cellplan.errors import StudyStoppedError
from cellplan.study.status import Best
from cellplan.study.study import Study
from cellplan.study.trial import Outcome, Trial, TrialStatus, Variant
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


def product(variant: Variant) -> Outcome:
    """A figure that can be computed by hand; odd numbers fail."""
    x, y = variant.values["x"], variant.values["y"]
    assert isinstance(x, int)
    assert isinstance(y, float)
    status = TrialStatus.FAILED if x % 2 else TrialStatus.PASSED
    return Outcome(status=status, reason="odd" if x % 2 else "", figures={"product": x * y})


def product_until_5(variant: Variant) -> Outcome:
    """As ``product``; the disk is full from number 5 on."""
    if variant.number == 5:
        raise StudyStoppedError("no more")
    return product(variant)


def halved(variant: Variant) -> Outcome:
    """A figure below that of the trial it begins with; those whose number ends in 7 fail."""
    number, base = variant.number, variant.values["base"]
    assert isinstance(base, float)
    if number % 10 == 7:
        return Outcome(status=TrialStatus.FAILED, reason="seven", figures={"length": 0.0})
    return Outcome(status=TrialStatus.PASSED, figures={"length": base * (1.0 - 0.1 / (1 + number % 5))})


def accident(variant: Variant) -> Outcome:
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
    return Outcome(status=TrialStatus.PASSED, figures={"length": float("nan")}) if number == 8 else halved(variant)


def from_the_best(finished: Sequence[Trial]) -> list[dict[str, object]]:
    """Trials of a round that begin with the best one of the rounds before."""
    best = Best("length").of(finished)
    length = best.outcome.figures["length"] if best else 1.0
    return [{"base": length, "place": (place, 1)} for place in range(SIZE)]


def rounds(folder: Path, **changed: Any) -> Study:
    """A study in rounds of four."""
    given: dict[str, Any] = {"header": HEADER, "size": SIZE, "propose": from_the_best, "best": Best("length")}
    return Study(folder=folder, **{**given, **changed})
