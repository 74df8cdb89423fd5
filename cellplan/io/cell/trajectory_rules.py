"""Rules between a task and the file of its path, once the file was read: who gives orientations and times."""

from collections.abc import Iterator, Mapping
from typing import Final

from cellplan.io.cell.rules import TIME_TOL, needs_surface
from cellplan.io.input.findings import Finding, KeyPath
from cellplan.io.schema.partial import ValidEntries
from cellplan.io.schema.path import CsvEntry
from cellplan.io.schema.task import TaskEntry
from cellplan.io.yaml.reader import YamlDocument
from cellplan.model.task import SampledPath, TimedPath

Targets = Mapping[str, SampledPath | TimedPath]  # what was read of the files of paths, by task

CLOCK_KEYS: Final = ("duration_s", "feed_mm_s", "process", "time_law", "corners")  # what a trajectory decides by itself


def target_findings(valid: ValidEntries, targets: Targets, document: YamlDocument) -> Iterator[Finding]:
    """Everything in the tasks that contradicts the files of their paths."""
    for name, path in targets.items():
        task = valid.tasks[name]
        yield from _axes(task, path, document, name)
        if isinstance(path, TimedPath):
            yield from _clock(task, document, name)
            yield from _end(task, path, valid, document=document, name=name)


def _axes(task: TaskEntry, path: SampledPath | TimedPath, document: YamlDocument, name: str) -> Iterator[Finding]:
    """A file without orientations that is not projected onto the part has no normals."""
    has_axes = path.axes is not None or path.rotations is not None
    if needs_surface(task) and task.path.project is None and not has_axes:
        project = "" if task.relative_to == "world" else "add project: +z (or another side), "
        text = (
            "tool_axis: normal requires axes or quaternions in the file, or a path that is projected onto the part: "
            f"add columns i,j,k, {project}or give tool_axis a direction"
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
