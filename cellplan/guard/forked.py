"""Run functions in copies of this process beside it; fall back to this process."""

import os
import pickle
import select
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from types import TracebackType
from typing import Any, BinaryIO, Final, NoReturn, Self, TypeVar

HELD: Final = {signal.SIGINT, signal.SIGTERM}  # signals that must not reach a copy before it ignores or obeys them
PROGRESS_EVERY_S: Final = 0.1  # [s] between two messages of a copy on its progress
LONGEST_S: Final = 3600.0  # [s] that a copy is waited for, far above what any honest work takes

Value = TypeVar("Value")
Listener = Callable[[str, float], None]


class ForkedWork:
    """Does each function in a copy of this process, until the ``with`` statement ends.

    Nothing is sent to a copy, which has all that this process has. A copy is no more than a help: where there is no
    second processor, where this process runs threads, and on systems on which a copy may not use the system's libraries
    (all but Linux), everything is done in this process as soon as its result is needed; so is whatever a copy ends
    without.
    """

    def __init__(self, progress: Listener) -> None:
        """Prepare; progress is called with the stage and the fraction done, while a result is waited for."""
        self._progress = progress
        self._running: dict[int, BinaryIO] = {}  # what comes from each copy, by its process number
        self._life = os.pipe() if sys.platform == "linux" else None  # it ends with this process

    def __enter__(self) -> Self:
        """Begin to take work."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End all copies, in the middle of their work if need be."""
        for process in [*self._running]:
            self._end(process)
        for end in self._life or ():
            os.close(end)
        self._life = None

    def begin(self, function: Callable[..., Value], *arguments: object) -> Callable[[], Value]:
        """Begin ``function(*arguments, progress=...)`` in a copy of this process; the value returned gives its result.

        The function has no side effects, and its result can be pickled; exceptions are those of the function.
        """
        may_fork = self.is_possible and len(self._running) < processors()
        process = self._forked(function, arguments) if may_fork else None

        @cache
        def result() -> Value:
            if process in self._running:
                with suppress(EOFError, OSError, pickle.UnpicklingError):
                    return self._read(process)
            return function(*arguments, progress=self._progress)

        return result

    @property
    def is_possible(self) -> bool:
        """Whether a copy would work, and beside this process."""
        is_alone = threading.active_count() == 1  # a copy has none of the other threads, but all that they have locked
        return self._life is not None and is_alone and processors() > 1

    def _forked(self, function: Callable[..., Value], arguments: tuple[object, ...]) -> int | None:
        """Number of a copy that works; None where the system allows none."""
        come, go = os.pipe()
        held = signal.pthread_sigmask(signal.SIG_BLOCK, HELD)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter(
                    "ignore", DeprecationWarning
                )  # threads of the linear algebra, which can be copied
                process = os.fork()
            if process == 0:
                self._work(function, arguments, go)
            self._running[process] = os.fdopen(come, "rb")
        except OSError:
            os.close(come)
            return None
        finally:
            os.close(go)
            signal.pthread_sigmask(signal.SIG_SETMASK, held)
        return process

    def _work(self, function: Callable[..., Value], arguments: tuple[object, ...], go: int) -> NoReturn:
        """Do the work of a copy, and end it."""
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # handled by the process that was copied
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, HELD)
            if self._life is not None:
                os.close(self._life[1])
                threading.Thread(target=_end_with, args=self._life[:1], daemon=True).start()
            value = function(*arguments, progress=_sender(go))
            with os.fdopen(go, "wb") as answer:
                pickle.dump((value,), answer, pickle.HIGHEST_PROTOCOL)
        finally:
            os._exit(0)  # whatever has gone wrong is done again by the process that was copied, and goes wrong there

    def _read(self, process: int) -> Any:
        """What a copy has found; EOFError when it ended without, or was ended because it took too long."""
        clock = threading.Timer(LONGEST_S, os.kill, [process, signal.SIGKILL])
        clock.start()
        try:
            while True:
                message = pickle.load(self._running[process])  # noqa: S301 - written by our own copy
                if len(message) == 1:
                    return message[0]
                self._progress(*message)
        finally:
            clock.cancel()
            clock.join(PROGRESS_EVERY_S)
            self._end(process)

    def _end(self, process: int) -> None:
        """End a copy and its pipe."""
        self._running.pop(process).close()
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


def processors() -> int:
    """How many processors this process may use."""
    with suppress(AttributeError, OSError):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _sender(pipe: int) -> Listener:
    """A listener that passes progress on, seldom, and never waits for the reader."""
    last = time.monotonic()

    def send(stage: str, share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= PROGRESS_EVERY_S and select.select([], [pipe], [], 0.0)[1]:
            last = now
            os.write(pipe, pickle.dumps((stage, share)))  # shorter than what is written at once

    return send


def _end_with(life: int) -> None:
    """End this process when the one that it is a copy of has ended."""
    os.read(life, 1)
    os._exit(1)
