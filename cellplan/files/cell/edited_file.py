"""The file of a cell with the values that were changed since it was read, and all else in it as it stands."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.files.cell.changes import changed
from cellplan.files.cell.load import CellFile
from cellplan.files.input.findings import KeyPath
from cellplan.files.yaml.edit import REMOVED, edited_text
from cellplan.files.yaml.reader import YamlDocument, parse_yaml
from cellplan.model.cell.cell import Cell

MARK: Final = "\ufeff"  # that some editors put at the beginning of a file


def edited_file(cell: Cell, data: bytes) -> bytes:
    """The content of a cell file with all values that were changed since it was read; read again, it is the same cell.

    Args:
        cell: The cell, with its changes; see ``Cell.with_values``.
        data: The content that it was read from.

    Raises:
        InputError: A changed value has no place in the file, or the file is one that cannot be edited in place.
    """
    source = cell.origin.source
    if not isinstance(source, CellFile):
        raise InputError(f"cell '{cell.name}': expected a cell that was read from a file, got one built in Python")
    text = data.decode("utf-8")
    mark = MARK if text.startswith(MARK) else ""
    try:
        edits = dict(_edits(source.entries, changed(source.entries, source.changes)))
        edited = edited_text(text.removeprefix(MARK), edits, is_remarked=False)
        entries = parse_yaml(edited.encode(), file=source.entries.file)
        is_same = replace(source, entries=entries, changes={}).document_with({}).root == source.document.root
    except (InputError, KeyError, ValueError):
        is_same = False
    if not is_same:
        names = ", ".join(source.changes)
        raise InputError(
            f"{source.entries.file}: expected values that have a place of their own in the file, got changes of "
            f"{names}; write them by hand, or give them as --set"
        )
    return (mark + edited).encode()


def _edits(old: YamlDocument, new: YamlDocument) -> Iterator[tuple[KeyPath, object]]:
    """New values by key path: of what is in the old document itself, or whole where something above it is not."""
    places = dict.fromkeys(_place(old.root, new.root, path) for path in new.changes)
    for path in places:
        if not any(path[:length] in places for length in range(len(path))):
            before, after = _value(old.root, path), _value(new.root, path)
            if before is not after and before != after:
                yield path, after


def _place(old: Any, new: Any, path: KeyPath) -> KeyPath:
    """What of a key path is edited: up to the first key that is new; above keys that leave nothing when they go."""
    path = next((path[:length] for length in range(len(path)) if _value(old, path[:length]) is REMOVED), path)
    while len(path) > 1 and _value(new, path) is REMOVED and not _value(new, path[:-1]):
        path = path[:-1]
    return path


def _value(node: Any, path: KeyPath) -> Any:
    """The value at a key path; ``REMOVED`` where there is none."""
    for step in path:
        if isinstance(node, Mapping) and step in node:
            node = node[str(step)]
        elif isinstance(node, tuple) and isinstance(step, int) and step < len(node):
            node = node[step]
        else:
            return REMOVED
    return node
