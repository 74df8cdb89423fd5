"""``--watch``: do the work of a command again whenever the cell or one of its files is saved.

The system's own notifications do not reach into many containers and network folders, and a cell has few files: asking
for their times five times a second works everywhere and costs nothing that could be measured.
"""

import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final, NoReturn

from cellplan.cli.terminal.errors import (
    InterruptedWorkError,
    OutputError,
    error_lines,
    exit_status,
    report_failure,
    tell,
)
from cellplan.cli.terminal.output import Result, present, say_json
from cellplan.cli.terminal.progress import Listener, progress_listener
from cellplan.files.input.files import digest
from cellplan.model.cell.cell import Cell

Work = Callable[[Callable[[Cell], None], Listener], Result]  # called with what to tell of the cell, and of progress
POLL_EVERY_S: Final = 0.2  # [s] between two polls while waiting
SETTLED_S: Final = 0.3  # [s] without a further change after which a save counts as complete
EMPTIED_S: Final = 3.0  # [s] for which an emptied file may lack its new content: editors empty before they write
ASK_EVERY_S: Final = 0.3  # [s] between two polls during a computation
INPUT_SUFFIXES: Final = frozenset(
    {
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
    }
)
MOST_ENTRIES: Final = 2000  # [-] files below the folder of a cell that are polled
NOTHING: Final = digest(b"")  # of an empty file
Stamp = tuple[int, int, int] | None  # time in [ns], size and number of a file; None while there is none


def watch(work: Work, cell: Path, *, schema: str, as_json: bool, quiet: bool) -> NoReturn:
    """Do the work, wait until a file is saved, and so on until Ctrl-C.

    What is wrong with a cell is said, and its files are watched further. Work during which a file is saved is given up
    and begun anew.

    Args:
        as_json: Whether each round gives one JSON object on a line of its own, instead of text.

    Raises:
        InterruptedWorkError: Always, at the end.
    """
    files, number = WatchedFiles(cell), 0
    try:
        while True:
            number += 1
            _round(work, files, schema=schema, as_json=as_json, quiet=quiet)
            if not quiet:
                count = "1 file" if files.count == 1 else f"{files.count} files"
                tell(f"watching {count}: save one for another round, Ctrl-C ends")
            saved = files.next_saved()
            if not quiet:
                tell(f"round {number + 1}: {saved} was saved")
    except KeyboardInterrupt:
        raise InterruptedWorkError(f"watching ended in round {number}") from None


class WatchedFiles:
    """The cell file, and every file that it was last read from."""

    def __init__(self, cell: Path) -> None:
        """Begin with the cell file alone."""
        self.cell = cell
        self._digests: dict[Path, str | None] = {}
        self._stamps: dict[Path, Stamp] = {}
        self._last_look = 0.0
        self._are_inputs_unknown = False
        self._note(cell)

    @property
    def count(self) -> int:
        """Number of files."""
        return len(self._stamps)

    def begin(self) -> None:
        """Take the files as they are now, before they are read; not in the middle of a save."""
        if self._is_one_emptied():
            self.settle()
        for path in self._stamps:
            self._note(path)

    def follow(self, cell: Cell) -> None:
        """Watch the files that a cell was read from, with the content that was read."""
        self._digests, self._stamps, self._are_inputs_unknown = {}, {}, False
        for path, content in _files_of(cell, self.cell).items():
            self._note(path)
            if self._digests[path] != content:  # saved since it was read
                self._stamps[path], self._digests[path] = None, content

    def follow_neighbours(self) -> None:
        """Watch what a cell that cannot be read may name: files of the usual kinds below its folder, new ones too."""
        self._are_inputs_unknown = True
        for path in _neighbours(self.cell.parent):
            if path not in self._stamps:
                self._note(path)

    def changed(self) -> Path | None:
        """A file whose content is another one than before, or that a broken cell may lack; None if there is none."""
        if (path := self.rewritten()) is not None or not self._are_inputs_unknown:
            return path
        return next((path for path in _neighbours(self.cell.parent) if path not in self._stamps), None)

    def rewritten(self) -> Path | None:
        """A watched file whose content is another one than before; None if all are the same."""
        for path, stamp in self._stamps.items():
            now = _stamp(path)
            if now != stamp:
                if _digest(path) != self._digests[path]:
                    return path
                self._stamps[path] = now
        return None

    def require_unchanged(self) -> None:
        """Poll the files now and then during a computation, and stop it once one of them was saved."""
        if time.monotonic() - self._last_look < ASK_EVERY_S:
            return
        self._last_look = time.monotonic()
        if self.changed() is not None:
            raise InputsChangedError

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
        before, quiet_since = dict[Path, Stamp](), time.monotonic()
        while time.monotonic() - quiet_since < (EMPTIED_S if self._is_one_emptied() else SETTLED_S):
            if (now := {path: _stamp(path) for path in self._stamps}) != before:
                before, quiet_since = now, time.monotonic()
            time.sleep(SETTLED_S / 2.0)

    def _is_one_emptied(self) -> bool:
        """Whether a file that had content is empty or away, as it is for a moment while it is saved."""
        full = (path for path, content in self._digests.items() if content not in (None, NOTHING))
        return any((stamp := _stamp(path)) is None or stamp[1] == 0 for path in full)

    def _note(self, path: Path) -> None:
        """Keep time and content of a file."""
        self._stamps[path] = _stamp(path)
        self._digests[path] = _digest(path)


def _round(work: Work, files: WatchedFiles, *, schema: str, as_json: bool, quiet: bool) -> None:
    """One round; saved files begin it anew."""
    while True:
        files.begin()
        try:
            with progress_listener(quiet=quiet) as listener:
                result = work(files.follow, _interruptible(files, listener))
        except InputsChangedError:
            files.settle()
            continue
        except OutputError:
            raise
        except Exception as error:  # noqa: BLE001 - the next save may mend whatever it is
            if files.rewritten() is not None:  # half a save was read
                files.settle()
                continue
            _refuse(error, files, schema=schema, as_json=as_json)
            return
        present(result, as_json=as_json, on_one_line=True)
        return


def _interruptible(files: WatchedFiles, listener: Listener) -> Listener:
    """The listener, which also notices saved files."""

    def listen(stage: str, share: float) -> None:
        files.require_unchanged()
        listener(stage, share)

    return listen


def _refuse(error: Exception, files: WatchedFiles, *, schema: str, as_json: bool) -> None:
    """Say why a round has no result, and watch for files that the cell lacks."""
    files.follow_neighbours()
    if as_json:
        status = int(exit_status(error))
        say_json({"schema": schema, "status": "error", "exit": status, "errors": error_lines(error)}, on_one_line=True)
    report_failure(error)


class InputsChangedError(Exception):
    """A file of the cell was saved while it was being worked on."""


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
