"""How a robot's controller counts its joints, and what the robot carries: entries of its file as the model has them."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import Finding, KeyPath, raise_findings, unknown_name
from cellplan.files.schema.messages import validate
from cellplan.files.yaml.reader import YamlDocument, read_yaml
from cellplan.geometry.arrays import Array
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import Joint, RobotModel
from cellplan.model.settings.controllers import ControllerZeroEntry
from cellplan.model.settings.robot import PayloadEntry
from cellplan.model.settings.units import si_or_none

PARALLEL: Final = 0.999  # [-] cosine of two axes that count as parallel: 2.6 deg


def with_zero_of_file(model: RobotModel, path: Path, *, file: str) -> tuple[RobotModel, str]:
    """The robot with the counting that a separate file states, with the keys of ``controller`` in a joint-axis table.

    The model file does not state it. The SHA-256 of the separate file comes second.

    Raises:
        InputError: All findings about the separate file at once.
    """
    document = read_yaml(path, file=file)
    entry, findings = validate(ControllerZeroEntry, document)
    turns = {joint.name: joint.is_revolute for joint in model.joints}
    findings = [*findings, *document.findings, *controller_findings((), entry, turns, document)]
    axes = {joint.name: joint.axis_B for joint in model.joints}
    raise_findings(file, [*findings, *sense_findings((), entry, axes, document)])
    if entry is None:
        raise InputError(f"{file}: the zero of the controller cannot be understood")
    return replace(model, controller=build_controller(entry, model.joints)), document.digest


def build_controller(entry: ControllerZeroEntry | None, joints: Sequence[Joint]) -> ControllerZero | None:
    """The controller's counting in [rad] and [m]; None when it is not stated."""
    if entry is None:
        return None
    index = {joint.name: number for number, joint in enumerate(joints)}
    coupling = np.zeros((len(joints), len(joints)))
    for joint, factors in entry.coupling.items():
        for other, factor in factors.items():
            coupling[index[joint], index[other]] = factor
    stated = {**entry.zero_deg, **entry.zero_mm}
    return ControllerZero(
        zero=np.array([si_or_none(stated.get(joint.name)) or 0.0 for joint in joints]),
        sign=np.array([float(entry.sign.get(joint.name, 1)) for joint in joints]),
        coupling=coupling,
        source=entry.source,
        limits=np.array([_range(entry, joint.name) for joint in joints]) if entry.limits_deg else None,
    )


def _range(entry: ControllerZeroEntry, joint: str) -> tuple[float, float]:
    """Limits in [rad] of what the controller shows of a joint; infinite where none are stated."""
    lower, upper = entry.limits_deg.get(joint, (None, None))
    return (-np.inf, np.inf) if lower is None or upper is None else (lower.si, upper.si)


def controller_findings(
    path: KeyPath, entry: ControllerZeroEntry | None, turns: Mapping[str, bool], document: YamlDocument
) -> Iterator[Finding]:
    """Joints that exist, in their own unit, and couplings to earlier joints of the same kind.

    ``turns`` says whether a joint is revolute, by name, from the base to the flange.
    """
    if entry is None:
        return
    for key, is_revolute in (("zero_deg", True), ("zero_mm", False), ("limits_deg", True)):
        known = [joint for joint, turning in turns.items() if turning is is_revolute]
        what = "a revolute joint of the robot" if is_revolute else "a prismatic joint of the robot"
        yield from _names((*path, key), what, getattr(entry, key), known, document)
    yield from _names((*path, "sign"), "a joint of the robot", entry.sign, turns, document)
    yield from _names((*path, "coupling"), "a joint of the robot", entry.coupling, turns, document)
    for joint, (lower, upper) in entry.limits_deg.items():
        if not lower.si < upper.si:
            yield document.finding((*path, "limits_deg", joint), "expected a lower limit below the upper one")
    names = list(turns)
    for joint, factors in entry.coupling.items():
        if joint in turns:
            earlier = [other for other in names[: names.index(joint)] if turns[other] is turns[joint]]
            what = f"an earlier joint than '{joint}' of its kind"
            yield from _names((*path, "coupling", joint), what, factors, earlier, document)


def sense_findings(
    path: KeyPath, entry: ControllerZeroEntry | None, axes: Mapping[str, Array], document: YamlDocument
) -> Iterator[Finding]:
    r"""Couplings to the neighbouring parallel axis have the sign with which the shown angle is one to the level.

    The later link turns by :math:`q_2 + (a_2 \cdot a_3) q_3` about axis 2. What the controller shows, :math:`s_3 q_3 +
    k s_2 q_2`, depends on this alone where :math:`k = s_2 s_3 (a_2 \cdot a_3)`: with the other sign the earlier axis
    would count twice instead of not at all.

    Axes are directions at the reference configuration, shape (3,), by name of the joint, from the base on.
    """
    for other, joint in pairwise(axes if entry is not None else ()):
        factor = None if entry is None else entry.coupling.get(joint, {}).get(other)
        along = float(axes[other] @ axes[joint]) / float(np.linalg.norm(axes[other]) * np.linalg.norm(axes[joint]))
        if entry is None or factor is None or abs(factor) != 1.0 or abs(along) < PARALLEL:
            continue
        senses = entry.sign.get(other, 1) * entry.sign.get(joint, 1)
        if factor != (right := senses * round(along)):
            sense = "the same way" if right > 0 else "against each other"
            yield document.finding(
                (*path, "coupling", joint, other),
                f"expected {right}, with which the angle of '{joint}' is shown against the level, as '{other}' and "
                f"'{joint}' turn {sense} on the controller, got {factor:g}",
            )


def _names(
    path: KeyPath, what: str, given: Iterable[str], known: Collection[str], document: YamlDocument
) -> Iterator[Finding]:
    for joint in given:
        if joint not in known:
            yield document.key_finding((*path, joint), unknown_name(what, joint, known))


def payload_findings(
    path: KeyPath, entry: PayloadEntry | None, turning: tuple[str, ...], document: YamlDocument
) -> Iterator[Finding]:
    """Limits of axes belong to the last turning joints before the flange, named from the base on."""
    last = turning[-3:]
    for joint in entry.axes if entry is not None else ():
        if joint not in last:
            text = unknown_name("one of the last turning joints", joint, last)
            yield document.key_finding((*path, "axes", joint), text)
