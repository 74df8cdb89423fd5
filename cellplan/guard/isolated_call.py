"""The parent's side of the guard: one child process for all jobs, started at the first, replaced after a crash."""

import atexit
import contextlib
import os
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from cellplan.errors import CellplanError, OverrunError
from cellplan.guard.worker import Answer, WorkerJob, import_modules
from cellplan.guard.worker_process import ChildProcess, Guard

Value = TypeVar("Value")


def begin_child(*modules: str) -> None:
    """Start the child process, which imports modules of later jobs meanwhile; nothing where it runs already."""
    with _lock:
        if not (_running and _running[0].is_usable):
            _child().begin(job_here(import_modules, modules, Guard(file="", worker="the imports")))


def in_child(function: Callable[..., Value], *arguments: object, guard: Guard) -> Value:
    """Result of ``function(*arguments)``, worked out in the child process, which imports the function from its module.

    Raises:
        OverrunError: The work crashed, or took too long or too much memory.
        CellplanError: What the function itself raises; other exceptions are reported as internal errors.
    """
    with _lock:
        answer = _child().ask(job_here(function, arguments, guard), guard)
    return value_of(answer, guard)


def value_of(answer: Answer, guard: Guard) -> Any:
    """The value of an answer; its error is raised."""
    if answer.error is not None:
        raise answer.error
    if answer.is_out_of_memory:
        raise OverrunError(f"{guard.file}: {guard.worker} needed more than {guard.megabytes} MB")
    if answer.surprise is not None:
        raise CellplanError(f"{guard.file}: {guard.worker} failed: {answer.surprise}")
    return answer.value


def job_here(function: Callable[..., object], arguments: tuple[object, ...], guard: Guard) -> WorkerJob:
    """A job for the child, in the working directory of this process."""
    folder = None
    with contextlib.suppress(OSError):  # it may have been removed
        folder = os.getcwd()  # noqa: PTH109 - a text crosses
    return WorkerJob(function, arguments, folder, guard.seconds, guard.megabytes)


_lock = threading.Lock()
_running: list[ChildProcess] = []


def _child() -> ChildProcess:
    """The running child; a new one when there is none."""
    if not _running or not _running[0].is_usable:
        _end_child()
        _running.append(ChildProcess())
    return _running[0]


@atexit.register
def _end_child() -> None:
    while _running:
        _running.pop().end()
