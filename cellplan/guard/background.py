"""Run functions in a background process; fall back to this process."""

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from types import TracebackType
from typing import Final, Self, TypeVar

from cellplan.guard.worker import Answer, Job
from cellplan.guard.worker_process import ChildProcess, Guard

BACKGROUND_GUARD: Final = Guard(
    file="cellplan", worker="the child process", seconds=600.0, megabytes=4000
)  # no foreign work

Value = TypeVar("Value")


class BackgroundProcess:
    """Does jobs in a child process, one after the other, until the ``with`` statement ends.

    The child is no more than a help: without a second processor there is none, and whatever it cannot do, for lack
    of memory or of permission to start a process, is done in this process as soon as its result is needed.
    """

    def __init__(self) -> None:
        """Prepare; the process is started with the first job."""
        self._child: ChildProcess | None = None
        self._is_desired = processors() > 1
        self._waiting = ThreadPoolExecutor(max_workers=1, thread_name_prefix="cellplan-background")

    def __enter__(self) -> Self:
        """Begin to take jobs."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End the child, in the middle of a job if need be."""
        self._is_desired = False
        if self._child is not None:
            self._child.kill()
        self._waiting.shutdown(wait=True, cancel_futures=True)
        if self._child is not None:
            self._child.end()

    def begin(self, function: Callable[..., Value], *arguments: object) -> Callable[[], Value]:
        """Begin ``function(*arguments)`` in the child.

        Args:
            function: A function of a module, without side effects; the child imports it from there.
            *arguments: Plain data.

        Returns:
            What gives the result, once it is there; exceptions are those of the function.
        """
        begun = self._begun(Job(function, arguments, None, BACKGROUND_GUARD.seconds, BACKGROUND_GUARD.megabytes))

        def result() -> Value:
            answer = None if begun is None else begun.result()
            if answer is None or answer.error or answer.surprise or answer.is_out_of_memory:
                return function(*arguments)
            value: Value = answer.value
            return value

        return result

    def _begun(self, job: Job) -> Future[Answer | None] | None:
        """The future answer; None when there is no child."""
        if self._is_desired and self._child is None:
            with suppress(OSError, TypeError):  # no permission, no memory, no interpreter
                self._child = ChildProcess()
        if not self._is_desired or self._child is None:
            self._is_desired = False
            return None
        return self._waiting.submit(self._asked, self._child, job)

    def _asked(self, child: ChildProcess, job: Job) -> Answer | None:
        """Answer of the child; None when it has none."""
        try:
            return child.ask(job, BACKGROUND_GUARD)
        except Exception:  # noqa: BLE001 - the child is gone, or the job cannot be sent: it is done here
            self._is_desired = False
            return None


def processors() -> int:
    """How many processors this process may use."""
    with suppress(AttributeError, OSError):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
