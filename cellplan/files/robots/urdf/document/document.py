"""URDF as it is written: links with solids, joints with limits and mimics, checked one by one and counted."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import did_you_mean, listed, shown
from cellplan.files.robots.urdf import XACRO_SUFFIX
from cellplan.files.robots.urdf.document.spelling import check_spelling, unused_names
from cellplan.files.robots.urdf.document.stated_limits import UrdfLimit, read_limit, without_slips_of_unit
from cellplan.files.robots.urdf.document.xacro import XacroSettings, read_elements
from cellplan.files.robots.urdf.document.xml import Element, Remarks, origin_of
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Sphere
from cellplan.geometry.transforms import Array

MAX_LINKS: Final = 1000  # a humanoid with two hands has 130
MAX_SIZE: Final = 20.0  # [m] larger bodies are a wrong unit
NAME: Final = re.compile(r"[A-Za-z0-9_/][A-Za-z0-9_./-]{0,119}")  # joints that are driven have stricter ones
MOVABLE: Final = ("revolute", "continuous", "prismatic")
REFUSED: Final = ("floating", "planar")
SHAPES: Final = ("box", "cylinder", "capsule", "sphere", "mesh")
FOREIGN: Final = frozenset({"gazebo", "transmission", "ros2_control", "sensor", "plugin", "group_state", "actuator"})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfMesh:
    """A mesh that a geometry names: the name as written and metres per unit of the file along x, y, z."""

    uri: str
    scale: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfSolid:
    """One collision (or visual) element; ``X_LS`` is the pose of its shape in the link frame."""

    element: Element
    shape: Box | Cylinder | Capsule | Sphere | UrdfMesh
    X_LS: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfLink:
    """A link and the solids that stand for it: its collision elements, or its visual ones when it has no others."""

    name: str
    element: Element
    solids: tuple[UrdfSolid, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfMimic:
    """``q = multiplier q_leader + offset``."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfJoint:
    """A joint: its frame in the parent link at zero, ``X_PJ``, and its unit axis in its own frame, ``axis_J``."""

    name: str
    kind: str
    element: Element
    parent: str
    child: str
    X_PJ: Array
    axis_J: Array
    limit: UrdfLimit
    mimic: UrdfMimic | None

    @property
    def is_fixed(self) -> bool:
        """Whether the joint does not move at all."""
        return self.kind == "fixed"

    def error(self, what: str) -> InputError:
        """Finding about this joint, with its line."""
        return self.element.error(f"joint '{self.name}': {what}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfDocument:
    """All links and joints of a file by name, in its order."""

    file: str  # name of the file, without folders
    name: str  # name of the robot
    links: dict[str, UrdfLink]  # links by name
    joints: dict[str, UrdfJoint]  # joints by name
    remarks: tuple[str, ...] = ()  # what was not read, one line for each kind
    included: tuple[Path, ...] = ()  # files that a xacro file includes, each once


Named = TypeVar("Named", UrdfLink, UrdfJoint)


def read_document(path: Path, settings: XacroSettings | None = None, *, used: tuple[str, ...] = ()) -> UrdfDocument:
    """Read a URDF, or expand a file ``.xacro`` with its settings into one, and check every element for itself.

    Names that the reader uses beside these are ``used``: they are not listed as unused.

    An ``InputError`` has file and line of what is missing, double, misspelt, out of range or not supported.
    """
    remarks = Remarks()
    root, included = read_elements(path, settings, remarks)
    if root.tag != "robot":
        raise root.error(f"expected a URDF with the root element <robot>, got <{shown(root.tag)[1:-1]}>")
    for element in root.walk(frozenset()):
        if element.tag.startswith("xacro:"):
            raise element.error(
                f"expected plain URDF, got <{element.tag}>: let the name of the file end in {XACRO_SUFFIX}"
            )
    check_spelling(root.all("link"), root.all("joint"), remarks)
    _leave_out_nameless_meshes(root.all("link"), remarks)
    links = _by_name(_link(element) for element in root.all("link"))
    joints = _by_name(_joint(element, remarks) for element in root.all("joint"))
    turning = [(it.name, it.element, it.limit) for it in joints.values() if it.kind == "revolute"]
    for (name, *_), limit in zip(turning, without_slips_of_unit(turning, remarks), strict=True):
        joints[name] = replace(joints[name], limit=limit)
    if not 1 <= len(links) <= MAX_LINKS:
        hint = ": is it a file of macros that others include?" if included is not None and not links else ""
        raise InputError(f"{path.name}: expected 1 to {MAX_LINKS} links, got {len(links)}{hint}")
    _require_nothing_hidden(root, links, joints)
    if unused := list(dict.fromkeys(name for name in unused_names(root) if name not in used)):
        remarks.add("unused", f"{path.name}: known, but not used: {listed(unused)}")
    return UrdfDocument(
        file=path.name, name=_name(root), links=links, joints=joints, remarks=remarks.lines, included=included or ()
    )


def _leave_out_nameless_meshes(links: Iterable[Element], remarks: Remarks) -> None:
    """Drop collision and visual elements whose mesh has an empty file name, with a remark: they have no shape."""
    for link in links:
        for element in link.all("collision", "visual"):
            meshes = [mesh for geometry in element.all("geometry") for mesh in geometry.all("mesh")]
            if any(not mesh.attributes.get("filename", "-").strip() for mesh in meshes):
                link.children.remove(element)
                text = f"link '{link.attributes.get('name', '')}': <{element.tag}> names no mesh file: it has no body"
                remarks.add(f"no file of a {element.tag}", text, element)


def _by_name(things: Iterable[Named]) -> dict[str, Named]:
    """Links or joints by name; a second one of the same name is refused."""
    named: dict[str, Named] = {}
    for thing in things:
        if thing.name in named:
            first = named[thing.name].element
            raise thing.element.error(f"{first.tag} '{thing.name}': is already defined in line {first.line}")
        named[thing.name] = thing
    return named


def _require_nothing_hidden(root: Element, links: dict[str, UrdfLink], joints: dict[str, UrdfJoint]) -> None:
    """Count links, joints and collisions wherever they stand: none may lie where the reader does not read."""
    everywhere = [element for element in root.walk(FOREIGN) if element.tag in ("link", "joint", "collision")]
    known = {id(link.element) for link in links.values()} | {id(joint.element) for joint in joints.values()}
    known |= {id(solid.element) for link in links.values() for solid in link.solids}
    for element in everywhere:
        if id(element) not in known:
            raise element.error(f"expected <{element.tag}> directly below its owner: here it would be lost")


def _name(element: Element) -> str:
    """Name of a link, a joint or the robot."""
    name = element.text("name", element.tag)
    if not NAME.fullmatch(name):
        what = "a name of 1 to 120 letters, digits, '_', '-', '.' or '/' that does not start with '-' or '.'"
        raise element.error(f"{element.tag}: expected {what}, got {shown(name)}")
    return name


def _link(element: Element) -> UrdfLink:
    """One link; a link that is drawn but has no collision body gets the drawn one."""
    name = _name(element)
    owner = f"link '{name}'"
    shapes = element.all("collision") or element.all("visual")
    return UrdfLink(name=name, element=element, solids=tuple(read_solid(solid, owner) for solid in shapes))


def read_solid(element: Element, owner: str) -> UrdfSolid:
    """One collision or visual element."""
    geometry = element.one("geometry", owner)
    shapes = [] if geometry is None else geometry.all(*SHAPES) or geometry.children
    if len(shapes) != 1:
        count = len(shapes)
        raise element.error(f"{owner}: expected <{element.tag}> with a <geometry> of one shape, got {count} shapes")
    return UrdfSolid(element=element, shape=_shape(shapes[0], owner), X_LS=origin_of(element, owner))


def _shape(element: Element, owner: str) -> Box | Cylinder | Capsule | Sphere | UrdfMesh:
    match element.tag:
        case "box":
            x, y, z = _sizes(element, "size", 3, owner=owner)
            return Box((x, y, z))
        case "cylinder":
            return Cylinder(_size(element, "radius", owner), _size(element, "length", owner))
        case "capsule":
            return Capsule(_size(element, "radius", owner), _size(element, "length", owner))
        case "sphere":
            return Sphere(_size(element, "radius", owner))
        case "mesh":
            return UrdfMesh(uri=element.text("filename", owner), scale=_scale(element, owner))
        case other:
            raise element.error(f"{owner}: expected a box, cylinder, capsule, sphere or mesh, got <{other}>")


def _sizes(element: Element, name: str, count: int, *, owner: str) -> list[float]:
    """Positive lengths of a likely size in [m]."""
    values = element.numbers(name, count, owner=owner)
    if np.any(values <= 0.0):
        raise element.error(f"{owner}: expected a positive '{name}', got {shown(element.attributes[name])}")
    if np.any(values > MAX_SIZE):
        given = shown(element.attributes[name])
        raise element.error(f"{owner}: expected a '{name}' of at most {MAX_SIZE:g} m, got {given}: is the unit mm?")
    return [float(value) for value in values]


def _size(element: Element, name: str, owner: str) -> float:
    """One positive length in [m]."""
    return _sizes(element, name, 1, owner=owner)[0]


def _scale(element: Element, owner: str) -> tuple[float, float, float]:
    """Metres per unit of a mesh file along its axes; one number stands for all three."""
    count = 1 if len(element.attributes.get("scale", "1 1 1").split()) == 1 else 3
    values = np.broadcast_to(element.numbers("scale", count, owner=owner, default=(1.0,) * count), (3,))
    if np.any(values == 0.0):
        raise element.error(f"{owner}: expected a 'scale' without zeros, got {shown(element.attributes['scale'])}")
    return (float(values[0]), float(values[1]), float(values[2]))


def _joint(element: Element, remarks: Remarks) -> UrdfJoint:
    name = _name(element)
    owner = f"joint '{name}'"
    kind = element.text("type", owner)
    if kind in REFUSED:
        raise element.error(f"{owner}: expected one axis at most, got the type '{kind}', which is not supported")
    if kind not in (*MOVABLE, "fixed"):
        hint = did_you_mean(kind, (*MOVABLE, "fixed"))
        raise element.error(
            f"{owner}: expected the type revolute, continuous, prismatic or fixed, got {shown(kind)}{hint}"
        )
    ends = {tag: element.one(tag, owner) for tag in ("parent", "child")}
    for tag, end in ends.items():
        if end is None:
            raise element.error(f"{owner}: expected <{tag} link=…>, got none")
    parent, child = (end.text("link", owner) for end in ends.values() if end is not None)
    return UrdfJoint(
        name=name,
        kind=kind,
        element=element,
        parent=parent,
        child=child,
        X_PJ=origin_of(element, owner),
        axis_J=np.array([1.0, 0.0, 0.0]) if kind == "fixed" else _axis(element, owner),
        limit=read_limit(element, owner, kind=kind, remarks=remarks),
        mimic=None if kind == "fixed" else _mimic(element, owner),
    )


def _axis(element: Element, owner: str) -> Array:
    """Unit axis in the joint frame; x when the file names none."""
    axis = element.one("axis", owner)
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    vector = axis.numbers("xyz", 3, owner=owner)
    length = float(np.linalg.norm(vector))
    if not 1e-6 < length < 1e6:
        raise axis.error(f"{owner}: expected an axis that is not zero, got {shown(axis.attributes['xyz'])}")
    return vector / length


def _mimic(element: Element, owner: str) -> UrdfMimic | None:
    """The joint that drives this one through a linkage."""
    mimic = element.one("mimic", owner)
    if mimic is None:
        return None
    return UrdfMimic(
        leader=mimic.text("joint", owner),
        multiplier=mimic.number("multiplier", owner, default=1.0),
        offset=mimic.number("offset", owner, default=0.0),
    )
