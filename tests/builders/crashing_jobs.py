"""Work that a guard must survive: crashes, endless loops, endless memory; run in its child process only."""

import ctypes
import os
import signal
import sys
import time

from cellplan.errors import InputError, InvalidFileError


def read_address_zero() -> None:
    """Crash as a native library does."""
    ctypes.string_at(0)


def abort() -> None:
    """End as a native library does after an exception that nobody catches."""
    os.abort()


def leave() -> None:
    """End the process without an answer."""
    os._exit(7)


def loop_forever() -> None:
    """Keep the processor busy."""
    while True:
        pass


def sleep_long() -> None:
    """Wait without using the processor."""
    time.sleep(600.0)


def take_eight_gigabytes() -> int:
    """Ask for more memory than any file needs."""
    return len(bytearray(8 << 30))


def print_much() -> str:
    """Write where the answers go."""
    os.write(1, b"noise" * 100_000)
    sys.stdout.write("more noise")
    sys.stdout.flush()
    return "answer"


def process() -> int:
    """Who works."""
    return os.getpid()


def folder() -> str:
    """Where the work is done."""
    return os.getcwd()  # noqa: PTH109


def complain() -> None:
    """Refuse a file with two findings."""
    raise InvalidFileError([InputError("f:1: one"), InputError("f:2: two")])


def stumble() -> None:
    """Fail in a way that nobody foresaw."""
    raise KeyError("word")


def ignores_interruption() -> bool:
    """Say whether Ctrl-C is left to the parent."""
    return signal.getsignal(signal.SIGINT) == signal.SIG_IGN


def same(value: object) -> object:
    """Give back what was given."""
    return value


def leave_unless_in(home: int) -> str:
    """End the process without an answer, but not that one."""
    if os.getpid() != home:
        os._exit(7)
    return "done at home"


def loaded(names: tuple[str, ...]) -> list[str]:
    """Those of some modules that the process has imported."""
    return [name for name in names if name in sys.modules]
