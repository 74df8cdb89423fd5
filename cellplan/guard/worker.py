"""The child's side of the guard: takes one job after the other from its standard input and answers each."""

import contextlib
import os
import pickle
import select
import signal
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any, Final, NamedTuple

from cellplan.errors import CellplanError

MEGABYTE: Final = 1 << 20  # [bytes]


class WorkerJob(NamedTuple):
    """A job of the parent: a function of a module, its arguments, its folder and its limits."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    folder: str | None
    seconds: float
    megabytes: int


class Answer(NamedTuple):
    """The result of a job: its value, our own error, no memory left, or another exception as text."""

    value: Any = None
    error: CellplanError | None = None
    is_out_of_memory: bool = False
    surprise: str | None = None


def serve() -> None:
    """Do jobs until the parent closes the pipe.

    Output of libraries is discarded: the pipe carries answers only. Ctrl-C is handled by the parent.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    limit("RLIMIT_CORE", 0)  # a crash leaves no file behind
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    while True:
        try:
            job = pickle.load(sys.stdin.buffer)  # noqa: S301 - written by the parent
        except EOFError:
            return
        answers.write(pickle.dumps(_done(job)))
        answers.flush()


def import_modules(*names: str) -> None:
    """Import what later jobs need."""
    for name in names:
        import_module(name)


def end_with_parent() -> None:
    """End this process, in the middle of a job too, when the parent has ended and its end of the pipe is closed."""
    with contextlib.suppress(AttributeError, OSError, ValueError):  # Windows cannot wait for it
        pipe = select.poll()
        pipe.register(sys.stdin.fileno(), 0)
        pipe.poll()
        os._exit(1)


def _done(job: WorkerJob) -> Answer:
    try:
        if job.folder is not None:
            os.chdir(job.folder)
        limit("RLIMIT_AS", job.megabytes * MEGABYTE)
        limit("RLIMIT_CPU", int(sum(os.times()[:2]) + job.seconds) + 1)
        return Answer(value=job.function(*job.arguments))
    except CellplanError as error:
        return Answer(error=error)
    except MemoryError:
        return Answer(is_out_of_memory=True)
    except Exception as error:  # noqa: BLE001 - reported by the parent
        return Answer(surprise=f"{type(error).__name__}: {error}")


def limit(name: str, amount: int) -> None:
    """Set a soft limit where the system knows it and allows it; Windows knows none, macOS no limit on memory."""
    with contextlib.suppress(ImportError, AttributeError, ValueError, OSError):
        import resource

        kind = getattr(resource, name)
        hard = resource.getrlimit(kind)[1]
        soft = amount if hard == resource.RLIM_INFINITY else min(amount, hard)
        resource.setrlimit(kind, (soft, hard))
