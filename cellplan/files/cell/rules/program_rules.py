"""Rules of programs from home to home: names in orders, marks and places of the part, and keys that need a program."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from cellplan.files.cell.rules.rules import holders_as_written, operators_as_written
from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, unknown_name
from cellplan.files.robots.rules import configuration_findings
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.task import TaskEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.cell.sequence import order_faults
from cellplan.model.robot.robot import RobotModel, configuration_in_si
from cellplan.model.settings.program import PartPlaceEntry
from cellplan.model.settings.units import Mm

STAND_OFF: Final = Mm(30.0)  # of the tools of a program where the cell gives none
STAND_OFFS: Final = ("approach_mm", "retract_mm")
TASK_KEYS: Final = ("after", "start_deg", "start", "holder_deg", "holder", "holder_moves", "via")  # of a program
CURE: Final = "add program: {} for a program from home to home"


def with_stand_offs(valid: ValidEntries) -> ValidEntries:
    """The entries with the default approach and retraction of a program, for tasks on the part."""
    if valid.program is None:
        return valid
    tasks = {name: task.model_copy(update=_stand_offs(task)) for name, task in valid.tasks.items()}
    whole = None if valid.whole is None else valid.whole.model_copy(update={"tasks": tasks})
    return replace(valid, tasks=tasks, whole=whole)


def _stand_offs(task: TaskEntry) -> dict[str, Mm]:
    """Default approach and retraction of a task in a program, as far as it states none."""
    keys = STAND_OFFS if task.relative_to == "part" else ()
    return {key: STAND_OFF for key in keys if key not in task.model_fields_set}


def program_findings(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Everything about programs that contradicts other entries; before the default approaches are filled in."""
    if "program" not in document.root:
        yield from _without_program(valid, document)
        return
    marks = _mark_names(document)
    yield from _marks(marks, valid, document)
    yield from _orders(marks, valid, document)
    yield from _preceding(marks, valid, document)
    yield from _places(valid, document)
    yield from _times(valid, document)
    yield from _holding(valid, document)


def posture_findings(
    valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument
) -> Iterator[Finding]:
    """Configurations of tasks and services have a value for each joint, within its limits."""
    for name, entry in valid.robots.items():
        if entry.service is not None and name in models:
            path: KeyPath = ("robots", name, "service", "at")
            findings = list(configuration_findings(path, entry.service.at, models[name], document))
            yield from findings or _limits(path, entry.service.at, models[name], document)
    holders = [robot for _, robot in holders_as_written(document)]
    for name, task in valid.tasks.items():
        for key, robot, given in (
            ("start", task.robot, task.given_start),
            ("holder", holders[0] if holders else "", task.given_holder),
        ):
            if given is None or robot not in models:
                continue
            findings = list(configuration_findings(("tasks", name, key), given, models[robot], document))
            yield from findings
            if not findings:
                place = ("tasks", name, key if isinstance(given, dict) else f"{key}_deg")
                yield from _limits(place, given, models[robot], document)

        for key, points in (("before", task.via.before), ("after", task.via.after)) if task.via is not None else ():
            for index, point in enumerate(points):
                path = "tasks", name, "via", key, index
                by = valid.robots.get(task.robot)
                if point == "service" and by is not None and by.service is None:
                    yield document.finding(path, f"expected a robot with a service, got '{task.robot}' without: add it")
                if isinstance(point, str) or task.robot not in models:
                    continue
                findings = list(configuration_findings(path, point, models[task.robot], document))
                yield from findings or _limits(path, point, models[task.robot], document)


def _limits(
    path: KeyPath, given: tuple[float, ...] | dict[str, Any], model: RobotModel, document: YamlDocument
) -> Iterator[Finding]:
    """A configuration is within the limits of all joints."""
    for joint, position in zip(model.joints, configuration_in_si(model, given), strict=True):
        if not joint.lower <= position <= joint.upper:
            unit, scale = joint.display_unit
            low, high, got = (f"{scale * value:.6g}" for value in (joint.lower, joint.upper, position))
            yield document.finding(path, f"expected '{joint.name}' within its limits {low} .. {high} {unit}, got {got}")


def _without_program(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Keys and modes that only a program has."""
    for name, robot in valid.robots.items():
        if robot.order is not None:
            yield document.key_finding(("robots", name, "order"), f"unexpected key without program: {CURE}")
        if robot.service is not None:
            yield document.key_finding(("robots", name, "service"), f"unexpected key without program: {CURE}")
    for name, task in valid.tasks.items():
        for key in TASK_KEYS:
            if getattr(task, key) is not None:
                yield document.key_finding(("tasks", name, key), f"unexpected key without program: {CURE}")
    if valid.motion is not None and valid.motion.mode == "semi_coordinated":
        text = f"expected simultaneous, pairwise or part_at_rest without program, got 'semi_coordinated': {CURE}"
        yield document.finding(("motion", "mode"), text)


def _mark_names(document: YamlDocument) -> list[tuple[KeyPath, str]]:
    """Names of the marks and where they stand, also in a program that is wrong in other ways."""
    program = document.root["program"]
    marks = program.get("marks") if isinstance(program, dict) else None
    names: list[tuple[KeyPath, str]] = []
    for index, mark in enumerate(marks if isinstance(marks, tuple) else ()):
        place: KeyPath = ("program", "marks", index)
        name = mark.get("name") if isinstance(mark, dict) else mark
        if isinstance(name, str):
            names.append(((*place, "name") if isinstance(mark, dict) else place, name))
    return names


def _marks(marks: list[tuple[KeyPath, str]], valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Marks have names of their own, and stand in the order of some robot."""
    seen: set[str] = set()
    orders = [robot.order or () for robot in valid.robots.values()]
    for path, name in marks:
        if name in valid.names["tasks"]:
            yield document.finding(path, f"expected a name that no task has, got '{name}', a task: rename the mark")
        elif name in seen:
            yield document.finding(path, f"expected each mark once, got '{name}' twice")
        elif len(valid.robots) == len(valid.names["robots"]) and not any(name in order for order in orders):
            text = f"expected a mark in the order of some robot, got '{name}' in none: add it to robots.ROBOT.order"
            yield document.finding(path, text)
        seen.add(name)


def _orders(marks: list[tuple[KeyPath, str]], valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """The order of a robot has each of its tasks once, and otherwise only marks."""
    operators = {task: robot for task, _, robot in operators_as_written(document)}
    names = [name for _, name in marks]
    for robot, entry in valid.robots.items():
        if entry.order is None:
            continue
        tasks = [task for task, operator in operators.items() if operator == robot]
        for index, text in order_faults(robot, entry.order, operators, names):
            place: KeyPath = ("robots", robot, "order")
            if index is None:
                yield document.finding(place, text)
                continue
            word = entry.order[index]
            is_known = word in operators or word in names
            hint = "" if is_known else did_you_mean(word, [*tasks, *names])
            yield document.finding((*place, index), text + hint)


def _preceding(marks: list[tuple[KeyPath, str]], valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """What a task comes after is another task of the cell."""
    names, known = [name for _, name in marks], valid.names["tasks"]
    for name, task in valid.tasks.items():
        for index, other in enumerate(task.preceding):
            place: KeyPath = (
                ("tasks", name, "after") if isinstance(task.after, str) else ("tasks", name, "after", index)
            )
            if other == name:
                yield document.finding(place, f"expected another task than '{name}' itself, got '{other}'")
            elif other in names:
                text = f"expected a task, got the mark '{other}': put marks into robots.{task.robot}.order"
                yield document.finding(place, text)
            elif other not in known:
                yield document.finding(place, unknown_name("a task of this cell", other, known))


def _places(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A part that is gripped or put down is held by a robot, and rests on bodies that exist."""
    if valid.program is None:
        return
    places: dict[str, PartPlaceEntry | None] = {"attach": valid.program.attach, "detach": valid.program.detach}
    holders = [robot for _, robot in holders_as_written(document)]
    for key, place in places.items():
        if place is None:
            continue
        if len(holders) > 1:
            text = "unexpected key, several robots hold the part and only one could grip it: remove it"
            yield document.key_finding(("program", key), text)
        if not holders:
            text = "unexpected key, no robot holds the part (part.held_by): remove it, or let a robot hold the part"
            yield document.key_finding(("program", key), text)
        for index, name in enumerate(place.supports):
            path: KeyPath = (
                ("program", key, "rests_on") if name == place.rests_on else ("program", key, "rests_on", index)
            )
            if name not in valid.names["environment"]:
                text = unknown_name("a body of the environment", name, valid.names["environment"])
                yield document.finding(path, text)
            elif name in place.supports[:index]:
                yield document.finding(path, f"expected each body once, got '{name}' twice")
    given = [key for key, place in places.items() if place is not None]
    if valid.program.cycles > 1 and len(given) == 1:
        missing = "detach" if given == ["attach"] else "attach"
        text = (
            f"expected attach and detach, or none of them, in a program of {valid.program.cycles} cycles, got "
            f"{given[0]} only: add {missing}, or set cycles: 1"
        )
        yield document.finding(("program", given[0]), text)


def _times(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Times of a task leave room for the approach that a program adds; joints fail at no time within a program."""
    for name, task in valid.tasks.items():
        approaches = bool(task.approach_mm or _stand_offs(task).get("approach_mm"))
        if approaches and not task.approach_mm and task.settle_s:
            text = (
                "expected no time to settle in a program, in which the tool comes to its path by an approach: remove "
                "it, or add approach_mm: 0"
            )
            yield document.finding(("tasks", name, "settle_s"), text)
        elif approaches and not task.approach_mm and task.start_s is not None and task.start_s < task.approach_s:
            text = (
                f"expected at least approach_s = {task.approach_s:g} in a program, got {task.start_s:g}: remove it, or "
                "add approach_mm: 0"
            )
            yield document.finding(("tasks", name, "start_s"), text)
    for index, lock in enumerate(valid.motion.locked_joints if valid.motion is not None else ()):
        if lock.from_s > 0.0:
            text = f"expected 0 in a cell with program, got {lock.from_s:g}: remove it"
            yield document.finding(("motion", "locked_joints", index, "from_s"), text)


def _holding(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """The configuration of the holder is given only where a robot holds the part, and in tasks of other robots."""
    holders = [robot for _, robot in holders_as_written(document)]
    for name, task in valid.tasks.items():
        if task.holder_moves and valid.motion is not None and valid.motion.mode != "semi_coordinated":
            text = f"expected the mode semi_coordinated, in which the part rests otherwise, got {valid.motion.mode}"
            yield document.key_finding(("tasks", name, "holder_moves"), text)
        holder = "holder_deg" if task.holder_deg is not None else "holder"
        if getattr(task, holder) is None:
            continue
        if not holders:
            text = "unexpected key, no robot holds the part (part.held_by): remove it"
            yield document.key_finding(("tasks", name, holder), text)
        elif task.robot == holders[0]:
            text = f"unexpected key, '{task.robot}' itself holds the part: give {holder.replace('holder', 'start')}"
            yield document.key_finding(("tasks", name, holder), text)
    if valid.motion is not None and valid.motion.mode == "semi_coordinated" and not holders:
        text = "expected a part that a robot holds, got one that is fixed in the world: choose simultaneous"
        yield document.finding(("motion", "mode"), text)
