"""Accelerations, jerk and process speeds in the record of a run, in printed units; tools and part in m/s2 and m/s3."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

from cellplan.model.acceleration import (
    JointAcceleration,
    MotionAccelerations,
    PartAcceleration,
    PointAcceleration,
    ProcessSpeed,
)
from cellplan.report.record.run import Record, number

REST: Final = "all robots stand still before the first row and after the last one"
MOST_STRETCHES: Final = 100  # stretches of varying speed that are listed; their number is told


def acceleration_parts(record: Record, found: MotionAccelerations) -> Record:
    """The parts of a record that know of accelerations: joints and tasks with more keys, and ``accelerations``.

    Args:
        record: The record so far, with ``joints`` and ``tasks``.
        found: Accelerations of the run, or the worst of several runs.
    """
    by_joint = {(use.robot, use.joint): _joint_record(use) for use in found.joints}
    return {
        "tasks": {
            name: {**task, "process_speed": _process_record(found.process.get(name))}
            for name, task in record["tasks"].items()
        },
        "joints": {
            robot: {joint: {**use, **by_joint.get((robot, joint), {})} for joint, use in uses.items()}
            for robot, uses in record["joints"].items()
        },
        "accelerations": {
            "assumption": REST,
            "tools": {robot: _point_record(point) for robot, point in found.tools.items()},
            "part": None if found.part is None else _part_record(found.part),
            "not_judged": [
                {"robot": left.robot or None, "what": left.what, "reason": left.reason} for left in found.not_judged
            ],
        },
    }


def merge_accelerations(runs: Iterable[MotionAccelerations]) -> MotionAccelerations:
    """The worst of several runs: of each joint, of each tool and of the part; the process speed of every task."""
    every = list(runs)
    joints: dict[tuple[str, str], list[JointAcceleration]] = {}
    for use in (use for run in every for use in run.joints):
        joints.setdefault((use.robot, use.joint), []).append(use)
    parts = [run.part for run in every if run.part is not None]
    tools = {robot: [run.tools[robot] for run in every if robot in run.tools] for run in every for robot in run.tools}
    return MotionAccelerations(
        joints=tuple(_worst_joint(uses) for uses in joints.values()),
        tools={robot: _worst_point(points) for robot, points in tools.items()},
        part=PartAcceleration(
            centre=_worst_point([part.centre for part in parts]), corner=_worst_point([part.corner for part in parts])
        )
        if parts
        else None,
        process={name: speed for run in every for name, speed in run.process.items()},
        not_judged=tuple(dict.fromkeys(left for run in every for left in run.not_judged)),
    )


def table_line(found: MotionAccelerations, robot: str) -> str:
    """What the header of a robot's table says: its largest acceleration and jerk, as shares of limits where known."""
    uses = [use for use in found.joints if use.robot == robot]
    most = max(uses, key=lambda use: (use.ratio is not None, use.peak if use.ratio is None else use.ratio))
    scale, unit = _unit(most)
    against = "not judged" if most.ratio is None else f"{100.0 * most.ratio:.3g} % of its {most.source} limit"
    hardest = max(uses, key=lambda use: (use.is_revolute, use.peak_jerk))
    jerk_scale, jerk_unit = _unit(hardest)
    return (
        f"at most {scale * most.peak:.4g} {unit}/s2 at {most.peak_at_s:.3f} s ({most.joint}, {against}), "
        f"jerk {jerk_scale * hardest.peak_jerk:.4g} {jerk_unit}/s3 over {1e3 * hardest.window:g} ms "
        f"at {hardest.peak_jerk_at_s:.3f} s ({hardest.joint})"
    )


def _unit(use: JointAcceleration) -> tuple[float, str]:
    return (math.degrees(1.0), "deg") if use.is_revolute else (1e3, "mm")


def _worst_joint(uses: Sequence[JointAcceleration]) -> JointAcceleration:
    most, hardest = max(uses, key=lambda use: use.peak), max(uses, key=lambda use: use.peak_jerk)
    return replace(most, peak_jerk=hardest.peak_jerk, peak_jerk_at_s=hardest.peak_jerk_at_s)


def _worst_point(points: Sequence[PointAcceleration]) -> PointAcceleration:
    most, hardest = max(points, key=lambda point: point.peak), max(points, key=lambda point: point.peak_jerk)
    return replace(most, peak_jerk=hardest.peak_jerk, peak_jerk_at_s=hardest.peak_jerk_at_s)


def _joint_record(use: JointAcceleration) -> Record:
    """What one joint's entry says besides positions and speeds."""
    scale, _ = _unit(use)
    return {
        "peak_acceleration": number(scale * use.peak),
        "peak_acceleration_at_s": number(use.peak_at_s),
        "acceleration_limit": None if use.limit is None else number(scale * use.limit),
        "acceleration_limit_source": str(use.source),
        "acceleration_ratio": number(use.ratio),
        "peak_jerk": number(scale * use.peak_jerk),
        "peak_jerk_at_s": number(use.peak_jerk_at_s),
        "jerk_limit": None if use.jerk_limit is None else number(scale * use.jerk_limit),
        "jerk_window_ms": number(1e3 * use.window),
    }


def _point_record(point: PointAcceleration) -> Record:
    return {
        "peak_acceleration_m_s2": number(point.peak),
        "peak_acceleration_at_s": number(point.peak_at_s),
        "peak_jerk_m_s3": number(point.peak_jerk),
        "peak_jerk_at_s": number(point.peak_jerk_at_s),
        "jerk_window_ms": number(1e3 * point.window),
    }


def _part_record(part: PartAcceleration) -> Record:
    """The centre of the bounding box, and the corner of it that is accelerated most."""
    return {"centre": _point_record(part.centre), "corner": _point_record(part.corner)}


def _process_record(speed: ProcessSpeed | None) -> Record | None:
    """Speed of a tool tip along its path; None for a tool that stands still."""
    if speed is None:
        return None
    return {
        "mean_mm_s": number(1e3 * speed.mean),
        "peak_mm_s": number(1e3 * speed.peak),
        "peak_at_s": number(speed.peak_at_s),
        "steady_share": number(speed.steady_share),
        "slower_count": len(speed.slower),
        "slower_at_s": [[number(first), number(last)] for first, last in speed.slower[:MOST_STRETCHES]],
    }
