"""Rules of a program for its tasks, as welders state them: tasks that exist, and rules that some program can keep."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise, product
from typing import Final

from cellplan.files.input.findings import Finding, KeyPath, listed, unknown_name
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.settings.program import ProgramEntry, groups_of

ROUNDING: Final = 1e-9  # [s] of two begins that are the same
Named = tuple[KeyPath, str]  # a place in the file, and the task that is named there
Edge = tuple[str, str, KeyPath | None]  # a task, one that is done before it, and the rule that says so; None for a key


def task_rule_findings(
    valid: ValidEntries, document: YamlDocument, robots: Mapping[str, Sequence[str]]
) -> Iterator[Finding]:
    """Everything about these rules that contradicts other entries; ``robots`` are those of each open task."""
    program, known = valid.program, valid.names["tasks"]
    if program is None:
        return
    places = [*chain.from_iterable(_groups(program, key) for key in ("same_robot", "together")), _turns(program)]
    unknown = [named for group in places for named in group if named[1] not in known]
    for path, name in unknown:
        yield document.finding(path, unknown_name("a task of this cell", name, known))
    for key in ("same_robot", "together", "order"):
        seen: set[str] = set()
        for path, name in chain.from_iterable(group for group in places if group and group[0][0][1] == key):
            if name in seen:
                yield document.finding(path, f"expected each task once, got '{name}' twice")
            seen.add(name)
    is_whole = len(valid.tasks) == len(known)
    if program.tacks_first and is_whole and not any(task.tack for task in valid.tasks.values()):
        yield document.finding(("program", "tacks_first"), "expected tasks with tack: true, got none")
    if not unknown and is_whole:
        able = {name: tuple(robots.get(name, (task.robot,))) for name, task in valid.tasks.items()}
        yield from _robots(program, able, document)
        yield from _begins(valid, program, document)
        yield from _circles(valid, program, document)


def _groups(program: ProgramEntry, key: str) -> Iterator[list[Named]]:
    """The tasks of each list of a rule with their places."""
    given = getattr(program, key)
    for number, names in enumerate(groups_of(given)):
        place: KeyPath = ("program", key) if isinstance(given[0], str) else ("program", key, number)
        yield [((*place, index), name) for index, name in enumerate(names)]


def _turns(program: ProgramEntry) -> list[Named]:
    """The tasks that take turns with their places."""
    lists = program.order.alternate if program.order else ()
    return [
        (("program", "order", "alternate", number, index), name)
        for number, names in enumerate(lists)
        for index, name in enumerate(names)
    ]


def _robots(program: ProgramEntry, able: Mapping[str, Sequence[str]], document: YamlDocument) -> Iterator[Finding]:
    """One robot may do all tasks of the same robot; tasks that begin together have one each, with both rules."""
    same: dict[str, str] = {}
    for key in ("same_robot", "together"):
        for group in _groups(program, key):
            names = [name for _, name in group]
            robots = "; ".join(f"'{name}' {listed(able[name])}" for name in names)
            if key == "same_robot":
                same |= dict.fromkeys(names, names[0])
                is_possible = bool(set.intersection(*(set(able[name]) for name in names)))
                words = "that one robot may do"
            else:
                choices, words = product(*(able[name] for name in names)), "of different robots"
                is_possible = any(len(set(choice)) == len(choice) for choice in choices)
            if not is_possible:
                yield document.finding(group[0][0][:-1], f"expected tasks {words}, got {robots}")
            elif key == "together" and len({same.get(name, name) for name in names}) < len(names):
                text = "expected tasks of different robots, got some that program.same_robot gives to one robot"
                yield document.finding(group[0][0][:-1], text)


def _begins(valid: ValidEntries, program: ProgramEntry, document: YamlDocument) -> Iterator[Finding]:
    """Paths that begin together begin equally long after their block."""
    for group in _groups(program, "together"):
        begins = {name: valid.tasks[name].begins_s for _, name in group}
        if max(begins.values()) - min(begins.values()) > ROUNDING:
            got = ", ".join(f"'{name}' {begin:g} s" for name, begin in begins.items())
            text = f"expected paths that begin equally long after their block, got {got}: give one approach_s to all"
            yield document.finding(group[0][0][:-1], text)


def _circles(valid: ValidEntries, program: ProgramEntry, document: YamlDocument) -> Iterator[Finding]:
    """Some order keeps all rules, with what tasks come after and the orders of the robots that are given."""
    groups = ([name for _, name in group] for group in _groups(program, "together"))
    first = {name: " with ".join(names) for names in groups for name in names}
    edges: list[Edge] = [
        (name, other, ("tasks", name, "after"))
        for name, task in valid.tasks.items()
        for other in task.preceding
        if other in valid.tasks
    ]
    for robot in valid.robots.values():
        edges += [(later, one, None) for one, later in pairwise(it for it in robot.order or () if it in valid.tasks)]
    tacks = [name for name, task in valid.tasks.items() if task.tack]
    for one, later, key in program.in_order(tacks, valid.tasks):
        edges.append((later, one, ("program", *key.split("."))))
    before: dict[str, dict[str, KeyPath | None]] = {}
    for later, one, place in edges:
        before.setdefault(first.get(later, later), {}).setdefault(first.get(one, one), place)
    left = set(before)
    while ready := {name for name in left if left.isdisjoint(before[name])}:
        left -= ready
    if left:
        circle = [min(left)]
        while circle[-1] not in circle[:-1]:
            circle.append(next(name for name in before[circle[-1]] if name in left))
        circle = circle[circle.index(circle[-1]) :]
        words = " before ".join(f"'{name}'" for name in reversed(circle))
        places = [place for place in (before[later][one] for later, one in pairwise(circle)) if place is not None]
        of_program: list[KeyPath] = [place for place in places if place[0] == "program"]
        of_program += [] if set(first.values()).isdisjoint(circle) else [("program", "together")]
        if of_program:
            text = f"expected rules that some order keeps, with after and the orders of the robots, got {words}"
            yield document.finding(of_program[0], text)
        elif 1 < len(places) == len(circle) - 1:  # a circle of given orders is named where blocks are made
            text = f"expected an order that can be worked off, got a circle: {words}: change after"
            yield document.finding(places[0], text)
