"""Shapes of a file, in millimetres, become solids in their own centred frames with a pose."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.files.schema.robot_table import LinkBodyEntry, SegmentEntry
from cellplan.files.schema.shapes import (
    BoxEntry,
    CylinderEntry,
    ObstacleEntry,
    PartShapeEntry,
    RoundEnds,
    SolidEntry,
    SphereEntry,
    ToolRoundEntry,
    ToolShapeEntry,
)
from cellplan.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Mesh, Shape, Solid, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.settings.entry import PoseEntry
from cellplan.model.settings.units import Mm, in_si

ALONG: Final = {
    "x": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "z": np.eye(3),
}  # rotations that bring the z axis of a round shape onto the named axis

MeshReader = Callable[[str, str | None], Mesh]  # (file as written, unit) -> mesh in [m]


def direction(written: str | tuple[float, float, float]) -> Array:
    """Unit vector of a word such as ``+x`` or of a vector of any length."""
    if isinstance(written, str):
        vector = np.zeros(3)
        vector["xyz".index(written[-1])] = -1.0 if written.startswith("-") else 1.0
        return vector
    return np.array(written) / np.linalg.norm(written)


def centred_solid(entry: PartShapeEntry | SolidEntry, read_mesh: MeshReader) -> tuple[Solid, Array]:
    """Solid of a shape that is centred on its frame, and the pose of the solid's own frame in it."""
    if entry.mesh is not None:
        return read_mesh(entry.mesh, entry.unit), np.eye(4)
    round_shape = entry.cylinder or getattr(entry, "capsule", None)
    X = np.eye(4)
    if round_shape is not None:
        X[:3, :3] = ALONG[round_shape.axis]
    return _primitive(entry.box or round_shape or entry.sphere), X


def obstacle_shape(entry: ObstacleEntry, read_mesh: MeshReader) -> tuple[Shape, Array]:
    """Shape of a fixed thing and its pose in the world."""
    if entry.plane is not None:
        return HalfSpace(), pose((0.0, 0.0, entry.plane.z_mm.si))
    solid, X_AS = centred_solid(entry, read_mesh)
    return solid, X_AS if entry.at is None else entry.at.matrix @ X_AS


def tool_solid(entry: ToolShapeEntry, X_FT: Array, read_mesh: MeshReader) -> tuple[Solid, Array]:
    """Solid that ends at the tool tip, and its pose in the flange frame."""
    if entry.mesh is not None:
        return read_mesh(entry.mesh, entry.unit), np.eye(4)
    solid = _primitive(entry.box or entry.cylinder or entry.capsule or entry.sphere)
    return solid, X_FT @ pose((0.0, 0.0, -_half_length(solid)))


def link_solid(entry: LinkBodyEntry, read_mesh: MeshReader) -> tuple[Solid, Array]:
    """Solid of a link and its pose in the robot's base frame."""
    if entry.mesh is not None:
        return read_mesh(entry.mesh.file, entry.mesh.unit), entry.mesh.at.matrix
    if entry.box is not None:
        placed = PoseEntry(xyz_mm=entry.box.center_mm, rpy_deg=entry.box.rpy_deg)
        return _box(entry.box.size_mm), placed.matrix
    if entry.sphere is not None:
        return Sphere(entry.sphere.radius_mm.si), pose(in_si(entry.sphere.center_mm))
    segment = entry.capsule or entry.cylinder
    if segment is None:
        raise ValueError("a link body without a shape")
    return _along_segment(segment, is_capsule=entry.capsule is not None)


def _primitive(entry: BoxEntry | CylinderEntry | ToolRoundEntry | RoundEnds | SphereEntry | None) -> Solid:
    """Solid in its own frame; capsules are measured from end to end in files and between centres here."""
    match entry:
        case BoxEntry():
            return _box(entry.size_mm)
        case RoundEnds():
            length = Mm(entry.length_mm - 2.0 * entry.radius_mm).si
            return Capsule(entry.radius_mm.si, length) if length > 0.0 else Sphere(entry.radius_mm.si)
        case CylinderEntry() | ToolRoundEntry():
            return Cylinder(entry.radius_mm.si, entry.length_mm.si)
        case SphereEntry():
            return Sphere(entry.radius_mm.si)
    raise ValueError("an entry without a shape")


def _half_length(solid: Solid) -> float:
    """Distance from the centre of a solid to its end along z, in [m]."""
    match solid:
        case Box(size):
            return 0.5 * size[2]
        case Cylinder(_, length):
            return 0.5 * length
        case Capsule(radius, length):
            return 0.5 * length + radius
        case Sphere(radius):
            return radius
        case _:
            return 0.0


def _along_segment(entry: SegmentEntry, *, is_capsule: bool) -> tuple[Solid, Array]:
    """Round solid along a segment; a capsule without length is a ball."""
    start, end = in_si(entry.from_mm), in_si(entry.to_mm)
    radius, length = entry.radius_mm.si, float(np.linalg.norm(end - start))
    X = pose(0.5 * (start + end))
    if length == 0.0:
        return Sphere(radius), X
    X[:3, :3] = _z_along((end - start) / length)
    return (Capsule(radius, length) if is_capsule else Cylinder(radius, length)), X


def _z_along(z: Array) -> Array:
    """A rotation whose z axis is the given unit vector; x is taken off the axis that z leans to least."""
    other = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(other, z)
    x = x / np.linalg.norm(x)
    y = np.cross(z, x)
    return np.column_stack([x, y / np.linalg.norm(y), z])


def _box(size: tuple[Mm, Mm, Mm]) -> Box:
    """A cuboid of these edge lengths."""
    x, y, z = size
    return Box((x.si, y.si, z.si))
