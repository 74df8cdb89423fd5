"""Rules between the entries of a cell file: names that must exist, times that must fit, keys that need each other."""

from collections.abc import Iterator, Sequence
from typing import Final

from cellplan.io.cell.as_listed import holders_as_written, operators_as_written
from cellplan.io.cell.solver_rules import accurate_findings, feedback_findings
from cellplan.io.input.findings import Finding, KeyPath, unknown_name
from cellplan.io.schema.partial import ValidEntries
from cellplan.io.schema.task import TaskEntry
from cellplan.io.yaml.reader import YamlDocument

TIME_TOL: Final = 1e-9  # [-] of the duration: rounding of start_s + duration_s
ORIENTATION_AXES: Final = frozenset({"rx", "ry", "rz"})
MEANS_ELSE: Final = {"part": "the workpiece", "world": "the frame that everything stands in"}
AT_REST: Final = frozenset({"part_at_rest", "semi_coordinated"})  # modes in which tasks are done on a part at rest


def rule_findings(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Everything in a cell file that contradicts something else in it."""
    yield from _clashing_names(valid, document)
    yield from _holders(valid, document)
    yield from _operators(valid, document)
    for name, task in valid.tasks.items():
        yield from _times(valid, document, name)
        yield from _tool_axis(task, document, name)
    yield from feedback_findings(valid, document)
    yield from accurate_findings(valid, document)
    yield from _timing(valid, document)


def _clashing_names(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Names of files and folders that some systems do not distinguish, and names that mean two bodies."""
    for section in ("robots", "tasks", "controllers"):
        seen: dict[str, str] = {}
        for name in valid.names[section]:
            other = seen.setdefault(name.lower(), name)
            if other != name:
                text = f"expected a name that differs from '{other}' by more than upper and lower case"
                yield document.key_finding((section, name), text)
    for name in valid.names["robots"]:
        if name.lower() in MEANS_ELSE:
            text = f"expected another name, '{name.lower()}' means {MEANS_ELSE[name.lower()]}"
            yield document.key_finding(("robots", name), text)
    if "part" in valid.names["environment"]:
        yield document.key_finding(("environment", "part"), "expected another name, 'part' means the workpiece")


def _holders(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """The part is held by robots of the cell, each once."""
    seen: set[str] = set()
    for path, robot in holders_as_written(document):
        yield from _known_robot(robot, valid, document, path)
        if robot in seen:
            yield document.finding(path, f"expected a robot that does not hold the part already, got '{robot}' twice")
        seen.add(robot)


def _operators(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A task is done by a robot that does not hold the part, or carries it; without a program each by another one."""
    holders = [robot for _, robot in holders_as_written(document)]
    busy: dict[str, str] = {}
    for name, path, robot in operators_as_written(document):
        yield from _known_robot(robot, valid, document, path)
        if robot in holders:
            is_in_world = document.root["tasks"][name].get("relative_to") == "world"
            text = _wrong_holder(robot, holders, valid, is_in_world=is_in_world)
            if text:
                yield document.finding(path, text)
        other = busy.setdefault(robot, name)
        if other != name and "program" not in document.root:
            text = (
                f"expected a robot without another task, got '{robot}', which does '{other}': add program: {{}} for a "
                "sequence of tasks"
            )
            yield document.finding(path, text)


def _wrong_holder(robot: str, holders: Sequence[str], valid: ValidEntries, *, is_in_world: bool) -> str | None:
    """What is wrong with a task of a robot that holds the part; None for one that may carry it along a path."""
    if not is_in_world:
        return f"expected a robot that does not hold the part, got the positioner '{robot}'"
    if robot != holders[0]:
        return f"expected the first holder '{holders[0]}', which carries the part frame, got '{robot}'"
    if valid.motion is not None and valid.motion.mode in AT_REST:
        mode = valid.motion.mode
        return f"expected a robot that does not hold the part in the mode {mode}, got the positioner '{robot}'"
    return None


def _known_robot(robot: str, valid: ValidEntries, document: YamlDocument, path: KeyPath) -> Iterator[Finding]:
    """A robot that the cell has."""
    known = valid.names["robots"]
    if robot not in known:
        yield document.finding(path, unknown_name("a robot of this cell", robot, known))


def _times(valid: ValidEntries, document: YamlDocument, name: str) -> Iterator[Finding]:
    """A task starts and ends within the common clock."""
    if valid.motion is None:
        return
    task, clock = valid.tasks[name], valid.motion.duration_s
    if clock is None:  # the command line may give one
        return
    start, leaving = task.begins_s, task.leaving_s
    if start + leaving >= clock:
        also = f" and retract_s = {leaving:g}" if leaving else ""
        text = f"expected a start before the end of the clock (motion.duration_s = {clock:g}){also}, got {start:g}"
        yield document.finding(("tasks", name, "start_s"), text)
    elif task.duration_s is not None and start + task.duration_s + leaving > clock * (1.0 + TIME_TOL):
        words = "start_s + duration_s + retract_s" if leaving else "start_s + duration_s"
        text = (
            f"expected an end within the clock (motion.duration_s = {clock:g}), "
            f"got {words} = {start + task.duration_s + leaving:g}"
        )
        yield document.finding(("tasks", name, "duration_s"), text)


def needs_surface(task: TaskEntry) -> bool:
    """Whether the tool's axis can come from nothing but the part's surface or the file of the path."""
    turns = ORIENTATION_AXES & set(task.axes)
    return task.tool_axis == "normal" or (task.tool_axis is None and bool(turns))


def _tool_axis(task: TaskEntry, document: YamlDocument, name: str) -> Iterator[Finding]:
    """A normal needs a surface; of a file it is known only later whether it brings orientations."""
    if needs_surface(task) and task.path.project is None and task.path.csv is None:
        cure = "give tool_axis a direction"
        if task.relative_to == "part":
            cure = f"add project: +z (or another side), or {cure}"
        text = f"tool_axis: normal requires a path that is projected onto the part: {cure}"
        key = "path" if task.tool_axis is None else "tool_axis"
        yield document.finding(("tasks", name, key), text)


def _timing(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """What happens at a time of its own has none in a program that is retimed."""
    if valid.motion is None or valid.motion.timing == "as_written":
        return
    text = "expected 0 in a program that is retimed (motion.timing), got {:g}; remove it, or write timing: as_written"
    for index, lock in enumerate(valid.motion.locked_joints):
        if lock.from_s > 0.0:
            yield document.finding(("motion", "locked_joints", index, "from_s"), text.format(lock.from_s))
    for name, task in valid.tasks.items():
        if task.settle_s > 0.0:
            yield document.finding(("tasks", name, "settle_s"), text.format(task.settle_s))
