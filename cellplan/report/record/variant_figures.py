"""Figures of a whole program for the comparison with other programs, from its records, just made or on disk."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.record.common import Number, Record, number
from cellplan.report.record.key_figures import KeyFigures

INTERVALS: Final = 240  # of the cycle, for curves
CURVE_DIGITS: Final = 4  # [-] significant, for curves
MAX_FAILED: Final = 20  # failed checks that are listed; their number is given as well
ROLES: Final = ("positioner", "operator", "idle")  # a robot has the first of them that it ever has


class JointFigures(TypedDict):
    """Use of a joint in the whole program."""

    range_ratio: Annotated[
        Number, "largest distance from the middle of its range as a fraction of half the range; null if it is endless"
    ]
    velocity_ratio: Annotated[Number, "largest speed as a fraction of its limit"]
    acceleration_ratio: Annotated[Number, "largest acceleration as a fraction of its limit; null if it is not judged"]
    travel: Annotated[Number, "sum of all distances travelled, in `unit`"]
    unit: Annotated[str, "`deg` or `mm`"]


class RobotFigures(TypedDict):
    """Work of a robot in the whole program."""

    role: Annotated[str, "`positioner`, `operator` or `idle`"]
    load_s: Annotated[Number, "load: for all joints added up, the time that a joint needs for its travel at top speed"]
    phase_load_s: Annotated[Number, "its load in the phase in which that is largest; `load_s` for a single phase"]
    work_load_s: Annotated[Number, "its load in the phases in which a task is worked on"]
    motion_share: Annotated[Number, "its load as a fraction of that of all robots"]
    joints: Annotated[dict[str, JointFigures], "by joint"]


class CurvesRecord(TypedDict):
    """Curves for plots: the extreme of each of 240 intervals of the cycle."""

    times_s: Annotated[list[Number], "middle of each interval"]
    velocity_ratio: Annotated[dict[str, list[Number]], "by robot: largest joint speed as a fraction of its limit"]
    clearance_times_s: Annotated[list[Number], "times of `clearance_mm`; empty if it is not known"]
    clearance_mm: Annotated[list[Number], "distance of all bodies, never above the true one"]


class _WorstJoints(TypedDict):
    min_margin_deg: Number
    min_margin_joint: str | None
    max_velocity_ratio: Number
    max_velocity_joint: str | None
    max_acceleration_ratio: Number
    max_acceleration_joint: str | None


class _WorkPeaks(TypedDict):
    work_velocity_ratio: Number
    work_velocity_joint: str | None
    work_acceleration_ratio: Number
    work_acceleration_joint: str | None


class VariantFigures(KeyFigures):
    """Figures of a program over all its phases; tool errors count once the tools have settled."""

    work_velocity_ratio: Annotated[Number, "as `max_velocity_ratio`, of the phases in which a task is worked on"]
    work_velocity_joint: Annotated[str | None, "that joint"]
    work_acceleration_ratio: Annotated[Number, "as `max_acceleration_ratio`, of these phases"]
    work_acceleration_joint: Annotated[str | None, "that joint"]
    min_clearance_certified: Annotated[bool, "whether that distance is proved between the rows too"]
    mean_velocity_ratio: Annotated[Number, "load of all robots divided by the cycle time and the number of joints"]
    positioner_load_s: Annotated[Number, "load of the robots that hold the part"]
    positioner_phase_load_s: Annotated[Number, "the same in the phase in which it is largest"]
    operator_load_s: Annotated[Number, "load of all other robots"]
    operator_work_load_s: Annotated[Number, "the same in the phases in which a task is worked on"]
    load_s: Annotated[Number, "load of all robots"]
    robots: Annotated[dict[str, RobotFigures], "by robot"]
    tasks: Annotated[dict[str, dict[str, Number]], "by task: `position_error_mm` and `orientation_error_deg`"]
    failed: Annotated[list[str], "the first 20 checks that failed, each with place and time"]
    not_in_program: Annotated[list[str], "moves that the program, and so its cycle time, leaves out"]
    required_clearance_mm: Annotated[Number, "`checks.clearance_mm`"]
    proof: Annotated[str, "`solved`, `verified`, or why a run on disk was not verified again"]


def variant_figures(record: Record, phases: Mapping[str, Record], *, proof: str) -> VariantFigures:
    """The figures of a program.

    Args:
        record: Its ``report.json``.
        phases: The ``report.json`` of each of its phases, in their order.
        proof: See ``VariantFigures``.
    """
    robots = _robots(record, list(phases.values()))
    loads = _loads(record)
    holders = [name for name, robot in robots.items() if robot["role"] == "positioner"]
    holding = sum(loads[name] for name in holders)
    hardest = max((sum(_loads(phase)[name] for name in holders) for phase in phases.values()), default=0.0)
    total, joints = sum(loads.values()), sum(len(each) for each in record["joints"].values())
    cycle = record["cycle_time_s"]
    tasks = {name: _tool_errors(task) for name, task in record["tasks"].items()}
    clearance = record["clearance"]["whole"]
    failed = [check for check in record["checks"] if not check["passed"]]
    speeds = [speed["tool_peak_mm_s"] for phase in phases.values() for speed in phase["speeds"].values()]
    return {
        "cycle_time_s": cycle,
        "failed_checks": len(failed),
        "max_position_error_mm": max((task["position_error_mm"] or 0.0 for task in tasks.values()), default=0.0),
        "max_orientation_error_deg": max(
            (task["orientation_error_deg"] or 0.0 for task in tasks.values()), default=0.0
        ),
        **_worst_joints(record),
        **_work_peaks(record, phases.values()),
        "min_clearance_mm": clearance["minimum_mm"],
        "min_clearance_pair": " - ".join(clearance["pair"]) if clearance["pair"] else None,
        "min_clearance_certified": clearance["certified"],
        "max_tool_speed_mm_s": max((speed or 0.0 for speed in speeds), default=0.0),
        "mean_velocity_ratio": number(total / (cycle * joints)) if cycle and joints else None,
        "positioner_load_s": number(holding),
        "positioner_phase_load_s": number(hardest),
        "operator_load_s": number(total - holding),
        "operator_work_load_s": number(
            sum(robot["work_load_s"] or 0.0 for name, robot in robots.items() if name not in holders)
        ),
        "load_s": number(total),
        "robots": robots,
        "tasks": tasks,
        "failed": [_with_phase(check) for check in failed[:MAX_FAILED]],
        "not_in_program": list(record["not_in_program"]),
        "required_clearance_mm": record["required_clearance_mm"],
        "proof": proof,
    }


def variant_curves(record: Record, phases: Sequence[Record], clearance: tuple[Array, Array] | None) -> CurvesRecord:
    """Curves of a program whose phases follow one another.

    Args:
        record: The ``report.json`` of the program: the limits of all joints.
        phases: The ``series.json`` of each phase.
        clearance: Times in [s] and smallest distances of all bodies in [m], shape (K,) each; None if not known.
    """
    found: dict[str, list[Array]] = {robot: [] for robot in record["joints"]}
    times, begin = [], 0.0
    for phase in phases:
        own = np.asarray(phase["times_s"], dtype=np.float64)
        times.append(begin + 0.5 * (own[1:] + own[:-1]))
        begin += float(own[-1])
        for robot, joints in record["joints"].items():
            found[robot].append(_speed_ratio(joints, phase["joints"][robot]))
    middle = np.concatenate(times)
    place = np.minimum((INTERVALS * middle / begin).astype(np.int64), INTERVALS - 1)
    kept, first = np.unique(place, return_index=True)
    at, distance = clearance or (np.empty(0), np.empty(0))
    return {
        "times_s": _short((kept + 0.5) * begin / INTERVALS),
        "velocity_ratio": {
            robot: _short(np.maximum.reduceat(np.concatenate(ratios), first)) for robot, ratios in found.items()
        },
        "clearance_times_s": _short(at),
        "clearance_mm": _short(1e3 * distance),
    }


def _speed_ratio(joints: Record, series: Record) -> Array:
    """Largest speed of the joints of a robot as a fraction of the limit, by step."""
    ratios = []
    for name, joint in joints.items():
        speed = np.abs(np.asarray(series[name][f"speed_{joint['unit']}_s"], dtype=np.float64))
        limit = joint["velocity_limit"]
        ratios.append(speed / limit if limit else np.zeros_like(speed))
    return np.max(ratios, axis=0)


def _short(values: Array) -> list[Number]:
    """Numbers for a plot."""
    return [float(f"{value:.{CURVE_DIGITS}g}") + 0.0 if math.isfinite(value) else None for value in values]


def _robots(record: Record, phases: Sequence[Record]) -> dict[str, RobotFigures]:
    """Work of each robot."""
    roles: dict[str, list[str]] = {}
    for phase in phases:
        for robot, share in phase["motion_share"].items():
            roles.setdefault(robot, []).append(share["role"])
    loads, by_phase = _loads(record), [_loads(phase) for phase in phases]
    at_work = [_loads(phase) for phase in _at_work(record, phases)]
    total = sum(loads.values())
    return {
        robot: {
            "role": min(roles.get(robot, ["idle"]), key=ROLES.index),
            "load_s": number(loads[robot]),
            "phase_load_s": number(max((each[robot] for each in by_phase), default=0.0)),
            "work_load_s": number(sum(each[robot] for each in at_work)),
            "motion_share": number(loads[robot] / total if total else 0.0),
            "joints": {name: _joint(joint) for name, joint in joints.items()},
        }
        for robot, joints in record["joints"].items()
    }


def _loads(record: Record) -> dict[str, float]:
    """Load in [s] of each robot; a joint without a limit adds nothing."""
    return {
        robot: sum(joint["travel"] / joint["velocity_limit"] for joint in joints.values() if joint["velocity_limit"])
        for robot, joints in record["joints"].items()
    }


def _at_work(record: Record, phases: Iterable[Record]) -> list[Record]:
    """The phases in which a task is worked on."""
    return [phase for phase in phases if not record["tasks"].keys().isdisjoint(phase["tasks"])]


def _joint(joint: Record) -> JointFigures:
    """Use of one joint."""
    lower, upper, margin = joint["lower"], joint["upper"], joint["margin"]
    half = None if None in {lower, upper} or margin is None else 0.5 * (upper - lower)
    return {
        "range_ratio": number(1.0 - margin / half) if half else None,
        "velocity_ratio": joint["velocity_ratio"],
        "acceleration_ratio": joint.get("acceleration_ratio"),
        "travel": joint["travel"],
        "unit": joint["unit"],
    }


def _worst_joints(record: Record) -> _WorstJoints:
    """The worst joint for each of margin, velocity and acceleration."""
    named = {f"{robot}/{name}": joint for robot, joints in record["joints"].items() for name, joint in joints.items()}
    bounded = {name: use["margin"] for name, use in named.items() if use["unit"] == "deg" and use["margin"] is not None}
    speeds = {name: math.inf if (ratio := use["velocity_ratio"]) is None else ratio for name, use in named.items()}
    hard = {name: ratio for name, use in named.items() if (ratio := use.get("acceleration_ratio")) is not None}
    near = min(bounded, key=lambda name: bounded[name], default=None)
    fast = max(speeds, key=lambda name: speeds[name], default=None)
    hardest = max(hard, key=lambda name: hard[name], default=None)
    return {
        "min_margin_deg": bounded.get(near or ""),
        "min_margin_joint": near,
        "max_velocity_ratio": number(speeds.get(fast or "")),
        "max_velocity_joint": fast,
        "max_acceleration_ratio": hard.get(hardest or ""),
        "max_acceleration_joint": hardest,
    }


def _work_peaks(record: Record, phases: Iterable[Record]) -> _WorkPeaks:
    """The largest velocity and acceleration of the phases in which a task is worked on, not of moves between them."""
    at_work = [_worst_joints(phase) for phase in _at_work(record, phases)]
    fast = max(at_work, key=lambda each: each["max_velocity_ratio"] or 0.0, default=None)
    hard = max(at_work, key=lambda each: each["max_acceleration_ratio"] or 0.0, default=None)
    return {
        "work_velocity_ratio": fast["max_velocity_ratio"] if fast else None,
        "work_velocity_joint": fast["max_velocity_joint"] if fast else None,
        "work_acceleration_ratio": hard["max_acceleration_ratio"] if hard else None,
        "work_acceleration_joint": hard["max_acceleration_joint"] if hard else None,
    }


def _tool_errors(task: Record) -> dict[str, Number]:
    """Largest errors of a tool, at the rows or between them."""
    return {
        "position_error_mm": _largest(task, "max_position_error_mm", "max_position_error_between_rows_mm"),
        "orientation_error_deg": _largest(task, "max_orientation_error_deg", "max_orientation_error_between_rows_deg"),
    }


def _largest(task: Record, *keys: str) -> Number:
    """The largest of some values, those that are not known left out."""
    return max((task[key] for key in keys if task.get(key) is not None), default=None)


def _with_phase(check: Record) -> str:
    """A failed check with the phase it is of, where there are several."""
    return f"{check['run']}: {check['message']}" if "run" in check else str(check["message"])
