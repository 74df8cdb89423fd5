"""What a cell says about a robot must fit its model: start posture, weights and limits, joint by joint."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.io.input.findings import Finding, did_you_mean, listed, shown
from cellplan.io.robots.build_payload import build_payload, payload_findings
from cellplan.io.robots.urdf.limits import JointLimits
from cellplan.io.schema.robot import SLIDING_LIMITS, TURNING_LIMITS, LimitsEntry, RobotEntry
from cellplan.io.yaml.reader import YamlDocument
from cellplan.model.robot import BodyAccuracy, Joint, RobotModel

FARTHEST_FLANGE: Final = 10.0  # [m] from the first axis at the reference posture: farther is a slip of the unit
Given = tuple[float, ...] | dict[str, Any] | None  # a configuration in the units of a file; None: to be found

ROOM: Final = 1e-9  # [rad] or [m]: degrees in a cell do not read back to the last bit


def start_keys(model: RobotModel) -> tuple[str, ...]:
    """Keys of a start posture by joint name: ``a1_deg``, ``rail_mm``."""
    return tuple(f"{joint.name}_{'deg' if joint.is_revolute else 'mm'}" for joint in model.joints)


def start_posture(entry: RobotEntry, model: RobotModel) -> Array | None:
    """Start posture in [rad] or [m] as written; None when it is to be found."""
    return _configuration(entry.given_start, model)


def home_configuration(entry: RobotEntry, model: RobotModel) -> Array | None:
    """Home in [rad] or [m] as written; None when it is to be found."""
    return _configuration(entry.given_home, model)


def _configuration(given: Given, model: RobotModel) -> Array | None:
    """Joint positions in [rad] or [m] from those of a file, shape (n,)."""
    if given is None:
        return None
    values = [given[key] for key in start_keys(model)] if isinstance(given, dict) else given
    turns = [joint.is_revolute for joint in model.joints]
    return np.where(turns, np.deg2rad(values), np.divide(values, 1000.0))


def limits_in_si(entry: LimitsEntry) -> JointLimits:
    """Limits of a cell in [rad], [m], [rad/s], [m/s] and the two rates after these."""
    slides = entry.unit == "mm"
    given = (getattr(entry, name) for name in (SLIDING_LIMITS if slides else TURNING_LIMITS))
    lower, upper, velocity, acceleration, jerk = (
        None if value is None else value / 1000.0 if slides else float(np.deg2rad(value)) for value in given
    )
    return JointLimits(
        lower=lower, upper=upper, velocity=velocity, acceleration=acceleration, jerk=jerk, wraps=entry.wrap
    )


def robot_findings(name: str, entry: RobotEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """Everything a cell says about a robot that its model contradicts."""
    path = ("robots", name)
    yield from _configuration_findings((*path, "start"), entry.given_start, model, document)
    yield from _configuration_findings((*path, "home"), entry.given_home, model, document)
    yield from _unit_findings(("robots", name), entry, model, document)
    turning = tuple(joint.name for joint in model.joints if joint.is_revolute)
    yield from payload_findings(("robots", name, "payload"), entry.payload, turning, document)
    count = len(model.joints)
    if entry.weights is not None and len(entry.weights) != count:
        text = f"expected {count} weights, one per joint ({listed(model.joint_names)}), got {len(entry.weights)}"
        yield document.finding(("robots", name, "weights"), text)
    reach = float(np.linalg.norm(model.X_BF[:3, 3] - model.joints[0].point_B))
    if reach > FARTHEST_FLANGE:
        text = f"expected a reach of at most {FARTHEST_FLANGE:g} m, got {reach:.6g} m; is the unit right?"
        yield document.finding(("robots", name, "model"), text)
    length = float(np.linalg.norm(entry.tool.xyz_mm)) / 1000.0
    if length > FARTHEST_FLANGE:
        text = f"expected a tool of at most {FARTHEST_FLANGE:g} m, got {length:.6g} m; is the unit right?"
        yield document.finding(("robots", name, "tool", "xyz_mm"), text)


def _configuration_findings(
    path: tuple[str, str, str], given: Given, model: RobotModel, document: YamlDocument
) -> Iterator[Finding]:
    """A start posture or a home has one value for each joint, in the joint's unit."""
    if given is None:
        return
    *robot, key = path
    keys = start_keys(model)
    if isinstance(given, dict):
        for joint in given:
            if joint not in keys:
                text = f"unknown key{did_you_mean(joint, keys)}; allowed: {listed(keys)}"
                yield document.key_finding((*path, joint), text)
        missing = [joint for joint in keys if joint not in given]
        if missing:
            yield document.finding(path, f"missing, expected one value per joint: add {listed(missing)}")
        return
    as_list = (*robot, f"{key}_deg")
    sliding = [joint.name for joint in model.joints if not joint.is_revolute]
    if sliding:
        expected = ", ".join(f"{joint}: …" for joint in keys)
        text = f"unexpected key, '{sliding[0]}' is a prismatic joint: use {key}: {{{expected}}}"
        yield document.key_finding(as_list, text)
    elif len(given) != len(keys):
        text = f"expected {len(keys)} angles, one per joint ({listed(model.joint_names)}), got {len(given)}"
        yield document.finding(as_list, text)


def _unit_findings(
    path: tuple[str, str], entry: RobotEntry, model: RobotModel, document: YamlDocument
) -> Iterator[Finding]:
    """Limits belong to joints that exist and are in the joint's unit."""
    joints = {joint.name: joint for joint in model.joints}
    for name, limits in entry.limits.items():
        if name not in joints:
            text = f"expected a joint of the robot ({listed(joints)}), got {shown(name)}{did_you_mean(name, joints)}"
            yield document.key_finding((*path, "limits", name), text)
        elif limits.unit is not None and (limits.unit == "deg") != joints[name].is_revolute:
            kind, unit = ("revolute", "deg") if joints[name].is_revolute else ("prismatic", "mm")
            text = f"expected limits in {unit}, the joint is {kind}, got {limits.unit}"
            yield document.finding((*path, "limits", name), text)


def tightened(
    path: tuple[str, str], entry: RobotEntry, model: RobotModel, document: YamlDocument
) -> tuple[RobotModel, list[Finding]]:
    """The model within the limits of the cell, which may only be tighter than its own."""
    findings: list[Finding] = []
    joints: list[Joint] = []
    for joint in model.joints:
        limits = entry.limits.get(joint.name)
        if limits is None:
            joints.append(joint)
            continue
        wider = list(_wider(joint, limits))
        findings += [document.finding((*path, "limits", joint.name, key), text) for key, text in wider]
        joints.append(joint if wider else _within(joint, limits_in_si(limits)))
    return replace(model, joints=tuple(joints)), findings


def with_statements(entry: RobotEntry, model: RobotModel) -> RobotModel:
    """The model with what the cell states in place of the robot's own file."""
    if entry.bodies is not None:
        accuracy = BodyAccuracy(distance=entry.bodies.accuracy_mm / 1000.0, source=entry.bodies.source)
        bodies = tuple(replace(body, accuracy=None) for body in model.bodies)
        model = replace(model, body_accuracy=accuracy, bodies=bodies)
    return model if entry.payload is None else replace(model, payload=build_payload(entry.payload))


def _wider(joint: Joint, entry: LimitsEntry) -> Iterator[tuple[str, str]]:
    """Limits of a cell that allow more than the model does, by key; and what leaves no room."""
    limits, unit = limits_in_si(entry), "deg" if joint.is_revolute else "mm"
    if limits.wraps:
        yield "wrap", "unexpected key, only a continuous joint of a URDF may turn without end"
        return
    for key, value, own, ending in (
        ("lower", limits.lower, joint.lower, unit),
        ("upper", limits.upper, joint.upper, unit),
        ("velocity", limits.velocity, joint.velocity, f"{unit}_s"),
        ("acceleration", limits.acceleration, joint.acceleration, f"{unit}_s2"),
        ("jerk", limits.jerk, joint.jerk, f"{unit}_s3"),
    ):
        if value is None or own is None:
            continue
        sign = -1.0 if key == "lower" else 1.0
        if sign * (value - own) > ROOM:
            bound = f"at {'least' if key == 'lower' else 'most'} {shown(_in_file_unit(joint, own))}"
            text = f"expected {bound}, the limit of the model, got {shown(_in_file_unit(joint, value))}"
            yield f"{key}_{ending}", text
    lower = joint.lower if limits.lower is None else limits.lower
    upper = joint.upper if limits.upper is None else limits.upper
    if not lower < upper:
        key = "lower" if limits.upper is None else "upper"
        ends = f"{shown(_in_file_unit(joint, lower))} and {shown(_in_file_unit(joint, upper))}"
        yield f"{key}_{unit}", f"expected a lower limit below the upper one, got {ends}"


def _within(joint: Joint, limits: JointLimits) -> Joint:
    """The joint with tighter limits; limits of acceleration and jerk may also be new ones."""
    accelerations = [value for value in (joint.acceleration, limits.acceleration) if value is not None]
    jerks = [value for value in (joint.jerk, limits.jerk) if value is not None]
    return replace(
        joint,
        acceleration=min(accelerations, default=None),
        jerk=min(jerks, default=None),
        rated_velocity=None if limits.velocity is None else joint.top_speed,
        lower=joint.lower if limits.lower is None else max(joint.lower, limits.lower),
        upper=joint.upper if limits.upper is None else min(joint.upper, limits.upper),
        velocity=joint.velocity if limits.velocity is None else min(joint.velocity, limits.velocity),
    )


def _in_file_unit(joint: Joint, value: float) -> float:
    """Degrees or millimetres for a message."""
    return round(float(np.rad2deg(value)) if joint.is_revolute else 1000.0 * value, 6)
