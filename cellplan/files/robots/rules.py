"""What a cell says about a robot must fit its model: start posture, weights and limits, joint by joint."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, listed, unknown_name
from cellplan.files.robots.build_controller import payload_findings
from cellplan.files.robots.inertias import inertia_findings, with_inertias
from cellplan.files.robots.limits import RATES, StatedLimits, limit_findings, limits_of, rates_of, tightest
from cellplan.files.schema.robot import SLIDING_LIMITS, TURNING_LIMITS, LimitsEntry, RobotEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import Joint, RobotModel, configuration_in_si, start_keys
from cellplan.model.settings.robot import InertiasEntry
from cellplan.model.settings.units import Mm, si_or_none

FARTHEST_FLANGE: Final = 10.0  # [m] from the first axis at the reference configuration: farther is a wrong unit
Given = tuple[float, ...] | dict[str, Any] | None  # a configuration in the units of a file; None: to be found


def start_posture(entry: RobotEntry, model: RobotModel) -> Array | None:
    """Start posture in [rad] or [m] as written; None when it is to be found."""
    return None if entry.given_start is None else configuration_in_si(model, entry.given_start)


def home_configuration(entry: RobotEntry, model: RobotModel) -> Array | None:
    """Home in [rad] or [m] as written; None when it is to be found."""
    return None if entry.given_home is None else configuration_in_si(model, entry.given_home)


def limits_in_si(entry: LimitsEntry) -> StatedLimits:
    """Limits of a cell in [rad], [m], [rad/s], [m/s] and the two rates after these."""
    keys = SLIDING_LIMITS if entry.unit == "mm" else TURNING_LIMITS
    values = [si_or_none(getattr(entry, key)) for key in keys]
    return StatedLimits(**dict(zip(RATES, values, strict=True)), wraps=entry.wrap)


def robot_findings(name: str, entry: RobotEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """Everything a cell says about a robot that its model contradicts."""
    path = ("robots", name)
    yield from configuration_findings((*path, "start"), entry.given_start, model, document)
    yield from configuration_findings((*path, "home"), entry.given_home, model, document)
    yield from _unit_findings(("robots", name), entry, model, document)
    turning = tuple(joint.name for joint in model.joints if joint.is_revolute)
    yield from payload_findings(("robots", name, "payload"), entry.payload, turning, document)
    if isinstance(entry.inertias, InertiasEntry):
        links = tuple(link.name for link in model.links)
        yield from inertia_findings((*path, "inertias"), entry.inertias, links, document)
    for number, names in enumerate(it.joints for it in entry.joint_sums):
        for index, joint in enumerate(names):
            if joint not in turning:
                place = (*path, "joint_sums", number, "joints", index)
                yield document.finding(place, unknown_name("a revolute joint of this robot", joint, turning))
    count = len(model.joints)
    if entry.weights is not None and len(entry.weights) != count:
        text = f"expected {count} weights, one per joint ({listed(model.joint_names)}), got {len(entry.weights)}"
        yield document.finding(("robots", name, "weights"), text)
    reach = float(np.linalg.norm(model.X_BF[:3, 3] - model.joints[0].point_B))
    if reach > FARTHEST_FLANGE:
        text = f"expected a reach of at most {FARTHEST_FLANGE:g} m, got {reach:.6g} m; is the unit right?"
        yield document.finding(("robots", name, "model"), text)
    rod = entry.tool.rod
    length = Mm(np.linalg.norm(entry.tool.xyz_mm) if rod is None else rod.length_mm).si
    if length > FARTHEST_FLANGE:
        text = f"expected a tool of at most {FARTHEST_FLANGE:g} m, got {length:.6g} m; is the unit right?"
        yield document.finding(("robots", name, "tool", *(("xyz_mm",) if rod is None else ("rod", "length_mm"))), text)


def configuration_findings(path: KeyPath, given: Given, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """A configuration has one value for each joint, in the joint's unit."""
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
    as_list = (*robot, key if isinstance(key, int) else f"{key}_deg")
    sliding = [joint.name for joint in model.joints if not joint.is_revolute]
    if sliding:
        expected = ", ".join(f"{joint}: …" for joint in keys)
        name = "" if isinstance(key, int) else f"{key}: "
        text = f"unexpected {'key' if name else 'list'}, '{sliding[0]}' is a prismatic joint: use {name}{{{expected}}}"
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
            yield document.key_finding((*path, "limits", name), unknown_name("a joint of the robot", name, joints))
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
        joint_limits, cell = limits_of(joint), limits_in_si(limits)
        wider = list(limit_findings(joint_limits, cell, is_revolute=joint.is_revolute))
        if cell.wraps:
            wider = [("wrap", "unexpected key, only a continuous joint of a URDF may turn without end")]
        findings += [document.finding((*path, "limits", joint.name, key), text) for key, text in wider]
        if not wider:  # one whose velocity the cell limits keeps its rated velocity
            rated = None if cell.velocity is None else joint.top_speed
            joint = replace(joint, rated_velocity=rated, **rates_of(tightest(joint_limits, cell)))  # noqa: PLW2901
        joints.append(joint)
    return replace(model, joints=tuple(joints)), findings


def with_statements(entry: RobotEntry, model: RobotModel) -> RobotModel:
    """The model with what the cell states in place of the robot's own file."""
    if entry.bodies is not None:
        bodies = tuple(replace(body, accuracy=None) for body in model.bodies)
        model = replace(model, body_accuracy=entry.bodies, bodies=bodies)
    if isinstance(entry.inertias, InertiasEntry):
        model = with_inertias(model, entry.inertias)
    return model if entry.payload is None else replace(model, payload=entry.payload)
