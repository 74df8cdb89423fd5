"""Expansion: one task of a cell file stands for passes, stitches or tacks; one that is skipped stands for none.

Findings about what an entry stands for name the keys from which it comes.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise, zip_longest
from math import floor, hypot, pi
from typing import Any, Final

from cellplan.files.cell.changes import changed
from cellplan.files.input.findings import Finding, KeyPath
from cellplan.files.schema.expansion import MOST_PARTS, StitchEntry, TacksEntry
from cellplan.files.schema.messages import valid_entry
from cellplan.files.schema.path import PathShapeEntry, PolylineEntry
from cellplan.files.schema.seam import PathEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.files.yaml.reader import YamlDocument

EXPANDED: Final = ("passes", "stitch", "tacks", "crater", "skip")  # keys of a task that stand for others
OF_PATH: Final = (
    "side_mm", "out_mm", "work_deg", "push_deg", "drag_deg", "from_mm", "to_mm", "reverse", "weave",
)  # keys of a pass that are keys of its path  # fmt: skip
OF_START: Final = ("start_deg", "start", "start_s")  # keys of a task that hold for the first of its parts
WHOLE: Final = "unexpected key, an outline or a raster is run as it is drawn"
NO_PARTS: Final = f"expected 1 to {MOST_PARTS} of them on the path; of a path from a file, write their count"
EXCLUDES: Final = {"push_deg": "drag_deg", "drag_deg": "push_deg"}
ROUNDING: Final = 1e-9  # [-] of a number of stitches
DECIMALS: Final = 9  # of a length in [mm] that is worked out
OF_EDGES: Final = "part.step"  # entry on which the lengths of edges depend
EdgeLength = Callable[[YamlDocument, PathEntry], float | None]  # length in [mm] of a path along edges, None if unknown


class _NoPartsError(Exception):
    """No stitch or tack, or too many, fit a path; the argument is their key."""


@dataclass(slots=True, kw_only=True)
class _Part:
    """A task that another one stands for."""

    name: str
    values: dict[str, Any]
    sources: dict[KeyPath, KeyPath] = field(default_factory=dict)  # keys below it, by those of the task they come from

    def put(self, path: tuple[str, ...], value: object, source: KeyPath) -> None:
        """Set a value at a key, which comes from another key of the task."""
        inner = self.values
        for key in path[:-1]:
            inner[key] = dict(inner.get(key, {}))
            inner = inner[key]
        inner[path[-1]] = value
        self.sources[path] = source


def with_values(entries: YamlDocument, values: Mapping[str, object], edge_length: EdgeLength) -> YamlDocument:
    """The expanded document of entries with other values by address.

    Those of an entry that stands for other tasks are set before it is expanded, all others afterwards.
    """
    whole = expanded(entries, edge_length)
    early = {address: value for address, value in values.items() if is_of_entry(address, entries, whole)}
    whole = expanded(changed(entries, early), edge_length) if early else whole
    return changed(whole, {address: value for address, value in values.items() if address not in early})


def is_of_entry(address: str, entries: YamlDocument, whole: YamlDocument) -> bool:
    """Whether an address leads to what parts are made of: an entry that is no task of the whole document itself."""
    section, name, key, *_ = (*address.split(".", 3), "", "")
    names, parts = (it.root.get("tasks") for it in (entries, whole))
    if section != "tasks" or not isinstance(names, dict) or not isinstance(parts, dict):
        return address.startswith(OF_EDGES)
    return name in names and (key.split("[", maxsplit=1)[0] in EXPANDED or name not in parts)


def expanded(document: YamlDocument, edge_length: EdgeLength) -> YamlDocument:
    """The document with all tasks that others stand for, in their order, and with their names where these are named."""
    tasks = document.root.get("tasks")
    if not isinstance(tasks, dict) or not any(
        isinstance(it, dict) and set(EXPANDED) & set(it) for it in tasks.values()
    ):
        return document
    parts: dict[str, list[_Part]] = {}
    findings: list[Finding] = []
    for name, task in tasks.items():
        entry = valid_entry(TaskEntry, document, ("tasks", name)) if isinstance(task, dict) else None
        if entry is None or not set(EXPANDED) & set(task):
            continue
        length = edge_length(document, entry.path) if entry.path.is_edge else stated_length(entry.path)
        try:
            made = list(_parts(name, task, entry, length=length, has_program="program" in document.root))
        except _NoPartsError as error:
            if entry.path.is_edge and length is None:
                continue  # its edges or their file are wrong, and say so
            place: KeyPath = ("tasks", name, error.args[0])
            is_whole = entry.path.is_on_part and not entry.path.is_edge
            made_of = document.key_finding(place, WHOLE) if is_whole else document.finding(place, NO_PARTS)
            findings.append(made_of)
            continue
        taken = next((it.name for it in made if it.name in tasks and it.name != name), None)
        if taken is not None:
            text = f"expected a name whose parts have no names of other tasks, got '{taken}' for a part"
            findings.append(document.key_finding(("tasks", name), text))
        parts[name] = made
    return _with_parts(replace(document, findings=(*document.findings, *findings)), parts)


def _parts(
    name: str, task: Mapping[str, Any], entry: TaskEntry, *, length: float | None, has_program: bool
) -> Iterator[_Part]:
    """The tasks that a task stands for, each after the one before it; ``length`` is that of its path in [mm]."""
    if entry.skip:
        return
    plain = {key: value for key, value in task.items() if key not in EXPANDED}
    made = [*_tacks(name, plain, entry, length), *_seams(name, plain, entry, length)]
    for before, part in zip([None, *made], made, strict=False):
        if before is not None:
            part.values = {key: value for key, value in part.values.items() if key not in OF_START}
            if has_program:
                part.values["after"] = before.name
        yield part


def _seams(name: str, plain: Mapping[str, Any], entry: TaskEntry, length: float | None) -> Iterator[_Part]:
    """The passes or the stitches of a seam, or the seam alone, each with its crater."""
    made = [_Part(name=name, values=dict(plain))]
    if entry.passes is not None:
        made = [_pass(f"{name}_{k + 1}", plain, entry, k) for k in range(len(entry.passes))]
    elif entry.stitch is not None:
        pitch = entry.stitch.length_mm + entry.stitch.gap_mm
        spans = _spans(entry.path, entry.stitch, pitch, length)
        made = [_stretch(f"{name}_{k + 1}", plain, span, "stitch") for k, span in enumerate(spans)]
    for part in made:
        if entry.crater is not None:
            part.put(("path", "back_mm"), float(entry.crater.back_mm), ("crater", "back_mm"))
            part.put(("process", "off_delay_s"), entry.crater.time_s, ("crater", "time_s"))
        yield part


def _tacks(name: str, plain: Mapping[str, Any], entry: TaskEntry, length: float | None) -> Iterator[_Part]:
    """The tacks before a seam, without its weave."""
    tacks = entry.tacks
    spans = _spans(entry.path, tacks, float(tacks.pitch_mm), length) if tacks is not None else ()
    for k, span in enumerate(spans):
        part = _stretch(f"{name}_t{k + 1}", plain, span, "tacks")
        part.values["path"] = {key: value for key, value in part.values["path"].items() if key != "weave"}
        part.put(("tack",), True, ("tacks",))
        yield part


def _pass(name: str, plain: Mapping[str, Any], entry: TaskEntry, number: int) -> _Part:
    """One pass of a seam."""
    part, given = _Part(name=name, values=dict(plain)), (entry.passes or ())[number]
    source: KeyPath = ("passes", number)
    written = given.model_dump(exclude_none=True)
    for key in OF_PATH:
        if key in written:
            part.put(("path", key), written[key], (*source, key))
            part.values["path"].pop(EXCLUDES.get(key), None)
    if given.feed_mm_s is not None:
        feed = ("feed_mm_s",) if entry.process is None else ("process", "feed_mm_s")
        part.put(feed, written["feed_mm_s"], (*source, "feed_mm_s"))
    if given.rest_s is not None:
        part.put(("dwell_s",), given.rest_s, (*source, "rest_s"))
    return part


def _stretch(name: str, plain: Mapping[str, Any], span: tuple[float, float], source: str) -> _Part:
    """A stretch of a path from one length to another in [mm]."""
    part = _Part(name=name, values=dict(plain))
    for key, value in zip(("from_mm", "to_mm"), span, strict=True):
        part.put(("path", key), value, (source,))
    left_out = {"overlap_mm", *(() if span[0] else ("from_mm",))}
    part.values["path"] = {key: it for key, it in part.values["path"].items() if key not in left_out}
    return part


def _spans(
    path: PathEntry, entry: StitchEntry | TacksEntry, pitch: float, length: float | None
) -> Sequence[tuple[float, float]]:
    """Begins and ends of stitches or tacks in [mm] along the path, in the order in which it is run along."""
    begin = float(path.from_mm or 0.0)
    end = float(path.to_mm) if path.to_mm is not None else length
    count = entry.count
    if count is None and end is not None:
        count = floor((end - begin - entry.length_mm) / pitch + ROUNDING) + 1
    if count is None or not 1 <= count <= MOST_PARTS:
        raise _NoPartsError("stitch" if isinstance(entry, StitchEntry) else "tacks")
    starts = [begin + k * pitch for k in range(count)]
    spans = [(round(it, DECIMALS), round(it + entry.length_mm, DECIMALS)) for it in starts]
    return spans[::-1] if path.reverse else spans


def stated_length(path: PathShapeEntry) -> float | None:
    """Length in [mm] of a path as it is drawn, before it is projected or rounded; None of one from a file."""
    if path.circle is not None:
        return 2.0 * pi * path.circle.radius_mm
    if path.rectangle is not None:
        return 2.0 * sum(path.rectangle.sides_mm)
    if path.rhombus is not None:
        return 2.0 * hypot(*path.rhombus.diagonals_mm)
    return None if path.polyline is None else _sides(path.polyline)


def _sides(polyline: PolylineEntry) -> float:
    """Length in [mm] of the sides of a polyline."""
    points = [*polyline.points_mm, *(polyline.points_mm[:1] if polyline.closed else ())]
    return sum(hypot(*(b - a for a, b in zip(one, other, strict=True))) for one, other in pairwise(points))


def _with_parts(document: YamlDocument, parts: Mapping[str, Sequence[_Part]]) -> YamlDocument:
    """The document with the parts of some tasks in their place."""
    names = {name: tuple(it.name for it in made) for name, made in parts.items()}
    tasks: dict[str, Any] = {}
    sources: dict[KeyPath, KeyPath] = {}
    values, keys = dict(document.values), dict(document.keys)
    for name, task in document.root["tasks"].items():
        for part in parts.get(name, [_Part(name=name, values=task)]):
            tasks[part.name] = part.values
            if name in parts:
                here, old = ("tasks", part.name), ("tasks", name)
                sources |= {here: old, **{(*here, *new): (*old, *it) for new, it in part.sources.items()}}
    for new, source in sources.items():
        n = len(source)
        for marks, before in ((values, document.values), (keys, document.keys)):
            marks |= {(*new, *place[n:]): mark for place, mark in before.items() if place[:n] == source}
    root = _renamed({**document.root, "tasks": tasks}, names)
    return replace(document, root=root, values=values, keys=keys, sources=sources)


def _renamed(root: dict[str, Any], names: Mapping[str, tuple[str, ...]]) -> dict[str, Any]:
    """The root with the names of parts wherever it names tasks: in what comes after, orders, rules and data."""
    new = dict(root)
    new["tasks"] = {name: _after(task, names) for name, task in root["tasks"].items()}
    if isinstance(robots := root.get("robots"), dict):
        new["robots"] = {
            name: {**it, "order": _flat(it["order"], names)} if isinstance(it, dict) and "order" in it else it
            for name, it in robots.items()
        }
    if isinstance(program := root.get("program"), dict):
        new["program"] = {key: _rule(key, value, names) for key, value in program.items()}
    if isinstance(controllers := root.get("controllers"), dict):
        new["controllers"] = {name: _data(it, names) for name, it in controllers.items()}
    return new


def _after(task: Any, names: Mapping[str, tuple[str, ...]]) -> Any:
    """A task that comes after the last parts of others."""
    after = task.get("after") if isinstance(task, dict) else None
    if after is None:
        return task
    every = [(after,)] if isinstance(after, str) else [(it,) for it in after]
    last = tuple(name for (it,) in every for name in names.get(it, (it,))[-1:])
    rest = {key: value for key, value in task.items() if key != "after"}
    return {**rest, "after": last} if last else rest


def _flat(given: Any, names: Mapping[str, tuple[str, ...]]) -> Any:
    """A list of names with the parts of each task."""
    if not isinstance(given, tuple):
        return given
    return tuple(name for it in given for name in (names.get(it, (it,)) if isinstance(it, str) else (it,)))


def _rule(key: str, value: Any, names: Mapping[str, tuple[str, ...]]) -> Any:
    """A rule of the program about parts: one robot does all, parts that begin together do so one by one."""
    if key == "order" and isinstance(value, dict) and isinstance(value.get("alternate"), tuple):
        return {**value, "alternate": tuple(_flat(it, names) for it in value["alternate"])}
    if key not in {"same_robot", "together"} or not isinstance(value, tuple):
        return value
    groups = value if any(isinstance(it, tuple) for it in value) else (value,)
    if key == "same_robot":
        return tuple(_flat(group, names) for group in groups)
    pairs = [
        tuple(it for it in one if it is not None)
        for group in groups
        for one in zip_longest(*(names.get(it, (it,)) for it in group))
    ]
    return tuple(pair for pair in pairs if len(pair) > 1)


def _data(controller: Any, names: Mapping[str, tuple[str, ...]]) -> Any:
    """A controller whose data of a task are those of its parts."""
    process = controller.get("process") if isinstance(controller, dict) else None
    data = process.get("data") if isinstance(process, dict) else None
    if not isinstance(process, dict) or not isinstance(data, dict):
        return controller
    of_parts = {name: value for task, value in data.items() for name in names.get(task, (task,))}
    return {**controller, "process": {**process, "data": of_parts}}
