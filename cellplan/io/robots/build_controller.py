"""How the controller of a robot counts its joints: entries of a robot file become the model's data."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cellplan.errors import InputError
from cellplan.io.input.findings import Finding, KeyPath, raise_findings, unknown_name
from cellplan.io.schema.controller import ControllerZeroEntry
from cellplan.io.schema.messages import validate
from cellplan.io.schema.units import si_or_none
from cellplan.io.yaml.reader import YamlDocument, read_yaml
from cellplan.model.controller import ControllerZero
from cellplan.model.robot import Joint, RobotModel


def with_zero_of_file(model: RobotModel, path: Path, *, file: str) -> tuple[RobotModel, str]:
    """The robot with the counting that a file of its own states, and the SHA-256 of that file.

    Args:
        model: A robot whose own file does not state it.
        path: The file: the keys of ``controller`` in a joint-axis table.
        file: Its name in messages.

    Raises:
        InputError: All findings about the file at once.
    """
    document = read_yaml(path, file=file)
    entry, findings = validate(ControllerZeroEntry, document)
    turns = {joint.name: joint.is_revolute for joint in model.joints}
    raise_findings(file, [*findings, *document.findings, *controller_findings((), entry, turns, document)])
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
    )


def controller_findings(
    path: KeyPath, entry: ControllerZeroEntry | None, turns: Mapping[str, bool], document: YamlDocument
) -> Iterator[Finding]:
    """Joints that exist, in their own unit, and couplings to earlier joints of the same kind.

    Args:
        path: Where the entry stands.
        entry: The entry.
        turns: Whether a joint is revolute, by name, from the base to the flange.
        document: The file.
    """
    if entry is None:
        return
    for key, is_revolute in (("zero_deg", True), ("zero_mm", False)):
        known = [joint for joint, turning in turns.items() if turning is is_revolute]
        what = "a revolute joint of the robot" if is_revolute else "a prismatic joint of the robot"
        yield from _names((*path, key), what, getattr(entry, key), known, document)
    yield from _names((*path, "sign"), "a joint of the robot", entry.sign, turns, document)
    yield from _names((*path, "coupling"), "a joint of the robot", entry.coupling, turns, document)
    names = list(turns)
    for joint, factors in entry.coupling.items():
        if joint in turns:
            earlier = [other for other in names[: names.index(joint)] if turns[other] is turns[joint]]
            what = f"an earlier joint than '{joint}' of its kind"
            yield from _names((*path, "coupling", joint), what, factors, earlier, document)


def _names(
    path: KeyPath, what: str, given: Iterable[str], known: Collection[str], document: YamlDocument
) -> Iterator[Finding]:
    """Keys that name a known joint."""
    for joint in given:
        if joint not in known:
            yield document.key_finding((*path, joint), unknown_name(what, joint, known))
