"""The tables of results: of what was solved, verified, searched and screened, and of the files of all these."""

from collections.abc import Iterator, Mapping
from functools import singledispatch
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.files import read_regular_file
from cellplan.files.input.json_reader import parse_json
from cellplan.files.run.folder import MANIFEST
from cellplan.files.run.stored import read_stored_run
from cellplan.geometry.transforms import rpy_from_rotation
from cellplan.jobs.present.kinds import OF_JOBS, record_of, record_tables
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.plan import ALL_TASKS
from cellplan.model.report.report import Report
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.robot.robot import Joint
from cellplan.model.task.task import Task
from cellplan.model.units import DEG, MM
from cellplan.planning.layout_screening import Screening
from cellplan.programs.formats.wide import wide_columns
from cellplan.programs.wide_table import solution_rows, verified_rows
from cellplan.report.record.common import Provenance, Record, check_record, number
from cellplan.report.record.rows import Row, Tables, columns_of, curve_columns, run_tables
from cellplan.report.record.run import run_record
from cellplan.report.record.sections.clearance import (
    clearance_record,
    closest_pairs_record,
    contacts_record,
    left_out_record,
)
from cellplan.report.record.sections.joints import joints_record
from cellplan.report.record.sections.world_motion import speed_record
from cellplan.report.record.series import series
from cellplan.runs.solution import Solution

LARGEST: Final = 500_000_000  # [bytes] of a file with a record
NOWHERE: Final = Provenance(versions={}, digests={})
POSE: tuple[str, ...] = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")


@singledispatch
def tables_of(result: object) -> Tables:
    """The tables of a result by name, each made when it is called.

    Args:
        result: The result; also a record of a JSON file, or the path of such a file or of its folder.

    Raises:
        InputError: It is no result that has tables.
    """
    record = record_of(result)
    if record is not None:
        return record_tables(record)
    raise InputError(f"to_frame: expected a result, a record or a path, got {type(result).__name__}")


@tables_of.register
def _(result: Mapping) -> Tables:  # type: ignore[type-arg]
    tables = record_tables(result)
    if not tables:
        raise InputError(f"to_frame: expected a record of cellplan, got one with schema {result.get('schema')!r}")
    return tables


@tables_of.register
def _(result: Path) -> Tables:
    if _is_run(result):
        stored = read_stored_run(result)
        phases = {record.get("phase"): place for place, record in stored.records.items()}
        tables = run_tables(list(stored.records.values()))
        return {**tables, "curves": lambda: _joined({name: stored.series(place) for name, place in phases.items()})}
    return tables_of(record_at(result))


@tables_of.register
def _(result: Cell) -> Tables:
    return cell_tables(result)


@tables_of.register
def _(result: Solution) -> Tables:
    records = [run_record(run, provenance=NOWHERE) for run in result.runs]
    return {"motion": lambda: wide_columns(solution_rows(result)), **run_tables(records)}


@tables_of.register
def _(result: VerifiedRun) -> Tables:
    records = [run_record(motion, provenance=NOWHERE) for motion in result.motions]
    return {"motion": lambda: wide_columns(verified_rows(result)), **run_tables(records)}


@tables_of.register
def _(result: Report) -> Tables:
    clearance = result.clearance
    record: dict[str, Any] = {
        "phase": result.phase,
        "checks": list(map(check_record, result.checks)),
        "joints": joints_record(result.joints, result.accelerations.joints),
        "tasks": _tool_errors(result),
        "clearance": clearance_record(clearance.minima),
        "closest_pairs": closest_pairs_record(clearance),
        "contacts": contacts_record(clearance),
        "left_out": left_out_record(clearance.left_out),
        "speeds": {robot: speed_record(speed) for robot, speed in result.speeds.items()},
    }
    tables = run_tables([record])
    del tables["motion_share"]  # who is at work is known to the cell alone
    return {**tables, "curves": lambda: curve_columns(series(result)), "distances": lambda: _distances(result)}


@tables_of.register
def _(result: Screening) -> Tables:
    return {"candidates": lambda: _candidates(result), "joints": lambda: columns_of(_candidate_joints(result))}


def record_at(path: Path) -> Record:
    """The record of a JSON file, or of the folder of a run, a study, a map, a repair or a rehearsal.

    Raises:
        InputError: There is none, or it cannot be read.
    """
    if _is_run(path):
        return read_stored_run(path).record
    names = [kind.file for kind in OF_JOBS]
    file = next((path / name for name in names if (path / name).exists()), path) if path.is_dir() else path
    return parse_json(read_regular_file(file, file=str(file), limit=LARGEST), str(file))


def _is_run(path: Path) -> bool:
    return all((path / name).is_file() for name in (MANIFEST, "report.json"))


def _joined(phases: Mapping[str | None, Mapping[str, Any]]) -> dict[str, Any]:
    """The curves of all phases, one after the other, each on its own time."""
    curves = {name or ALL_TASKS: curve_columns(tree) for name, tree in phases.items()}
    names = dict.fromkeys(name for columns in curves.values() for name in columns)
    joined: dict[str, Any] = {"phase": []} | {name: [] for name in names}
    for phase, columns in curves.items():
        count = len(columns["time_s"])
        joined["phase"] += [phase] * count
        for name in names:
            joined[name] += columns.get(name, [None] * count)
    return joined


def _tool_errors(report: Report) -> dict[str, Row]:
    """Tool errors of each task, settling included; what is allowed is known to the cell alone."""
    errors = {}
    for accuracy in report.accuracy:
        position, orientation = (
            np.linalg.norm(e, axis=1) for e in (accuracy.position_error, accuracy.orientation_error)
        )
        errors[accuracy.task] = {
            "robot": accuracy.robot,
            "max_position_error_with_settling_mm": number(MM * float(position.max())),
            "max_orientation_error_with_settling_deg": number(DEG * float(orientation.max())),
            "path_length_mm": number(MM * accuracy.path_length),
            "start_s": number(accuracy.start_s),
            "end_s": number(accuracy.end_s),
        }
    return errors


def _distances(report: Report) -> dict[str, Any]:
    """The distance that each class of pairs keeps, over time."""
    clearance = report.clearance
    curves = {f"clearance_{kind}_mm": MM * curve for kind, curve in clearance.curves.items()}
    return {"time_s": clearance.curve_times, **curves}


def _candidates(screening: Screening) -> dict[str, Any]:
    """A row for each layout; the joint that leaves least of its range and the fastest one, as shares."""
    return {
        "candidate": np.arange(len(screening.start)),
        "is_followed": screening.is_followed,
        "is_feasible": screening.is_feasible,
        "lost_at_s": np.where(np.isfinite(screening.lost_at), screening.lost_at, np.nan),
        "reached_start": screening.lost_at >= 0.0,
        "error_m_or_rad": screening.error,
        "max_velocity_ratio": screening.speed_ratios.max(axis=1, initial=0.0),
        **_margins(screening),
    }


def _margins(screening: Screening) -> dict[str, Any]:
    """Smallest margin of the turning joints and of the sliding ones of each layout, where the cell is known."""
    if screening.cell is None:
        return {}
    joints = [joint for robot in screening.cell.robots for joint in robot.model.joints]
    columns = {}
    for name, is_revolute in (("deg", True), ("mm", False)):
        revolute = [index for index, joint in enumerate(joints) if joint.is_revolute == is_revolute]
        if revolute:
            columns[f"min_margin_{name}"] = joints[revolute[0]].display_unit.scale * screening.margins[:, revolute].min(
                axis=1
            )
    return columns


def _candidate_joints(screening: Screening) -> Iterator[Row]:
    """A row for each joint of each layout, in the unit of the joint."""
    if screening.cell is None:
        return
    joints = [(robot.name, joint) for robot in screening.cell.robots for joint in robot.model.joints]
    for candidate in range(len(screening.start)):
        for index, (robot, joint) in enumerate(joints):
            unit, scale = joint.display_unit
            yield {
                "candidate": candidate,
                "robot": robot,
                "joint": joint.name,
                "unit": unit,
                "start": number(scale * float(screening.start[candidate, index])),
                "margin": number(scale * float(screening.margins[candidate, index])),
                "velocity_ratio": number(float(screening.speed_ratios[candidate, index])),
            }


def cell_tables(cell: Cell) -> Tables:
    """The tables of a cell, in the units of its file."""
    return {
        "robots": lambda: columns_of(_robot_row(cell, robot) for robot in cell.robots),
        "joints": lambda: columns_of(_joint_rows(cell)),
        "tasks": lambda: columns_of(map(_task_row, cell.tasks)),
    }


def role_of(cell: Cell, robot: str) -> str:
    """``positioner``, ``operator`` or ``idle``."""
    if robot in cell.positioners:
        return "positioner"
    return "operator" if any(task.robot == robot for task in cell.tasks) else "idle"


def _robot_row(cell: Cell, robot: Robot) -> Row:
    """A robot: its model, its role and the pose of its base in the world."""
    p, rpy = MM * robot.X_WB[:3, 3], DEG * rpy_from_rotation(robot.X_WB[:3, :3])
    pose = dict(zip(POSE, map(number, [*p.tolist(), *rpy.tolist()]), strict=True))
    names = {"robot": robot.name, "model": robot.model.name, "role": role_of(cell, robot.name)}
    return {**names, "joints": len(robot.model.joints), **pose}


def _joint_rows(cell: Cell) -> Iterator[Row]:
    """A joint with its limits, in its unit."""
    for robot in cell.robots:
        for index, joint in enumerate(robot.model.joints):
            start = None if robot.start is None else float(robot.start[index])
            yield {"robot": robot.name, "joint": joint.name, "unit": joint.display_unit.name, **_limits(joint, start)}


def _limits(joint: Joint, start: float | None) -> Row:
    scale = joint.display_unit.scale
    values = {
        "lower": joint.lower,
        "upper": joint.upper,
        "velocity_limit": joint.velocity,
        "acceleration_limit": joint.acceleration,
        "jerk_limit": joint.jerk,
        "start": start,
    }
    return {name: number(value, scale) for name, value in values.items()}


def _task_row(task: Task) -> Row:
    return {
        "task": task.name,
        "robot": task.robot,
        "path": type(task.path).__name__,
        "relative_to": str(task.relative_to),
        "start_s": number(task.start),
        "duration_s": number(task.duration),
        "feed_mm_s": number(task.feed, MM),
        "repeat": task.repeat,
        "position_tolerance_mm": number(task.tolerance.position_mm),
        "orientation_tolerance_deg": number(task.tolerance.orientation_deg),
    }
