"""Outlines of drawings on the part: contours of a DXF file with rapids between them, as the path of a task."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final, cast

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.paths.csv_table import METRES_PER_MM
from cellplan.files.cell.paths.dxf import DrawingSettings, FlatDrawing, read_drawing, require_dxf
from cellplan.files.cell.referenced_files import Sources
from cellplan.files.cell.step_parts import MEGABYTES, remembered
from cellplan.files.input.files import digest_of_file
from cellplan.files.input.findings import KeyPath, key_text, listed
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.programmed import OutlineEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.files.shapes import centred_solid, direction
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.extension import Tail
from cellplan.geometry.curves.flat_curves import WIDEST_STEP, Contour, begun_near
from cellplan.geometry.curves.placed_contours import SURFACE, Ground, drawing_pose, place_contours
from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine, tool_targets
from cellplan.geometry.projection import projection_onto
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.step.outlines import FaceError, Outline, PlacedOutline, place_on_step
from cellplan.geometry.step.part import StepPart
from cellplan.guard import Guard, in_child
from cellplan.model.settings.runs import AUTO, RunsEntry
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.settings.units import Deg, Mm, in_si
from cellplan.model.task.task import ProgrammedPath

SAME_POINT: Final = 1e-6  # [m] points that are nearer than this are one
LIFT_SIDES: Final = 48  # straight sides of a run that is lifted
NO_JUMP: Final = np.deg2rad(0.1)  # [rad] between the tool axes on both sides of a corner


def outline_paths(valid: ValidEntries, sources: Sources, part: StepPart | None) -> dict[str, ProgrammedPath]:
    """Paths of the tasks along outlines, by task; findings about the others. ``part`` is that of a STEP file."""
    tasks = {name: task for name, task in valid.tasks.items() if task.path.outline is not None}
    if valid.part is None or (valid.part.step is not None and part is None):
        return {}  # the part itself says why
    paths = {}
    for name, task in tasks.items():
        where: KeyPath = ("tasks", name, "path")
        if task.process is not None and task.process.has_open_feed:
            text = "expected a number above 0 in mm/s for an outline, whose feed is not sought"
            sources.findings.append(sources.document.finding(("tasks", name, "process", "feed_mm_s"), text))
        for key in ("run_in_mm", "run_out_mm") if task.process is not None else ():
            if getattr(task.process, key) == AUTO:
                text = "expected a length in mm for an outline, got auto"
                sources.findings.append(sources.document.finding(("tasks", name, "process", key), text))
        stated = task.path.outline
        entry = stated if isinstance(stated, OutlineEntry) else OutlineEntry(file=stated or "")
        place = sources.file(entry.file, (*where, "outline", *(() if isinstance(stated, str) else ("file",))))
        if place is None:
            continue
        try:
            drawing, sources.inputs[entry.file] = _drawing(place, entry, task.path.layer or "")
        except InputError as error:
            sources.errors.append(error)
            continue
        try:
            contours = _chosen(drawing.contours, entry, task)
            ground = task.path.on or "" if task.path.project is None else direction(task.path.project)
            outline = Outline(entry.file, contours, ground, entry.at.matrix, entry.chord_mm.si)
            placed = _placed(outline, valid, sources)
            if placed is not None:
                paths[name] = _programmed(placed, entry, task)
            sources.remarks.append((key_text((*where, "outline")), drawing.remark))
        except FaceError as error:
            sources.findings.append(sources.document.finding((*where, "on"), str(error)))
        except InputError as error:
            sources.findings.append(sources.document.finding((*where, "outline"), str(error)))
    return paths


def _drawing(place: Path, entry: OutlineEntry, layer: str) -> tuple[FlatDrawing, str]:
    """Contours of a layer, and the SHA-256 of their file."""
    require_dxf(entry.file)
    settings = DrawingSettings(source=entry.file, layer=layer, unit=entry.unit, join=entry.join_mm.si)
    digest = digest_of_file(place, file=entry.file)
    guard = Guard(file=entry.file, worker="the DXF reader")
    return remembered((digest, settings), lambda: in_child(read_drawing, place, settings, guard=guard)), digest


def _chosen(contours: Sequence[Contour], entry: OutlineEntry, task: TaskEntry) -> tuple[Contour, ...]:
    """Contours of a drawing that are run along, each as it is run along."""
    numbers = entry.contours or range(1, len(contours) + 1)
    if max(numbers) > len(contours):
        raise InputError(f"expected contours up to {len(contours)}, as many as the layer has, got {max(numbers)}")
    if len(set(numbers)) < len(numbers):
        raise InputError(
            f"expected every contour once, got {listed(map(str, numbers))}; write a task for a further time"
        )
    chosen = [contours[number - 1] for number in numbers]
    if task.path.reverse:
        chosen = [contour.turned_back() for contour in chosen]
    if entry.start_at_mm is not None:
        start = np.array(in_si(entry.start_at_mm))
        chosen = [begun_near(contour, start) if contour.is_closed else contour for contour in chosen]
    return tuple(chosen)


def _placed(outline: Outline, valid: ValidEntries, sources: Sources) -> PlacedOutline | None:
    """An outline on the part; None where the part has a mesh that cannot be read."""
    step, geometry = (valid.part.step, valid.part.geometry) if valid.part is not None else (None, None)
    if step is not None:
        place, digest = sources.file(step.file, ("part", "step", "file")), sources.inputs[step.file]
        guard = Guard(file=step.file, worker="the STEP reader", megabytes=MEGABYTES)
        return in_child(place_on_step, place, step.file, step.shape, digest, outline, guard=guard)
    if isinstance(outline.ground, str):
        raise FaceError("expected a part from a STEP file (part.step), or project: +z (or another side)")
    mesh = None
    if geometry is not None and geometry.mesh is not None:
        mesh = sources.mesh(geometry.mesh, geometry.unit, ("part", "geometry", "mesh"))
    if geometry is None or (geometry.mesh is not None and mesh is None):
        return None
    shape, X_PS = centred_solid(geometry, lambda *_: cast("Mesh", mesh))
    project = projection_onto(shape, X_PS, outline.ground)
    ground = Ground(
        project=project, X_PD=drawing_pose(outline.ground, 0.0, outline.X_FD), is_plane=False, name="the part"
    )
    return PlacedOutline(place_contours(outline.contours, ground, outline.chord, outline.source), outline.ground)


def _programmed(placed: PlacedOutline, entry: OutlineEntry, task: TaskEntry) -> ProgrammedPath:
    """Contours one after the other, with rapids between them over the highest point."""
    path = task.path
    angles = SeamAngles(
        face=SURFACE,
        work=(path.work_deg or Deg(0.0)).si,
        travel=(path.push_deg or Deg(0.0)).si - (path.drag_deg or Deg(0.0)).si,
        standoff=(path.standoff_mm or Mm(0.0)).si,
    )
    lines = placed.lines if entry.order == "file" else _by_distance(placed.lines)
    process = ProcessEntry() if task.process is None else task.process
    targets = [_with_runs(line, angles, entry, process) for line in lines]
    height = max(float((points @ placed.direction).max()) for points, *_ in targets) + entry.lift_mm.si
    points, axes, runs = [targets[0][0]], [targets[0][1]], [targets[0][2]]
    rapid = [np.zeros(len(runs[0]), dtype=bool)]
    for (before, held, _), (after, next_held, is_run) in pairwise(targets):
        ends = np.stack([before[-1], after[0]])
        points += [ends + (height - ends @ placed.direction)[:, None] * placed.direction, after]
        axes += [np.stack([held[-1], next_held[0]]), next_held]
        rapid += [np.ones(3, dtype=bool), np.zeros(len(after) - 1, dtype=bool)]
        runs += [np.zeros(3, dtype=bool), is_run]
    is_rapid = np.concatenate(rapid)
    feed = 0.0 if task.process is None else task.process.feed
    return ProgrammedPath(
        source=entry.file,
        points=np.concatenate(points),
        axes=np.concatenate(axes) if task.tool_axis in {None, "normal"} else None,
        rotations=None,
        is_smooth=False,
        is_closed=False,
        speeds=np.where(is_rapid, entry.transfer_mm_s.si, feed),
        is_rapid=is_rapid,
        is_run=np.concatenate(runs) if any(process.has_runs) else None,
        rounding=entry.rounding_mm.si,
        stop_angle=entry.stop_deg.si,
    )


def _with_runs(
    line: SeamLine, angles: SeamAngles, entry: OutlineEntry, process: ProcessEntry
) -> tuple[Array, Array, Flags]:
    """Tool tips and axes along a line with the runs of its process, and which sides these are."""
    points, axes = _targets_along(line, angles, entry)
    return _with_run_points(points, axes, line.tangents[[0, -1]], runs=process, chord=entry.chord_mm.si)


def _by_distance(lines: Sequence[SeamLine]) -> list[SeamLine]:
    """Lines of which each begins nearer to the end of the one before than all that are left."""
    left, ordered = list(lines[1:]), [lines[0]]
    while left:
        end = ordered[-1].points[-1]
        ordered.append(left.pop(int(np.argmin([np.linalg.norm(line.points[0] - end) for line in left]))))
    return ordered


def _targets_along(line: SeamLine, angles: SeamAngles, entry: OutlineEntry) -> tuple[Array, Array]:
    """Tool tips in [m] and unit tool axes into the part along a line, shape (N, 3) each, without points that repeat.

    At a corner that is passed without a stop the tool is held halfway between both sides.
    """
    _, axes = tool_targets(line, angles)
    corners = np.flatnonzero(np.diff(line.behind) == 0.0)
    turn = np.linalg.norm(line.tangents[corners + 1] - line.tangents[corners], axis=1)
    jump = np.linalg.norm(axes[corners + 1] - axes[corners], axis=1)
    sharp = corners[(turn > 2.0 * np.sin(0.5 * entry.stop_deg.si)) & (jump > NO_JUMP)]
    if len(sharp):
        x, y, z = line.points[sharp[0]] / METRES_PER_MM
        degrees = np.rad2deg(2.0 * np.arcsin(0.5 * jump[corners == sharp[0]][0]))
        raise InputError(
            f"expected a tool axis without a jump, but at the corner [{x:.3f}, {y:.3f}, {z:.3f}] mm of the part it "
            f"would turn by {degrees:.3g} deg at once; leave out work_deg, push_deg and drag_deg, or choose a contour "
            "without corners (outline.contours)"
        )
    axes[corners] += axes[corners + 1]
    axes = np.delete(axes, corners + 1, axis=0)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    points = np.delete(line.points, corners + 1, axis=0) - angles.standoff * axes
    far = np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > SAME_POINT)
    far[-2:] = [far[-2] and (far[-1] or len(far) == 2), True]  # the end stays
    return points[far], axes[far]


def _with_run_points(
    points: Array, axes: Array, tangents: Array, *, runs: RunsEntry, chord: float
) -> tuple[Array, Array, Flags]:
    """A contour with its runs, and which of its sides they are.

    Args:
        points: Tool tips along it in [m], shape (N, 3), expressed in P.
        axes: Unit tool axes into the part, shape (N, 3), which stay on the runs as they are at the ends.
        tangents: Unit directions of travel at both ends, shape (2, 3).
        runs: What is stated of its runs.
        chord: Largest distance in [m] of an arc from its straight sides.

    Returns:
        Points and axes, shape (M, 3) each, and whether each side is one of a run, shape (M - 1,).
    """
    first, last = runs.has_runs
    before = _run((points[0], tangents[0], axes[0]), runs, sign=-1.0, chord=chord)[::-1] if first else points[:0]
    behind = _run((points[-1], tangents[1], axes[-1]), runs, sign=1.0, chord=chord) if last else points[:0]
    is_run = np.repeat([True, False, True], [len(before), len(points) - 1, len(behind)])
    held = np.concatenate([np.tile(axes[0], (len(before), 1)), axes, np.tile(axes[-1], (len(behind), 1))])
    return np.concatenate([before, points, behind]), held, is_run


def _run(end: tuple[Array, Array, Array], runs: RunsEntry, *, sign: float, chord: float) -> Array:
    """Points of a run from the end of the work on, without it; ``end`` has tip, tangent and tool axis there."""
    p, along, axis = end
    across = np.sign(runs.arc) * np.cross(along, axis)
    tail = Tail(
        p=p,
        dp=along,
        side=across / max(float(np.linalg.norm(across)), np.finfo(float).tiny),
        normal=-axis,
        straight=runs.straights[0 if sign < 0.0 else 1],
        arc=abs(runs.arc),
        lift=runs.lift_mm.si,
        sign=sign,
    )
    arc = 0.5 * np.pi * tail.arc
    widest = min(WIDEST_STEP, 2.0 * float(np.arccos(1.0 - min(1.0, chord / tail.arc)))) if arc else np.inf
    places = np.union1d(np.linspace(0.0, arc, 1 + int(np.ceil(0.5 * np.pi / widest))), [tail.length])
    if tail.lift:
        places = np.union1d(places, np.linspace(0.0, tail.length, 1 + LIFT_SIDES))
    return tail.evaluate(sign * places[1:])[0]
