"""A disk that fails: within the block, the n-th call that writes below a folder raises; all calls are counted."""

import builtins
import contextlib
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

CALLS = ("mkdir", "rename", "replace", "fsync", "open")
WRITE_FLAGS = os.O_WRONLY | os.O_RDWR | os.O_CREAT


class Faults:
    """Counts calls that write, and lets one of them fail.

    Attributes:
        folder: Only calls below it count.
        fails_at: Which call fails, counted from 1; 0 for none.
        number: With which error of the system.
        calls: What was called so far.
    """

    def __init__(self, folder: Path, fails_at: int, number: int) -> None:
        self.folder = os.path.realpath(folder)
        self.fails_at = fails_at
        self.number = number
        self.calls: list[str] = []
        self.handles: set[int] = set()

    def strike(self, what: str) -> None:
        self.calls.append(what)
        if len(self.calls) == self.fails_at:
            raise OSError(self.number, os.strerror(self.number))

    def is_ours(self, target: Any) -> bool:
        if isinstance(target, int):
            return target in self.handles
        return os.path.realpath(os.fspath(target)).startswith(self.folder)

    def watched(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def watching(target: Any, *arguments: Any, **named: Any) -> Any:
            ours = self.is_ours(target)
            does_nothing = name == "mkdir" and Path(target).is_dir()
            if ours and not does_nothing and (name != "open" or arguments[0] & WRITE_FLAGS):
                self.strike(name)
            result = call(target, *arguments, **named)
            if ours and name == "open":
                self.handles.add(result)
            return result

        return watching

    def opener(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def opening(file: Any, mode: str = "r", *arguments: Any, **named: Any) -> Any:
            if isinstance(file, int) or not set(mode) & set("wxa+") or not self.is_ours(file):
                return call(file, mode, *arguments, **named)
            self.strike("open")
            stream = call(file, mode, *arguments, **named)
            self.handles.add(stream.fileno())
            return FaultyFile(stream, self)

        return opening


class FaultyFile:
    """A file whose writes can fail half-way: half of the content is on the disk then."""

    def __init__(self, stream: Any, faults: Faults) -> None:
        self._stream = stream
        self._faults = faults

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __enter__(self) -> "FaultyFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._faults.handles.discard(self._stream.fileno())
        self._stream.close()

    def write(self, content: Any) -> int:
        try:
            self._faults.strike("write")
        except OSError:
            self._stream.write(content[: len(content) // 2])
            raise
        return self._stream.write(content)

    def flush(self) -> None:
        self._faults.strike("flush")
        self._stream.flush()


@contextlib.contextmanager
def faulty(folder: Path, *, fails_at: int, number: int) -> Iterator[Faults]:
    """Let the system fail below a folder for as long as the block runs."""
    faults = Faults(folder, fails_at, number)
    before = {name: getattr(os, name) for name in CALLS}
    opens = builtins.open, io.open
    try:
        for name in CALLS:
            setattr(os, name, faults.watched(name, before[name]))
        builtins.open = io.open = faults.opener(io.open)  # type: ignore[assignment]
        yield faults
    finally:
        for name in CALLS:
            setattr(os, name, before[name])
        builtins.open, io.open = opens
