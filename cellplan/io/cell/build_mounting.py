"""What stands below a robot and what is mounted on its links: entries of a cell file become the cell's data."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from cellplan.io.input.findings import Finding, listed, unknown_name
from cellplan.io.schema.mounting import AttachmentEntry, PedestalEntry
from cellplan.io.schema.partial import ValidEntries
from cellplan.io.schema.robot import RobotEntry
from cellplan.io.schema.shapes import ObstacleEntry
from cellplan.io.schema.units import Mm
from cellplan.io.shapes import MeshReader, centred_solid, pose_from_entry
from cellplan.io.yaml.reader import YamlDocument
from cellplan.model.mounting import Pedestal
from cellplan.model.robot import Body, RobotModel

PEDESTAL: Final = "pedestal"  # name of the body
MOST_LEAN_DEG: Final = 1.0  # [deg] of a base on a pedestal: calibration, not a tilted or hanging arm
ROOM_MM: Final = 1e-3  # [mm] a lower pedestal is none


def build_pedestal(entry: RobotEntry, environment: Mapping[str, ObstacleEntry]) -> Pedestal | None:
    """The pedestal of a robot; None without one."""
    pedestal = entry.pedestal
    if pedestal is None:
        return None
    floor = floor_height_mm(entry, environment)
    size = None if pedestal.box is None else (pedestal.box.size_mm[0].si, pedestal.box.size_mm[1].si)
    return Pedestal(
        radius=None if pedestal.cylinder is None else pedestal.cylinder.radius_mm.si,
        size=size,
        floor=(floor or Mm(0.0)).si,
    )


def floor_height_mm(entry: RobotEntry, environment: Mapping[str, ObstacleEntry]) -> Mm | None:
    """Height of the floor that a pedestal stands on: as stated, or the highest plane not above the base."""
    if entry.pedestal is not None and entry.pedestal.floor_z_mm is not None:
        return entry.pedestal.floor_z_mm
    planes = [thing.plane.z_mm for thing in environment.values() if thing.plane is not None]
    return max((z_mm for z_mm in planes if z_mm <= entry.base.xyz_mm[2] + ROOM_MM), default=None)


def build_attachments(entries: Iterable[AttachmentEntry], model: RobotModel, read_mesh: MeshReader) -> tuple[Body, ...]:
    """Solids mounted on links, in the base frame while all joints read zero."""
    links = {link.name: link for link in model.links}
    entries = tuple(entries)
    bodies = []
    for name, entry in zip(attachment_names(entries), entries, strict=True):
        link = links[entry.link]
        solid, X_AS = centred_solid(entry, read_mesh)
        X_BS = link.X_BL @ pose_from_entry(entry.at) @ X_AS
        bodies.append(Body(name=name, link=link.index, shape=solid, X_BS=X_BS))
    return tuple(bodies)


def attachment_names(entries: Iterable[AttachmentEntry]) -> tuple[str, ...]:
    """Names of the attachments of one robot; those without one are numbered from 2 on."""
    entries = tuple(entries)
    taken = {entry.name for entry in entries if entry.name is not None}
    names = []
    for entry in entries:
        name, number = entry.name or "attachment", 2
        while entry.name is None and name in taken:
            name, number = f"attachment_{number}", number + 1
        taken.add(name)
        names.append(name)
    return tuple(names)


def mounted_names(entry: RobotEntry) -> tuple[str, ...]:
    """Names of all bodies that a cell gives a robot beside its tool."""
    return (*attachment_names(entry.attachments), *([PEDESTAL] if entry.pedestal is not None else []))


def mounting_findings(name: str, model: RobotModel, valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """What a cell mounts on a robot or puts below it must fit its links, its base and the floor."""
    entry = valid.robots[name]
    yield from _attachment_findings(name, entry, model, document)
    if entry.pedestal is not None:
        yield from _pedestal_findings(name, entry, entry.pedestal, valid=valid, document=document)
        if any(body.name == PEDESTAL for body in model.bodies):
            text = "unexpected key, a body of the model is called 'pedestal' already"
            yield document.key_finding(("robots", name, "pedestal"), text)


def _attachment_findings(name: str, entry: RobotEntry, model: RobotModel, document: YamlDocument) -> Iterator[Finding]:
    """Links that exist, and names of their own."""
    links = [link.name for link in model.links]
    taken = {body.name for body in model.bodies} | {PEDESTAL}
    seen: set[str] = set()
    for index, attachment in enumerate(entry.attachments):
        path = ("robots", name, "attachments", index)
        if attachment.link not in links:
            text = unknown_name("a link of the robot", attachment.link, links)
            yield document.finding((*path, "link"), text)
        own = attachment.name
        if own is None:
            continue
        if own in taken or own == "tool" or own.startswith("tool_"):
            text = f"expected another name, '{own}' means another body of the robot"
            yield document.finding((*path, "name"), text)
        if own in seen:
            yield document.finding((*path, "name"), f"expected a name of its own, got '{own}' twice")
        seen.add(own)


def _pedestal_findings(
    name: str, entry: RobotEntry, pedestal: PedestalEntry, *, valid: ValidEntries, document: YamlDocument
) -> Iterator[Finding]:
    """A pedestal stands on a floor, below an upright base."""
    path, height = ("robots", name, "pedestal"), entry.base.xyz_mm[2]
    floor = floor_height_mm(entry, valid.environment)
    if floor is None:
        text = "missing, expected the height of the floor: no plane of the environment lies below the base"
        yield document.finding((*path, "floor_z_mm"), text)
    elif height - floor < ROOM_MM:
        text = f"expected a base above the floor at {floor:g} mm, got one at {height:g} mm: leave the pedestal out"
        yield document.finding(path if pedestal.floor_z_mm is None else (*path, "floor_z_mm"), text)
    lean = math.degrees(math.acos(min(1.0, max(-1.0, float(pose_from_entry(entry.base)[2, 2])))))
    if lean > MOST_LEAN_DEG:
        text = (
            f"expected a base that stands upright, got one that leans by {lean:.4g} deg: "
            "draw what it hangs on or stands on in the environment"
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
