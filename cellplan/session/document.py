"""The cell file that is open in a session: what was changed of it, saving, and saves of other programs.

Nothing is lost: what was changed here is undone step by step, a file that an editor has saved meanwhile is not replaced
until the user decides, and while it cannot be read the last cell that could be read stays.
"""

import os
import stat
import time
from collections.abc import Iterable, Mapping, Sequence
from itertools import count
from pathlib import Path
from shlex import quote
from typing import Any, Final, NamedTuple

from cellplan.errors import InputError
from cellplan.files.cell.edited_file import edited_file
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.watched_files import POLL_EVERY_S, WatchedFiles
from cellplan.files.input.files import digest, read_regular_file
from cellplan.files.run.whole_file import refuse_unless_writable, write_whole
from cellplan.files.yaml.reader import SIZE_LIMIT
from cellplan.files.yaml.writer import flow_text
from cellplan.model.cell.cell import Cell
from cellplan.runs.overrides import read_settings
from cellplan.session.changes import Changes, differ

Record = dict[str, Any]
READS: Final = 3  # times that a file is read which is saved while it is read
LEFT_OUT: Final = "null"  # as the value of an option: the key is left out
DECIDE: Final = "take what it says now, or stay with the values here; saved under another name they are safe, too"


class _Read(NamedTuple):
    """The file as it was read."""

    data: bytes  # its content
    cell: Cell  # the cell, with the settings of the session


class Document:
    """A cell file that is changed value by value.

    Attributes:
        path: The file.
        allow_dirs: Further folders that the files it names may lie in.
        given: The cell as it was last read, with the settings of the session.
        changes: The values that were changed since it was read, beside the settings, and the steps to undo and redo.
    """

    def __init__(self, path: Path, settings: Iterable[str] = (), allow_dirs: Sequence[Path] = ()) -> None:
        """Open a cell file.

        Args:
            path: The file.
            settings: Values set in the cell from the beginning, each as ``KEY=VALUE``.
            allow_dirs: Further folders that the files it names may lie in.

        Raises:
            InputError: The cell cannot be read, or a setting is not valid.
        """
        self.path, self.allow_dirs, self._settings = path, tuple(allow_dirs), read_settings(settings)
        self._read = self._read_file(self._settings)
        self._theirs: _Read | None = None  # the file as another program has saved it, until the user decides
        self._files, self._last_look = WatchedFiles(path), time.monotonic()
        self._files.follow(self._read.cell)
        self.given = self._read.cell
        self.changes = Changes(self._read.cell)
        self._built: tuple[Mapping[str, object], Cell] = ({}, self._read.cell)  # values and the cell that has them

    @property
    def cell(self) -> Cell:
        """The cell with all changes.

        Raises:
            InputError: The values do not go together.
        """
        values = self.changes.values
        if self._built[0] != values:
            self._built = {**values}, self._read.cell.with_values(values) if values else self._read.cell
        return self._built[1]

    @property
    def history(self) -> list[str]:
        """What differs from the file, as options of commands that read it; empty where all is saved."""
        return [f"--set {quote(setting)}" for setting in self.settings]

    @property
    def settings(self) -> list[str]:
        """The same as ``KEY=VALUE``."""
        values = {**self._settings, **self.changes.values}
        return [f"{address}={LEFT_OUT if it is None else flow_text(it)}" for address, it in values.items()]

    def save(self, *, as_another: bool = False) -> Record:
        """Write all values into the file, or into a new one next to it, and say so.

        Args:
            as_another: Whether another file is written, whose name is the first free one of ``NAME-edited.yaml``,
                ``NAME-edited-2.yaml``, …; the values are not saved in this one then.

        Raises:
            InputError: Another program has saved the file since it was read, it cannot be written, or a value has no
                place in it.
        """
        data = edited_file(self.cell, self._read.data)
        if as_another:
            target = _free_name(self.path)
            _write(target, data)
            return _event("saved", f"saved as {target.name}; {self.path.name} is as it was")
        if self.path.exists() and _content(self.path) != self._read.data:  # one that is gone is written anew
            raise InputError(f"{self.path}: was saved by another program since it was read: {DECIDE}")
        _write(self.path, data)
        read = self._read_file({})
        self._settings = {}
        self._adopt(read)
        return _event("saved", f"saved {self.path.name}")

    def look(self) -> Record | None:
        """What another program has done to the file or to those that it names; None for nothing new, at once."""
        if time.monotonic() - self._last_look < POLL_EVERY_S:
            return None
        self._last_look = time.monotonic()
        if (saved := self._files.changed()) is None or not self._files.is_settled():
            return None
        self._theirs = None
        self._files.take()
        if not self.path.exists():
            return _event(
                "gone", f"{self.path}: is gone; the cell as it was last read stays, and saving writes it anew"
            )
        try:
            read = self._read_file(self._settings)
        except InputError as error:
            self._files.follow_neighbours()
            return _event("broken", f"{error}")
        return self._arrived(read, saved)

    def _arrived(self, read: _Read, saved: Path) -> Record:
        """Go on from a file that another program has saved, or have the user decide."""
        if read.data != self._read.data and differ(self.changes.values, read.cell):
            return self._conflict(read, "has values that are not those here")
        try:
            self._adopt(read)
        except InputError as error:
            return self._conflict(read, f"does not go with the values here ({error})")
        return _event("changed", f"{saved.name} was saved, and is read")

    def reload(self) -> Record:
        """Take the file as it is; what was changed here can be undone to."""
        read = self._theirs or self._read_file(self._settings)
        self._adopt(read, is_taken=True)
        return _event("changed", f"{self.path.name} as it is in the file; undo brings back the values of before")

    def keep(self) -> Record:
        """Stay with the values that were changed here, on top of the file as it is now.

        Raises:
            InputError: They do not go with what the file says now.
        """
        self._adopt(self._theirs or self._read)
        return _event("changed", f"{self.path.name} as it is in the file, with the values here on top")

    def _adopt(self, read: _Read, *, is_taken: bool = False) -> None:
        """Go on from a file; ``is_taken`` says that its values take the place of those that were changed here."""
        mine = {} if is_taken else self.changes.values
        cell = read.cell.with_values(mine) if mine else read.cell
        self.changes.move_to(read.cell, is_taken=is_taken)
        self.given, self._read, self._theirs, self._built = read.cell, read, None, ({**self.changes.values}, cell)
        self._files.follow(read.cell)

    def _conflict(self, read: _Read, why: str) -> Record:
        self._theirs = read
        self._files.follow(read.cell)
        return _event("conflict", f"{self.path.name} was saved by another program and {why}: {DECIDE}")

    def _read_file(self, settings: Mapping[str, object]) -> _Read:
        """The content of the file and the cell that was read from the same content."""
        for _ in range(READS):
            data = _content(self.path)
            cell = load_cell(self.path, allow_dirs=self.allow_dirs)
            if cell.inputs[self.path.name] == digest(data):
                return _Read(data, cell.with_values(settings) if settings else cell)
        raise InputError(f"{self.path}: is saved again and again while it is read")


def _content(path: Path) -> bytes:
    """Content of the cell file."""
    return read_regular_file(path, file=str(path), limit=SIZE_LIMIT)


def _free_name(path: Path) -> Path:
    """The first free name for another file next to a file."""
    names = (f"{path.stem}-edited{f'-{number}' if number > 1 else ''}{path.suffix}" for number in count(1))
    return next(free for free in map(path.with_name, names) if not os.path.lexists(free))


def _write(target: Path, data: bytes) -> None:
    """Write a cell file whole or not at all, through links and with the rights that it had."""
    place = target.resolve()
    refuse_unless_writable(place)
    mode = stat.S_IMODE(place.stat().st_mode) if place.exists() else None
    if mode is not None and not os.access(place, os.W_OK):
        raise InputError(f"{target}: cannot be saved: no right to write it")
    try:
        write_whole(place, data)
        if mode is not None:
            place.chmod(mode)
    except OSError as error:
        raise InputError(f"{target}: cannot be saved: {(error.strerror or str(error)).lower()}") from error


def _event(state: str, text: str) -> Record:
    """An event about the file."""
    return {"event": "file", "state": state, "text": text}
