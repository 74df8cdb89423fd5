"""What can be worked on in a STEP file, as people and scripts read it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.files.cell.step_parts import load_drawing, load_step_part
from cellplan.files.schema.shapes import StepEntry
from cellplan.geometry.step.drawing import StepDrawing, StepEdge
from cellplan.geometry.step.part import StepPart
from cellplan.model.settings.units import Mm
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import number

SCHEMA: Final = "cellplan.seams/1"
NO_SEAM: Final = "no seam is listed where edges of one are inside the other; correct the drawing"
MM2: Final = 1e6  # [mm^2/m^2]


@dataclass(frozen=True, slots=True, kw_only=True)
class SeamsRequest:
    """Which part is listed, and how its seams are looked for."""

    path: Path
    shape: str | None = None
    gap_mm: float = 0.0
    fillets: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Listing:
    """Edges and seams of a part that were asked for."""

    drawing: StepDrawing
    part: StepPart
    edges: tuple[StepEdge, ...]


def list_seams(request: SeamsRequest) -> Listing:
    """Edges and seams of a STEP file: all but smooth ones, or those for fillets.

    Raises:
        InputError: The extra ``step`` is not installed, or the file cannot be read.
    """
    if not request.path.is_file():
        raise InputError(f"{request.path}: expected an existing STEP file")
    file = str(request.path)
    entry = StepEntry(file=file, shape=request.shape, gap_mm=Mm(request.gap_mm))
    part, _ = load_step_part(request.path, entry)
    drawing = load_drawing(request.path, file, request.shape, entry.gap_mm.si)
    edges = tuple(edge for edge in drawing.edges if _is_listed(edge, request))
    return Listing(drawing=drawing, part=part, edges=edges)


def _is_listed(edge: StepEdge, request: SeamsRequest) -> bool:
    """Fillets are concave; other lists leave out edges within a smooth surface."""
    return edge.is_fillet if request.fillets else edge.bend != "smooth" or edge.joint is not None


def seams_record(listing: Listing, request: SeamsRequest) -> dict[str, Any]:
    """The listing for a script."""
    return {
        "schema": SCHEMA,
        "file": request.path.as_posix(),
        "gap_mm": number(request.gap_mm),
        "parts": list(listing.drawing.parts),
        "edges": [_edge_record(edge) for edge in listing.edges],
        "faces": [
            {"name": face.name, "kind": face.kind, "part": face.part, "area_mm2": number(MM2 * face.area)}
            for face in listing.drawing.faces
        ],
        "unused": list(listing.drawing.unused),
        "penetrating": [list(pair) for pair in listing.drawing.penetrating],
        "tasks": task_lines(listing.edges),
    }


def _edge_record(edge: StepEdge) -> dict[str, Any]:
    return {
        "name": edge.name,
        "kind": edge.kind,
        "joint": edge.joint,
        "bend": edge.bend,
        "length_mm": number(MM * edge.length),
        "angle_deg": number(DEG * edge.angle),
        "gap_mm": number(MM * edge.gap),
        "closed": edge.line.is_closed,
        "parts": list(edge.parts),
        "walls": list(edge.line.walls),
        "from_mm": [number(MM * x) for x in edge.line.points[0]],
        "to_mm": [number(MM * x) for x in edge.line.points[-1]],
    }


def seams_lines(listing: Listing, request: SeamsRequest) -> Iterator[str]:
    """The listing for a terminal, with tasks to paste at its end."""
    drawing, edges = listing.drawing, listing.edges
    joints = [edge for edge in edges if edge.joint is not None]
    yield f"{request.path.name}: {_count(drawing.parts, 'solid')}, {_count(drawing.faces, 'face')}"
    yield from (f"  not used: {text}" for text in drawing.unused)
    yield from (f"  {one} and {other} penetrate each other: {NO_SEAM}" for one, other in drawing.penetrating)
    width = max([len(edge.name) for edge in edges], default=0)
    for title, listed in (("seams", joints), ("edges", [edge for edge in edges if edge.joint is None])):
        if listed:
            yield f"{title} ({len(listed)})"
        yield from (f"  {_edge_line(edge, width)}" for edge in listed)
    if not edges:
        yield "no edge or seam of this kind" + ("; solids that do not touch need --gap-mm" if request.fillets else "")
        return
    if not request.fillets:
        yield f"faces ({len(drawing.faces)})"
        yield from (f"  {it.name:<{width}}  {it.kind}, {MM2 * it.area:.1f} mm2, of {it.part}" for it in drawing.faces)
    yield "tasks to paste, with a robot for each:"
    yield from task_lines(edges if request.fillets or not joints else joints)


def _edge_line(edge: StepEdge, width: int) -> str:
    """One edge: name, kind, length, walls."""
    what = f"{edge.joint} joint, {edge.bend}" if edge.joint and edge.bend != "smooth" else edge.joint or edge.bend
    what += " joint" if edge.joint and edge.bend == "smooth" else ""
    angle = f"{DEG * edge.angle:.4g} deg between {' and '.join(edge.line.walls)}"
    gap = f", gap {MM * edge.gap:.2f} mm" if edge.gap > 0.0 else ""
    closed = ", closed" if edge.line.is_closed else ""
    return f"{edge.name:<{width}}  {what}, {edge.kind} of {MM * edge.length:.3f} mm{closed}, {angle}{gap}"


def task_lines(edges: Sequence[StepEdge]) -> list[str]:
    """A section ``tasks`` with a task for each edge, the tool halfway between its walls."""
    lines = ["tasks:"]
    for edge in edges:
        work = f"{DEG * edge.angle / 2.0:.4g}" if edge.bend == "concave" else "0"
        held = f", from: {next(iter(edge.line.walls))}, work_deg: {work}" if edge.bend != "convex" else ""
        lines.append(f"  {edge.name}: {{robot: any, path: {{edge: {edge.name}{held}}}}}")
    return lines


def _count(values: Sequence[object], word: str) -> str:
    return f"{len(values)} {word}{'' if len(values) == 1 else 's'}"
