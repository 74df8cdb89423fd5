"""Rules of given joint motion, a path or one in the null space: whose it may be, its numbers, and what it excludes."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from cellplan.files.cell.rules.rules import holders_as_written, operators_as_written
from cellplan.files.input.findings import Finding, KeyPath, listed, unknown_name
from cellplan.files.robots.rules import configuration_findings
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.path import JointPathEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.model.robot.robot import RobotModel, configuration_in_si, start_keys
from cellplan.model.settings.solver import SolverEntry

SAME_START: Final = 1e-8  # [rad] or [m] by which a start posture may differ from the start of the path: rounding
REMOVE: Final = "remove it, or remove the {}"


def build_path(entry: JointPathEntry | None, model: RobotModel) -> JointSpline | None:
    """The path of a robot in [rad] and [m]; None where none is given."""
    if entry is None:
        return None
    rows = [configuration_in_si(model, row) for row in entry.rows]
    return JointSpline(coefficients=np.array(rows), degree=entry.degree)


def path_findings(valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument) -> Iterator[Finding]:
    """Everything about given joint motion that contradicts robots with a known model, part, motion and solver."""
    for name, robot in valid.robots.items():
        for key, entry in (("path", robot.path), ("null_space", robot.null_space)):
            if entry is None:
                continue
            if key == "path":
                yield from _carries(name, document)
            elif robot.path is not None:
                text = f"unexpected key beside robots.{name}.path: {REMOVE.format('path')}"
                yield document.key_finding(("robots", name, key), text)
            yield from _excluded(name, key, valid, document)
            if name not in models:
                continue
            findings = list(_rows(("robots", name, key, entry.key), entry, models[name], document))
            yield from findings
            if key == "path" and not findings and robot.given_start is not None:
                yield from _start(name, valid, models[name], document)


def _carries(name: str, document: YamlDocument) -> Iterator[Finding]:
    """Only the robot that carries the part, and does nothing else, has a path."""
    holders = [robot for _, robot in holders_as_written(document)]
    place: KeyPath = ("robots", name, "path")
    if name not in holders[:1]:
        whose = f"of the first holder of the part, '{holders[0]}'" if holders else "of a robot that holds the part"
        yield document.key_finding(place, f"expected the path {whose}, got one of '{name}': remove it")
        return
    for task, _, robot in operators_as_written(document):
        if robot == name:
            cure = REMOVE.format("path")
            text = f"expected a robot without a task of its own, got '{name}', which does '{task}': {cure}"
            yield document.key_finding(place, text)


def _excluded(name: str, key: str, valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """Modes, programs and methods in which a robot has no motion of its own over the whole clock."""
    path, remove = f"robots.{name}.{key}", REMOVE.format(key)
    if valid.program is not None:
        yield document.key_finding(("program",), f"unexpected key beside {path}, which covers one clock: {remove}")
    if (motion := valid.motion) is not None:
        if motion.mode != "simultaneous":
            text = f"expected simultaneous beside {path}, got '{motion.mode}': choose it, or remove the {key}"
            yield document.finding(("motion", "mode"), text)
        if motion.cyclic:
            yield document.finding(("motion", "cyclic"), f"expected false beside {path}, got true: {remove}")
        for index, lock in enumerate(motion.locked_joints):
            if lock.robot == name and key == "path":
                text = f"expected a joint of another robot beside {path}, got '{name}/{lock.joint}': {remove}"
                yield document.finding(("motion", "locked_joints", index), text)
    if (solver := valid.solver) is not None:
        for other in _nonminimal_keys(solver):
            text = f"expected the accurate mode (weighted_pseudo_inverse without goals) beside {path}: change it"
            yield document.finding(("solver", *other.split(".")), text)


def _nonminimal_keys(solver: SolverEntry) -> tuple[str, ...]:
    """Keys of the solver that exclude a given path, which goes with the smallest weighted velocities alone."""
    if solver.integrator != "auto":  # an explicit accurate mode has its own rule
        return ("integrator",) if solver.integrator == "euler" else ()
    return solver.nonminimal_keys


def _rows(place: KeyPath, path: JointPathEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """Every coefficient has one value per joint, in the joint's unit."""
    keys = start_keys(model)
    sliding = [joint.name for joint in model.joints if not joint.is_revolute]
    if path.coefficients_deg is not None and sliding:
        expected = ", ".join(f"{joint}: …" for joint in keys)
        text = f"unexpected key, '{sliding[0]}' is a prismatic joint: use coefficients: [{{{expected}}}, …]"
        yield document.key_finding(place, text)
        return
    for index, row in enumerate(path.rows):
        if not isinstance(row, dict):
            if len(row) != len(keys):
                text = f"expected {len(keys)} angles, one per joint ({listed(model.joint_names)}), got {len(row)}"
                yield document.finding((*place, index), text)
            continue
        for joint in row:
            if joint not in keys:
                yield document.key_finding((*place, index, joint), unknown_name("a joint with its unit", joint, keys))
        missing = [joint for joint in keys if joint not in row]
        if missing:
            yield document.finding((*place, index), f"missing, expected one value per joint: add {listed(missing)}")


def _start(name: str, valid: ValidEntries, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """A start posture that is given besides is the first coefficient."""
    robot = valid.robots[name]
    path, start = build_path(robot.path, model), robot.given_start
    is_wrong = any(True for _ in configuration_findings(("robots", name, "start"), start, model, document))
    if path is None or start is None or is_wrong:
        return
    off = np.abs(configuration_in_si(model, start) - path.start)
    if not np.all(off <= SAME_START):
        joint = model.joints[int(np.argmax(off))].name
        text = f"expected the first coefficient of robots.{name}.path, '{joint}' differs: remove the start posture"
        key = "start" if isinstance(start, dict) else "start_deg"
        yield document.finding(("robots", name, key), text)
