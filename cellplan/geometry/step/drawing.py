"""What can be worked on in a STEP file: edges between faces, seams between solids, and faces, by name."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.step.joints import Place, joints, penetrating
from cellplan.geometry.step.kernel import Solid
from cellplan.geometry.step.lines import line_of_edge
from cellplan.geometry.step.reader import read_solids

LONGEST_NAME: Final = 40  # letters of the name of a wall or of a task
SMOOTH: Final = np.deg2rad(1.0)  # [rad] faces whose normals differ by less run on without an edge
MOST_EDGES: Final = 20_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepEdge:
    """An edge of a solid, or a seam between two.

    Attributes:
        name: Name in the file, or a number such as E12; of a seam the names of both solids and a number.
        kind: Kind of its curve, such as line or circle.
        joint: T, lap, corner, butt or edge; None for an edge of a solid.
        bend: ``concave``, ``convex`` or ``smooth``: how the two walls meet.
        angle: Least angle in [rad] between the walls, measured through air at a concave edge, else through material.
        parts: Names of its solid, or of both.
        gap: Greatest distance in [m] between the solids along a seam; 0 of an edge.
        line: Its line, the wall on the left of travel first.
    """

    name: str
    kind: str
    joint: str | None
    bend: str
    angle: float
    parts: tuple[str, ...]
    gap: float
    line: SeamLine

    @property
    def is_fillet(self) -> bool:
        """Whether it can be welded by a fillet."""
        return self.bend == "concave"

    @property
    def length(self) -> float:
        """Length in [m]."""
        return float(self.line.behind[-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class StepFace:
    """A face of a solid."""

    name: str  # name in the file, or a number such as F3
    kind: str  # kind of its surface, such as plane or cylinder
    part: str  # name of its solid
    area: float  # in [m^2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepDrawing:
    """Edges, seams and faces of a part."""

    edges: tuple[StepEdge, ...]  # edges of the solids in the order of the file, then seams
    faces: tuple[StepFace, ...]
    parts: tuple[str, ...]  # names of the solids
    unused: tuple[str, ...]  # what else the file holds, with its count
    penetrating: tuple[tuple[str, str], ...]  # names of solids that penetrate each other

    def edge(self, name: str) -> StepEdge | None:
        """The edge or seam of a name; None when there is none."""
        return next((edge for edge in self.edges if edge.name == name), None)


def read_drawing(path: Path, file: str, shape: str | None, gap: float) -> StepDrawing:
    """Edges, seams and faces of a STEP file in its own frame.

    Args:
        file: Name of the file for messages.
        shape: Name of an assembly, a part or a solid of the file; None for all of it.
        gap: Distance in [m] up to which solids that do not touch are joined by a seam.

    Raises:
        InputError: The file cannot be read, is damaged or holds no solid.
    """
    content = read_solids(path, file, shape)
    solids = content.solids
    of_faces = names_of_faces(solids)
    if sum(len(solid.edges) for solid in solids) > MOST_EDGES:
        raise InputError(f"{file}: expected at most {MOST_EDGES} edges, got more; choose a part of it with shape")
    used = [solid.name for solid in solids]
    of_edges = _labels([name for solid in solids for name in solid.names_of_edges], "E{}", [])
    faces, edges = [], []
    for solid in solids:
        names = [of_faces.pop(0) for _ in solid.faces]
        faces += [
            StepFace(name=name, kind=face.kind, part=solid.name, area=face.area)
            for name, face in zip(names, solid.faces, strict=True)
        ]
        edges += [_edge(solid, k, of_edges.pop(0), names, file) for k in range(len(solid.edges))]
    seams = _seams(solids, joints(solids, gap, file), [edge.name for edge in edges])
    return StepDrawing(
        edges=(*edges, *seams),
        faces=tuple(faces),
        parts=tuple(used),
        unused=tuple(content.unused),
        penetrating=tuple((used[a], used[b]) for a, b in penetrating(solids)),
    )


def names_of_faces(solids: Sequence[Solid]) -> list[str]:
    """Names that differ for the faces of all solids, one solid after the other; the solids get such names as well."""
    used = _labels([solid.name for solid in solids], "PART_{}", [])
    for solid, name in zip(solids, used, strict=True):
        solid.name = name
    return _labels([name for solid in solids for name in solid.names_of_faces], "F{}", used)


def _edge(solid: Solid, k: int, name: str, faces: Sequence[str], file: str) -> StepEdge:
    """An edge of a solid with its line."""
    edge = solid.edges[k]
    first, second = edge.faces if edge.turns[0] > 0.0 else edge.faces[::-1]
    line = line_of_edge(edge, (solid.faces[first], solid.faces[second]), (faces[first], faces[second]), file)
    bend, angle = _bend(line)
    return StepEdge(
        name=name, kind=edge.kind, joint=None, bend=bend, angle=angle, parts=(solid.name,), gap=0.0, line=line
    )


def _bend(line: SeamLine) -> tuple[str, float]:
    """How two walls meet, and the angle between them in [rad], both in the middle of a line.

    The wall on the left reaches away from the edge along ``n x t``: it rises above the other one at a concave edge.
    """
    k = len(line.points) // 2
    left, right = (normals[k] for normals in line.walls.values())
    turn = float(np.arctan2(np.linalg.norm(np.cross(left, right)), left @ right))
    if turn < SMOOTH:
        return "smooth", np.pi - turn
    return "concave" if np.cross(left, line.tangents[k]) @ right > 0.0 else "convex", np.pi - turn


def _seams(solids: Sequence[Solid], places: Sequence[Place], edges: Sequence[str]) -> Iterator[StepEdge]:
    """Seams with names: those of both solids and a number within the pair."""
    numbers: Counter[str] = Counter()
    for place in places:
        parts = tuple(solids[k].name for k in place.parts)
        base = "-".join(parts)[: LONGEST_NAME - 4]
        while (name := f"{base}-{numbers[base] + 1}") in edges:
            numbers[base] += 1
        numbers[base] += 1
        bend, angle = _bend(place.line)
        yield StepEdge(
            name=name,
            kind=_kind(place.line),
            joint=place.kind,
            bend=bend,
            angle=angle,
            parts=parts,
            gap=place.gap,
            line=place.line,
        )


def _kind(line: SeamLine) -> str:
    """Kind of the curve of a seam."""
    if len(line.points) == 2:
        return "line"
    return "circle" if line.is_closed else "curve"


def _labels(names: Sequence[str | None], number: str, used: Sequence[str]) -> list[str]:
    """Names of letters, digits, ``_`` and ``-`` that differ: numbers in place of those that are missing or repeated."""
    clean = [re.sub(r"[^A-Za-z0-9_-]+", "_", name or "").strip("_")[:LONGEST_NAME] for name in names]
    counts = Counter(clean)
    numbered = {number.format(k) for k in range(1, len(names) + 1)}
    taken = numbered | set(used)
    return [
        name if name and counts[name] == 1 and name not in taken else number.format(k)
        for k, name in enumerate(clean, start=1)
    ]
