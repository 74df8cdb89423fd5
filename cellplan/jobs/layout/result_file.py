"""``best.yaml``: the given cell file with the values of the best layout, and the files that it names beside it."""

import os
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, Final

from cellplan.files.input.files import digest, read_regular_file
from cellplan.files.yaml.edit import changed_text
from cellplan.model.cell.cell import Cell

BEST: Final = "best.yaml"
NAMING: Final = frozenset(
    {"model", "mesh", "csv", "apt", "gcode", "file", "srdf", "moveit_limits"}
)  # keys whose values may name files
FOLDERS: Final = frozenset({"package_dirs"})
MAX_BYTES: Final = 2_000_000_000


def result_files(cell: Cell, given: Path, folder: Path, *, head: str) -> dict[str, bytes]:
    """Content of ``best.yaml`` and of the files that it names, by name.

    Files below the folder of the given cell are copied, so the result can be moved; others are named from the new
    folder, and need leave to be read as before.

    Args:
        folder: Where ``best.yaml`` will lie.
        head: Lines of comment above it.
    """
    source = cell.origin.source
    if source is None:
        raise ValueError("expected a cell that was read from a file, got one built in Python")
    values = _renamed(dict(source.written), given.parent, folder)
    text = changed_text(given.read_text(encoding="utf-8-sig"), values, head=head)
    files = {BEST: text.encode()}
    for name in cell.inputs:
        if _is_copied(name, given):
            files[name] = read_regular_file(given.parent / name, file=name, limit=MAX_BYTES)
    return files


def file_records(files: Mapping[str, bytes]) -> list[dict[str, str]]:
    """Names and digests of ``best.yaml`` and the files beside it."""
    return [{"name": name, "sha256": digest(content)} for name, content in files.items()]


def _is_copied(name: str, given: Path) -> bool:
    """Whether an input lies below the folder of the cell, and is neither the cell itself nor a bundled robot."""
    path = PurePosixPath(name)
    is_inside = not path.is_absolute() and ".." not in path.parts and ":" not in name
    return is_inside and name != given.name and (given.parent / name).is_file()


def _renamed(node: Any, old: Path, new: Path, key: str = "") -> Any:
    """The values with the names of files outside the old folder as they are seen from the new one."""
    if isinstance(node, Mapping):
        return {name: _renamed(value, old, new, str(name)) for name, value in node.items()}
    if isinstance(node, tuple | list):
        return tuple(_renamed(value, old, new, key) for value in node)
    is_file = isinstance(node, str) and key in NAMING | FOLDERS and ".." in PurePosixPath(node).parts
    if is_file and (old / node).exists():
        return Path(os.path.relpath((old / node).resolve(), new.resolve())).as_posix()
    return node
