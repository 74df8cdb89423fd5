"""Errors file: how the real cell differs from the written one, read and checked against the names of its cell."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import Finding, KeyPath, raise_findings, unknown_name
from cellplan.files.schema.messages import validate
from cellplan.files.yaml.reader import YamlDocument, read_yaml
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.cell_errors import SHORTEST_LINK, CellErrors, link_vector
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.cell_errors import ErrorsDocument


def load_errors(path: Path | str, cell: Cell) -> CellErrors:
    """Read an errors file.

    Args:
        path: The file.
        cell: The cell it belongs to: its robots and joints are the ones that may be named.

    Raises:
        InvalidFileError: Everything that is wrong with the file, one located line each.
        InputError: The file cannot be read at all.
    """
    file = str(path)
    document = read_yaml(Path(path), file=file)
    whole, findings = validate(ErrorsDocument, document)
    findings += document.findings
    findings += _unknown_names(document, cell)
    raise_findings(file, findings)
    if whole is None:
        raise InputError(f"{file}: the errors cannot be understood")
    return CellErrors(
        robots=whole.robots,
        grasps=whole.grasp,
        measurement=whole.measurement,
        simulation=whole.simulation,
        seed=whole.seed,
        trials=whole.trials,
        file=file,
        digest=document.digest,
    )


def _unknown_names(document: YamlDocument, cell: Cell) -> Iterator[Finding]:
    """Robots and joints that the cell does not have, and links that cannot grow."""
    models = {robot.name: robot.model for robot in cell.robots}
    for name, written in _mapping(document.root, "robots").items():
        place: KeyPath = ("robots", name)
        if name not in models:
            yield document.key_finding(place, unknown_name("a robot of this cell", name, models))
        elif isinstance(written, dict):
            yield from _wrong_joints(document, place, written, models[name])
    for name in _mapping(document.root, "grasp"):
        if name not in cell.positioners:
            text = unknown_name("a robot that holds the part", name, cell.positioners)
            yield document.key_finding(("grasp", name), text)
    for name, written in _mapping(_mapping(document.root, "simulation"), "robots").items():
        place = ("simulation", "robots", name)
        if name not in models:
            yield document.key_finding(place, unknown_name("a robot of this cell", name, models))
            continue
        for key, figures in written.items() if isinstance(written, dict) else ():
            for joint in figures if isinstance(figures, dict) else ():
                if joint not in models[name].joint_names:
                    text = unknown_name(f"a joint of '{name}'", joint, models[name].joint_names)
                    yield document.key_finding((*place, key, joint), text)


def _wrong_joints(
    document: YamlDocument, place: KeyPath, written: Mapping[str, object], model: RobotModel
) -> Iterator[Finding]:
    """Joints that a robot does not have, that move in another unit, or before which there is no link to lengthen."""
    kinds = {"joint_offsets_deg": True, "joint_offsets_mm": False}
    for key in (*kinds, "link_lengths_mm"):
        for name in _mapping(written, key):
            path = (*place, key, name)
            if name not in model.joint_names:
                text = unknown_name(f"a joint of '{place[-1]}'", name, model.joint_names)
                yield document.key_finding(path, text)
                continue
            joint = model.joint_names.index(name)
            if key in kinds and model.joints[joint].is_revolute != kinds[key]:
                kind, cure = ("prismatic", "joint_offsets_mm") if kinds[key] else ("revolute", "joint_offsets_deg")
                yield document.key_finding(path, f"joint '{name}' is {kind}: state its offset under {cure}")
            if key == "link_lengths_mm" and np.linalg.norm(link_vector(model, joint)) < SHORTEST_LINK:
                text = (
                    f"the axis points of '{name}' and of the joint before it are one point, so the link has no "
                    "direction to be lengthened in: state the error under base or tool, or move a point along its axis"
                )
                yield document.key_finding(path, text)


def _mapping(root: Mapping[str, object], key: str) -> Mapping[str, object]:
    """A section by name; empty when it is no mapping, which validation has reported already."""
    section = root.get(key)
    return section if isinstance(section, dict) else {}
