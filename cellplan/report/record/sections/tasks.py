"""Tasks in the record of a run: tool errors, tool depth, direction of the path, process speed."""

from collections.abc import Iterable
from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.acceleration import ProcessSpeed
from cellplan.model.cell.cell import Cell
from cellplan.model.report.greatest_feed import GreatestFeed
from cellplan.model.report.report import Report, Standoff, TaskAccuracy, ToolDepth
from cellplan.model.task.path_direction import run_direction
from cellplan.model.task.task import Task
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import AXES, Number, Record, entry_record, number
from cellplan.report.record.sections.smoothing import SmoothedRecord, smoothed_record
from cellplan.report.record.sections.tool_errors import BetweenRowsRecord, between_record, by_axis, largest, mean_length

AS_LISTED: Final = "as listed"
AXIS_TOL: Final = 1e-9  # [-] a direction this close to an axis is named after it
AXIS: Final = "axis"
MAX_INTERVALS: Final = 100  # intervals of lower speed that are listed; their number is given as well


class _ToleranceRecord(TypedDict):
    position_mm: Annotated[Number, "admissible distance at the rows of the table"]
    orientation_deg: Annotated[Number, "admissible angle at the rows of the table"]


BETWEEN_ROWS: Final = ("between_rows_mm", "between_rows_deg")


class ToleranceRecord(_ToleranceRecord, total=False):
    """Admissible tool errors."""

    between_rows_mm: Annotated[Number, "admissible distance between the rows"]
    between_rows_deg: Annotated[Number, "admissible angle between the rows"]


class DirectionRecord(TypedDict):
    """Direction of travel along a path."""

    direction: Annotated[str, "`counterclockwise` or `clockwise` for a closed path, `as listed` for others"]
    direction_seen_from: Annotated[
        str | list[Number] | None, "side from which a closed path is seen: `+z`, or the components of a direction"
    ]


class ProcessSpeedRecord(TypedDict):
    """Speed of the tool tip relative to the part, on its path, once settled, without its runs."""

    mean_mm_s: Annotated[Number, "mean speed"]
    peak_mm_s: Annotated[Number, "largest speed"]
    peak_at_s: Annotated[Number, "its time"]
    steady_share: Annotated[Number, "fraction of that time in which the speed is within 5 % of the peak"]
    slower_count: Annotated[int, "number of intervals in which it is lower"]
    slower_at_s: Annotated[list[list[Number]], "the first 100 of them as `[from, to]`"]


class DepthRecord(TypedDict, total=False):
    """Depth of a tool in the part; not for tasks in the world."""

    max_tool_depth_mm: Annotated[
        Number, "largest length of tool inside the part or beyond it, along the tool's axis from where it enters"
    ]
    max_tool_depth_at_s: Annotated[Number, "its time"]
    deepest_body: Annotated[str, "deepest body of the tool, or `axis`"]
    allowed_tool_depth_mm: Annotated[Number, "admissible depth"]


class StandoffRecord(TypedDict, total=False):
    """Distance of a tool tip from the part along its path; not for tasks in the world."""

    min_standoff_mm: Annotated[Number, "smallest distance of the tip from the part; 0 where it is inside"]
    max_standoff_mm: Annotated[Number, "largest one"]
    min_standoff_along_axis_mm: Annotated[
        Number, "smallest distance along the tool's axis; null where it meets nothing"
    ]
    max_standoff_along_axis_mm: Annotated[Number, "largest one; null where the axis does not meet the part somewhere"]
    standoff_mm: Annotated[list[Number] | None, "stated distances; null where none are"]
    off_part_mm: Annotated[dict[str, Number], "by stretch that the task excuses: its length"]


class PhaseOfTask(TypedDict, total=False):
    """Only of a program with several phases."""

    phase: Annotated[str, "phase in which it is worked on, from whose begin its times count"]


class RapidsRecord(TypedDict, total=False):
    """Only of a path with rapids."""

    process_off_s: Annotated[list[list[Number]], "begin and end of each rapid move along the path: the process is off"]


class RunsRecord(TypedDict, total=False):
    """Only of a path with runs, which are in its length."""

    run_in_mm: Annotated[Number, "length of the run-in, with its arc and its slope"]
    run_out_mm: Annotated[Number, "length of the run-out, likewise"]
    process_on_s: Annotated[list[Number], "times between which the process is on"]


class TiltRecord(TypedDict, total=False):
    """Only of a tool whose axis may lean; its orientation errors count from the cone on."""

    max_tilt_deg: Annotated[Number, "largest angle of the tool's axis from the desired one in the rows"]
    allowed_tilt_deg: Annotated[Number, "half angle of the cone within which it may lean"]


class GreatestFeedRecord(TypedDict):
    """The greatest constant feed along the same joint path, and what binds where it is least."""

    feed_mm_s: Annotated[Number, "feed at which the path is run along"]
    greatest_mm_s: Annotated[Number, "greatest feed at which all limits hold, by what scales with time"]
    binding: Annotated[str, "robot and joint that binds, the robot whose tool does, or the task"]
    limit: Annotated[str, "`velocity`, `acceleration`, `jerk`, `tool speed` or `tolerance between rows`"]
    at_mm: Annotated[Number, "place on the path, from its start"]
    at_s: Annotated[Number, "its time"]
    point: Annotated[str, "point of the file that is nearest, with its line; empty for a path without a file"]
    in_ramp: Annotated[bool, "whether the tool speeds up or slows down there"]


class GreatestRecord(TypedDict, total=False):
    """Only of a task with one feed that is held."""

    greatest_feed: Annotated[GreatestFeedRecord, "greatest constant feed, and what binds"]


class TaskRecord(
    BetweenRowsRecord,
    DepthRecord,
    StandoffRecord,
    DirectionRecord,
    RapidsRecord,
    RunsRecord,
    TiltRecord,
    GreatestRecord,
    SmoothedRecord,
    PhaseOfTask,
):
    """Tool error of a task, desired minus actual, over the components that the task constrains."""

    robot: Annotated[str, "the operator"]
    relative_to: Annotated[str, "`part` or `world`: frame in which the task is given"]
    max_position_error_mm: Annotated[Number, "largest distance from the desired position"]
    max_position_error_at_s: Annotated[Number, "its time"]
    mean_position_error_mm: Annotated[Number, "mean distance over all samples"]
    max_position_error_by_axis_mm: Annotated[dict[str, Number], "largest amount along `x`, `y`, `z` of the part frame"]
    max_position_error_with_settling_mm: Annotated[Number, "largest distance, settling included"]
    max_orientation_error_deg: Annotated[Number, "largest angle from the desired orientation"]
    max_orientation_error_at_s: Annotated[Number, "its time"]
    mean_orientation_error_deg: Annotated[Number, "mean angle over all samples"]
    max_orientation_error_by_axis_deg: Annotated[
        dict[str, Number], "largest amount of the rotation vector about `rx`, `ry`, `rz` of the part frame"
    ]
    max_orientation_error_with_settling_deg: Annotated[Number, "largest angle, settling included"]
    settle_s: Annotated[Number, "time in which the tool may move onto its path"]
    judged_from_s: Annotated[Number, "time from which the tool error is evaluated"]
    tolerance: Annotated[ToleranceRecord, "admissible errors"]
    axes: Annotated[list[str], "constrained components"]
    path_length_mm: Annotated[Number, "length of the path on the surface"]
    path_bulge_mm: Annotated[
        Number, "largest distance of a smooth path from the straight lines between its points; null for other paths"
    ]
    cycles: Annotated[int, "number of passes along the path"]
    start_s: Annotated[Number, "start of the path"]
    end_s: Annotated[Number, "end of the path"]
    process_speed: Annotated[ProcessSpeedRecord | None, "speed along the path; null for a tool at rest"]


def tasks_record(report: Report, cell: Cell) -> dict[str, TaskRecord]:
    """Everything about each task of a run, by name."""
    depths = {depth.task: depth for depth in report.depths}
    tips = {tip.task: tip for tip in report.standoffs}
    return {
        accuracy.task: _task_record(
            accuracy, report, cell, depth=depths.get(accuracy.task), tip=tips.get(accuracy.task)
        )
        for accuracy in report.accuracy
    }


def _task_record(
    accuracy: TaskAccuracy, report: Report, cell: Cell, *, depth: ToolDepth | None, tip: Standoff | None
) -> TaskRecord:
    task = cell.task(accuracy.task)
    first = task.first_judged(report.times)
    times = report.times[first:]
    position, orientation = MM * accuracy.position_error, np.rad2deg(accuracy.orientation_error)
    max_position, at_position = largest(position[first:])
    max_orientation, at_orientation = largest(orientation[first:])
    return {
        "robot": accuracy.robot,
        "relative_to": str(task.relative_to),
        "max_position_error_mm": number(max_position),
        "max_position_error_at_s": number(times[at_position]),
        "mean_position_error_mm": number(mean_length(position[first:])),
        "max_position_error_by_axis_mm": by_axis(position[first:], AXES[:3]),
        "max_position_error_with_settling_mm": number(largest(position)[0]),
        "max_orientation_error_deg": number(max_orientation),
        "max_orientation_error_at_s": number(times[at_orientation]),
        "mean_orientation_error_deg": number(mean_length(orientation[first:])),
        "max_orientation_error_by_axis_deg": by_axis(orientation[first:], AXES[3:]),
        "max_orientation_error_with_settling_deg": number(largest(orientation)[0]),
        "settle_s": number(task.settle),
        "judged_from_s": number(task.judged_from),
        "tolerance": entry_record(task.tolerance.filled, without=() if accuracy.between else BETWEEN_ROWS),
        "axes": [AXES[index] for index in task.axes],
        "path_length_mm": number(MM * accuracy.path_length),
        "path_bulge_mm": number(accuracy.path_bulge, MM),
        "cycles": task.repeat,
        "start_s": number(accuracy.start_s),
        "end_s": number(accuracy.end_s),
        **_rapids_record(accuracy),
        **_runs_record(accuracy),
        **_tilt_record(accuracy, task),
        **_greatest_record(report, task),
        **smoothed_record(accuracy.listed, task),
        **_phase_of(report),
        **direction_record(task),
        **between_record(accuracy.between),
        **_depth_record(depth),
        **_standoff_record(tip, task),
        "process_speed": _process_record(report.accelerations.process.get(task.name)),
    }


def _rapids_record(accuracy: TaskAccuracy) -> RapidsRecord:
    """When the process of a task is off along its path; nothing where it is on throughout."""
    off = [[number(begin), number(end)] for begin, end in accuracy.process_off]
    return {"process_off_s": off} if off else {}


def _runs_record(accuracy: TaskAccuracy) -> RunsRecord:
    """Runs of a path, and when its process is on; nothing without."""
    if not any(accuracy.runs):
        return {}
    run_in, run_out = (number(MM * run) for run in accuracy.runs)
    return {"run_in_mm": run_in, "run_out_mm": run_out, "process_on_s": [number(at) for at in accuracy.process_on]}


def _greatest_record(report: Report, task: Task) -> GreatestRecord:
    """The greatest feed of a task; nothing where it has none."""
    greatest = next((feed for feed in report.greatest_feeds if feed.task == task.name), None)
    return {} if greatest is None else {"greatest_feed": greatest_feed_record(greatest)}


def greatest_feed_record(greatest: GreatestFeed) -> GreatestFeedRecord:
    """The greatest feed of a task in printed units."""
    return {
        "feed_mm_s": number(greatest.feed, MM),
        "greatest_mm_s": number(greatest.greatest, MM),
        "binding": greatest.binding,
        "limit": greatest.kind,
        "at_mm": number(greatest.at, MM),
        "at_s": number(greatest.at_s),
        "point": greatest.point,
        "in_ramp": greatest.is_in_ramp,
    }


def _tilt_record(accuracy: TaskAccuracy, task: Task) -> TiltRecord:
    """How far the axis of a tool leans, where it may."""
    if accuracy.lean is None:
        return {}
    return {"max_tilt_deg": number(accuracy.lean, DEG), "allowed_tilt_deg": number(task.tilt, DEG)}


def _phase_of(report: Report) -> PhaseOfTask:
    """The phase of a report; nothing of the only one."""
    return {} if report.phase is None else {"phase": report.phase}


def direction_record(task: Task) -> DirectionRecord:
    """Direction of travel along a closed path and the side it is seen from; ``as listed`` for an open one."""
    direction, outside = run_direction(task)
    if direction is None or outside is None:
        return {"direction": AS_LISTED, "direction_seen_from": None}
    return {"direction": str(direction), "direction_seen_from": _named(outside)}


def direction_text(record: Record) -> str:
    """The direction of travel as text, ``clockwise seen from +z``."""
    seen_from = record["direction_seen_from"]
    if seen_from is None:
        return str(record["direction"])
    return f"{record['direction']} seen from {seen_from if isinstance(seen_from, str) else _listed(seen_from)}"


def _depth_record(depth: ToolDepth | None) -> DepthRecord:
    """Depth of the tool of a task; empty for a task in the world."""
    if depth is None:
        return {}
    return {
        "max_tool_depth_mm": number(MM * depth.depth),
        "max_tool_depth_at_s": number(depth.at_s),
        "deepest_body": depth.body if depth.body == AXIS else f"{depth.robot}/{depth.body}",
        "allowed_tool_depth_mm": number(MM * depth.limit),
    }


def _standoff_record(tip: Standoff | None, task: Task) -> StandoffRecord:
    """Distance of the tip of a task; empty for a task in the world."""
    if tip is None:
        return {}
    return {
        "min_standoff_mm": number(MM * tip.nearest[0]),
        "max_standoff_mm": number(MM * tip.nearest[1]),
        "min_standoff_along_axis_mm": number(MM * tip.along[0]),
        "max_standoff_along_axis_mm": number(MM * tip.along[1]),
        "standoff_mm": None if task.standoff is None else [number(MM * value) for value in task.standoff],
        "off_part_mm": {name: number(MM * length) for name, length in tip.excused.items()},
    }


def _process_record(speed: ProcessSpeed | None) -> ProcessSpeedRecord | None:
    """Speed of a tool tip along its path; None for a tool at rest."""
    if speed is None:
        return None
    return {
        "mean_mm_s": number(MM * speed.mean),
        "peak_mm_s": number(MM * speed.peak),
        "peak_at_s": number(speed.peak_at_s),
        "steady_share": number(speed.steady_share),
        "slower_count": len(speed.slower),
        "slower_at_s": [[number(first), number(last)] for first, last in speed.slower[:MAX_INTERVALS]],
    }


def _named(direction: Array) -> str | list[Number]:
    """``+z`` for an axis, else the components."""
    for axis, letter in enumerate("xyz"):
        rest = [float(abs(value)) for k, value in enumerate(direction) if k != axis]
        if max(rest) <= AXIS_TOL:
            return f"{'+' if direction[axis] > 0.0 else '-'}{letter}"
    return [number(float(value)) for value in direction]


def _listed(components: Iterable[Number]) -> str:
    """Components of a direction with four decimals."""
    return f"[{', '.join(f'{round(value or 0.0, 4) + 0.0:g}' for value in components)}]"
