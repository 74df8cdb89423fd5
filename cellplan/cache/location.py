"""Location of the cache: a private directory of the user, or none."""

import os
import stat
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

VARIABLE: Final = "CELLPLAN_CACHE"  # a folder, or a word that turns the cache off
OFF: Final = frozenset({"off", "0", "no", "false"})
OTHERS_MAY_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH


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
