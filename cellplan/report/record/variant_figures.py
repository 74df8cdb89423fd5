"""Figures of a whole program for the comparison with other programs, from its records, just made or on disk."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.record.common import Number, Record, number
from cellplan.report.record.figures import KEY, Figures

INTERVALS: Final = 240  # of the cycle, for curves
CURVE_DIGITS: Final = 4  # [-] significant, for curves
MAX_FAILED: Final = 20  # failed checks that are listed; their number is given as well
ROLES: Final = ("positioner", "operator", "idle")  # a robot has the first of them that it ever has


WORK: Final = ("velocity_ratio", "velocity_joint", "acceleration_ratio", "acceleration_joint")
SHOWN: Final = (
    *KEY[:10],
    *("work_velocity_ratio", "work_velocity_joint", "work_acceleration_ratio", "work_acceleration_joint"),
    *("min_clearance_mm", "min_clearance_pair", "min_clearance_certified", "max_tool_speed_mm_s", "energy_j"),
    *("mean_velocity_ratio", "positioner_load_s", "positioner_phase_load_s", "operator_load_s"),
    *(
        "operator_work_load_s",
        "load_s",
        "robots",
        "tasks",
        "failed",
        "not_in_program",
        "required_clearance_mm",
        "proof",
    ),
)


def variant_figures(record: Record, phases: Mapping[str, Record], *, proof: str) -> dict[str, Any]:
    """The figures of a program over its phases by the keys of ``SHOWN``; ``proof`` says why a run was not verified."""
    whole = Figures.of_record(record)
    by_phase = [whole.in_phases([name]) for name in whole.by_phase]
    tasks = zip(whole.by_phase, (phase["tasks"] for phase in phases.values()), strict=True)
    work = whole.in_phases(name for name, worked_on in tasks if not record["tasks"].keys().isdisjoint(worked_on))
    robots = _robots(record, phases.values(), whole, by_phase, work)
    holders = [name for name, robot in robots.items() if robot["role"] == "positioner"]
    holding = sum(_load(whole, name) for name in holders)
    total, joints = sum(whole.of("load_s").values()), len(whole.of("load_s"))
    failed = [check for check in record["checks"] if not check["passed"]]
    cycle = record["cycle_time_s"]
    figures = {
        **whole.record((*KEY, "energy_j")),
        **{f"work_{key}": work.recorded(f"max_{key}") for key in WORK},
        "cycle_time_s": cycle,
        "min_clearance_certified": record["clearance"]["whole"]["certified"],
        "mean_velocity_ratio": number(total / (cycle * joints)) if cycle and joints else None,
        "positioner_load_s": number(holding),
        "positioner_phase_load_s": number(
            max((sum(_load(phase, name) for name in holders) for phase in by_phase), default=0.0)
        ),
        "operator_load_s": number(total - holding),
        "operator_work_load_s": number(
            sum(robot["work_load_s"] or 0.0 for name, robot in robots.items() if name not in holders)
        ),
        "load_s": number(total),
        "robots": robots,
        "tasks": {
            name: {key: whole.of(f"max_{key}")[name] for key in ("position_error_mm", "orientation_error_deg")}
            for name in record["tasks"]
        },
        "failed": [
            ": ".join(check[key] for key in ("phase", "message") if key in check) for check in failed[:MAX_FAILED]
        ],
        "not_in_program": list(record["not_in_program"]),
        "required_clearance_mm": record["required_clearance_mm"],
        "proof": proof,
    }
    return {key: figures[key] for key in SHOWN}


def variant_curves(record: Record, phases: Sequence[Record], clearance: tuple[Array, Array] | None) -> dict[str, Any]:
    """Curves of a program whose phases follow one another.

    Args:
        record: The ``report.json`` of the program: the limits of all joints.
        clearance: Times in [s] and smallest distances of all bodies in [m], shape (K,) each; None if not known.
    """
    ratios_of_robots: dict[str, list[Array]] = {robot: [] for robot in record["joints"]}
    times, begin = [], 0.0
    for phase in phases:
        phase_times = np.asarray(phase["times_s"], dtype=np.float64)
        times.append(begin + 0.5 * (phase_times[1:] + phase_times[:-1]))
        begin += float(phase_times[-1])
        for robot, joints in record["joints"].items():
            ratios_of_robots[robot].append(_speed_ratio(joints, phase["joints"][robot]))
    middle = np.concatenate(times)
    place = np.minimum((INTERVALS * middle / begin).astype(np.int64), INTERVALS - 1)
    intervals, first = np.unique(place, return_index=True)
    at, distance = clearance or (np.empty(0), np.empty(0))
    return {
        "times_s": _short((intervals + 0.5) * begin / INTERVALS),
        "velocity_ratio": {
            robot: _short(np.maximum.reduceat(np.concatenate(ratios), first))
            for robot, ratios in ratios_of_robots.items()
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


def _robots(
    record: Record, phases: Iterable[Record], whole: Figures, by_phase: Sequence[Figures], work: Figures
) -> dict[str, dict[str, Any]]:
    """Work of each robot: its role, loads in all, in the hardest phase and at work, and the use of its joints."""
    roles: dict[str, list[str]] = {}
    for phase in phases:
        for robot, share in phase["motion_share"].items():
            roles.setdefault(robot, []).append(share["role"])
    total = sum(whole.of("load_s").values())
    return {
        robot: {
            "role": min(roles.get(robot, ["idle"]), key=ROLES.index),
            "load_s": number(_load(whole, robot)),
            "phase_load_s": number(max((_load(phase, robot) for phase in by_phase), default=0.0)),
            "work_load_s": number(_load(work, robot)),
            "motion_share": number(_load(whole, robot) / total if total else 0.0),
            "joints": {name: _joint(joint) for name, joint in joints.items()},
        }
        for robot, joints in record["joints"].items()
    }


def _load(figures: Figures, robot: str) -> float:
    """Load in [s] of a robot; a joint without a limit adds nothing."""
    return sum(value for joint, value in figures.of("load_s").items() if joint.startswith(f"{robot}/"))


def _joint(joint: Record) -> dict[str, Any]:
    lower, upper, margin = joint["lower"], joint["upper"], joint["margin"]
    half = None if None in {lower, upper} or margin is None else 0.5 * (upper - lower)
    return {
        "range_ratio": number(1.0 - margin / half) if half else None,
        "velocity_ratio": joint["velocity_ratio"],
        "acceleration_ratio": joint.get("acceleration_ratio"),
        "travel": joint["travel"],
        "unit": joint["unit"],
    }
