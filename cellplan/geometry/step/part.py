"""A part from a STEP file: the mesh that stands for it where bodies are compared, and how far it is off."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.mesh.load import require_likely_size, require_solid
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.step.kernel import Solid
from cellplan.geometry.step.reader import read_solids

MOST_TRIANGLES: Final = 500_000
MOST_LOOSE: Final = 1e-4  # [m] between faces that are to meet: tight files have 1e-8, careless ones 1e-5
FIRST_SHARE: Final = 0.7  # [-] of the deviation that is asked of the mesher, which keeps it only roughly
REFINEMENTS: Final = 4  # halvings of it until the measured deviation is kept


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepPart:
    """A part as its STEP file has it.

    Attributes:
        mesh: Mesh of all solids in [m]; several that touch are one part.
        deviation: Distance in [m] within which the mesh follows the surfaces of the solids.
        solids: Names of the solids.
        unused: What else the file holds, with its count.
    """

    mesh: Mesh
    deviation: float
    solids: tuple[str, ...]
    unused: tuple[str, ...]

    @property
    def remark(self) -> str:
        """One line on what the mesh is and what was not read of the file."""
        count = f"{len(self.solids)} solids" if len(self.solids) > 1 else f"solid {self.solids[0]}"
        text = f"{count} as a mesh of {len(self.mesh.faces)} triangles within {1e3 * self.deviation:g} mm"
        return f"{text}; not used: {', '.join(self.unused)}" if self.unused else text


def read_step_part(path: Path, file: str, shape: str | None, deviation: float) -> StepPart:
    """The part in a STEP file, in the frame of the file.

    Args:
        file: Name of the file for messages.
        shape: Name of an assembly, a part or a solid of the file; None for all of it.
        deviation: Largest distance in [m] of the mesh from the surfaces.

    Raises:
        InputError: The file cannot be read, is damaged or holds no sound solid.
    """
    content = read_solids(path, file, shape)
    for solid in content.solids:
        if not solid.is_sound:
            raise InputError(f"{file}: expected sound solids, but the surface of {solid.name} is damaged: repair it")
        if solid.looseness > MOST_LOOSE:
            text = f"expected faces that meet within {1e3 * MOST_LOOSE:g} mm, but those of {solid.name} miss each other"
            raise InputError(f"{file}: {text} by {1e3 * solid.looseness:.3g} mm: repair it")
    pieces = [piece for solid in content.solids for piece in _facets(solid, file, deviation)]
    first = np.cumsum([0, *(len(corners) for corners, _ in pieces)])
    corners = np.concatenate([corners for corners, _ in pieces])
    faces = np.concatenate([indices + start for (_, indices), start in zip(pieces, first, strict=False)])
    if len(faces) > MOST_TRIANGLES:
        cure = "allow a larger deviation_mm"
        raise InputError(f"{file}: expected a mesh of at most {MOST_TRIANGLES} triangles, got {len(faces)}: {cure}")
    require_likely_size(corners, file)
    mesh = make_mesh(corners, faces, source=file)
    require_solid(mesh)
    names = tuple(solid.name for solid in content.solids)
    return StepPart(mesh=mesh, deviation=deviation, solids=names, unused=tuple(content.unused))


def _facets(solid: Solid, file: str, deviation: float) -> list[tuple[Array, Indices]]:
    """Triangles of each face of a solid that follow it within the deviation."""
    for step in range(REFINEMENTS):
        pieces = list(solid.facets(FIRST_SHARE * deviation * 0.5**step))
        if max(off for _, _, off in pieces) <= deviation:
            return [(corners, indices) for corners, indices, _ in pieces]
    raise InputError(
        f"{file}: expected a mesh of {solid.name} within {1e3 * deviation:g} mm, got none: allow a larger deviation_mm"
    )
