"""Merging of several runs: the worst values of joints, accelerations and clearance."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from cellplan.model.acceleration import JointAcceleration, MotionAccelerations, PartAcceleration, PointAcceleration
from cellplan.model.report import ClearanceClass, ClearanceMinimum, JointUse, Report


def merge_joint_uses(uses: Iterable[JointUse]) -> list[JointUse]:
    """One entry per joint over several runs: the widest range, the smallest margin, the highest speed, all travel."""
    merged: dict[tuple[str, str], JointUse] = {}
    for use in uses:
        key = (use.robot, use.joint)
        merged[key] = _merge_two(merged[key], use) if key in merged else use
    return list(merged.values())


def _merge_two(first: JointUse, second: JointUse) -> JointUse:
    tighter = min(first, second, key=lambda use: use.margin)
    faster = max(first, second, key=lambda use: use.peak_velocity)
    return replace(
        first,
        min=min(first.min, second.min),
        max=max(first.max, second.max),
        margin=tighter.margin,
        margin_at_s=tighter.margin_at_s,
        peak_velocity=faster.peak_velocity,
        peak_velocity_at_s=faster.peak_velocity_at_s,
        travel=first.travel + second.travel,
    )


def merge_minima(runs: list[Report]) -> dict[ClearanceClass, ClearanceMinimum]:
    """The smallest distance of each class over several runs, certified when every run's is."""
    merged = {}
    for kind in ClearanceClass:
        found = [run.clearance.minima[kind] for run in runs if kind in run.clearance.minima]
        measured = [minimum for minimum in found if minimum.minimum is not None]
        if measured:
            smallest = min(measured, key=lambda minimum: math.inf if minimum.minimum is None else minimum.minimum)
            merged[kind] = replace(smallest, certified=all(minimum.certified for minimum in measured))
    return merged


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


def _worst_joint(uses: Sequence[JointAcceleration]) -> JointAcceleration:
    most, hardest = max(uses, key=lambda use: use.peak), max(uses, key=lambda use: use.peak_jerk)
    return replace(most, peak_jerk=hardest.peak_jerk, peak_jerk_at_s=hardest.peak_jerk_at_s)


def _worst_point(points: Sequence[PointAcceleration]) -> PointAcceleration:
    most, hardest = max(points, key=lambda point: point.peak), max(points, key=lambda point: point.peak_jerk)
    return replace(most, peak_jerk=hardest.peak_jerk, peak_jerk_at_s=hardest.peak_jerk_at_s)
