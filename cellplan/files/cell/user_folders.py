"""Folders that the user allows all cells to read from, by an environment variable or a configuration of the user's own.

A cell has no say in it: a relative path would mean whatever lies beside a cell, and a configuration below the folder of
the cell, which may have come with it, is not read.
"""

import os
import stat
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

from cellplan.files.input.findings import raise_findings, shown
from cellplan.files.yaml.reader import parse_yaml

VARIABLE: Final = "CELLPLAN_ALLOW_DIRS"  # folders, parted as the system parts those of PATH
KEY: Final = "allow_dirs"
SIZE_LIMIT: Final = 100_000  # [bytes] of the configuration
OTHERS_MAY_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH


def user_folders(cell_folder: Path) -> tuple[Path, ...]:
    """Folders that the user allows for every cell; names that are not absolute in the variable are passed over.

    An ``InvalidFileError`` has what is wrong with the configuration.
    """
    named = [Path(word) for word in os.environ.get(VARIABLE, "").split(os.pathsep)]
    return (*(folder for folder in named if folder.is_absolute()), *_configured(cell_folder))


def configuration_file() -> Path | None:
    """Path of the user's own configuration; None where there is none."""
    place = os.environ.get("APPDATA" if sys.platform == "win32" else "XDG_CONFIG_HOME", "")
    folder = Path(place)
    if not folder.is_absolute():
        try:
            folder = Path.home() / ".config"
        except RuntimeError:
            return None
    return folder / "cellplan" / "config.yaml"


def _configured(cell_folder: Path) -> tuple[Path, ...]:
    """Folders that the configuration allows; none without one that can be trusted."""
    path = configuration_file()
    if path is None or _may_have_come_with(cell_folder, path):
        return ()
    data = _private_content(path)
    if data is None:
        return ()
    document = parse_yaml(data, file=str(path))
    findings = list(document.findings)
    findings += [document.key_finding((key,), f"unknown key; allowed: {KEY}") for key in document.root if key != KEY]
    given = document.root.get(KEY, ())
    if not isinstance(given, tuple):
        findings.append(document.finding((KEY,), f"expected a list of folders, got {shown(given)}"))
        given = ()
    for index, written in enumerate(given):
        if not isinstance(written, str) or not Path(written).expanduser().is_absolute():
            text = f"expected an absolute path of a folder, got {shown(written)}"
            findings.append(document.finding((KEY, index), text))
    raise_findings(str(path), findings)
    return tuple(Path(written).expanduser() for written in given)


def _may_have_come_with(cell_folder: Path, path: Path) -> bool:
    """Whether a configuration lies below the folder of the cell."""
    try:
        return path.resolve().is_relative_to(cell_folder.resolve())
    except (OSError, RuntimeError):
        return True


def _private_content(path: Path) -> bytes | None:
    """Content of a regular file that belongs to the user and that no other user may write to; None of any other."""
    with suppress(OSError, ValueError):
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(handle, "rb") as file:
            status = os.fstat(handle)
            is_private = not hasattr(os, "getuid") or (
                status.st_uid == os.getuid() and not status.st_mode & OTHERS_MAY_WRITE
            )
            if stat.S_ISREG(status.st_mode) and is_private and status.st_size <= SIZE_LIMIT:
                return file.read(SIZE_LIMIT)
    return None
