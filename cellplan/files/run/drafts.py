"""Hidden folders beside a run: its draft and the older run, named after the process that works on them.

A process that was killed leaves them behind. The next one removes a draft, and puts an older run back where there is no
other in its place. Whether a process still lives is known only on the same system: a folder may be shared.
"""

import hashlib
import os
import platform
import re
import shutil
import stat
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Final
from uuid import uuid4

from cellplan.files.run.content import foreign_within

DRAFT, OLDER = ".partial", ".replaced"
LETTERS: Final = 6  # [-] of the digests in a name: enough to tell a few systems and processes apart
NAME: Final = re.compile(
    r"\.(?P<name>.+)\.(?P<system>[0-9a-f]{6})-(?P<process>[0-9]+)-(?P<start>[0-9a-f]{6})\.[0-9a-f]{6}"
    rf"(?P<kind>{re.escape(DRAFT)}|{re.escape(OLDER)})"
)


def hidden_folders(path: Path) -> tuple[Path, Path]:
    """Where this process collects the files of a run, and where it puts the older run meanwhile; neither exists."""
    process = os.getpid()
    stem = f".{path.name}.{_system()}-{process}-{_start(process)}.{uuid4().hex[:LETTERS]}"
    return path.parent / f"{stem}{DRAFT}", path.parent / f"{stem}{OLDER}"


def put_right(folder: Path) -> None:
    """Remove or put back what dead processes left in a folder; what is not theirs alone, and what resists, stays."""
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return
    for entry in entries:
        match = NAME.fullmatch(entry.name)
        if match is None or not _is_left_behind(match):
            continue
        with suppress(OSError):
            if not _is_cache_folder(entry):
                continue
            target = folder / match["name"]
            if match["kind"] == OLDER and not target.exists() and not target.is_symlink():
                entry.rename(target)
            elif foreign_within(entry) is None:
                shutil.rmtree(entry)


def _is_left_behind(match: re.Match[str]) -> bool:
    """Whether the process that a name speaks of was one of this system and is no more."""
    if match["system"] != _system():
        return False
    process = int(match["process"])
    return not _exists(process) or match["start"] != _start(process)


def _exists(process: int) -> bool:
    """Whether there is a process of that number; true where that is unknown."""
    if not hasattr(os, "getuid"):  # another system, where asking may end the process
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # of another user
        return True
    return True


def _start(process: int) -> str:
    """Digest of when a process started, which distinguishes a later one of the same number; zeros if unknown."""
    try:
        words = Path(f"/proc/{process}/stat").read_bytes().rpartition(b")")[2].split()
        boot = Path("/proc/sys/kernel/random/boot_id").read_bytes()
        return _letters(boot + words[19])  # the 22nd field, in ticks since the system started
    except (OSError, IndexError):
        return "0" * LETTERS


@cache
def _system() -> str:
    """Digest of what tells this system from others that may share its folders, containers among them."""
    about = [platform.node()]
    with suppress(OSError):
        about.append(Path("/etc/machine-id").read_text(encoding="ascii"))
    with suppress(OSError):
        about.append(str(Path("/proc/self/ns/pid").readlink()))
    return _letters("\n".join(about).encode())


def _letters(content: bytes) -> str:
    """The first letters of a digest."""
    return hashlib.sha256(content).hexdigest()[:LETTERS]


def _is_cache_folder(entry: Path) -> bool:
    """Whether something is a folder, no link, that belongs to the user."""
    status = entry.lstat()
    return stat.S_ISDIR(status.st_mode) and (not hasattr(os, "getuid") or status.st_uid == os.getuid())
