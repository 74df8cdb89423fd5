"""Injuries to YAML files: one place of the text is changed, and the line of that place is known."""

from collections.abc import Iterator
from typing import NamedTuple

import yaml


class Injury(NamedTuple):
    """A changed text: what was done, where (line from 1), and the key path of the place."""

    kind: str
    path: tuple[str | int, ...]
    line: int
    text: str


class Place(NamedTuple):
    """A node of the file with its key path, and the node of its key when it has one."""

    path: tuple[str | int, ...]
    key: yaml.ScalarNode | None
    node: yaml.Node


def places(text: str) -> list[Place]:
    """All places of a file but the whole."""
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    return list(_below(root, ()))


def _below(node: yaml.Node, path: tuple[str | int, ...]) -> Iterator[Place]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield Place((*path, key.value), key, value)
            yield from _below(value, (*path, key.value))
    if isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            yield Place((*path, index), None, value)
            yield from _below(value, (*path, index))


def replaced(text: str, place: Place, value: str, *, kind: str) -> Injury:
    """The file with another value at a place, written in flow style."""
    start, end = _span(text, place.node)
    block = isinstance(place.node, yaml.CollectionNode) and not place.node.flow_style
    line = (place.key or place.node).start_mark.line + 1 if block else place.node.start_mark.line + 1
    opening = " " if text[start - 1 : start] == "\n" or block else ""
    if block and place.key is not None:
        start = place.key.end_mark.index + text[place.key.end_mark.index :].index(":") + 1
    return Injury(kind, place.path, line, f"{text[:start]}{opening}{value}{_rest(text, end, block=block)}")


def renamed(text: str, place: Place, key: str, *, kind: str = "key renamed") -> Injury:
    """The file with another key at a place."""
    mark, end = place.key.start_mark, place.key.end_mark
    return Injury(kind, (*place.path[:-1], key), mark.line + 1, f"{text[: mark.index]}{key}{text[end.index :]}")


def with_key(text: str, place: Place, key: str, value: str, *, kind: str = "key added") -> Injury | None:
    """The file with one more entry just before a place; None where the place has no key."""
    if place.key is None:
        return None
    mark = place.key.start_mark
    before = text[text.rfind("\n", 0, mark.index) + 1 : mark.index]
    is_flow = bool(before.strip(" -"))  # or behind other keys of one line
    entry = f"{key}: {value}" + (", " if is_flow else "\n" + " " * mark.column)
    return Injury(kind, (*place.path[:-1], key), mark.line + 1, f"{text[: mark.index]}{entry}{text[mark.index :]}")


def without(text: str, place: Place) -> Injury:
    """The file without an entry."""
    start_mark = (place.key or place.node).start_mark
    _, end = _span(text, place.node)
    block = isinstance(place.node, yaml.CollectionNode) and not place.node.flow_style
    rest = _rest(text, end, block=block).lstrip(" ")
    return Injury("entry removed", place.path, start_mark.line + 1, text[: start_mark.index] + rest.removeprefix(","))


def duplicated(text: str, place: Place) -> Injury | None:
    """The file with a key twice; the second one is the mistake."""
    twin = with_key(text, place, place.path[-1], "1", kind="key twice")
    if twin is None:
        return None
    moved = twin.text[: place.key.start_mark.index].count("\n")
    added = twin.text.count("\n") - text.count("\n")
    return twin._replace(line=moved + 1 + added)


def _span(text: str, node: yaml.Node) -> tuple[int, int]:
    """First and last index of a value; the end of a block is that of its last line with words."""
    start, end = node.start_mark.index, node.end_mark.index
    if isinstance(node, yaml.CollectionNode) and not node.flow_style:
        end = start + len(text[start:end].rstrip())
    return start, end


def _rest(text: str, end: int, *, block: bool) -> str:
    """What follows a value; the comment behind a block goes with it."""
    if not block:
        return text[end:]
    begin = text.find("\n", end)
    return text[begin:] if begin >= 0 else ""
