"""A child process that does one job after the other, and the pipes to it."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from typing import Final

from cellplan.errors import OverrunError, TimeLimitError
from cellplan.guard.worker import Answer, WorkerJob

# The child starts without its working directory on the path, or a file named pickle.py there would be run.
WORKER_PROGRAM: Final = (
    "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); from cellplan.guard.worker import serve; serve()"
)
ONE_THREAD: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")  # each more takes address space
EXIT_TIMEOUT_S: Final = 0.5  # [s] an idle process ends at once when its pipe is closed
KILL_TIMEOUT_S: Final = 10.0  # [s] a killed process ends at once, unless the system holds it at a disk that is gone


@dataclass(frozen=True, slots=True, kw_only=True)
class Guard:
    """Name and limits of guarded work."""

    file: str  # the file at fault when it goes wrong, as messages name it
    worker: str  # name of the worker in messages, such as "the mesh reader"
    seconds: float = 60.0  # longest time of the processor
    patience: float = 1.0  # longest time of the clock, as a multiple of it
    megabytes: int = 1500  # largest address space of the child, what Python and its libraries take included


class ChildProcess:
    """The process and the pipes to it."""

    def __init__(self) -> None:
        """Start the process."""
        self.owner = os.getpid()
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter
            [sys.executable, "-I", "-c", WORKER_PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **dict.fromkeys(ONE_THREAD, "1")},
        )
        self._has_path = False
        self._unread = 0  # answers to jobs that were begun only

    @property
    def is_usable(self) -> bool:
        """Whether the process runs and belongs to this one; a fork has pipes that are not its own."""
        return self.owner == os.getpid() and self._process.poll() is None

    def begin(self, job: WorkerJob) -> None:
        """Hand over a job whose answer does not matter, and do not wait for it."""
        with contextlib.suppress(OSError):  # the next job finds out that the process has ended
            self._send(job)
            self._unread += 1

    def ask(self, job: WorkerJob, guard: Guard) -> Answer:
        """Answer to a job; the process is ended when there is none, and after an interruption."""
        late = threading.Event()
        clock = threading.Timer(guard.patience * guard.seconds, self._end_late, [late])
        clock.start()
        try:
            return self._exchange(job)
        except (OSError, EOFError, pickle.UnpicklingError):
            self.end()
            raise self._overrun(guard, is_late=late.is_set()) from None
        except BaseException:
            self.end()
            raise
        finally:
            clock.cancel()

    def kill(self) -> None:
        """End the process in the middle of a job; a caller that waits for its answer gets an error."""
        if self.owner == os.getpid():
            self._process.kill()

    def end(self) -> None:
        """End the process and its pipes."""
        if self.owner != os.getpid():
            return
        for pipe in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
        try:
            self._process.wait(EXIT_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(KILL_TIMEOUT_S)

    def _exchange(self, job: WorkerJob) -> Answer:
        """Send a job and wait for its answer, which comes after those to jobs that were begun before."""
        self._send(job)
        if self._process.stdout is None:
            raise EOFError
        while self._unread:
            pickle.load(self._process.stdout)  # noqa: S301 - written by our own child
            self._unread -= 1
        return pickle.load(self._process.stdout)  # noqa: S301 - likewise

    def _send(self, job: WorkerJob) -> None:
        """Send a job, after the path on which its modules are found."""
        if self._process.stdin is None:
            raise EOFError
        if not self._has_path:
            pickle.dump(sys.path, self._process.stdin)
            self._has_path = True
        pickle.dump(job, self._process.stdin)
        self._process.stdin.flush()

    def _end_late(self, late: threading.Event) -> None:
        """End a process that takes too long."""
        late.set()
        self._process.kill()

    def _overrun(self, guard: Guard, *, is_late: bool) -> OverrunError:
        """The error for a process that ended without an answer."""
        status = self._process.returncode
        if is_late or status == -getattr(signal, "SIGXCPU", 0):
            return TimeLimitError(f"{guard.file}: {guard.worker} took longer than {guard.seconds:g} s")
        try:
            how = signal.Signals(-(status or 0)).name
        except ValueError:
            how = f"exit status {status}"
        return OverrunError(f"{guard.file}: {guard.worker} crashed ({how})")
