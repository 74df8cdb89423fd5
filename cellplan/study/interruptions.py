"""Interruptions at safe moments: no half line is written, and no lock of a future stays with the main thread."""

import signal
import threading
import time
from collections.abc import Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from typing import Any, Final, TypeVar

PAUSE_S: Final = 0.1  # [s] after which an interruption is heard at the latest

Value = TypeVar("Value")


@contextmanager
def deferred_interruptions() -> Iterator[None]:
    """Let Ctrl-C and its like wait for the end of the ``with`` statement, in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    numbers = [
        number
        for name in ("SIGINT", "SIGTERM", "SIGHUP")
        if (number := getattr(signal, name, None)) is not None
        and signal.getsignal(number) is signal.default_int_handler
    ]
    try:
        for number in numbers:
            signal.signal(number, lambda caught_number, _frame: caught.append(caught_number))
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.default_int_handler)
        if caught:
            raise KeyboardInterrupt


def is_one_done(futures: Collection[Future[Any]], timeout: float) -> bool:
    """Wait until one of some futures is done; False where none is within a time in [s].

    An exception of a signal in the midst of ``concurrent.futures.wait`` would leave locks behind that the threads of
    the futures wait for.
    """
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        with deferred_interruptions():
            if wait(futures, timeout=PAUSE_S, return_when=FIRST_COMPLETED).done:
                return True
    return False


def result_of(future: Future[Value], timeout: float) -> Value:
    """Result of a future, as ``future.result``: ``TimeoutError`` where it has none within a time in [s]."""
    is_one_done([future], timeout)
    with deferred_interruptions():
        return future.result(timeout=0)
