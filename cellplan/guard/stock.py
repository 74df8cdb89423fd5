"""Several child processes at once: each thread that asks takes an idle one, or a new one."""

import threading
from collections.abc import Callable
from typing import Any

from cellplan.errors import OverrunError
from cellplan.guard.isolated_call import job_here, value_of
from cellplan.guard.worker_process import ChildProcess, Guard


class ChildStock:
    """Child processes that stay warm between jobs; one that crashed or ran out of time or memory is replaced."""

    def __init__(self) -> None:
        """Begin without a process."""
        self._prepared: dict[ChildProcess, object] = {}
        self._lock = threading.Lock()
        self._idle: list[ChildProcess] = []
        self._busy: list[ChildProcess] = []
        self._is_open = True

    def call(
        self,
        function: Callable[..., Any],
        *arguments: object,
        guard: Guard,
        prepare: tuple[Callable[[Any], object], object, Guard] | None = None,
    ) -> Any:
        """Result of ``function(*arguments)``, worked out in a child process; as ``in_child``.

        What a process prepares that has not done so yet comes with its argument and limits: imports, for which the
        limits of the job are too narrow.
        """
        child = self._taken()
        try:
            if prepare is not None and self._prepared.get(child) != prepare[1]:
                begin, argument, limits = prepare
                value_of(child.ask(job_here(begin, (argument,), limits), limits), limits)
                self._prepared[child] = argument
            value = value_of(child.ask(job_here(function, arguments, guard), guard), guard)
        except OverrunError:
            child.end()
            raise
        finally:
            with self._lock:
                self._busy.remove(child)
                if self._is_open and child.is_usable:
                    self._idle.append(child)
                else:
                    self._prepared.pop(child, None)
        return value

    def stop(self) -> None:
        """End the processes that are in the middle of a job; what waits for its answer gets an error."""
        with self._lock:
            for child in self._busy:
                child.kill()

    def end(self) -> None:
        """End all processes, in the middle of a job if need be; what waits for an answer gets an error."""
        with self._lock:
            self._is_open = False
            for child in self._busy:
                child.kill()
            idle, self._idle = self._idle, []
        for child in idle:
            child.end()

    def _taken(self) -> ChildProcess:
        """An idle process, or a new one."""
        with self._lock:
            while self._idle:
                child = self._idle.pop()
                if child.is_usable:
                    self._busy.append(child)
                    return child
            if not self._is_open:
                raise OverrunError("the worker processes were ended")
            child = ChildProcess()
            self._busy.append(child)
            return child
