"""Shapes of a 3-D page: each once, meshes with as few triangles as a picture needs."""

from collections.abc import Hashable
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import PurePosixPath
from typing import Final

import numpy as np

from cellplan.cache import as_here
from cellplan.errors import InputError
from cellplan.files.cell.load import CellFile
from cellplan.files.cell.referenced_files import URDF_SUFFIXES, argument_text
from cellplan.files.cell.user_folders import user_folders
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.urdf.load import UrdfOptions
from cellplan.files.robots.urdf.visuals import Visual, read_visuals
from cellplan.geometry.mesh.decimate import decimated
from cellplan.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Mesh, Shape, Sphere
from cellplan.guard import Guard, in_child
from cellplan.jobs.view.result import Numbers, packed, point_numbers
from cellplan.model.cell.cell import Cell
from cellplan.report.record.common import Record

MESH_TRIANGLES: Final = 160_000  # [-] of all meshes of a page: 2 MB, and smooth where a browser draws without hardware
FEWEST: Final = 400  # [-] triangles that every mesh may keep
STEPS: Final = 65535  # [-] of 16 bit

_ROUNDED: Final = 9  # decimals of dimensions in [m]


@dataclass(slots=True)
class Geometries:
    """The shapes of a page in the order in which they were first used."""

    records: list[Record] = field(default_factory=list)  # the shapes
    # what the file of each robot draws, by its name; read when it is first asked for
    visuals: dict[str, tuple[Visual, ...]] = field(default_factory=dict)
    weights: dict[Hashable, int] = field(default_factory=dict)  # triangles of each mesh in its file, by its key
    _places: dict[Hashable, int] = field(default_factory=dict)

    def announce(self, shapes: list[Shape]) -> None:
        """Name the shapes that are going to be asked for, so that their meshes share the triangles of a page."""
        for shape in shapes:
            if isinstance(shape, Mesh):
                self.weights[shape_key(shape)] = len(shape.faces)

    def visuals_of(self, cell: Cell, robot: str) -> tuple[Visual, ...]:
        """What the file of a robot draws; the robots of all scenes of a page are the same."""
        if robot not in self.visuals:
            self.visuals[robot] = robot_visuals(cell, robot)
        return self.visuals[robot]

    def place(self, shape: Shape) -> int:
        """Number of a shape."""
        key = shape_key(shape)
        if key not in self._places:
            self.announce([shape])
            self._places[key] = len(self.records)
            self.records.append(self._record(shape))
        return self._places[key]

    def _record(self, shape: Shape) -> Record:
        """One shape."""
        match shape:
            case Box(size):
                return {"box": _plain(*size)}
            case Cylinder(radius, length):
                return {"cylinder": _plain(radius, length)}
            case Capsule(radius, length):
                return {"capsule": _plain(radius, length)}
            case Sphere(radius):
                return {"sphere": _plain(radius)}
            case HalfSpace():
                return {"plane": []}
            case Mesh():
                share = MESH_TRIANGLES / max(MESH_TRIANGLES, sum(self.weights.values()))
                return mesh_record(shape, max(FEWEST, int(share * len(shape.faces))))


def shape_key(shape: Shape) -> Hashable:
    """What two shapes have in common that look the same."""
    if not isinstance(shape, Mesh):
        return shape
    return shape.source, sha256(shape.vertices.tobytes() + np.ascontiguousarray(shape.faces).tobytes()).digest()


def mesh_record(mesh: Mesh, limit: int) -> Record:
    """A mesh with about as many triangles as a limit says, its points on a grid of 16 bit along each axis."""
    reduced = decimated(mesh, limit)
    low = reduced.points.min(axis=0)
    size = np.maximum(reduced.points.max(axis=0) - low, 1e-9)
    steps = np.rint((reduced.points - low) / size * STEPS)
    rounding = float(np.linalg.norm(size / STEPS / 2))
    return {
        "low": [float(coordinate) for coordinate in low],
        "size": [float(length) for length in size],
        "points": packed(steps, "<u2"),
        "triangles": packed(reduced.triangles, "<u2" if len(reduced.points) <= STEPS + 1 else "<u4"),
        "deviation": point_numbers(np.array([reduced.deviation + rounding]))[0],
    }


def _plain(*values: float) -> Numbers:
    return [round(float(value), _ROUNDED) for value in values]


def robot_visuals(cell: Cell, robot: str) -> tuple[Visual, ...]:
    """Visual elements of a robot; none of a robot without a URDF, or whose URDF cannot be read any more."""
    source = cell.origin.source
    if not isinstance(source, CellFile):
        return ()
    entry = source.written["robots"][robot]
    written = str(entry["model"])
    if PurePosixPath(written).suffix.lower() not in URDF_SUFFIXES:
        return ()
    folders = AllowedFolders(folder=source.folder, allowed=(*source.allow_dirs, *user_folders(source.folder)))
    try:
        options = UrdfOptions(
            package_dirs=tuple(folders.directory(folder) for folder in entry.get("package_dirs", ())),
            within=folders,
            xacro_args={key: argument_text(value) for key, value in entry.get("xacro_args", {}).items()},
        )
        guard = Guard(file=written, worker="the URDF reader")
        return in_child(as_here(read_visuals), folders.file(written), options, guard=guard)
    except InputError:
        return ()
