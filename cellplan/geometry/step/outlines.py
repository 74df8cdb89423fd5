"""Outlines of drawings on the solids of a STEP file: on one of its plane faces, or projected onto all of them."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.flat_curves import Contour
from cellplan.geometry.curves.placed_contours import Ground, Projected, drawing_pose, place_contours
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.step.drawing import names_of_faces
from cellplan.geometry.step.kernel import Face, Solid, first_hits
from cellplan.geometry.step.reader import read_solids

MOST_LISTED: Final = 12  # names in a message


class FaceError(InputError):
    """A STEP file has no face of that name, or it is not plane."""


class Outline(NamedTuple):
    """Contours, and how they come to lie on a part."""

    source: str  # name of their file, for messages
    contours: tuple[Contour, ...]
    ground: str | Array  # name of a plane face, or the unit direction, shape (3,), that they are projected from
    X_FD: Array  # pose of the drawing in the frame of the face or of the projection, shape (4, 4)
    chord: float  # distance in [m] within which sides follow them


class PlacedOutline(NamedTuple):
    """Contours on a part, and the direction out of it from which they are seen, shape (3,)."""

    lines: list[SeamLine]
    direction: Array


def place_on_step(path: Path, file: str, shape: str | None, digest: str, outline: Outline) -> PlacedOutline:
    """An outline on the solids of a STEP file, or on those of a shape of that name, in the frame of the file.

    ``digest`` is that of the file: solids that were read last are not read again.

    Raises:
        FaceError: There is no plane face of that name.
        InputError: The file cannot be read, or the outline does not lie on it; see `place_contours`.
    """
    solids = _solids(path, file, shape, digest)
    if isinstance(outline.ground, str):
        ground = _on_face(_plane_face(solids, outline.ground), outline)
    else:
        ground = _on_solids(solids, outline.ground, outline)
    return PlacedOutline(place_contours(outline.contours, ground, outline.chord, outline.source), ground.X_PD[:3, 2])


@lru_cache(maxsize=1)
def _solids(path: Path, file: str, shape: str | None, digest: str) -> list[Solid]:  # noqa: ARG001 - part of the key
    """The solids of a file."""
    return read_solids(path, file, shape).solids


def _plane_face(solids: Sequence[Solid], name: str) -> Face:
    """The plane face of a name."""
    faces = dict(zip(names_of_faces(solids), (face for solid in solids for face in solid.faces), strict=True))
    plane = [other for other, face in faces.items() if face.kind == "plane"]
    if name not in plane:
        kind = f"which is a {faces[name].kind}: project the outline (project: +z)" if name in faces else "which is none"
        more = f" and {len(plane) - MOST_LISTED} more" if len(plane) > MOST_LISTED else ""
        known = ", ".join(plane[:MOST_LISTED]) + more
        raise FaceError(f"expected a plane face of the STEP file ({known}), got '{name}', {kind}")
    return faces[name]


def _on_face(face: Face, outline: Outline) -> Ground:
    """A plane face."""
    _, (foot,), (normal,) = face.project(np.zeros((1, 3)))

    def project(points: Array) -> Projected:
        uv, feet, normals = face.project(points)
        return Projected(feet, normals, face.holds(uv))

    X_PD = drawing_pose(normal, float(foot @ normal), outline.X_FD)
    return Ground(project=project, X_PD=X_PD, is_plane=True, name=f"the face {outline.ground}")


def _on_solids(solids: Sequence[Solid], direction: Array, outline: Outline) -> Ground:
    """All solids, as they are seen from a direction."""

    def project(points: Array) -> Projected:
        feet, normals = first_hits(solids, points, direction)
        return Projected(feet, normals, np.isfinite(feet[:, 0]))

    return Ground(project=project, X_PD=drawing_pose(direction, 0.0, outline.X_FD), is_plane=False, name="the part")
