"""Rasters of faces of the part from its STEP file, as paths of tasks."""

from pathlib import Path

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.referenced_files import Sources
from cellplan.files.cell.step_parts import read_of_step
from cellplan.files.input.findings import KeyPath, did_you_mean, key_text, shown
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.raster import RasterEntry
from cellplan.files.schema.seam import PathEntry
from cellplan.files.schema.shapes import StepEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.geometry.step.face_raster import FaceRequest, Raster, RasterSettings, StepSizeError, read_raster
from cellplan.model.settings.units import Mm
from cellplan.model.task.task import ProgrammedPath
from cellplan.model.units import MM


def raster_paths(valid: ValidEntries, sources: Sources) -> dict[str, ProgrammedPath]:
    """Paths of the tasks that raster a face, by task; findings about the others."""
    paths: dict[str, ProgrammedPath] = {}
    for name, task in valid.tasks.items():
        where: KeyPath = ("tasks", name, "path")
        if task.path.raster is None or valid.part is None:
            continue
        entry = valid.part.step
        if entry is None:
            text = "expected a part from a STEP file (part.step)"
            sources.findings.append(sources.document.finding((*where, "face"), text))
            continue
        place = sources.file(entry.file, ("part", "step", "file"))
        if place is None or entry.file not in sources.inputs:
            continue  # the part itself says why
        try:
            content = _raster(task.path, task.path.raster, entry, place)
        except StepSizeError as error:
            sources.findings.append(sources.document.finding((*where, "raster", "step_mm"), str(error)))
        except InputError as error:
            sources.findings.append(sources.document.finding((*where, "raster"), str(error)))
        else:
            if isinstance(content, Raster):
                paths[name] = _programmed(content, task, task.path.raster)
                sources.remarks.append((key_text((*where, "raster")), _remark(content, task.path.face)))
                continue
            text = f"expected a face of the STEP file, got {shown(task.path.face)}"
            text += f"{did_you_mean(task.path.face or '', content)}; cellplan seams lists them"
            sources.findings.append(sources.document.finding((*where, "face"), text))
    return paths


def _raster(path: PathEntry, raster: RasterEntry, entry: StepEntry, place: Path) -> Raster | tuple[str, ...]:
    """The raster of the face that a path names; the names of all faces where there is no such face."""
    settings = RasterSettings(
        step=raster.step_mm.si,
        direction=raster.direction_deg.si,
        overlap=raster.overlap_mm.si,
        lead=raster.lead_mm.si,
        chord=raster.chord_mm.si,
        standoff=(path.standoff_mm or Mm(0.0)).si,
    )
    return read_of_step(read_raster, place, entry.file, entry.shape, FaceRequest(path.face or "", settings))[0]


def _programmed(raster: Raster, task: TaskEntry, entry: RasterEntry) -> ProgrammedPath:
    """The path along all lines, at the feed of the process on them and as fast as transfers between them."""
    feed = 0.0 if task.process is None else task.process.feed
    return ProgrammedPath(
        source=f"face {task.path.face}",
        points=raster.points,
        axes=-raster.normals if task.tool_axis in {None, "normal"} else None,
        rotations=None,
        is_smooth=False,
        is_closed=False,
        speeds=np.where(raster.is_off, entry.transfer_mm_s.si, feed),
        is_rapid=raster.is_off,
        rounding=entry.rounding_mm.si,
        stop_angle=entry.stop_deg.si,
    )


def _remark(raster: Raster, face: str | None) -> str:
    """One line on what a raster consists of."""
    sides = np.linalg.norm(np.diff(raster.points, axis=0), axis=1)
    on, off = (MM * float(sides[flags].sum()) for flags in (~raster.is_off, raster.is_off))
    text = f"face {face} as {raster.line_count} lines in {raster.stretch_count} stretches, {len(raster.points)} points"
    text += f"; {on:.1f} mm with the process on, {off:.1f} mm between"
    return f"{text}; not used: stretches below 1 mm ({raster.short_count})" if raster.short_count else text
