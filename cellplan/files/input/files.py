"""Reading foreign files: regular files only, of bounded size, known by their digest."""

import hashlib
import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.findings import shown

CHUNK: Final = 1 << 20  # [bytes] read at a time when only the digest is desired


def read_regular_file(path: Path, *, file: str, limit: int) -> bytes:
    """Content of a regular file; one missing or too large, a pipe, a device or a folder is refused at once."""
    handle = _open_regular(path, file)
    try:
        with os.fdopen(handle, "rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {_reason(error)}") from None
    if len(data) > limit:
        raise InputError(f"{file}: expected a file of at most {limit / 1e6:g} MB, got a larger one")
    return data


def utf8_text(data: bytes, *, file: str) -> str:
    """Content of a file as text; an ``InputError`` has the line of the first byte that is none of UTF-8."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start)
        raise InputError(f"{file}:{line}: expected text in UTF-8, got byte 0x{data[error.start]:02x}") from None


def digest(data: bytes) -> str:
    """SHA-256 of bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def digest_of_file(path: Path, *, file: str) -> str:
    """SHA-256 of a regular file, in hexadecimal."""
    total = hashlib.sha256()
    handle = _open_regular(path, file)
    try:
        with os.fdopen(handle, "rb") as stream:
            while chunk := stream.read(CHUNK):
                total.update(chunk)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {_reason(error)}") from None
    return total.hexdigest()


def _open_regular(path: Path, file: str) -> int:
    """Open without blocking, then refuse anything that is not a regular file."""
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read: {_reason(error)}") from None
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise InputError(f"{file}: expected a regular file, got a folder, a pipe or a device")
    return handle


def _reason(error: Exception) -> str:
    """The system's word for a failure, without the path."""
    return (getattr(error, "strerror", None) or str(error)).lower()


@dataclass(frozen=True, slots=True, kw_only=True)
class AllowedFolders:
    """Folder that names are relative to, and folders that they may lead into."""

    folder: Path  # folder of the file that names others
    allowed: tuple[Path, ...] = ()  # further folders, by leave of the user

    def file(self, written: str) -> Path:
        """Path of a file within the allowed folders; an ``InputError`` has the reason, not the place of the name."""
        path = self._within(written)
        if not _is(path, "is_file"):
            what = "a regular file, got a folder, a pipe or a device" if _is(path, "exists") else "an existing file"
            got = "" if "got" in what else f", got {shown(written)}"
            raise InputError(f"expected {what}{got}")
        return path

    def directory(self, written: str) -> Path:
        """Path of a folder within the allowed folders; ``InputError`` as for a file."""
        path = self._within(written)
        if not _is(path, "is_dir"):
            raise InputError(f"expected an existing folder, got {shown(written)}")
        return path

    def holds(self, path: Path) -> bool:
        """Whether a path, followed through all links, lies within the allowed folders."""
        try:
            real = path.resolve()
            return any(real.is_relative_to(root.resolve()) for root in (self.folder, *self.allowed))
        except (OSError, ValueError, RuntimeError):
            return False

    def _within(self, written: str) -> Path:
        """Path of a name, which must not lead out of the allowed folders."""
        path = self.folder / written
        if not self.holds(path):
            raise InputError(
                f"expected a path below the folder of the cell file, got {shown(written)}; "
                "allow other folders with --allow-dir"
            )
        return path


def _is(path: Path, question: str) -> bool:
    """Answer of the file system; no for names that it cannot resolve."""
    try:
        return bool(getattr(path, question)())
    except (OSError, ValueError):
        return False
