"""The files that a cell is read from, watched for saves.

The system's own notifications do not reach into many containers and network folders, and a cell has few files: asking
for their times five times a second works everywhere and costs nothing that could be measured.
"""

import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from cellplan.files.input.files import digest
from cellplan.model.cell.cell import Cell

POLL_EVERY_S: Final = 0.2  # [s] between two polls while waiting
SETTLED_S: Final = 0.3  # [s] without a further change after which a save counts as complete
EMPTIED_S: Final = 3.0  # [s] for which an emptied file may lack its new content: editors empty before they write
INPUT_SUFFIXES: Final = frozenset(
    [
        ".yaml",
        ".yml",
        ".csv",
        ".apt",
        ".cls",
        ".cl",
        ".nc",
        ".gcode",
        ".ngc",
        ".tap",
        ".stl",
        ".obj",
        ".dae",
        ".ply",
        ".urdf",
        ".xacro",
        ".srdf",
        ".json",
    ]
)
MOST_ENTRIES: Final = 2000  # [-] files below the folder of a cell that are polled
NOTHING: Final = digest(b"")  # of an empty file
Stamp = tuple[int, int, int] | None  # time in [ns], size and number of a file; None while there is none


class WatchedFiles:
    """The cell file, and every file that it was last read from."""

    def __init__(self, cell: Path) -> None:
        """Begin with the cell file alone."""
        self.cell = cell
        self._seen: dict[Path, tuple[Stamp, str | None]] = {cell: _seen(cell)}
        self._are_inputs_unknown = False
        self._before: dict[Path, Stamp] = {}
        self._quiet_since = 0.0

    @property
    def count(self) -> int:
        """Number of files."""
        return len(self._seen)

    def begin(self) -> None:
        """Take the files as they are now, before they are read; not in the middle of a save."""
        if self._is_one_emptied():
            self.settle()
        self.take()

    def take(self) -> None:
        """Take the files as they are now."""
        self._seen = {path: _seen(path) for path in self._seen}

    def follow(self, cell: Cell) -> None:
        """Watch the files that a cell was read from, with the content that was read."""
        self._seen, self._are_inputs_unknown = {}, False
        for path, content in _files_of(cell, self.cell).items():
            stamp, now = _seen(path)
            self._seen[path] = (stamp if now == content else None, content)  # another one: saved since it was read

    def follow_neighbours(self) -> None:
        """Watch what a cell that cannot be read may name: files of the usual kinds below its folder, new ones too."""
        self._are_inputs_unknown = True
        for path in _neighbours(self.cell.parent):
            if path not in self._seen:
                self._seen[path] = _seen(path)

    def changed(self) -> Path | None:
        """A file whose content is another one than before, or that a broken cell may lack; None if there is none."""
        if (path := self.rewritten()) is not None or not self._are_inputs_unknown:
            return path
        return next((path for path in _neighbours(self.cell.parent) if path not in self._seen), None)

    def rewritten(self) -> Path | None:
        """A watched file whose content is another one than before; None if all are the same."""
        for path, (stamp, content) in self._seen.items():
            now = _stamp(path)
            if now != stamp:
                if _digest(path) != content:
                    return path
                self._seen[path] = now, content
        return None

    def next_saved(self) -> Path:
        """The file that was saved next, once it is complete; waits until the user saves one."""
        while True:
            if self.changed() is not None:
                self.settle()
                if (path := self.changed()) is not None:
                    return path
            time.sleep(POLL_EVERY_S)

    def settle(self) -> None:
        """Wait until no file has changed for a moment, and for the content of those that a save has just emptied."""
        self._before = {}
        while not self.is_settled():
            time.sleep(SETTLED_S / 2.0)

    def is_settled(self) -> bool:
        """Whether no file has changed for a moment, as far as calls of this have seen; it waits for nothing."""
        if (now := {path: _stamp(path) for path in self._seen}) != self._before:
            self._before, self._quiet_since = now, time.monotonic()
        return time.monotonic() - self._quiet_since >= (EMPTIED_S if self._is_one_emptied() else SETTLED_S)

    def _is_one_emptied(self) -> bool:
        """Whether a file that had content is empty or away, as it is for a moment while it is saved."""
        full = (path for path, (_, content) in self._seen.items() if content not in (None, NOTHING))
        return any((stamp := _stamp(path)) is None or stamp[1] == 0 for path in full)


def _files_of(cell: Cell, path: Path) -> Mapping[Path, str]:
    """The files that a cell was read from and the digests of what was read; bundled robots do not change."""
    named = {path.parent / name: content for name, content in cell.inputs.items()}
    return {path: cell.inputs.get(path.name, "")} | {file: content for file, content in named.items() if file.is_file()}


def _neighbours(folder: Path) -> Iterator[Path]:
    """Files of the usual kinds below a folder, hidden ones excepted; of a large folder the first ones."""
    left = MOST_ENTRIES
    for above, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        left -= len(files)
        if left < 0:
            return
        yield from (Path(above) / name for name in sorted(files) if Path(name).suffix.lower() in INPUT_SUFFIXES)


def _seen(path: Path) -> tuple[Stamp, str | None]:
    """What a file is known by, and its content."""
    return _stamp(path), _digest(path)


def _stamp(path: Path) -> Stamp:
    """What changes when a file is saved."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def _digest(path: Path) -> str | None:
    """SHA-256 of a file; None while it cannot be read."""
    try:
        return digest(path.read_bytes())
    except OSError:
        return None
