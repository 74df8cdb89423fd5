"""Reading foreign files: regular files only, of bounded size, known by their digest."""

import hashlib
import os
import stat
from pathlib import Path
from typing import Final

from cellplan.errors import InputError

CHUNK: Final = 1 << 20  # [bytes] read at a time when only the digest is desired


def read_regular_file(path: Path, *, file: str, limit: int) -> bytes:
    """Content of a regular file; a pipe, a device or a folder is refused without waiting for it.

    Raises:
        InputError: When it is missing, unreadable, not a regular file or too large.
    """
    handle = _open_regular(path, file)
    try:
        with os.fdopen(handle, "rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {_reason(error)}") from None
    if len(data) > limit:
        raise InputError(f"{file}: expected a file of at most {limit / 1e6:g} MB, got a larger one")
    return data


def digest(data: bytes) -> str:
    """SHA-256 of bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def digest_of_file(path: Path, *, file: str) -> str:
    """SHA-256 of a regular file, in hexadecimal.

    Raises:
        InputError: When it is missing, unreadable or not a regular file.
    """
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
