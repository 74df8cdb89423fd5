"""State of a running study: ``study-state.json``, which is locked while the study runs and gone when it has ended."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Final

from cellplan.errors import InputError

STATE: Final = "study-state.json"
TRIES: Final = 20  # times that the lock is tried: one that reads the state holds it for a moment
PAUSE_S: Final = 0.01  # [s] between two of them


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningState:
    """What ``--status`` has to know of a study beyond its journal."""

    began: float  # when it was begun or continued, in seconds of the system's clock
    done_before: int  # number of trials that were recorded then
    trials: int | None  # number of trials at which it ends; None where only the budget or the search itself ends it
    budget: float | None  # seconds after which no round is begun; None for no such limit


@contextmanager
def running(folder: Path, state: RunningState) -> Iterator[None]:
    """Hold the folder of a study while it runs, for a ``with`` statement; not removed when the process is killed."""
    path = folder / STATE
    try:
        file = path.open("a+b")
    except OSError as error:
        raise cannot_write(path, error) from error
    with file:
        for _ in range(TRIES):
            if _locked(file):
                break
            time.sleep(PAUSE_S)
        else:
            raise _busy(folder)
        file.truncate(0)
        file.write(json.dumps(asdict(state)).encode())
        file.flush()
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


def read_state(folder: Path) -> tuple[RunningState | None, bool]:
    """The state of a study, and whether it runs; None where it has ended in order."""
    with suppress(OSError, ValueError, TypeError), (folder / STATE).open("r+b") as file:
        is_running = not _locked(file)
        return RunningState(**json.loads(file.read())), is_running
    return None, False


def require_idle(folder: Path) -> None:
    """Refuse a folder that a running study holds."""
    with suppress(OSError), (folder / STATE).open("r+b") as file:
        if not _locked(file):
            raise _busy(folder)


def seconds_since(state: RunningState) -> float:
    """Time since the study was begun or continued, in s."""
    return max(0.0, time.time() - state.began)


def _locked(file: IO[bytes]) -> bool:
    """Lock an open file until it is closed; False when another process has. Always true where there are no locks."""
    try:
        import fcntl
    except ImportError:
        return True
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


def cannot_write(path: Path, error: OSError) -> InputError:
    """The error that users see where the disk refuses."""
    return InputError(f"{path}: cannot write the study: {(error.strerror or str(error)).lower()}")


def _busy(folder: Path) -> InputError:
    """The error that users see."""
    return InputError(f"{folder}: another study is being written there; wait for it or choose another folder with -o")
