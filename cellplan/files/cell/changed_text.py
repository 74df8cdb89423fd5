"""A changed cell as a cell file that keeps the words, the order and the comments of the one it was read from."""

from collections.abc import Iterator, Mapping
from typing import Any

from cellplan.errors import InputError
from cellplan.files.input.findings import KeyPath
from cellplan.files.yaml.edit import REMOVED, edited_text
from cellplan.files.yaml.reader import parse_yaml
from cellplan.files.yaml.writer import yaml_text


def changed_text(text: str, values: Mapping[str, Any], *, head: str) -> str:
    """The text of a cell file with other values, each beside what it was, below comment lines of a head without ``#``.

    Where the text cannot be edited in place, all values are written anew, without its comments.
    """
    top = "".join(f"# {line}\n" for line in head.splitlines())
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n")
    before = parse_yaml(plain.encode(), file="cell").root
    try:
        edited = edited_text(plain, dict(_changes(before, values, ())))
        if parse_yaml(edited.encode(), file="cell").root == values:
            return top + edited
    except (InputError, KeyError, ValueError):
        pass
    return top + yaml_text(values)


def _changes(old: Any, new: Any, path: KeyPath) -> Iterator[tuple[KeyPath, object]]:
    """New values by key path, as deep as mappings and lists of entries have a value to compare with."""
    if isinstance(old, Mapping) and isinstance(new, Mapping) and new:
        for key in old:
            if key in new:
                yield from _changes(old[key], new[key], (*path, key))
            else:
                yield (*path, key), REMOVED
        for key in new:
            if key not in old:
                yield (*path, key), new[key]
    elif _are_entries(old) and _are_entries(new) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _changes(one, other, (*path, index))
    elif old != new:
        yield path, new


def _are_entries(value: Any) -> bool:
    """Whether a value is a list of mappings."""
    return isinstance(value, tuple) and all(isinstance(item, Mapping) for item in value)
