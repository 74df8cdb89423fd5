"""Single files that appear whole or not at all."""

import os
from collections.abc import Callable
from pathlib import Path

from cellplan.errors import InputError


def write_whole(path: Path, content: bytes) -> None:
    """Write a file whole or not at all.

    Raises:
        OSError: It cannot be written; what was there stays.
    """
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
    """Refuse a place that a file must not be written to; call it early, before any long work.

    Args:
        is_of_kind: Whether a file is of the kind and written by cellplan.

    Raises:
        InputError: The place holds something else, or no file can be there.
    """
    if target.is_symlink() or (target.exists() and not is_of_kind(target)):
        raise InputError(f"{target}: holds something that is no {kind}; choose another file with -o")
    refuse_unless_writable(target)


def refuse_unless_writable(path: Path) -> None:
    """Refuse a place below something that is no folder, or that nothing may be written to.

    Raises:
        InputError: The nearest existing folder above is none, or may not be written to.
    """
    above = path.parent
    while not above.exists() and above != above.parent:
        above = above.parent
    if not above.is_dir():
        raise InputError(f"{path}: cannot write the output: '{above}' is not a folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot write the output: no right to write to '{above}'")


def replace_older(target: Path, content: bytes, *, is_of_kind: Callable[[Path], bool], kind: str) -> None:
    """Write a file whole or not at all, where there is none or an older one of its kind.

    Args:
        target: The file; missing folders above it are made.
        is_of_kind: Whether a file is of that kind and written by cellplan.

    Raises:
        InputError: The place holds something else, or cannot be written.
    """
    refuse_foreign(target, is_of_kind=is_of_kind, kind=kind)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, content)
    except OSError as error:
        raise InputError(f"{target}: cannot write the {kind}: {(error.strerror or str(error)).lower()}") from error
