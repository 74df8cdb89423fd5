"""Edits of a YAML text in place: other values, new keys and removed ones, with all comments and the order kept."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import yaml

from cellplan.errors import InputError
from cellplan.files.input.findings import KeyPath
from cellplan.files.yaml.reader import parse_yaml
from cellplan.files.yaml.writer import flow_text, yaml_text

REMOVED: Final = object()  # in place of a value: the key is removed
Edit = tuple[int, int, int, str]  # begin and end of what is replaced, rank among edits at one place, the new text
LATE: Final = 100  # rank of what follows the comment of a line, less the depth of its key
SHOWN: Final = 100  # [characters] of an old value that the comment repeats
COMMENT: Final = re.compile(r"\s#")


@dataclass(slots=True, kw_only=True)
class _Node:
    """Where a value stands in the text."""

    key: tuple[int, int]  # index of the first character of its key, and of the first one after it; of itself in a list
    span: tuple[int, int]  # likewise of the value; of a block only up to its last entry
    is_block: bool = False  # whether it is a mapping or list with an entry to a line
    children: list[KeyPath] = field(default_factory=list)  # the paths of its entries


def changed_text(text: str, values: Mapping[str, Any], *, head: str) -> str:
    """The text of a cell file with other values, each beside what it was, below comment lines of a head without ``#``.

    Where the text cannot be edited in place, all values are written anew, without its comments.
    """
    top = "".join(f"# {line}\n" for line in head.splitlines())
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n")
    before = parse_yaml(plain.encode(), file="cell").root
    try:
        edited = edited_text(plain, dict(_changes(before, values, ())))
        root = parse_yaml(edited.encode(), file="cell").root
        if root == values and [*root.get("tasks", ())] == [*values.get("tasks", ())]:  # whose order counts
            return top + edited
    except (InputError, KeyError, ValueError):
        pass
    return top + yaml_text(values)


def edited_text(text: str, values: Mapping[KeyPath, object], *, is_remarked: bool = True) -> str:
    """The text with other values.

    Args:
        values: New values by key path; ``REMOVED`` for keys that are removed. The mapping that a new key belongs to
            exists.
        is_remarked: Whether comments at the end of lines repeat what was in the place of each value, and say which
            keys are new.
    """
    nodes = _nodes(text)
    edits: list[Edit] = []
    remarks: dict[int, list[str]] = {}
    for path, value in values.items():
        if value is REMOVED:
            edits += _removal(text, nodes, path)
        elif path in nodes:
            node = nodes[path]
            begin, end = (node.key[1], node.span[1]) if node.is_block else node.span
            edits.append((begin, end, 0, f": {flow_text(value)}" if node.is_block else flow_text(value)))
            remarks.setdefault(_line_end(text, end), []).append(f"{_last_key(path)}: {_shown(text[slice(*node.span)])}")
        else:
            edits.append(_insertion(text, nodes, path, f"{path[-1]}: {flow_text(value)}", "  # new" * is_remarked))
    if is_remarked:
        edits += [(end, end, 1, _comment(text, end, notes)) for end, notes in remarks.items()]
    for begin, end, _, new in sorted(edits, key=lambda edit: edit[:3])[::-1]:  # of equal ones the first comes first
        text = text[:begin] + new + text[end:]
    return text


def _nodes(text: str) -> dict[KeyPath, _Node]:
    nodes: dict[KeyPath, _Node] = {}
    events: Iterator[Any] = iter(yaml.parse(text, Loader=yaml.SafeLoader))
    root: Any = next(event for event in events if isinstance(event, yaml.MappingStartEvent))
    _read(events, root, (), (0, 0), nodes)
    return nodes


def _read(events: Iterator[Any], event: Any, path: KeyPath, key: tuple[int, int], nodes: dict[KeyPath, _Node]) -> _Node:
    """Take over the value that begins with an event, and all below it."""
    node = _Node(key=key, span=(event.start_mark.index, event.end_mark.index))
    nodes[path] = node
    if not isinstance(event, yaml.CollectionStartEvent):
        return node
    end, places, is_mapping = node.span[1], 0, isinstance(event, yaml.MappingStartEvent)
    entry: Any
    while not _ends(entry := next(events)):
        child, where = entry, (entry.start_mark.index, entry.end_mark.index)
        step: str | int = places
        if is_mapping:
            step, child = str(entry.value), next(events)
        node.children.append((*path, step))
        end = _read(events, child, (*path, step), where, nodes).span[1]
        places += 1
    node.is_block = not event.flow_style
    node.span = (node.span[0], end if node.is_block else entry.end_mark.index)
    return node


def _ends(event: object) -> bool:
    """Whether an event ends a mapping or list."""
    return isinstance(event, yaml.CollectionEndEvent)


def _insertion(text: str, nodes: Mapping[KeyPath, _Node], path: KeyPath, entry: str, remark: str) -> Edit:
    """The edit that adds an entry to a mapping, after its last one; a remark ends a line of its own."""
    above = nodes[path[:-1]]
    if not above.is_block:
        at = nodes[above.children[-1]].span[1] if above.children else above.span[1] - 1
        return at, at, 0, f", {entry}" if above.children else entry
    first = nodes[above.children[0]].key[0]
    column = first - (text.rfind("\n", 0, first) + 1)
    at = _line_end(text, above.span[1])
    return at, at, LATE - len(path), f"\n{' ' * column}{entry}{remark}"


def _removal(text: str, nodes: Mapping[KeyPath, _Node], path: KeyPath) -> Iterator[Edit]:
    """The edits that take a key out: its lines become comments, or it leaves the mapping on its line."""
    node, above = nodes[path], nodes[path[:-1]]
    if above.is_block:
        begin, last = text.rfind("\n", 0, node.key[0]) + 1, _line_end(text, node.span[1])
        lines = text[begin:last].split("\n")
        yield begin, last, 0, "\n".join(f"# removed: {line}" for line in lines)
        return
    place = above.children.index(path)
    if place + 1 < len(above.children):
        yield node.key[0], nodes[above.children[place + 1]].key[0], 0, ""
    else:
        yield nodes[above.children[place - 1]].span[1] if place else node.key[0], node.span[1], 0, ""


def _line_end(text: str, index: int) -> int:
    end = text.find("\n", index)
    end = len(text) if end < 0 else end
    return end - 1 if text[index:end].endswith("\r") else end


def _comment(text: str, end: int, notes: list[str]) -> str:
    """What is added at the end of a line."""
    line = text[text.rfind("\n", 0, end) + 1 : end]
    was = f"was {', '.join(notes)}"
    return f"; {was}" if COMMENT.search(line) else f"  # {was}"


def _last_key(path: KeyPath) -> str:
    """Name of the value in a comment."""
    return str(next(step for step in reversed(path) if isinstance(step, str)))


def _shown(old: str) -> str:
    """An old value on one line, short."""
    plain = " ".join(old.split())
    return plain if len(plain) <= SHOWN else f"{plain[:SHOWN]}…"


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
