"""Work that sends events, for processes that are polled."""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

from cellplan.errors import InputError

Send = Callable[[Any], None]


def count(number: int, *, send: Send) -> None:
    """Send the numbers up to one."""
    for value in range(number):
        send(value)


def say_number(*, send: Send) -> None:
    """Send the number of the process, and then do nothing for long."""
    send(os.getpid())
    time.sleep(600.0)


def go_on_for_ever(*, send: Send) -> None:
    """Work in Python without an event."""
    send("begun")
    while True:
        sum(range(1000))


def send_for_ever(*, send: Send) -> None:
    """Send event after event, each of several writes."""
    while True:
        send("x" * 300_000)


def refuse(*, send: Send) -> None:
    """Send something, then find the input wrong."""
    send("begun")
    raise InputError("cell.yaml:3: expected a robot, got a fish")


def fail(*, send: Send) -> None:
    """Make a mistake."""
    send(1 // 0)


def kill(*, send: Send) -> None:
    """End as nobody expects."""
    send("begun")
    os.kill(os.getpid(), signal.SIGKILL)


def measure(data: bytes, *, send: Send) -> None:
    """Send the size of what is larger than a pipe."""
    send(len(data))
    sys.stdout.write("of no interest")


def multiples(number: int, count: int) -> Iterator[int]:
    """So many multiples of a number, one after the other."""
    if count < 0:
        raise ValueError(f"expected a count, got {count}")
    yield from range(0, number * count, number)
