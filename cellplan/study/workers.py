"""Worker processes of a study: each trial is worked out in a child process, which it may crash or block."""

import atexit
import json
import pickle
import re
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from types import TracebackType
from typing import Any, Final, NamedTuple, TypeVar

from cellplan.errors import CellplanError, NotFiniteError, OverrunError, StudyStoppedError, TimeLimitError
from cellplan.guard import ChildStock, Guard
from cellplan.study.bundle import Unpacked, packed_with_paths, reading_below
from cellplan.study.interruptions import result_of
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

ADDRESS: Final = re.compile(r" at 0x[0-9a-fA-F]+")  # of an object in an error text: another one in each process
PATIENCE: Final = 4.0  # [-] clock over processor: trials may share a processor with others
START: Final = Guard(
    file="cellplan", worker="the start of a worker process", seconds=300.0, patience=PATIENCE, megabytes=16_000
)
LONGEST_S: Final = 2.0 * PATIENCE * START.seconds  # [s] of the clock for a piece of work, that before it included

Evaluate = Callable[[Variant], TrialOutcome]
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of one trial, far above what an honest one needs."""

    seconds: float = 3600.0  # longest time of the processor; of the clock, four times as long
    megabytes: int = 16_000  # largest address space of its process, Python and its libraries included

    @property
    def longest(self) -> float:
        """Time of the clock in [s] within which a trial ends or is ended, the start of its process included."""
        return PATIENCE * (self.seconds + START.seconds)


class Lost(NamedTuple):
    """Why the process of a trial ended without an outcome."""

    reason: str
    is_late: bool = False


class Workers(ThreadPoolExecutor):
    """Executor whose threads each wait for a worker process; to be used in a ``with`` statement.

    The processes start at once and import modules while the caller goes on. They end with the ``with`` statement, in
    the middle of a trial if it is left by an exception, and with this process, however that ends.
    """

    def __init__(
        self,
        count: int,
        modules: Sequence[str] = (),
        *,
        first: Callable[[], object] | None = None,
        at_once: int | None = None,
    ) -> None:
        """Start the processes.

        Args:
            first: What each process works out before its first trial, to keep it: a function of a module, bound to
                plain data. What it raises is ignored: trials meet it again.
            at_once: Number of processes that start now; the others with their first trials. None for all.
        """
        self.count, self._children = count, ChildStock()
        super().__init__(count, thread_name_prefix="cellplan-worker", initializer=_use, initargs=(self._children,))
        for _ in range(count if at_once is None else min(count, at_once)):
            self.submit(_warm, tuple(modules), None if first is None else pickle.dumps(first))

    def begin(self, function: Callable[..., Value], *arguments: object) -> Callable[[], Value]:
        """Begin ``function(*arguments)`` in one of the processes; the returned function waits for its value.

        What goes wrong with the process or on the way is done in this one.
        """
        begun = self.submit(_called, function, arguments)

        def value() -> Value:
            with suppress(CellplanError, TypeError, AttributeError, pickle.PicklingError, TimeoutError):
                return result_of(begun, LONGEST_S)
            return function(*arguments)

        return value

    def attempt(self, function: Callable[..., object], *arguments: object) -> None:
        """Do ``function(*arguments)`` in one of the processes, which it may end: what goes wrong is ignored."""
        with suppress(CellplanError, TimeoutError):
            result_of(self.submit(_called, function, arguments), LONGEST_S)

    def stop(self) -> None:
        """End the processes of trials under way: nothing is asked of these any more."""
        self._children.stop()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End the processes."""
        self.shutdown(wait=False, cancel_futures=True)
        self._children.end()
        self.shutdown(wait=True)


CHILDREN: Final = ChildStock()  # of threads that another executor has made
atexit.register(CHILDREN.end)
_thread = threading.local()


def _use(children: ChildStock) -> None:
    """Have this thread ask processes of its own executor."""
    _thread.children = children


def _children() -> ChildStock:
    return getattr(_thread, "children", CHILDREN)


def packed(evaluate: Evaluate) -> bytes:
    """What an evaluator is sent to a worker as."""
    try:
        payload = packed_with_paths(evaluate)
    except (AttributeError, TypeError, pickle.PicklingError) as error:
        raise TypeError(f"evaluate: expected a function of a module, bound to plain data, got {error}") from None
    if b"__main__" in payload:
        raise TypeError("evaluate: expected a function of a module, got one of the program that was started")
    return payload


def outcome_in_child(evaluate: bytes, variant: Variant, limits: Limits, root: str = "") -> str | Lost:
    """Outcome of a trial as JSON, worked out in a child process of this one; or how it was lost.

    Args:
        root: The folder of the files of the study; empty where they stand under their own paths.
    """
    guard = Guard(
        file=f"trial {variant.number}",
        worker="its process",
        seconds=limits.seconds,
        patience=PATIENCE,
        megabytes=limits.megabytes,
    )
    try:
        prepare = prepared, (evaluate, root), START
        text: str = _children().call(evaluated, evaluate, variant, root, guard=guard, prepare=prepare)
    except OverrunError as error:
        return Lost(str(error), isinstance(error, TimeLimitError))
    return text


def evaluated(evaluate: bytes, variant: Variant, root: str = "") -> str:
    """Outcome of a trial as JSON; an exception of the evaluator is one too.

    Raises:
        StudyStoppedError: The evaluator says that no trial can be worked out any more.
        NotFiniteError: A figure of the trial is no number: what it judges by is wrong.
        MemoryError: There is not enough of it.
    """
    as_written: Callable[[str], str] = str
    try:
        unpacked = _unpacked(evaluate, root)
        as_written = unpacked.as_written
        with reading_below(root):
            return as_written(_text(unpacked.value(variant)))
    except (StudyStoppedError, NotFiniteError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - the trial's own
        said = (str(error).splitlines() or [""])[0]
        reason = said if isinstance(error, CellplanError) else f"{type(error).__name__}: {said}"
        return as_written(_text(crashed(ADDRESS.sub("", reason))))


def prepared(evaluate_and_root: tuple[bytes, str]) -> None:
    """Read what the evaluator needs; an error of it shows in every trial."""
    with suppress(Exception):
        _unpacked(*evaluate_and_root)


def crashed(reason: str) -> TrialOutcome:
    """Outcome of a trial that has none of its own."""
    return TrialOutcome(status=TrialStatus.CRASHED, reason=reason, figures={})


@lru_cache(maxsize=1)
def _unpacked(evaluate: bytes, root: str) -> Unpacked:
    """The evaluator, which keeps what it has read from one trial to the next."""
    return Unpacked(evaluate, root)


def _text(outcome: TrialOutcome) -> str:
    try:
        return json.dumps(outcome.record, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError):
        return _text(crashed("expected finite numbers and other plain data as its figures, got something else"))


def _warm(modules: tuple[str, ...], first: bytes | None) -> None:
    """Get a child process ready; what goes wrong does so again in the first trial, which says it."""
    with suppress(CellplanError):
        _children().call(_made_ready, modules, first, guard=START)


def _called(function: Callable[..., Any], arguments: tuple[object, ...]) -> Any:
    """Value of a function in a child process."""
    return _children().call(function, *arguments, guard=START)


def _made_ready(modules: tuple[str, ...], first: bytes | None) -> None:
    for name in modules:
        import_module(name)
    if first is not None:
        with suppress(Exception):
            pickle.loads(first)()  # noqa: S301 - packed by the process that asks
