"""Torques of the drives in the record of a run, in Nm, N, J and W."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, TypedDict

from cellplan.model.report.report import Report
from cellplan.model.robot.torque import JointTorque, RobotTorques, mean_torque
from cellplan.report.record.common import Number, number


class JointTorqueRecord(TypedDict):
    """Torque of a drive behind its gears, in `unit`."""

    unit: Annotated[str, "`Nm` for a revolute joint, `N` for a prismatic one"]
    peak_torque: Annotated[Number, "largest torque or force, at the samples and between them"]
    peak_torque_at_s: Annotated[Number, "its time"]
    torque_limit: Annotated[Number, "largest torque or force of the drive; null if it is not stated"]
    torque_ratio: Annotated[Number, "largest torque as a fraction of its limit; null if that is not stated"]
    rms_torque: Annotated[Number, "root of its mean square over the time"]


class RobotTorquesRecord(TypedDict):
    """Torques, work and power of a robot."""

    joints: Annotated[dict[str, JointTorqueRecord], "by joint"]
    energy_j: Annotated[Number, "work of the drives; a drive that brakes gives nothing back"]
    peak_power_w: Annotated[Number, "largest sum of the powers of the drives that do work"]
    peak_power_at_s: Annotated[Number, "its time"]


class TorquesKey(TypedDict, total=False):
    """Only of a cell with a robot whose masses are stated and sound."""

    torques: Annotated[
        dict[str, RobotTorquesRecord], "by robot whose masses are stated: torques of its drives; only if there is one"
    ]


def torques_record(torques: Iterable[RobotTorques]) -> TorquesKey:
    """Torques by robot; no key where there are none."""
    known = {use.robot: _robot_record(use) for use in torques if not use.missing}
    return {"torques": known} if known else {}


def torques_of_phases(reports: Sequence[Report], worst: Mapping[str, Any]) -> TorquesKey:
    """The same of several phases, from the worst of each figure: means over all of their time, and all their work."""
    record: dict[str, Any] = {}
    for robot, merged in worst.items():
        uses = [use for report in reports for use in report.torques if use.robot == robot and not use.missing]
        joints = {
            joint: figures | {"rms_torque": number(mean_torque(_means(uses, joint)))}
            for joint, figures in merged["joints"].items()
        }
        record[robot] = merged | {"joints": joints, "energy_j": number(sum(use.energy for use in uses))}
    return {"torques": record} if record else {}


def unjudged_torques(torques: Iterable[RobotTorques]) -> list[str]:
    """A line on the robots whose torques are not known, with the reasons, and one on drives without a limit."""
    reasons: dict[str, list[str]] = {}
    drives: list[str] = []
    for use in torques:
        for reason in use.missing:
            robots = reasons.setdefault(reason, [])
            robots += [use.robot] if use.robot not in robots else []
        unlimited = [joint.joint for joint in use.joints if joint.limit is None]
        names = f" {', '.join(unlimited)}" if len(unlimited) < len(use.joints) else ""
        drives += [f"{use.robot}{names}"] if unlimited else []
    texts = [f"{reason} ({', '.join(robots)})" for reason, robots in reasons.items()]
    lines = [f"torques and base reactions not known: {'; '.join(texts)}"] if texts else []
    if drives:
        lines.append(f"torques not judged: largest ones not stated ({'; '.join(dict.fromkeys(drives))})")
    return lines


def _means(uses: Iterable[RobotTorques], name: str) -> list[tuple[float, float]]:
    return [(joint.rms, use.duration) for use in uses for joint in use.joints if joint.joint == name]


def _robot_record(use: RobotTorques) -> RobotTorquesRecord:
    return {
        "joints": {joint.joint: _joint_record(joint) for joint in use.joints},
        "energy_j": number(use.energy),
        "peak_power_w": number(use.peak_power),
        "peak_power_at_s": number(use.peak_power_at_s),
    }


def _joint_record(joint: JointTorque) -> JointTorqueRecord:
    return {
        "unit": joint.unit,
        "peak_torque": number(joint.peak),
        "peak_torque_at_s": number(joint.peak_at_s),
        "torque_limit": number(joint.limit),
        "torque_ratio": None if joint.limit is None else number(joint.peak / joint.limit),
        "rms_torque": number(joint.rms),
    }
