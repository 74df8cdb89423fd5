"""Entries: arrays of numbers, found again by the digest of what they were made from and of the code that made them.

An entry is never more than a saving of time. It is looked at only when it is whole, by a digest of its own; whatever
is wrong with it, or with the folder, the work is done as if there were none. Nothing that was refused is kept, so a
refused file is read and refused again.
"""

import hashlib
import io
import os
import platform
import tempfile
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellplan.cache.place import cache_folder

Arrays = tuple[NDArray[np.generic], ...]

FORMAT: Final = b"cellplan cache 1\n"
DIGEST: Final = 32  # [bytes] of a SHA-256
SUFFIX: Final = ".entry"
MAKERS: Final = ("cache", "geometry", "collision")  # packages whose code makes what is kept
LIBRARIES: Final = ("numpy", "trimesh", "coal")  # and what they rest on
MAX_ENTRY: Final = 64_000_000  # [bytes]
MAX_FOLDER: Final = 256_000_000  # [bytes]; the entries that were not used for longest go first
MAX_RECENT: Final = 32_000_000  # [bytes] held by this process

_recent: OrderedDict["Key", Arrays] = OrderedDict()


class Key(NamedTuple):
    """What an entry is found by: the kind of thing it is, and the digest of all that it follows from."""

    kind: str
    digest: str


def key_of(kind: str, *contents: bytes) -> Key | None:
    """Key of what is made from some contents; None when it cannot be told which code makes it."""
    code = _code()
    if code is None:
        return None
    total = hashlib.sha256()
    for content in (code, kind.encode(), *contents):
        total.update(len(content).to_bytes(8, "little"))
        total.update(content)
    return Key(kind, total.hexdigest())


def recall(key: Key | None) -> Arrays | None:
    """The arrays that were kept under a key; None when there are none, or not whole ones. They cannot be written to."""
    if key is None:
        return None
    if key in _recent:
        _recent.move_to_end(key)
        return _recent[key]
    folder = cache_folder()
    if folder is None:
        return None
    path = _path(folder, key)
    try:
        if path.stat().st_size > MAX_ENTRY:
            return None
        arrays = _unpacked(path.read_bytes())
    except Exception:  # noqa: BLE001 - whatever is wrong with an entry, it is made again
        return None
    if arrays is not None:
        with suppress(OSError):
            os.utime(path)  # it was of use
        _remember(key, arrays)
    return arrays


def keep(key: Key | None, arrays: Sequence[NDArray[np.generic]]) -> None:
    """Keep arrays under a key, in this process and in the folder; where that is not possible, they are not kept."""
    if key is None or any(array.dtype.hasobject for array in arrays):
        return
    own = tuple(np.array(array, order="C") for array in arrays)
    for array in own:
        array.setflags(write=False)
    _remember(key, own)
    folder, packed = cache_folder(), _packed(own)
    if folder is not None and len(packed) <= MAX_ENTRY:
        with suppress(OSError):
            _write(_path(folder, key), packed)
            _make_room(folder)


def forget() -> None:
    """Forget what this process holds; the folder stays as it is."""
    _recent.clear()


def _remember(key: Key, arrays: Arrays) -> None:
    """Hold arrays for the rest of this process, as far as there is room."""
    _recent[key] = arrays
    while sum(array.nbytes for held in _recent.values() for array in held) > MAX_RECENT:
        _recent.popitem(last=False)


def _path(folder: Path, key: Key) -> Path:
    """File of an entry."""
    return folder / f"{key.kind}-{key.digest}{SUFFIX}"


def _packed(arrays: Arrays) -> bytes:
    """The arrays as bytes, after a digest of these bytes."""
    body = io.BytesIO()
    for array in arrays:
        np.lib.format.write_array(body, array, allow_pickle=False)
    content = body.getvalue()
    return FORMAT + hashlib.sha256(content).digest() + content


def _unpacked(packed: bytes) -> Arrays | None:
    """The arrays; None when a byte is not as it was written."""
    head, body = packed[: len(FORMAT) + DIGEST], packed[len(FORMAT) + DIGEST :]
    if head != FORMAT + hashlib.sha256(body).digest():
        return None
    stream, arrays = io.BytesIO(body), []
    while stream.tell() < len(body):
        array = np.lib.format.read_array(stream, allow_pickle=False)
        array.setflags(write=False)
        arrays.append(array)
    return tuple(arrays)


def _write(path: Path, content: bytes) -> None:
    """Write a file that appears whole or not at all."""
    number, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(number, "wb") as file:
            file.write(content)
        Path(name).replace(path)
    except BaseException:
        with suppress(OSError):
            Path(name).unlink()
        raise


def _make_room(folder: Path) -> None:
    """Remove the entries that were not used for longest, until the others fit."""
    found = []
    for path in folder.iterdir():
        if path.suffix in (SUFFIX, ".part"):
            with suppress(OSError):
                status = path.stat()
                found.append((status.st_mtime, path.name, status.st_size))
    total = sum(size for _, _, size in found)
    for _, name, size in sorted(found):
        if total <= MAX_FOLDER:
            return
        with suppress(OSError):
            (folder / name).unlink()
        total -= size


@cache
def _code() -> bytes | None:
    """Digest of the code that makes what is kept, and of the versions it rests on; None when it cannot be read."""
    total = hashlib.sha256(f"{platform.system()} {platform.machine()}".encode())
    root = Path(__file__).resolve().parent.parent
    try:
        files = [path for package in MAKERS for path in sorted((root / package).glob("*.py"))]
        for path in files:
            total.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
        for library in LIBRARIES:
            total.update(f"{library} {version(library)}".encode())
    except (OSError, PackageNotFoundError):
        return None
    return total.digest() if files else None
