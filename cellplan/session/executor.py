"""Executors: what an engine wants that takes longer than an answer, worked out here or in another process."""

from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple, Protocol

from cellplan.guard import Ended, EventProcess
from cellplan.guard.event_process import Send

Step = tuple[
    str | int, Callable[..., Iterator[Any]], tuple[object, ...]
]  # a name, and a function of results, its arguments
FAILURE: Final = "failure"  # name of the result of steps that have none


class Result(NamedTuple):
    """Something that was worked out."""

    step: str | int  # name of the step, or ``FAILURE``
    value: Any  # what the function has yielded; the reason of a failure


class Executor(Protocol):
    """Works out steps one after the other; what is begun later takes the place of all that was begun before."""

    @property
    def is_busy(self) -> bool:
        """Whether there may be further results."""

    def begin(self, *steps: Step) -> None:
        """Begin some steps."""

    def results(self) -> list[Result]:
        """Results since the last call."""

    def stop(self) -> None:
        """Leave the steps that were begun."""

    def close(self) -> None:
        """End for good."""


class InlineExecutor:
    """Works out the next result whenever results are looked for, in the same thread."""

    def __init__(self) -> None:
        """Begin without steps."""
        self._left: Iterator[Result] | None = None

    @property
    def is_busy(self) -> bool:
        """See ``Executor``."""
        return self._left is not None

    def begin(self, *steps: Step) -> None:
        """See ``Executor``."""
        self._left = _results(steps) if steps else None

    def results(self) -> list[Result]:
        """The next result; none at the end."""
        for result in self._left or ():
            return [result]
        self._left = None
        return []

    def stop(self) -> None:
        """See ``Executor``."""
        self._left = None

    def close(self) -> None:
        """See ``Executor``."""
        self._left = None


class ProcessExecutor:
    """Works out steps in one process, which stays warm; results are never waited for."""

    def __init__(self) -> None:
        """Start the process."""
        self._process, self._is_busy = EventProcess(niceness=0), False
        self._number = self._ended = 0  # how often steps were begun, and how often they have ended

    @property
    def is_busy(self) -> bool:
        """See ``Executor``."""
        return self._is_busy

    @property
    def process(self) -> int:
        """Number of the process in the system."""
        return self._process.number

    def begin(self, *steps: Step) -> None:
        """See ``Executor``."""
        self.stop()
        if not steps:
            return
        if not self._process.is_usable:
            self._process.end()
            self._process, self._ended = EventProcess(niceness=0), self._number
        self._number, self._is_busy = self._number + 1, True
        self._process.begin(execute, self._number, steps)

    def results(self) -> list[Result]:
        """Results since the last call, at once."""
        results = list[Result]()
        for event in self._process.poll():
            if not isinstance(event, Ended):
                number, result = event
                results += [result] if self._is_busy and number == self._number else []
                continue
            self._ended = self._number if event.is_crash else self._ended + 1
            if self._is_busy and self._ended == self._number:
                self._is_busy = False
                results += [Result(FAILURE, event.error)] if event.error else []
        return results

    def stop(self) -> None:
        """See ``Executor``."""
        self._is_busy = False
        self._process.drop()

    def close(self) -> None:
        """End the process."""
        self._is_busy = False
        self._process.end()


def execute(number: int, steps: tuple[Step, ...], *, send: Send) -> None:
    """Send the results of steps, each with a number that tells them from those of others."""
    for result in _results(steps):
        send((number, result))


def _results(steps: tuple[Step, ...]) -> Iterator[Result]:
    """All results, one after the other."""
    for name, function, arguments in steps:
        for value in function(*arguments):
            yield Result(name, value)
