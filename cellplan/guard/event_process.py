"""A child process whose work sends events while it goes on; its owner looks for them and never waits.

It stays warm from one piece of work to the next, so imports are paid once. Work whose result does not matter any more
is dropped in its midst without the process. It may be ended at any time, and ends with its owner, however that ends.
"""

import _thread
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Final, NamedTuple

from cellplan.errors import CellplanError
from cellplan.guard.worker import MEGABYTE, end_with_parent, limit
from cellplan.guard.worker_process import EXIT_TIMEOUT_S, KILL_TIMEOUT_S, ONE_THREAD

# The child starts without its working directory on the path, or a file named pickle.py there would be run.
PROGRAM: Final = (
    "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); "
    "from cellplan.guard.event_process import serve; serve(*map(int, sys.argv[1:]))"
)
MEGABYTES: Final = 16_000  # largest address space, far above what honest work takes
NICENESS: Final = 5  # the owner comes first where both need the processor
OLDEST: Final = 8  # [bytes] at the beginning of the file of jobs: the number of the oldest one that is not dropped
DROP: Final = signal.SIGUSR1  # has a process look which of its jobs are dropped
DROPPED: Final = "it was dropped"
Send = Callable[[Any], None]


class Ended(NamedTuple):
    """The last event of a piece of work."""

    error: str = ""  # why it has no result: its own error, or how its process ended; empty where it was done
    is_crash: bool = False  # whether the process is gone


class EventProcess:
    """The process, the pipe from it, and the pieces of work that it was given.

    These are written to a file without a name, as a pipe whose other end is busy would have the owner wait.
    """

    def __init__(self, niceness: int = NICENESS) -> None:
        """Start the process; ``niceness`` is how far its owner and others come first."""
        self._jobs = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as the process
        self._jobs.write(bytes(OLDEST))
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {DROP})  # as the process begins, until it handles it
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own interpreter
                [sys.executable, "-I", "-c", PROGRAM, str(self._jobs.fileno()), str(niceness)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, **dict.fromkeys(ONE_THREAD, "1")},
                pass_fds=[self._jobs.fileno()],
                bufsize=0,
            )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        if self._process.stdin is None or self._process.stdout is None:
            raise OSError("a process without pipes")
        self._orders, self._events = self._process.stdin, Connection(os.dup(self._process.stdout.fileno()))
        self._orders.write(pickle.dumps(sys.path))
        self._begun = 0  # pieces of work so far
        self.left = 0  # pieces of work that have not ended

    @property
    def is_usable(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    @property
    def number(self) -> int:
        """Its number in the system."""
        return self._process.pid

    def begin(self, function: Callable[..., None], *arguments: object) -> None:
        """Have ``function(*arguments, send=...)`` done after what was begun before; ``send`` makes events of values."""
        if not self.left:
            self._jobs.seek(OLDEST)
        at, job = self._jobs.tell(), pickle.dumps((function, arguments))
        self._jobs.write(job)
        self._jobs.flush()
        self._begun, self.left = self._begun + 1, self.left + 1
        with suppress(OSError):  # of a process that has ended, which is the next event
            self._orders.write(b"%d %d %d\n" % (self._begun, at, len(job)))

    def drop(self) -> None:
        """End what was begun so far, in its midst too, at the next step of the interpreter; the process stays."""
        if self.left:
            os.pwrite(self._jobs.fileno(), (self._begun + 1).to_bytes(OLDEST, "little"), 0)
            self._process.send_signal(DROP)

    def poll(self) -> list[Any]:
        """Events since the last call, an ``Ended`` after those of each piece of work."""
        events: list[Any] = []
        try:
            while self._events.poll():
                events.append(self._events.recv())
                self.left -= isinstance(events[-1], Ended)
        except (OSError, EOFError, pickle.UnpicklingError):
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(EXIT_TIMEOUT_S)
            self.end()
            self.left = 0
            events.append(Ended(self._how_it_ended(), is_crash=True))
        return events

    def end(self) -> None:
        """End the process, in the middle of its work if need be."""
        self._process.kill()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(KILL_TIMEOUT_S)
        for pipe in (self._orders, self._process.stdout, self._events, self._jobs):
            if pipe is not None:
                pipe.close()

    def _how_it_ended(self) -> str:
        status = self._process.returncode or 0
        with suppress(ValueError):
            return f"its process was ended ({signal.Signals(-status).name})"
        return f"its process ended with status {status}"


class _DroppedError(BaseException):
    """Raised in work that was dropped."""


class _Worker:
    """What the child does with its pieces of work."""

    def __init__(self, jobs: int, events: Connection) -> None:
        """Do pieces of work from an open file, by its number."""
        self._jobs, self._events, self._number = jobs, events, 0
        self._may_drop = False  # never while a message is half written, or modules are half imported

    def done(self, number: int, at: int, size: int) -> Ended:
        """Do a piece of work."""
        try:
            function, arguments = pickle.loads(os.pread(self._jobs, size, at))  # noqa: S301 - written by our own process
            self._number = number
            try:
                self._let_drop()
                function(*arguments, send=self._send)
            finally:
                self._may_drop = False
        except _DroppedError:
            return Ended(DROPPED)
        except CellplanError as error:
            return Ended(str(error))
        except MemoryError:
            return Ended(f"it needed more than {MEGABYTES} MB")
        except Exception as error:  # noqa: BLE001 - the owner says it
            return Ended(f"{type(error).__name__}: {error}")
        return Ended()

    def look(self, *_: object) -> None:
        """Leave the work under way if it was dropped."""
        if self._may_drop and self._number < int.from_bytes(os.pread(self._jobs, OLDEST, 0), "little"):
            self._may_drop = False  # once is enough
            raise _DroppedError

    def _let_drop(self) -> None:
        self._may_drop = True
        self.look()

    def _send(self, event: Any) -> None:
        self._may_drop = False
        self._events.send(event)
        self._let_drop()


def serve(jobs: int, niceness: int) -> None:
    """Do pieces of work until the owner closes the pipe; output of libraries is discarded.

    Args:
        jobs: Number of the open file that they stand in.
        niceness: How far others come first where they need the processor.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # handled by the owner
    events = Connection(os.dup(sys.stdout.fileno()))
    worker = _Worker(jobs, events)
    signal.signal(DROP, worker.look)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {DROP})
    _thread.start_new_thread(end_with_parent, ())  # of no use to copies of this process, which it must not keep away
    limit("RLIMIT_CORE", 0)  # a crash leaves no file behind
    limit("RLIMIT_AS", MEGABYTES * MEGABYTE)
    with suppress(AttributeError, OSError):
        os.nice(niceness)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    for order in sys.stdin.buffer:
        events.send(worker.done(*map(int, order.split())))
