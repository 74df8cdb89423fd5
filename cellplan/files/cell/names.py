"""Names of controllers in a file beside the cell: tasks, signals, tools and frames, on which no proof depends.

The file has keys of a cell file. A name takes the place of that of the cell, whole; all else says what the cell says.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from cellplan.files.cell.changes import changed
from cellplan.files.input.findings import KeyPath, did_you_mean, key_text, listed, raise_findings, shown_whole
from cellplan.files.yaml.reader import YamlDocument, read_yaml
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry

NAMES: Final = sorted(ControllerEntry.NAMES | RobotControlEntry.NAMES)


def is_name(path: KeyPath) -> bool:
    """Whether the value at a key path of a cell file is a name, which may change after the cell was solved."""
    match path:
        case ("controllers", _, key, *_):
            return key in ControllerEntry.NAMES
        case ("robots", _, "controller", key, *_):
            return key in RobotControlEntry.NAMES
    return False


def with_stated_names(document: YamlDocument, file: Path) -> YamlDocument:
    """The document of a valid cell with the names that a file states; an ``InvalidFileError`` has all that is wrong."""
    stated = read_yaml(file, file=str(file))
    findings, names = list(stated.findings), dict[str, Any]()
    for path, value in _values(stated.root):
        known = _at(document.root, path)
        if is_name(path) and _at(document.root, path[:2]) is not None:
            names[key_text(path)] = value
        elif value != known:
            hint = "" if known else did_you_mean(str(path[-1]), NAMES)
            text = f"expected {shown_whole(known)} as in '{document.file}', got {shown_whole(value)}{hint}; without"
            text += f" solving again only names of controllers may change ({listed(NAMES)})"
            findings.append(stated.key_finding(path, text))
    raise_findings(stated.file, findings)
    lines = stated.lines()
    return changed(document, names, {key: f"{stated.file}:{lines[key]}" for key in names})


def _values(node: Mapping[str, Any], path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """All values of a document with their key paths; a name is one value, whatever it consists of."""
    for key, value in node.items():
        inner: KeyPath = (*path, key)
        if isinstance(value, dict) and not is_name(inner):
            yield from _values(value, inner)
        else:
            yield inner, value


def _at(node: Any, path: KeyPath) -> Any:
    """The value at a key path; None without one."""
    for key in path:
        node = node.get(key) if isinstance(node, dict) else None
    return node
