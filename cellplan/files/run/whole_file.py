"""Single files that appear whole or not at all."""

import os
from collections.abc import Callable
from pathlib import Path

from cellplan.errors import InputError


def write_whole(path: Path, content: bytes) -> None:
    """Write a file whole or not at all; on an ``OSError`` what was there stays."""
    draft = path.with_name(f".{path.name}.draft")
    try:
        with draft.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    except (OSError, KeyboardInterrupt):
        draft.unlink(missing_ok=True)
        raise


def refuse_foreign(target: Path, *, is_of_kind: Callable[[Path], bool], kind: str) -> None:
    """Refuse a place that holds something else than a file of a kind written by cellplan, or where no file can be."""
    if target.is_symlink() or (target.exists() and not is_of_kind(target)):
        raise InputError(f"{target}: holds something that is no {kind}; choose another file with -o")
    refuse_unless_writable(target)


def refuse_unless_writable(path: Path) -> None:
    """Refuse a place below something that is no folder, or that nothing may be written to."""
    above = path.parent
    while not above.exists() and above != above.parent:
        above = above.parent
    if not above.is_dir():
        raise InputError(f"{path}: cannot write the output: '{above}' is not a folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot write the output: no right to write to '{above}'")


def replace_older(target: Path, content: bytes, *, is_of_kind: Callable[[Path], bool], kind: str) -> None:
    """Write a file of a kind, and folders above it, where there is none or an older one, whole or not at all."""
    refuse_foreign(target, is_of_kind=is_of_kind, kind=kind)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, content)
    except OSError as error:
        raise InputError(f"{target}: cannot write the {kind}: {(error.strerror or str(error)).lower()}") from error
