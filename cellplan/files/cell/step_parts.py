"""Parts from STEP files, and paths along their edges; read in the child process, and what was read last not again."""

from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Final, TypeVar, cast

from cellplan.errors import InputError
from cellplan.files.cell.referenced_files import Sources
from cellplan.files.input.files import AllowedFolders, digest_of_file
from cellplan.files.input.findings import KeyPath, did_you_mean, key_text, shown
from cellplan.files.schema.messages import valid_entry
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.seam import PathEntry
from cellplan.files.schema.shapes import StepEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.step.drawing import StepDrawing, read_drawing
from cellplan.geometry.step.kernel import require_step
from cellplan.geometry.step.lines import chain, started_near
from cellplan.geometry.step.part import StepPart, read_step_part
from cellplan.geometry.step.reader import UnknownShapeError
from cellplan.guard import Guard, in_child
from cellplan.model.settings.units import in_si
from cellplan.model.units import MM

Value = TypeVar("Value")
MEGABYTES: Final = 3000  # of which OpenCASCADE alone takes some hundreds
MOST_READ: Final = 16  # results that this process holds
_READ: Final[dict[Hashable, object]] = {}


def read_part(valid: ValidEntries, sources: Sources) -> StepPart | None:
    """The part of a cell from its STEP file, which becomes one of its sources; None without one or after a finding."""
    path: KeyPath = ("part", "step")
    entry = valid.part.step if valid.part is not None else None
    place = None if entry is None else sources.file(entry.file, (*path, "file"))
    if entry is None or place is None:
        return None
    try:
        part, sources.inputs[entry.file] = load_step_part(place, entry)
        sources.remarks.append((key_text(path), part.remark))
    except UnknownShapeError as error:
        sources.findings.append(sources.document.finding((*path, "shape"), str(error)))
    except InputError as error:
        sources.findings.append(sources.document.finding((*path, "file"), str(error)))
    else:
        return part
    return None


def load_step_part(place: Path, entry: StepEntry) -> tuple[StepPart, str]:
    """The part in a STEP file, and the SHA-256 of the file.

    Raises:
        InputError: The extra ``step`` is not installed, or the file cannot be read; see `read_step_part`.
    """
    return read_of_step(read_step_part, place, entry.file, entry.shape, entry.deviation_mm.si)


def load_drawing(place: Path, file: str, shape: str | None, gap: float) -> StepDrawing:
    """Edges, seams and faces of a STEP file; see `read_drawing`.

    Raises:
        InputError: The extra ``step`` is not installed, or the file cannot be read.
    """
    return read_of_step(read_drawing, place, file, shape, gap)[0]


def read_of_step(
    read: Callable[..., Value], place: Path, file: str, shape: str | None, request: Hashable
) -> tuple[Value, str]:
    """What a function reads of a STEP file, and the SHA-256 of the file; what was read last is not read again."""
    require_step(file)
    digest = digest_of_file(place, file=file)
    guard = Guard(file=file, worker="the STEP reader", megabytes=MEGABYTES)
    key = (read, digest, file, shape, request)
    return remembered(key, lambda: in_child(read, place, file, shape, request, guard=guard)), digest


def remembered(key: Hashable, read: Callable[[], Value]) -> Value:
    """What was read under a key; read now where it is not among what was read last."""
    if key not in _READ:
        content = read()
        while len(_READ) >= MOST_READ:
            del _READ[next(iter(_READ))]
        _READ[key] = content
    return cast("Value", _READ[key])


def edge_length(document: YamlDocument, path: PathEntry, folders: AllowedFolders) -> float | None:
    """Length in [mm] of a path along edges of the part of a document; None where these cannot be read."""
    root = document.root.get("part")
    entry = valid_entry(StepEntry, document, ("part", "step")) if isinstance(root, dict) and "step" in root else None
    place = Sources(document, folders, {}).file(entry.file, ()) if entry is not None else None
    try:
        drawing = load_drawing(place, entry.file, entry.shape, entry.gap_mm.si) if entry and place else None
        return MM * float(edge_line(path, drawing).behind[-1])
    except InputError:
        return None  # the path itself says why


def edge_lines(valid: ValidEntries, sources: Sources) -> dict[str, SeamLine]:
    """Lines of the tasks whose path runs along edges of the part, by task; findings about the others."""
    tasks = {name: task.path for name, task in valid.tasks.items() if task.path.is_edge}
    if not tasks or valid.part is None:
        return {}
    entry, lines = valid.part.step, {}
    place = None if entry is None else sources.file(entry.file, ("part", "step", "file"))
    try:
        drawing = load_drawing(place, entry.file, entry.shape, entry.gap_mm.si) if entry and place else None
    except InputError:
        return {}  # the part itself says why
    for name, path in tasks.items():
        place_of: KeyPath = ("tasks", name, "path")
        try:
            if entry is None or drawing is not None:
                lines[name] = edge_line(path, drawing)
        except _EdgeError as error:
            sources.findings.append(sources.document.finding((*place_of, *error.path), str(error)))
    return lines


def edge_line(path: PathEntry, drawing: StepDrawing | None) -> SeamLine:
    """The line of a path along edges: chained, turned round, begun and cut as the path says."""
    if drawing is None:
        raise _EdgeError("edge" if path.edge else "edges", "expected a part from a STEP file (part.step)")
    names = path.edges or (path.edge or "",)
    edges = [drawing.edge(name) for name in names]
    key = "edge" if path.edge is not None else "edges"
    for place, (name, edge) in enumerate(zip(names, edges, strict=True)):
        if edge is None:
            text = f"expected an edge or seam of the STEP file, got {shown(name)}"
            known = did_you_mean(name, [edge.name for edge in drawing.edges])
            raise _EdgeError(key, f"{text}{known}; cellplan seams lists them", *([place] if path.edges else []))
    line = chain([edge.line for edge in edges if edge is not None])
    if isinstance(line, int):
        text = f"expected an edge that begins where {shown(names[line - 1])} ends, got {shown(names[line])}"
        raise _EdgeError(key, text, line)
    if path.start_at_mm is not None:
        if not line.is_closed:
            raise _EdgeError("start_at_mm", "unexpected key, only edges that are closed begin anywhere; use from_mm")
        line = started_near(line, in_si(path.start_at_mm))
    for wall_key, wall in (("from", path.from_), ("toward", path.toward)):
        if wall is not None and wall not in line.walls:
            raise _EdgeError(wall_key, f"expected one of the walls {' and '.join(line.walls)}, got {shown(wall)}")
    return line


class _EdgeError(InputError):
    """What is wrong with a path along edges, and the keys below the path that say so."""

    def __init__(self, key: str, text: str, *further: int) -> None:
        super().__init__(text)
        self.path: KeyPath = (key, *further)
