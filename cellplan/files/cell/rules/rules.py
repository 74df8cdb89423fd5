"""Rules between the entries of a cell file: names that must exist, times that must fit, keys that need each other."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from cellplan.files.cell.rules.smooth_rules import smooth_findings
from cellplan.files.cell.rules.solver_rules import accurate_findings, feedback_findings
from cellplan.files.input.findings import Finding, KeyPath, unknown_name
from cellplan.files.schema.cell import CycleEntry
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.path import CsvEntry
from cellplan.files.schema.seam import OF_FEED
from cellplan.files.schema.task import TaskEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.model.task.task import SampledPath, TimedPath

TIME_TOL: Final = 1e-9  # [-] of the duration: rounding of start_s + duration_s
ORIENTATION_AXES: Final = frozenset({"rx", "ry", "rz"})
MEANS_ELSE: Final = {"part": "the workpiece", "world": "the frame that everything stands in"}
AT_REST: Final = frozenset({"part_at_rest", "semi_coordinated"})  # modes in which tasks are done on a part at rest
Targets = Mapping[str, SampledPath | TimedPath | SeamLine]  # what was read of the files of paths, by task
CLOCK_KEYS: Final = ("duration_s", "feed_mm_s", "process", "time_law", "corners")  # what a trajectory decides by itself

OF_LENGTH: Final = (
    "walls",
    "work_deg",
    "push_deg",
    "drag_deg",
    "standoff_mm",
    "side_mm",
    "out_mm",
    "from_mm",
    "to_mm",
    "reverse",
    "overlap_mm",
    "back_mm",
    "weave",
)  # keys of a path that are about its travel, which a trajectory brings along


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
    yield from _open_feeds(valid, document)


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
    has_walls = task.path.is_seam or task.path.is_on_part
    return task.tool_axis == "normal" or (task.tool_axis is None and bool(turns) and not has_walls)


def _tool_axis(task: TaskEntry, document: YamlDocument, name: str) -> Iterator[Finding]:
    """A normal needs a surface; of a file it is known only later whether it brings orientations."""
    is_laid = task.path.file_key or task.path.on or task.path.raster
    if needs_surface(task) and task.path.project is None and not is_laid:
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


def _open_feeds(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A feed that is sought decides how long the motion takes; nothing else does."""
    motion = valid.motion
    stated = {
        "motion.duration_s": motion is not None and motion.duration_s is not None,
        "motion.timing.cycle_s": motion is not None and isinstance(motion.timing, CycleEntry),
    }
    for name, task in valid.tasks.items():
        if task.process is None or not task.process.has_open_feed:
            continue
        place: KeyPath = ("tasks", name, "process", "feed_mm_s")
        for key in (key for key, is_stated in stated.items() if is_stated):
            text = f"expected a number beside {key}, as a feed that is sought sets the clock; leave {key} out"
            yield document.finding(place, text)
        for key in (key for key in OF_FEED if task.path.weave is not None and getattr(task.path.weave, key)):
            text = f"expected a number beside path.weave.{key}, whose length follows from the feed"
            yield document.finding(place, text)


def target_findings(valid: ValidEntries, targets: Targets, document: YamlDocument) -> Iterator[Finding]:
    """Everything in the tasks that contradicts the files of their paths."""
    for name, path in targets.items():
        task = valid.tasks[name]
        if not isinstance(path, SeamLine):
            yield from _axes(task, path, document, name)
            yield from smooth_findings(name, task, path, document)
        if isinstance(path, TimedPath):
            yield from _clock(task, document, name)
            yield from _end(task, path, valid, document=document, name=name)


def _axes(task: TaskEntry, path: SampledPath | TimedPath, document: YamlDocument, name: str) -> Iterator[Finding]:
    """A file without orientations that is not projected onto the part has no normals."""
    has_axes = path.axes is not None or path.rotations is not None
    if has_axes and task.path.is_seam and task.path.outline is None:
        text = f"expected no walls and angles beside {path.source}, which gives the tool's orientation already"
        yield document.finding(("tasks", name, "path"), text)
    if needs_surface(task) and task.path.project is None and not has_axes:
        project = "" if task.relative_to == "world" else "add project: +z (or another side), "
        text = (
            "tool_axis: normal requires tool axes in the file: have CAM write them, or give tool_axis a direction"
            if task.path.has_feeds
            else "tool_axis: normal requires axes or quaternions in the file, or a path that is projected onto the "
            f"part: add columns i,j,k, {project}or give tool_axis a direction"
        )
        yield document.finding(("tasks", name, "tool_axis" if task.tool_axis else "path"), text)


def _clock(task: TaskEntry, document: YamlDocument, name: str) -> Iterator[Finding]:
    """A trajectory has its own times, its own smoothness and its own place."""
    for key in CLOCK_KEYS:
        if getattr(task, key) is not None:
            yield document.key_finding(
                ("tasks", name, key), "unexpected key, the column t_s of the path's file decides"
            )
    if task.tool_turn_deg != 0.0:
        text = "expected no turn on a path with a column t_s; give the turn as qw,qx,qy,qz in the file"
        yield document.finding(("tasks", name, "tool_turn_deg"), text)
    if task.path.project is not None:
        text = "unexpected key, a path with a column t_s is used as it stands in the file"
        yield document.key_finding(("tasks", name, "path", "project"), text)
    for key in OF_LENGTH:
        if getattr(task.path, key) is not None:
            text = "unexpected key, a path with a column t_s is used as it stands in the file"
            yield document.key_finding(("tasks", name, "path", key), text)
    if isinstance(task.path.csv, CsvEntry) and not task.path.csv.smooth:
        text = "expected true for a file with a column t_s: straight sides would jump in speed, got false"
        yield document.finding(("tasks", name, "path", "csv", "smooth"), text)
    if isinstance(task.path.csv, CsvEntry) and task.path.csv.join_mm:
        text = "unexpected key, rows of a file with a column t_s are apart in time: leave one out in the file"
        yield document.key_finding(("tasks", name, "path", "csv", "join_mm"), text)


def _end(
    task: TaskEntry, path: TimedPath, valid: ValidEntries, *, document: YamlDocument, name: str
) -> Iterator[Finding]:
    """A trajectory ends within the common clock."""
    if valid.motion is None or valid.motion.duration_s is None:
        return
    clock, end = valid.motion.duration_s, task.begins_s + task.repeat * path.duration + task.leaving_s
    if end > clock * (1.0 + TIME_TOL):
        cycles = f"{task.repeat} cycles of " if task.repeat > 1 else ""
        place: KeyPath = ("tasks", name, "path", "csv")
        text = (
            f"expected an end within the clock (motion.duration_s = {clock:g}), got start_s + {cycles}"
            f"{path.duration:g} s of {path.source} = {end:g}"
        )
        yield document.finding(place, text)


def holders_as_written(document: YamlDocument) -> Iterator[tuple[KeyPath, str]]:
    """Robots that hold the part, also of a part that is wrong in other ways."""
    part = document.root.get("part")
    grasps = part.get("held_by") if isinstance(part, dict) else None
    for index, grasp in enumerate(grasps if isinstance(grasps, tuple) else ()):
        robot = grasp.get("robot") if isinstance(grasp, dict) else None
        if isinstance(robot, str):
            yield ("part", "held_by", index, "robot"), robot


def operators_as_written(document: YamlDocument) -> Iterator[tuple[str, KeyPath, str]]:
    """Robots of the tasks, also of tasks that are wrong in other ways."""
    tasks = document.root.get("tasks")
    for name, task in tasks.items() if isinstance(tasks, dict) else ():
        robot = task.get("robot") if isinstance(task, dict) else None
        if isinstance(robot, str):
            yield name, ("tasks", name, "robot"), robot
