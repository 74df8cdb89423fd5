"""Time line of a program or of one run: what each robot does, from when to when."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import Task
from cellplan.report.page.times import phase_begins
from cellplan.report.record.common import Entries, Record

MAX_TICKS: Final = 6  # intervals of the axis
STEPS: Final = (1.0, 2.0, 5.0, 10.0)  # [-] of a power of ten: round distances of ticks
SHORTEST: Final = 1e-9  # [s] shorter spans are not drawn
WORK: Final = "work: "


@dataclass(frozen=True, slots=True)
class Span:
    """What a robot does for a while."""

    kind: str  # ``work``, ``process``, ``delay``, ``dwell``, ``settle``, ``carry``, ``move`` or ``rest``
    text: str  # the same in words
    begin: float  # its begin in [s]
    end: float  # its end in [s]


def time_line(record: Record, cell: Cell) -> dict[str, Any]:
    """Strips of a time line by robot, its phases and the ticks of its axis; places and widths are in percent.

    Args:
        record: Of a run, or of a program with several phases, whose first cycle is shown.
    """
    phases = _phases(record)
    total = max((phase["end_s"] for phase in phases), default=0.0) or 1.0
    tasks = {task.name: task for task in cell.tasks}
    robots = dict.fromkeys(robot for phase in phases for robot in phase["roles"])
    strips = []
    for robot in robots:
        spans = [span for phase in phases for span in _spans(phase, robot, record["tasks"], tasks)]
        strips.append({"robot": robot, "spans": [_placed(span, total) for span in spans]})
    kinds = {span["kind"] for strip in strips for span in strip["spans"]}
    return {
        "total": total,
        "strips": strips,
        "kinds": kinds,
        "phases": [{**phase, "left": _percent(phase["begin_s"], total)} for phase in phases],
        "ticks": [{"at": at, "left": _percent(at, total)} for at in _ticks(total)],
    }


def task_times(record: Record, cell: Cell) -> Entries:
    """When each task of a run begins and ends, and its process is on."""
    entries: Entries = []
    for task in cell.tasks:
        if task.name in record["tasks"]:
            task_record = record["tasks"][task.name]
            process = None if task.process is None else (task_record["start_s"], task_record["end_s"] + task.off_delay)
            entries.append({"name": task.name, **task_record, "process": process, "dwell_s": task.dwell})
    return entries


def _phases(record: Record) -> Entries:
    """The phases that the clock of a page spans: those of a first cycle, or the one of a run, from 0."""
    begins, name = phase_begins(record), record.get("phase")
    first = [dict(phase) for phase in record["phases"] if phase["begin_s"] == begins[phase["name"]]]
    if name is None:
        return first
    return [phase | {"begin_s": 0.0, "end_s": record["cycle_time_s"]} for phase in first if phase["name"] == name]


def _spans(phase: Record, robot: str, records: Record, tasks: Mapping[str, Task]) -> Iterator[Span]:
    role, begin, end = phase["roles"].get(robot, "hold"), phase["begin_s"], phase["end_s"]
    name = role.removeprefix(WORK)
    if role.startswith(WORK) and name in records and name in tasks:
        spans = _work(tasks[name], records[name], begin, end)
        yield from (span for span in spans if span.end - span.begin > SHORTEST)
    elif role.startswith(WORK):
        yield Span("work", name, begin, end)
    elif role == "carry":
        yield Span("carry", "carries the part", begin, end)
    elif role.startswith("transfer"):
        yield Span("move", role, begin, end)
    else:
        yield Span("rest", role.replace("hold", "stands"), begin, end)


def _work(task: Task, record: Record, begin: float, end: float) -> Iterator[Span]:
    """A task from the begin of its phase to the end, in [s]."""
    first, last = begin + record["start_s"], begin + record["end_s"]
    moves = first + (task.process.on_delay_s if task.process else 0.0)
    off, leaves = last + task.off_delay, last + task.off_delay + task.dwell
    yield Span("move" if task.approach else "rest", "approach" if task.approach else "waits", begin, first)
    yield Span("delay", "process on, tool at rest", first, moves)
    yield Span("work", task.name, moves, last)
    yield Span("delay", "process on, tool at rest", last, off)
    yield Span("dwell", "dwell", off, leaves)
    yield Span("move" if task.retract else "rest", "retract" if task.retract else "waits", leaves, end)
    if task.settle > 0.0:
        yield Span("settle", "settling: tool errors are not judged", first, first + task.settle)
    if task.process is not None:
        on, off = (begin + at for at in record["process_on_s"]) if "process_on_s" in record else (first, off)
        ends = [on, *(begin + at for rapid in record.get("process_off_s", ()) for at in rapid), off]
        for on, until in zip(ends[0::2], ends[1::2], strict=True):
            yield Span("process", f"process of {task.name} on", on, until)


def _ticks(total: float) -> list[float]:
    """Round times in [s] from 0 to the end of the axis."""
    unit = 10.0 ** math.floor(math.log10(total / MAX_TICKS))
    step = next(unit * step for step in STEPS if MAX_TICKS * unit * step >= total * (1.0 - SHORTEST))
    return [step * k for k in range(math.floor(total / step * (1.0 + SHORTEST)) + 1)]


def _placed(span: Span, total: float) -> dict[str, Any]:
    return {
        "kind": span.kind,
        "text": span.text,
        "begin": span.begin,
        "end": span.end,
        "left": _percent(span.begin, total),
        "width": _percent(span.end - span.begin, total),
    }


def _percent(value: float, total: float) -> float:
    return round(100.0 * value / total, 3)
