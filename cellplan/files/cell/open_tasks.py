"""Open tasks: tasks that several robots may do, one of which an assignment chooses."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from cellplan.files.input.findings import Finding, did_you_mean, listed, shown
from cellplan.files.yaml.reader import YamlDocument

ANY: Final = "any"


def open_tasks(root: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """The robots that may do each open task: those that are listed, or all that are available and hold no part.

    A task of a robot that is not available is open too.
    """
    tasks, robots = root.get("tasks"), root.get("robots")
    if not isinstance(tasks, Mapping) or not isinstance(robots, Mapping):
        return {}
    part = root.get("part")
    held_by = part.get("held_by") if isinstance(part, Mapping) else None
    holders = (
        [entry.get("robot") for entry in held_by if isinstance(entry, Mapping)] if isinstance(held_by, tuple) else []
    )
    absent = {name for name, robot in robots.items() if isinstance(robot, Mapping) and robot.get("available") is False}
    free = tuple(name for name in robots if name not in holders and name not in absent)
    able: dict[str, tuple[str, ...]] = {}
    for name, task in tasks.items():
        robot = task.get("robot") if isinstance(task, Mapping) else None
        if (robot == ANY and ANY not in robots) or (isinstance(robot, str) and robot in absent):
            able[name] = free
        elif isinstance(robot, tuple):
            able[name] = tuple(it for it in map(str, robot) if it not in absent)
    return able


def with_first_robots(document: YamlDocument) -> YamlDocument:
    """The document with a robot for each open task, the first of its own, so that all else in it can be read."""
    opened, robots = open_tasks(document.root), document.root.get("robots")
    if not opened or not robots:
        return document
    names = list(robots)
    first = {name: next((it for it in able if it in names), names[-1]) for name, able in opened.items()}
    tasks = {
        name: {**task, "robot": first[name]} if name in first else task for name, task in document.root["tasks"].items()
    }
    return replace(document, root={**document.root, "tasks": tasks})


def open_task_findings(document: YamlDocument) -> Iterator[Finding]:
    """Refuse open tasks, those with the same robots in one line."""
    alike: dict[tuple[str, str], list[str]] = {}
    for name in open_tasks(document.root):
        value = document.root["tasks"][name]["robot"]
        kind = "a robot" if isinstance(value, tuple) or value == ANY else "an available robot"
        alike.setdefault((kind, shown(value)), []).append(name)
    for (kind, value), (name, *others) in alike.items():
        words = (
            f"expected the name of {kind}, got {value}{_more(others)}: cellplan assign chooses who does an open task"
        )
        yield document.finding(("tasks", name, "robot"), words)


def unknown_robot_findings(document: YamlDocument) -> Iterator[Finding]:
    """Refuse lists with names that are not those of robots, and with a robot twice."""
    for name in open_tasks(document.root):
        known, robots = list(document.root["robots"]), document.root["tasks"][name]["robot"]
        for index, robot in enumerate(map(str, robots) if isinstance(robots, tuple) else ()):
            words = f"expected one of {listed(known)}, got {shown(robot)}{did_you_mean(robot, known)}"
            if robot in robots[:index]:
                words = f"expected each robot once, got {shown(robot)} twice"
            if robot not in known or robot in robots[:index]:
                yield document.finding(("tasks", name, "robot", index), words)
    if undone := [name for name, robots in open_tasks(document.root).items() if not robots]:
        words = f"expected an available robot that does not hold the part, got none{_more(undone[1:])}"
        yield document.finding(("tasks", undone[0], "robot"), words)


def _more(others: Sequence[str]) -> str:
    """How many tasks are as the one that is named."""
    return f", as in {len(others)} more task{'s' * (len(others) > 1)}" if others else ""
