"""Map of a base: what becomes of the whole job of a cell when one of its robots stands elsewhere in the plane."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.files.cell.write import written_document
from cellplan.files.run.folder import RunFolder
from cellplan.jobs.base_map.grid import BaseGrid
from cellplan.jobs.base_map.prepared import PreparedMap, prepared
from cellplan.jobs.base_map.result import map_files, map_record
from cellplan.jobs.base_map.tiles import Tiles, judged
from cellplan.jobs.drawing import drawing
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Record, number
from cellplan.report.record.figures import KEY, figures_of
from cellplan.runs.outcome import solved_outcome
from cellplan.runs.plan.rounded import rounded
from cellplan.runs.solution import Solution
from cellplan.runs.write_run import versions
from cellplan.search.base_map.verdicts import MapJob, PlaceVerdict, best_first

BEST: Final = 10  # [-] places that are listed with their settings
SAME_ANGLE: Final = 1e-9  # [deg]


def base_map(
    cell: Cell, robot: str, grid: BaseGrid | None = None, *, certify: int = 0, progress: Progress = silent
) -> Record:
    """Judge the whole job of a cell with the base of one robot at each place of a grid.

    All other robots, the height and the tilt of the base stay. The motion of every place is worked out anew at 65 nodes
    with the pseudo-inverse of the cell, and judged by position limits, speeds, accelerations and, at up to 33 nodes, by
    the distances that the cell demands. Of several start postures at a place the one that is nearest to the present
    start is tried first, and the first that passes is kept.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        robot: Name of an operator: a robot with a task that does not hold the part.
        grid: Where its base is tried.
        certify: How many of the best places are solved and verified.
        progress: Called with the stage and the fraction done.

    Returns:
        The record of ``map.json``; the same as that of ``map_study``.

    Raises:
        InputError: There is no such operator, the grid is not usable, or the cell is of a kind that is not mapped.
        StartNotFoundError: A start posture is to be found, and there is none at the present base.
    """
    ready = prepared(cell, robot, grid or BaseGrid(), progress)
    progress("finding starts", 0.0)
    tiles = Tiles.of(ready.job, *ready.starts())
    trials = []
    for place, values in enumerate(tiles.values):
        progress("judging places", place / len(tiles.values))
        trials.append({"values": values, **judged(ready.job, values).record})
    return finished_record(ready, tiles.verdicts(trials), certify=certify, progress=progress)


def finished_record(
    ready: PreparedMap, verdicts: Sequence[PlaceVerdict], *, certify: int = 0, progress: Progress = silent
) -> Record:
    """The record of a map whose places are judged, the best ``certify`` of them solved and verified."""
    job, cell = ready.job, ready.cell
    best = best_first(verdicts)[: max(BEST, certify)]
    settings = [place_settings(job, verdicts[place], place) for place in best]
    certified = []
    for done, values in enumerate(settings[:certify]):
        progress("certifying", done / certify)
        outcome = solved_outcome(partial(cell.with_values, values), _figures, file=Path(cell.origin.file))
        certified.append({"status": str(outcome.status), "reason": outcome.reason, "figures": dict(outcome.figures)})
    return map_record(
        job,
        verdicts,
        best=list(zip(best, settings, strict=True)),
        certified=certified,
        drawing=drawing(job.scene, job.start, ready.schedule),
        versions=versions(),
    )


def write_base_map(record: Record, folder: Path, *, formats: Collection[str] = ()) -> None:
    """Write ``map.json``, ``map.html`` and ``map.svg`` into a folder, which appears whole or not at all.

    Args:
        record: As ``base_map`` returns it.
        folder: The folder; an earlier map there is replaced.
        formats: Formats of the picture beside SVG: ``png``, ``pdf``; both need matplotlib.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    with RunFolder(folder) as target:
        for name, content in map_files(record, formats).items():
            target.write_bytes(name, content)


def place_settings(job: MapJob, verdict: PlaceVerdict, place: int) -> dict[str, Any]:
    """Values of the cell file that put the robot to a place, with its start posture there, by address."""
    cell, robot, places = job.scene.cell, job.scene.cell.robot(job.robot), job.places
    xy, base = MM * places.X_WB[place, :2, 3], f"robots.{robot.name}.base"
    values: dict[str, Any] = {f"{base}.x_mm": number(xy[0]), f"{base}.y_mm": number(xy[1])}
    yaw = DEG * places.yaw[place]
    if abs(yaw - DEG * float(np.arctan2(robot.X_WB[1, 0], robot.X_WB[0, 0]))) > SAME_ANGLE:
        values[f"{base}.yaw_deg"] = number(yaw)
    if verdict.start is not None:
        started = replace(robot, start=rounded(robot, verdict.start))
        others = tuple(started if other.name == robot.name else other for other in cell.robots)
        entry = written_document(replace(cell, robots=others))["robots"][robot.name]
        values |= {f"robots.{robot.name}.{key}": entry[key] for key in ("start", "start_deg") if key in entry}
    return values


def _figures(solution: Solution) -> dict[str, Any]:
    """Key figures of a certified place."""
    return figures_of([run.report for run in solution.runs]).record(KEY)
