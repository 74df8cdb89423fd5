"""Differences between cell files, by key path."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from cellplan.files.input.findings import KeyPath, key_text

ABSENT: Final = object()  # in place of a value: the document has no such key


def document_differences(documents: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Key paths at which documents differ, with the value of each; None where a document has no such key.

    Paths lead as deep as all documents that have them agree in form: to numbers where lists have the same length.
    """
    differences = _differences(tuple(documents), ())
    return {
        key_text(path): [None if value is ABSENT else _plain(value) for value in values] for path, values in differences
    }


def _differences(values: tuple[Any, ...], path: KeyPath) -> Iterator[tuple[KeyPath, tuple[Any, ...]]]:
    """Key paths below a node at which its values differ."""
    if all(isinstance(value, Mapping) for value in values):
        for key in dict.fromkeys(key for value in values for key in value):
            yield from _differences(tuple(value.get(key, ABSENT) for value in values), (*path, str(key)))
    elif _are_lists_of_one_length(values):
        for index, items in enumerate(zip(*values, strict=True)):
            yield from _differences(items, (*path, index))
    elif any(_plain(value) != _plain(values[0]) for value in values[1:]):
        yield path, values


def _are_lists_of_one_length(values: Sequence[Any]) -> bool:
    """Whether all values are lists with equally many entries."""
    return all(isinstance(value, list | tuple) for value in values) and len({len(value) for value in values}) == 1


def _plain(value: Any) -> Any:
    """A value in which tuples are lists."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
