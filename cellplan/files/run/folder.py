"""Run folder: the files of one run, which appear on disk whole or not at all.

Files are collected in a hidden folder beside the final one, each forced to the disk, and the folder takes the place of
an older run at the end: in one step where the system knows how. A folder that cellplan did not write, or that holds
anything else at any depth, is never replaced.
"""

import ctypes
import errno
import os
import shutil
import sys
from collections.abc import Collection
from functools import cache
from pathlib import Path, PurePosixPath
from types import TracebackType
from typing import Any, Final, Self

from cellplan.errors import InputError
from cellplan.files.input.files import digest
from cellplan.files.run.content import (
    EXPORT,
    MANIFEST,
    PROGRAMS,
    RECOVER,
    REHEARSAL,
    foreign_entry,
    foreign_within,
    is_run_folder,
)
from cellplan.files.run.drafts import hidden_folders, put_right
from cellplan.files.run.whole_file import refuse_unless_writable

__all__ = [
    "EXPORT",
    "MANIFEST",
    "PROGRAMS",
    "RECOVER",
    "REHEARSAL",
    "RunFolder",
    "is_run_folder",
    "refuse_unless_replaceable",
]
STUDY: Final = "study.jsonl"  # journal of a study, which is not replaced
NOT_SYNCED = frozenset({errno.EINVAL, errno.ENOTSUP})  # from file systems that cannot sync folders
AT_FDCWD: Final = -100  # paths start from the working folder
RENAME_EXCHANGE: Final = 2
NOT_THERE: Final = frozenset({errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EPERM})  # from systems that cannot


class RunFolder:
    """Writer of one run folder, to be used in a ``with`` statement.

    On a normal end the folder takes the place of an older run at the same path. On an exception or an interruption
    everything is removed and an older run stays as it was.
    """

    def __init__(self, path: Path, *, unlisted: Collection[str] = ()) -> None:
        """Name the folder; nothing is touched before the ``with`` statement begins.

        Args:
            unlisted: Names of files that may stand in it, and go, although no run lists them.
        """
        self.path = path  # where the run will stand
        self._unlisted = unlisted
        self.written: dict[str, tuple[int, str]] = {}  # size in bytes and SHA-256 of every file so far, by name
        self._draft, self._aside = hidden_folders(path)  # sideways is where the older run waits for its end
        self._made_parents: list[Path] = []

    def __enter__(self) -> Self:
        """Check the place and open the hidden folder; ``InputError`` where it must not or cannot be written."""
        refuse_unless_replaceable(self.path, unlisted=self._unlisted)
        try:
            self._made_parents = _make_parents(self.path.parent)
            self._draft.mkdir()
        except OSError as error:
            _remove_empty(self._made_parents)
            raise _cannot_write(self.path, error) from error
        return self

    def within(self, name: str) -> Path:
        """Place of a run folder of its own that appears together with this one."""
        return self._draft / name

    def write_text(self, name: str, text: str) -> None:
        """Write a text file in UTF-8, line breaks as given; ``name`` is relative, with ``/`` between folders.

        The name of an input file may hold bytes that are not UTF-8; they are written as escapes.
        """
        self.write_bytes(name, text.encode("utf-8", "backslashreplace"))

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file and force it to the disk; ``InputError`` where that refuses."""
        relative = PurePosixPath(name)
        if relative.is_absolute() or ".." in relative.parts or not relative.name:
            raise ValueError(f"run folder: {name!r} does not lie inside the folder")
        target = self._draft / relative
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with target.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise _cannot_write(self.path / relative, error) from error
        self.written[str(relative)] = (len(content), digest(content))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Put the folder into place, or remove every trace of it."""
        try:
            if error is None:
                self._put_into_place()
                self._made_parents = []
        except OSError as failure:
            raise _cannot_write(self.path, failure) from failure
        finally:
            _remove([self._draft, self._aside] if self.path.exists() else [self._draft])
            _remove_empty(self._made_parents)

    def _put_into_place(self) -> None:
        """Let the new run and the older one change places; undo it when the older one holds something foreign.

        Where the system cannot do it in one step, the older run is renamed first.
        """
        refuse_unless_replaceable(self.path, unlisted=self._unlisted)  # again: planning took a while
        for folder in (self._draft, *(path for path in self._draft.rglob("*") if path.is_dir())):
            _sync_folder(folder)
        if not self.path.exists():
            self._draft.rename(self.path)
        elif exchange(self._draft, self.path):
            foreign = foreign_within(self._draft, unlisted=self._unlisted)
            if foreign:  # put there meanwhile
                exchange(self._draft, self.path)
                raise _holds_foreign(self.path, foreign)
        else:
            self._move_existing_first()
        _sync_folder(self.path.parent)

    def _move_existing_first(self) -> None:
        """Rename the older run, then the new one into its place; undo the first when the second fails."""
        try:
            self.path.rename(self._aside)
            foreign = foreign_within(self._aside, unlisted=self._unlisted)
            if not foreign:
                self._draft.rename(self.path)
        finally:
            if self._aside.exists() and not self.path.exists():
                self._aside.rename(self.path)
        if foreign:
            raise _holds_foreign(self.path, foreign)


def refuse_unless_replaceable(path: Path, *, unlisted: Collection[str] = ()) -> None:
    """Refuse links, files, the working folder and folders with other things; call it before any long work.

    What processes that were killed left beside it is removed or put back first.

    Args:
        unlisted: Names of files that may stand in it although no run lists them.
    """
    try:
        for link in (path, path.parent):
            if link.is_symlink():
                raise InputError(f"{path}: output is never written through a symbolic link, and '{link}' is one")
        put_right(path.parent)
        if not path.exists():
            refuse_unless_writable(path)
            return
        if not path.is_dir():
            raise InputError(f"{path}: expected a folder for the output, got a file")
        if Path.cwd().resolve().is_relative_to(path.resolve()):
            raise InputError(f"{path}: the output needs a folder of its own, not the one you are working in")
        refuse_unless_writable(path)
        foreign = foreign_entry(path, unlisted=unlisted)
    except OSError as error:
        raise _cannot_write(path, error) from error
    if foreign:
        raise _holds_foreign(path, foreign)


def _make_parents(folder: Path) -> list[Path]:
    """Make the missing folders above the output; returns those made, the innermost first."""
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    for path in reversed(missing):
        path.mkdir(exist_ok=True)
    return missing


def _remove(folders: list[Path]) -> None:
    """Remove folders, to the end even when an interruption comes meanwhile."""
    try:
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:  # something was put there meanwhile: it stays
            return


def _sync_folder(folder: Path) -> None:
    """Force a folder's list of names to the disk, where the system knows how and lets it be read."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except PermissionError:  # it may be written to and not read: its owner has given up knowing
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in NOT_SYNCED:
            raise
    finally:
        os.close(handle)


def _cannot_write(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: cannot write the output: {(error.strerror or str(error)).lower()}")


def _holds_foreign(path: Path, foreign: str) -> InputError:
    if (path / STUDY).is_file():
        return InputError(f"{path}: holds a study, which no run replaces; choose another folder or empty this one")
    return InputError(
        f"{path}: holds '{foreign}', which cellplan did not write; choose another folder or empty this one"
    )


def exchange(one: Path, other: Path) -> bool:
    """Let two existing paths of one file system change places in one step, so that neither is ever missing.

    False where the system or the file system does not know how; ``OSError`` where it does and failed.
    """
    call = _renameat2()
    if call is None:
        return False
    if call(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in NOT_THERE:
        return False
    raise OSError(number, os.strerror(number), str(other))


@cache
def _renameat2() -> Any:
    """The function of the C library; None where there is none."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return None
    call.argtypes = (ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_uint)
    call.restype = ctypes.c_int
    return call
