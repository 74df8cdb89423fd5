"""What stands below a robot and what is mounted on its links: entries of a cell file become the cell's data."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from cellplan.files.input.findings import Finding, KeyPath, listed, unknown_name
from cellplan.files.schema.mounting import (
    AttachmentEntry,
    ColumnEntry,
    HangingEntry,
    PedestalEntry,
    RailBodyEntry,
    WallEntry,
)
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.schema.shapes import ObstacleEntry
from cellplan.files.shapes import MeshReader, centred_solid, direction
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.cell.mounting import Bracket, Hanger, Mount, Pedestal, Wedge
from cellplan.model.robot.robot import BASE, Body, Joint, JointKind, RobotModel, free_name, on_rail
from cellplan.model.settings.units import Mm, si_or_none

PEDESTAL: Final = "pedestal"  # name of the body
MOUNT: Final = "mount"  # name of the body of all other mounts
TILTED: Final = ("mount", "tilted")
RAIL_LINKS: Final[Mapping[str, int]] = {"track": BASE, "carriage": BASE + 1}  # lists of solids of a rail -> their link
STEEPEST_DEG: Final = 75.0  # a steeper base has hardly anything below it: it is fixed to a wall
MOST_LEAN_DEG: Final = 1.0  # [deg] of a base on a pedestal: calibration, not a tilted or hanging arm
SHORTEST_MM: Final = 1e-3  # [mm] a lower pedestal is none


def build_mount(entry: RobotEntry, environment: Mapping[str, ObstacleEntry]) -> Mount | None:
    """What a robot stands on, hangs from or is fixed to; None without a body."""
    path, column = _column(entry)
    if column is None:
        return None
    radius = None if column.cylinder is None else column.cylinder.radius_mm.si
    size = None if column.box is None else (column.box.size_mm[0].si, column.box.size_mm[1].si)
    if isinstance(column, HangingEntry):
        return Hanger(radius=radius, size=size, ceiling=column.ceiling_z_mm.si)
    if isinstance(column, WallEntry):
        return Bracket(radius=radius, size=size, length=column.length_mm.si)
    floor = (floor_height_mm(entry, environment) or Mm(0.0)).si
    return (Wedge if path == TILTED else Pedestal)(radius=radius, size=size, floor=floor)


def _column(entry: RobotEntry) -> tuple[KeyPath, ColumnEntry | None]:
    """The column that a robot is mounted on, and its key path below the robot; None without one."""
    if entry.mount is None:
        return ("pedestal",), entry.pedestal
    key, given = next((key, given) for key, given in entry.mount if given is not None)
    return ("mount", key), given if isinstance(given, ColumnEntry) else None


def with_floor_height(
    values: dict[str, Any], entry: RobotEntry, environment: Mapping[str, ObstacleEntry]
) -> dict[str, Any]:
    """A robot as plain values with the height of the floor written out, where it stands on one."""
    path, column = _column(entry)
    if isinstance(column, PedestalEntry):
        inner = values
        for key in path:
            inner = inner[str(key)]
        inner["floor_z_mm"] = floor_height_mm(entry, environment)
    return values


def on_mount(entry: RobotEntry, model: RobotModel) -> RobotModel:
    """The robot with the joint of its rail before all others, if it has one."""
    rail = entry.mount.rail if entry.mount is not None else None
    if rail is None:
        return model
    joint = Joint(
        name=rail.name,
        kind=JointKind.PRISMATIC,
        parent=BASE,
        axis_B=direction(rail.axis),
        point_B=np.zeros(3),
        lower=rail.lower_mm.si,
        upper=rail.upper_mm.si,
        velocity=rail.velocity_mm_s.si,
        acceleration=si_or_none(rail.acceleration_mm_s2),
        jerk=si_or_none(rail.jerk_mm_s3),
    )
    return on_rail(model, joint)


def rail_entries(entry: RobotEntry) -> Iterator[tuple[str, int, RailBodyEntry]]:
    """Solids of the rail of a robot with the key that they stand under and their place in its list."""
    rail = entry.mount.rail if entry.mount is not None else None
    for key in RAIL_LINKS if rail is not None else ():
        for index, solid in enumerate(getattr(rail, key)):
            yield key, index, solid


def rail_bodies(entry: RobotEntry, read_mesh: MeshReader) -> Iterator[Body]:
    """Solids of the rail of a robot, taken as exact like all that a cell draws."""
    for key, index, solid in rail_entries(entry):
        shape, X_AS = centred_solid(solid, read_mesh)
        name, X_BS = _rail_body_name(key, index), solid.at.matrix @ X_AS
        yield Body(name=name, link=RAIL_LINKS[key], shape=shape, X_BS=X_BS, accuracy=0.0)


def _rail_body_name(key: str, index: int) -> str:
    """Name of a solid of a rail: ``track``, ``track_2``, …."""
    return key if index == 0 else f"{key}_{index + 1}"


def floor_height_mm(entry: RobotEntry, environment: Mapping[str, ObstacleEntry]) -> Mm | None:
    """Height of the floor that a column stands on: as stated, or the highest plane not above the base."""
    _, column = _column(entry)
    if isinstance(column, PedestalEntry) and column.floor_z_mm is not None:
        return column.floor_z_mm
    planes = [thing.plane.z_mm for thing in environment.values() if thing.plane is not None]
    return max((z_mm for z_mm in planes if z_mm <= entry.base.xyz_mm[2] + SHORTEST_MM), default=None)


def build_attachments(entries: Iterable[AttachmentEntry], model: RobotModel, read_mesh: MeshReader) -> tuple[Body, ...]:
    """Solids mounted on links, in the base frame while all joints read zero."""
    links = {link.name: link for link in model.links}
    entries = tuple(entries)
    bodies = []
    for name, entry in zip(attachment_names(entries), entries, strict=True):
        link = links[entry.link]
        solid, X_AS = centred_solid(entry, read_mesh)
        X_BS = link.X_BL @ entry.at.matrix @ X_AS
        bodies.append(Body(name=name, link=link.index, shape=solid, X_BS=X_BS))
    return tuple(bodies)


def attachment_names(entries: Iterable[AttachmentEntry]) -> tuple[str, ...]:
    """Names of the attachments of one robot; those without one are numbered from 2 on."""
    entries = tuple(entries)
    taken = {entry.name for entry in entries if entry.name is not None}
    names = []
    for entry in entries:
        name = entry.name or free_name("attachment", taken)
        taken.add(name)
        names.append(name)
    return tuple(names)


def mounted_names(entry: RobotEntry) -> tuple[str, ...]:
    """Names of all bodies that a cell gives a robot beside its tool."""
    return (*attachment_names(entry.attachments), *_mount_names(entry))


def _mount_names(entry: RobotEntry) -> tuple[str, ...]:
    path, column = _column(entry)
    below = () if column is None else (PEDESTAL if path[-1] == PEDESTAL else MOUNT,)
    return (*below, *(_rail_body_name(key, index) for key, index, _ in rail_entries(entry)))


def mounting_findings(name: str, model: RobotModel, valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """What a cell mounts on a robot or puts below it must fit its links, its base and the floor."""
    entry = valid.robots[name]
    yield from _attachment_findings(name, entry, model, document)
    mount, column = _column(entry)
    path = ("robots", name, *mount)
    yield from _rail_findings(name, entry, model, document)
    if column is None:
        return
    carrier = PEDESTAL if mount[-1] == PEDESTAL else MOUNT
    if any(body.name == carrier for body in model.bodies):
        yield document.key_finding(path, f"unexpected key, a body of the model is called '{carrier}' already")
    if isinstance(column, PedestalEntry):
        yield from _floor_findings(path, entry, column, valid=valid, document=document)
    if isinstance(column, HangingEntry) and column.ceiling_z_mm - entry.base.xyz_mm[2] < SHORTEST_MM:
        text = f"expected a ceiling above the base at {entry.base.xyz_mm[2]:g} mm, got {column.ceiling_z_mm:g} mm"
        yield document.finding((*path, "ceiling_z_mm"), text)
    yield from _lean_findings(path, entry, document)


def _rail_findings(name: str, entry: RobotEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """A rail has a name and bodies of its own, and one place for its limits."""
    rail, path = entry.mount.rail if entry.mount is not None else None, ("robots", name, "mount", "rail")
    if rail is None:
        return
    taken = {*model.joint_names[1:], *(link.name for link in model.links)}
    if rail.name in taken or rail.name == "tool" or rail.name.startswith("tool_"):
        text = f"expected another name, '{rail.name}' means another joint or link of the robot"
        yield document.finding((*path, "name") if "name" in rail.model_fields_set else path, text)
    if rail.name in entry.limits:
        text = f"unexpected key, the limits of '{rail.name}' are those of mount.rail: change them there"
        yield document.key_finding(("robots", name, "limits", rail.name), text)
    bodies = {body.name for body in model.bodies}
    for key, index, _ in rail_entries(entry):
        if (body := _rail_body_name(key, index)) in bodies:
            text = f"unexpected solid, a body of the model is called '{body}' already"
            yield document.finding((*path, key, index), text)


def _attachment_findings(name: str, entry: RobotEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """Links that exist, and names of their own."""
    links = [link.name for link in model.links]
    taken = {body.name for body in model.bodies} | {PEDESTAL, *_mount_names(entry)}
    seen: set[str] = set()
    for index, attachment in enumerate(entry.attachments):
        path = ("robots", name, "attachments", index)
        if attachment.link not in links:
            text = unknown_name("a link of the robot", attachment.link, links)
            yield document.finding((*path, "link"), text)
        attached = attachment.name
        if attached is None:
            continue
        if attached in taken or attached == "tool" or attached.startswith("tool_"):
            text = f"expected another name, '{attached}' means another body of the robot"
            yield document.finding((*path, "name"), text)
        if attached in seen:
            yield document.finding((*path, "name"), f"expected a name of its own, got '{attached}' twice")
        seen.add(attached)


def _floor_findings(
    path: KeyPath, entry: RobotEntry, pedestal: PedestalEntry, *, valid: ValidEntries, document: YamlDocument
) -> Iterator[Finding]:
    """A pedestal stands on a floor, below the base."""
    height, floor = entry.base.xyz_mm[2], floor_height_mm(entry, valid.environment)
    if floor is None:
        text = "missing, expected the height of the floor: no plane of the environment lies below the base"
        yield document.finding((*path, "floor_z_mm"), text)
    elif height - floor < SHORTEST_MM:
        text = f"expected a base above the floor at {floor:g} mm, got one at {height:g} mm: leave the pedestal out"
        yield document.finding(path if pedestal.floor_z_mm is None else (*path, "floor_z_mm"), text)
    elif path[-2:] == TILTED:
        wedge = build_mount(entry, valid.environment)
        if wedge is not None and wedge.solid(entry.base.matrix) is None:
            text = "expected a column that ends above the floor on all sides, got one that is too wide for its height"
            yield document.finding(path, text)


def _lean_findings(path: KeyPath, entry: RobotEntry, document: YamlDocument) -> Iterator[Finding]:
    """A base stands upright on a pedestal, hangs upside down, and leans on a tilted mount."""
    lean = math.degrees(math.acos(min(1.0, max(-1.0, float(entry.base.matrix[2, 2])))))
    if path[-1] == "hanging" and 180.0 - lean > MOST_LEAN_DEG:
        text = f"expected a base upside down, such as rpy_deg: [180, 0, 0], got one that leans by {lean:.4g} deg"
        yield document.finding(path, text)
    elif path[-1] == "tilted" and lean > STEEPEST_DEG:
        text = f"expected a base that leans by at most {STEEPEST_DEG:g} deg, got {lean:.4g} deg: use wall or hanging"
        yield document.finding(path, text)
    elif path[-1] == PEDESTAL and lean > MOST_LEAN_DEG:
        text = (
            f"expected a base that stands upright, got one that leans by {lean:.4g} deg: "
            "use mount: {tilted: …}, {wall: …} or {hanging: …}"
        )
        yield document.finding(path, text)


def accuracy_findings(
    valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument
) -> Iterator[Finding]:
    """An accuracy can be added to the clearance only where it is stated."""
    if valid.checks is None or valid.checks.body_accuracy != "add":
        return
    unknown = [name for name, model in models.items() if any(model.accuracy_of(body) is None for body in model.bodies)]
    if unknown:
        cure = f"state robots.{unknown[0]}.bodies: {{accuracy_mm: …, source: …}}"
        text = f"expected stated accuracies of all link bodies to add, got none for {listed(unknown)}: {cure}"
        yield document.finding(("checks", "body_accuracy"), text)
