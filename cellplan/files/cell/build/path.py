"""Paths of a cell file, in millimetres and degrees, become those of the model, in metres and radians."""

from collections.abc import Callable
from typing import TypedDict

import numpy as np

from cellplan.files.cell.build.smoothed_path import smoothed
from cellplan.files.schema.cell import CellDocument
from cellplan.files.schema.closed_shapes import CircleEntry, RectangleEntry, RhombusEntry, start_direction
from cellplan.files.schema.path import PathShapeEntry, PolylineEntry
from cellplan.files.schema.seam import SURFACE, PathEntry, WeaveEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.files.shapes import direction
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine
from cellplan.model.settings.units import Deg, Mm, si_or_none
from cellplan.model.task.seam import Seam, Stretch, WallPlace, Weave, WeaveForm
from cellplan.model.task.task import (
    CirclePath,
    PathSpec,
    PlaneName,
    PolygonPath,
    RunDirection,
    SampledPath,
    SpacePolylinePath,
    TimedPath,
)

TargetReader = Callable[[str], SampledPath | TimedPath | SeamLine]  # name of the task -> its file, read


class PathFields(TypedDict):
    """What a task has of its path."""

    path: PathSpec
    seam: Seam | None
    stretch: Stretch | None
    weave: Weave | None
    project: Array | None
    plane_offset: float


def path_fields(name: str, document: CellDocument, read_targets: TargetReader) -> PathFields:
    """Geometry of a path, how the tool is held to walls and weaves, and its projection or place."""
    task = document.tasks[name]
    entry = task.path
    axis = None if task.tool_axis in {None, "normal"} else direction(task.tool_axis)
    path = _path(name, entry, read_targets, axis)
    is_placed = entry.outline is not None  # projected and held to the part already
    return PathFields(
        path=path,
        seam=None if is_placed else _seam(entry, tuple(path.walls) if isinstance(path, SeamLine) else entry.wall_names),
        stretch=None if is_placed else _stretch(entry),
        weave=None if entry.weave is None or is_woven_by_controller(task, document) else _weave(entry.weave, task),
        project=None if entry.project is None or is_placed else direction(entry.project),
        plane_offset=(entry.offset_mm or Mm(0.0)).si,
    )


def _path(name: str, entry: PathShapeEntry, read_targets: TargetReader, tool_axis: Array | None) -> PathSpec:
    """Geometry of a path in [m]; the axis is that of a tool whose file gives none."""
    if entry.circle is not None:
        return _circle(entry.circle)
    if entry.rectangle is not None:
        return _polygon(entry.rectangle, entry.rectangle.sides_mm, ((1, 1), (-1, 1), (-1, -1), (1, -1)))
    if entry.rhombus is not None:
        return _polygon(entry.rhombus, entry.rhombus.diagonals_mm, ((1, 0), (0, 1), (-1, 0), (0, -1)))
    if entry.polyline is not None:
        return _polyline(entry.polyline)
    path = read_targets(name)
    if entry.smooth is None or not isinstance(path, SampledPath):
        return path
    return smoothed(path, entry.smooth, tool_axis)


def _circle(entry: CircleEntry) -> CirclePath:
    """A circle with a unit direction to its start."""
    u, v = entry.center_mm
    toward = start_direction(entry.start_at, entry.plane)
    size = float(np.hypot(*toward))
    return CirclePath(
        plane=PlaneName(entry.plane),
        center=(u.si, v.si),
        radius=entry.radius_mm.si,
        start=(toward[0] / size, toward[1] / size),
        direction=RunDirection(entry.direction),
    )


def _polygon(
    entry: RectangleEntry | RhombusEntry, extents_mm: tuple[float, float], signs: tuple[tuple[int, int], ...]
) -> PolygonPath:
    """Corners of a centred shape, turned and moved in its plane, from its start on."""
    start = tuple(int(np.sign(part)) for part in start_direction(entry.start_at, entry.plane))
    first = signs.index((start[0], start[1]))
    signs = (*signs[first:], *signs[:first])
    angle = entry.angle_deg.si
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = np.array(signs) * (0.5 * np.array(extents_mm)) @ R.T + np.array(entry.center_mm)
    return PolygonPath(
        plane=PlaneName(entry.plane),
        corners=tuple((Mm(u).si, Mm(v).si) for u, v in corners),
        is_closed=True,
        direction=RunDirection(entry.direction),
    )


def _polyline(entry: PolylineEntry) -> PathSpec:
    """Points in a plane or in space."""
    points = [tuple(value.si for value in point) for point in entry.points_mm]
    if entry.plane is None:
        return SpacePolylinePath(points=tuple((x, y, z) for x, y, z in points), is_closed=entry.closed)
    return PolygonPath(plane=PlaneName(entry.plane), corners=tuple((u, v) for u, v in points), is_closed=entry.closed)


def _seam(entry: PathEntry, names: tuple[str, ...]) -> Seam | None:
    """How the tool is held to walls, by their names; None for a path without. Edges have walls of their file."""
    if not entry.is_seam and not entry.is_edge:
        return None
    walls = {
        name: WallPlace(wall) if wall in tuple(WallPlace) else direction(wall)
        for name, wall in ({} if entry.is_edge else entry.walls or dict.fromkeys(names, SURFACE)).items()
    }
    work = entry.work_deg or (None if entry.is_edge and entry.from_ is None else Deg(0.0))
    return Seam(
        walls=walls,
        angles=SeamAngles(
            face=entry.from_ or names[0],
            work=si_or_none(work),
            travel=(entry.push_deg or Deg(0.0)).si - (entry.drag_deg or Deg(0.0)).si,
            standoff=(entry.standoff_mm or Mm(0.0)).si,
            side=(entry.side_mm or Mm(0.0)).si,
            out=(entry.out_mm or Mm(0.0)).si,
            toward=entry.toward,
        ),
        rod_clearance=si_or_none(entry.rod_from_walls_mm),
    )


def _stretch(entry: PathEntry) -> Stretch | None:
    """The part of a path that is run along; None for all of it."""
    stretch = Stretch(
        begin=(entry.from_mm or Mm(0.0)).si,
        end=si_or_none(entry.to_mm),
        is_reversed=bool(entry.reverse),
        overlap=(entry.overlap_mm or Mm(0.0)).si,
        back=(entry.back_mm or Mm(0.0)).si,
    )
    return None if stretch == Stretch() else stretch


def is_woven_by_controller(task: TaskEntry, document: CellDocument) -> bool:
    """Whether the controller of a task's robot weaves by itself while its process is on."""
    control = document.robots[task.robot].controller
    entry = None if control is None else (document.controllers or {}).get(control.id)
    return task.process is not None and entry is not None and entry.process is not None and entry.process.weave_mm > 0.0


def _weave(entry: WeaveEntry, task: TaskEntry) -> Weave:
    """A weave with lengths for its times, at the feed of the process."""
    feed = 0.0 if task.process is None else task.process.feed
    return Weave(
        form=WeaveForm(entry.form),
        side=entry.side_mm.si,
        wavelength=entry.wavelength_mm.si if entry.wavelength_mm is not None else feed / (entry.frequency_hz or 1.0),
        dwells=(feed * entry.dwell_left_s, feed * entry.dwell_right_s),
        out=(entry.out_mm or Mm(0.0)).si,
        stands=entry.dwell == "standing",
    )
