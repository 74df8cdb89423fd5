"""Robots from joint-axis tables, also bundled ones: axes, limits, flange and bodies at the reference configuration."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.cache import as_here
from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders
from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, raise_findings, shown, unknown_name
from cellplan.files.robots.build_controller import (
    build_controller,
    controller_findings,
    payload_findings,
    sense_findings,
)
from cellplan.files.robots.inertias import inertia_findings, with_inertias
from cellplan.files.robots.limits import RATES
from cellplan.files.schema import RobotTableDocument
from cellplan.files.schema.messages import validate
from cellplan.files.schema.robot import SLIDING_LIMITS, TURNING_LIMITS
from cellplan.files.schema.robot_table import BodiesEntry, JointEntry
from cellplan.files.shapes import link_solid
from cellplan.files.yaml.reader import YamlDocument, read_yaml
from cellplan.geometry.mesh.load import read_drawing
from cellplan.geometry.shapes import Mesh
from cellplan.guard import Guard, in_child
from cellplan.model.robot.robot import BASE, Body, Joint, JointKind, Link, RobotModel, free_name
from cellplan.model.settings.robot import BodyAccuracyEntry
from cellplan.model.settings.units import in_si, si_or_none

FOLDER: Final = Path(__file__).resolve().parents[2] / "robots"
FOOT: Final = "base"  # word for the link that does not move
TOOL_NAME: Final = re.compile(r"tool(_[0-9]+)?")  # these names belong to the bodies of the tool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotTable:
    """A robot model and the files it was read from."""

    model: RobotModel
    digest: str  # SHA-256 of the table
    mesh_files: Mapping[str, Path]  # mesh files by name as written in the table


def read_robot_table(path: Path) -> RobotModel:
    """Robot model of a joint-axis table; see `load_robot_table`."""
    return load_robot_table(path, file=str(path), folders=AllowedFolders(folder=path.parent)).model


def load_robot_table(path: Path, *, file: str, folders: AllowedFolders) -> RobotTable:
    """Read a joint-axis table and its meshes in these folders; an ``InputError`` has all findings about the table."""
    document = read_yaml(path, file=file)
    table, findings = validate(RobotTableDocument, document)
    findings += document.findings
    if table is not None:
        findings += _rules(table, document)
    meshes = _Meshes(document, folders, table.solids_path if table is not None else ())
    bodies = tuple(_bodies(table, meshes)) if table is not None and not findings else ()
    raise_findings(file, [*findings, *meshes.findings])
    if table is None:
        raise InputError(f"{file}: the table cannot be understood")
    return RobotTable(model=_model(table, bodies), digest=document.digest, mesh_files=meshes.files)


def _rules(table: RobotTableDocument, document: YamlDocument) -> Iterator[Finding]:
    """Names that must exist, and names that mean something else already."""
    for name in table.joints:
        if name == FOOT or TOOL_NAME.fullmatch(name):
            text = f"expected another name, '{name}' means {'the foot' if name == FOOT else 'the tool'} of the robot"
            yield document.key_finding(("joints", name), text)
    links, place = (FOOT, *table.joints), table.solids_path
    for index, body in enumerate(table.solids):
        if body.link not in links:
            yield document.finding((*place, index, "link"), unknown_name("a link", body.link, links))
        if body.name is not None and TOOL_NAME.fullmatch(body.name):
            text = f"expected another name, '{body.name}' means the tool of the robot"
            yield document.finding((*place, index, "name"), text)
    yield from inertia_findings(("inertias",), table.inertias, links, document)
    turning = tuple(name for name, joint in table.joints.items() if joint.type == "revolute")
    yield from payload_findings(("payload",), table.payload, turning, document)
    turns = {name: joint.type == "revolute" for name, joint in table.joints.items()}
    yield from controller_findings(("controller",), table.controller, turns, document)
    axes = {name: np.array(joint.axis, dtype=float) for name, joint in table.joints.items()}
    yield from sense_findings(("controller",), table.controller, axes, document)
    if table.reach is not None and table.reach.to not in (None, "flange", *table.joints):
        text = unknown_name("flange or a joint", str(table.reach.to), ("flange", *table.joints))
        yield document.finding(("reach", "to"), text)
    named = [(index, body.name) for index, body in enumerate(table.solids) if body.name is not None]
    for order, (index, name) in enumerate(named):
        if name in {other for _, other in named[:order]}:
            yield document.finding((*place, index, "name"), f"expected a name of its own, got '{name}' twice")


class _Meshes:
    """Mesh files of a table, each read once for each unit."""

    def __init__(self, document: YamlDocument, folders: AllowedFolders, place: KeyPath) -> None:
        """Keep the folders and the document that findings refer to."""
        self._document, self._place = document, place
        self._folders = folders
        self._read: dict[tuple[str, str | None], Mesh] = {}
        self.files: dict[str, Path] = {}
        self.findings: list[Finding] = []

    def mesh(self, written: str, unit: str | None, *, index: int) -> Mesh | None:
        """Mesh in [m]; None after a finding."""
        if (written, unit) in self._read:
            return self._read[written, unit]
        try:
            path = self._folders.file(written)
            guard = Guard(file=written, worker="the mesh reader")
            mesh = in_child(as_here(partial(read_drawing, unit=unit)), path, guard=guard)
        except InputError as error:
            self.findings.append(self._document.finding((*self._place, index, "mesh", "file"), str(error)))
            return None
        self.files[written] = path
        self._read[written, unit] = replace(mesh, is_leaky=not mesh.is_closed)
        return self._read[written, unit]

    def known(self, written: str, unit: str | None, *, index: int) -> Mesh:
        """A mesh that was read before."""
        mesh = self.mesh(written, unit, index=index)
        if mesh is None:
            raise InputError(f"{self._document.file}: mesh {shown(written)} could not be read")
        return mesh


def _bodies(table: RobotTableDocument, meshes: _Meshes) -> Iterator[Body]:
    """Link bodies; one whose mesh cannot be read is left out after its finding."""
    links = {FOOT: BASE, **{name: index for index, name in enumerate(table.joints)}}
    taken = {body.name for body in table.solids if body.name is not None}
    for index, entry in enumerate(table.solids):
        if entry.mesh is not None and meshes.mesh(entry.mesh.file, entry.mesh.unit, index=index) is None:
            continue
        name = entry.name or free_name(entry.link, taken)
        taken.add(name)
        shape, X_BS = link_solid(entry, partial(meshes.known, index=index))
        accuracy = si_or_none(entry.accuracy_mm)
        link = links[entry.link]
        yield Body(name=name, link=link, shape=shape, X_BS=X_BS, accuracy=accuracy, link_name=entry.link)


def _model(table: RobotTableDocument, bodies: tuple[Body, ...]) -> RobotModel:
    """The robot in [m] and [rad]."""
    joints = tuple(_joint(name, entry, index - 1) for index, (name, entry) in enumerate(table.joints.items()))
    model = RobotModel(
        name=table.robot,
        source=table.source,
        joints=joints,
        flange_link=len(table.joints) - 1,
        X_BF=table.flange.matrix,
        bodies=bodies,
        body_accuracy=_body_accuracy(table),
        payload=table.payload,
        controller=build_controller(table.controller, joints),
        reach=table.reach,
        links=tuple(
            Link(name=name, index=index - 1, X_BL=np.eye(4)) for index, name in enumerate((FOOT, *table.joints))
        ),
    )
    return with_inertias(model, table.inertias)


def _body_accuracy(table: RobotTableDocument) -> BodyAccuracyEntry | None:
    """How good the bodies are, if the table says so."""
    bodies = table.bodies
    if not isinstance(bodies, BodiesEntry) or bodies.accuracy_mm is None:
        return None
    return BodyAccuracyEntry(accuracy_mm=bodies.accuracy_mm, source=bodies.source)


def _joint(name: str, entry: JointEntry, parent: int) -> Joint:
    """A joint; its axis was checked to be of length 1 but for the digits it was written with."""
    kind = JointKind(entry.type)
    keys = TURNING_LIMITS if kind == JointKind.REVOLUTE else SLIDING_LIMITS
    limits: dict[str, Any] = {name: si_or_none(getattr(entry, key)) for name, key in zip(RATES, keys, strict=True)}
    axis = np.array(entry.axis)
    return Joint(
        name=name, kind=kind, parent=parent, axis_B=axis / np.linalg.norm(axis), point_B=in_si(entry.point_mm), **limits
    )


def bundled_names() -> tuple[str, ...]:
    """Names of all bundled robots, in alphabetical order."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_bundled(name: str) -> RobotModel:
    """A bundled robot; ``InputError`` where there is none of that name."""
    return load_bundled_table(name).model


@lru_cache(maxsize=16)
def load_bundled_table(name: str) -> RobotTable:
    """A bundled robot with the digest of its table; read once in each process."""
    names = bundled_names()
    if name not in names:
        hint = did_you_mean(name, names)
        raise InputError(
            "expected a bundled robot (`cellplan robots` lists them) or a .urdf, .xacro or .yaml file, got "
            f"{shown(name)}{hint}"
        )
    return load_robot_table(FOLDER / f"{name}.yaml", file=f"bundled:{name}", folders=AllowedFolders(folder=FOLDER))
