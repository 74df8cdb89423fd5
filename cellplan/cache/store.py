"""Entries: arrays of numbers, found again by the digest of what they were made from and of the code that made them.

An entry is never more than a saving of time. It is used only when it is a regular file of the user's own and whole, by
a digest of its own; whatever is wrong with it, or with the folder, the work is done as if there were none. Nothing that
was refused is kept, so a refused file is read and refused again. The digest detects accidents, not forgery: commands
that prove something do without the folder (see ``without_cache``).
"""

import hashlib
import io
import os
import platform
import stat
import sys
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache, partial
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Arrays = tuple[NDArray[np.generic], ...]
Value = TypeVar("Value")
FORMAT: Final = b"cellplan cache 1\n"
DIGEST: Final = 32  # [bytes] of a SHA-256
SUFFIX: Final = ".entry"
CODE_PACKAGES: Final = ("cache", "geometry", "scene/collision")  # packages whose code makes what is kept
LIBRARIES: Final = ("numpy", "pycollada", "coal")  # and what they rest on
MAX_ENTRY: Final = 64_000_000  # [bytes]
MAX_FOLDER: Final = 256_000_000  # [bytes]; the entries that were not used for longest go first
MAX_RECENT: Final = 32_000_000  # [bytes] held by this process
OPEN: Final = os.O_RDONLY | sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
VARIABLE: Final = "CELLPLAN_CACHE"  # a folder, or a word that turns the cache off
OFF: Final = frozenset({"off", "0", "no", "false"})
OTHERS_MAY_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH

_IS_USED: Final = ContextVar("_IS_USED", default=True)


class Key(NamedTuple):
    """What an entry is found by: the kind of thing it is, and the digest of all that it follows from."""

    kind: str
    digest: str


class Held(NamedTuple):
    """Arrays that this process holds, and whether it made them itself: others came from the folder."""

    arrays: Arrays
    is_made_here: bool


_recent: OrderedDict[Key, Held] = OrderedDict()


def key_of(kind: str, *contents: bytes) -> Key | None:
    """Key of what is made from some contents; None when the code that makes it is unknown."""
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
    held = _recent.get(key)
    if held is not None and (held.is_made_here or is_cache_used()):
        _recent.move_to_end(key)
        return held.arrays
    folder = cache_folder() if is_cache_used() else None
    if folder is None:
        return None
    try:
        packed = _read_private(_path(folder, key))
        arrays = None if packed is None else _unpacked(packed)
    except Exception:  # noqa: BLE001 - whatever is wrong with an entry, it is made again
        return None
    if arrays is not None:
        _remember(key, Held(arrays, is_made_here=False))
    return arrays


def keep(key: Key | None, arrays: Sequence[NDArray[np.generic]]) -> None:
    """Keep arrays under a key, in this process and in the folder; where that is not possible, they are not kept."""
    if key is None or any(array.dtype.hasobject for array in arrays):
        return
    copies = tuple(np.array(array, order="C") for array in arrays)
    for array in copies:
        array.setflags(write=False)
    _remember(key, Held(copies, is_made_here=True))
    folder = cache_folder() if is_cache_used() else None
    packed = b"" if folder is None else _packed(copies)
    if folder is not None and len(packed) <= MAX_ENTRY:
        with suppress(OSError):
            _write(_path(folder, key), packed)
            _remove_oldest(folder)


def forget() -> None:
    """Forget what this process holds; the folder stays as it is."""
    _recent.clear()


def _remember(key: Key, held: Held) -> None:
    """Hold arrays for the rest of this process, up to a limit of memory."""
    _recent[key] = held
    while sum(array.nbytes for entry in _recent.values() for array in entry.arrays) > MAX_RECENT:
        _recent.popitem(last=False)


def _read_private(path: Path) -> bytes | None:
    """Content of an entry; None for anything but a regular file of the user's own that only the user may write to.

    It is opened without following a link and without waiting for another process.
    """
    handle = os.open(path, OPEN)
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        is_mine = not hasattr(os, "getuid") or (
            status.st_uid == os.getuid() and not status.st_mode & OTHERS_MAY_WRITE and status.st_nlink <= 1
        )  # no link is left to an entry that another process replaced after it was opened here
        if not stat.S_ISREG(status.st_mode) or not is_mine or status.st_size > MAX_ENTRY:
            return None
        content = file.read(MAX_ENTRY + 1)
        if os.utime in os.supports_fd:
            with suppress(OSError):
                os.utime(handle)  # it was of use
    return content


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


def _remove_oldest(folder: Path) -> None:
    """Remove the entries that were not used for longest, until the others fit."""
    entries = []
    with os.scandir(folder) as listing:
        for entry in listing:
            if entry.name.endswith((SUFFIX, ".part")):
                with suppress(OSError):
                    status = entry.stat(follow_symlinks=False)
                    entries.append((status.st_mtime, entry.name, status.st_size))
    total = sum(size for _, _, size in entries)
    for _, name, size in sorted(entries):
        if total <= MAX_FOLDER:
            return
        with suppress(OSError):
            (folder / name).unlink()
        total -= size


@cache
def _code() -> bytes | None:
    """Digest of the code that makes what is kept, and of the versions it rests on; None when it cannot be read."""
    from importlib.metadata import PackageNotFoundError, version  # slow, and proofs do without the cache

    total = hashlib.sha256(f"{platform.system()} {platform.machine()}".encode())
    root = Path(__file__).resolve().parent.parent
    try:
        files = [path for package in CODE_PACKAGES for path in sorted((root / package).rglob("*.py"))]
        for path in files:
            total.update(
                path.relative_to(root).as_posix().encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest()
            )
        for library in LIBRARIES:
            total.update(f"{library} {version(library)}".encode())
    except (OSError, PackageNotFoundError):
        return None
    return total.digest() if files else None


def cache_folder() -> Path | None:
    """The folder, made if need be; None when there is to be none, or none that can be trusted."""
    try:
        folder = _desired()
        if folder is None:
            return None
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return folder if _is_private(folder) else None
    except (OSError, ValueError, RuntimeError):  # no home, no leave, no such name
        return None


def _desired() -> Path | None:
    """The folder that the user wants, or the usual one of the system."""
    named = os.environ.get(VARIABLE, "")
    if named.strip().lower() in OFF:
        return None
    return Path(named).absolute() if named else _usual() / "cellplan"


def _usual() -> Path:
    """Where programs of this system keep what they can do without."""
    with suppress(KeyError):
        if sys.platform == "win32":
            return Path(os.environ["LOCALAPPDATA"])
        folder = Path(os.environ["XDG_CACHE_HOME"])
        if folder.is_absolute():  # others are to be ignored
            return folder
    return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache")


def _is_private(folder: Path) -> bool:
    """Whether the folder belongs to the user, and no other user may write to it."""
    status = folder.stat()
    if not hasattr(os, "getuid"):  # another system, with other rules
        return stat.S_ISDIR(status.st_mode)
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & OTHERS_MAY_WRITE


@contextmanager
def without_cache() -> Iterator[None]:
    """Neither read nor write the cache folder for as long as the ``with`` statement lasts.

    What this process makes meanwhile, from the files themselves, is still made once only.
    """
    before = _IS_USED.set(False)
    try:
        yield
    finally:
        _IS_USED.reset(before)


def is_cache_used() -> bool:
    """Whether entries of the cache folder may be read and written."""
    return _IS_USED.get()


def as_here(function: Callable[..., Value]) -> Callable[..., Value]:
    """The function as another process has to run it: with the cache used there as it is here."""
    return partial(_run, is_cache_used(), function)


def _run(is_used: bool, function: Callable[..., Value], *arguments: object) -> Value:
    """Result of a function, with or without the cache folder."""
    if is_used:
        return function(*arguments)
    with without_cache():
        return function(*arguments)
