"""Map of a base: what becomes of the whole job when one robot stands elsewhere in the plane; here or as a study."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from cellplan.files.cell.write import written_document
from cellplan.files.input.files import digest
from cellplan.files.run.folder import RunFolder
from cellplan.geometry.arrays import Array, Indices
from cellplan.jobs.base_map.grid import BaseGrid
from cellplan.jobs.base_map.prepared import (
    MapRequest,
    PreparedMap,
    prepared,
    prepared_request,
    refuse_map,
    requested_cell,
)
from cellplan.jobs.base_map.result import map_files, map_record
from cellplan.jobs.drawing import drawing
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.progress import Progress, silent
from cellplan.model.units import DEG, MM
from cellplan.report.plots.rendering import require_formats
from cellplan.report.record.common import Record, as_json, number
from cellplan.runs.outcome import solved_outcome
from cellplan.runs.plan.rounded import rounded
from cellplan.runs.write_run import versions
from cellplan.search.base_map.verdicts import (
    AT_ONCE,
    MapJob,
    PlaceVerdict,
    Verdict,
    best_first,
    judge_phases,
    verdicts_at_start,
)
from cellplan.study.folder import RESULT, SCHEMA, write_results
from cellplan.study.status import Best
from cellplan.study.study import Study
from cellplan.study.trial import StudyTrial, TrialOutcome, TrialStatus, Variant
from cellplan.study.workers import Limits, Workers

SHARES: Final = 4  # [-] of which the number of tiles is a multiple, so that so many workers end together
PAIRS: Final = frozenset({"joint", "fast", "pair"})  # of names, lists in plain data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tiles:
    """The places of a map that have starts within limits in all phases, in tiles that lie all over the map."""

    known: Sequence[PlaceVerdict]  # what is known of every place before its motions
    at_start: Sequence[Sequence[PlaceVerdict]]  # the same for each phase
    values: Sequence[Mapping[str, Any]]  # ``places`` and ``starts`` of each tile by phase, in order of trying

    @classmethod
    def of(cls, jobs: Sequence[MapJob], starts: Sequence[tuple[Array, Indices]]) -> Self:
        """The tiles of a map.

        Args:
            starts: For each phase starts of the robot, shape (S, n), as ``starts_at`` returns them, and their places.
        """
        at_start, inside = list[list[PlaceVerdict]](), list[tuple[Array, Indices]]()
        for phase, (job, (q, at)) in enumerate(zip(jobs, starts, strict=True)):
            verdicts, rows = verdicts_at_start(job, q, at)
            at_start.append([replace(verdict, phase=phase) for verdict in verdicts])
            inside.append((q[rows], at[rows]))
        can_begin = np.array([np.isin(np.arange(len(jobs[0].places)), at) for _, at in inside])
        places = np.flatnonzero(can_begin.all(axis=0))
        count = 1 if len(places) <= AT_ONCE // SHARES else SHARES * -(-len(places) // (SHARES * AT_ONCE))
        tiles = [places[tile::count] for tile in range(count)] if len(places) else []
        first = np.argmin(can_begin, axis=0).tolist()  # the first phase that cannot begin
        return cls(
            known=[at_start[phase][place] for place, phase in enumerate(first)],
            at_start=at_start,
            values=[{"phases": [_at_places(q, at, tile) for q, at in inside]} for tile in tiles],
        )

    def verdicts(self, trials: Iterable[Mapping[str, Any]]) -> list[PlaceVerdict]:
        """The verdict of every place, from the trials of all tiles as plain data, in their order."""
        verdicts = list(self.known)
        for trial in trials:
            judged = trial["figures"].get("places")
            if judged is None:
                for place in trial["values"]["phases"][0]["places"]:
                    verdicts[place] = PlaceVerdict(verdict=Verdict.NOT_JUDGED, reason=trial["reason"])
            for place, values in (judged or {}).items():
                verdict = _verdict(values)
                verdicts[int(place)] = verdict.or_better(self.at_start[verdict.phase][int(place)])
        return verdicts


def evaluate(request: MapRequest, variant: Variant) -> TrialOutcome:
    """Judge the places of a tile."""
    return judged(prepared_request(request).jobs, variant.values)


def judged(jobs: Sequence[MapJob], values: Mapping[str, Any]) -> TrialOutcome:
    """What becomes of the places of a tile, whose values are those of ``Tiles``."""
    starts = [(np.array(phase["starts"]), np.array(phase["places"], dtype=np.intp)) for phase in values["phases"]]
    verdicts = judge_phases(jobs, starts)
    listed = list(verdicts.values())
    figures: dict[str, Any] = {"places": {str(place): _plain(verdict) for place, verdict in sorted(verdicts.items())}}
    passing = best_first(listed)
    if not passing:
        return TrialOutcome(status=TrialStatus.FAILED, reason="no place passes", figures=figures)
    best = {"passing": len(passing), "cycle_s": listed[passing[0]].cycle}
    return TrialOutcome(status=TrialStatus.PASSED, figures={**best, **figures})


def _at_places(q: Array, at: Indices, places: Indices) -> dict[str, Any]:
    """The starts of some places as plain data."""
    rows = np.isin(at, places)
    return {"places": at[rows].tolist(), "starts": q[rows].tolist()}


def _plain(verdict: PlaceVerdict) -> dict[str, Any]:
    """A verdict as plain data, without what it does not have."""
    values = {field.name: getattr(verdict, field.name) for field in fields(verdict)}
    values["starts"] = [start.tolist() for start in verdict.starts] or None
    if verdict.start is not None:
        values["start"] = verdict.start.tolist()
    return {name: value for name, value in values.items() if value is not None and name != "reason"}


def _verdict(values: Mapping[str, Any]) -> PlaceVerdict:
    """The verdict of plain data."""
    fields_of_verdict: dict[str, Any] = {
        name: tuple(value) if name in PAIRS else value for name, value in values.items()
    }
    fields_of_verdict |= {
        "verdict": Verdict(values["verdict"]),
        "start": np.array(values["start"]),
        "starts": tuple(np.array(start) for start in values.get("starts", ())),
    }
    return PlaceVerdict(**fields_of_verdict)


LISTED: Final = 10  # [-] places that are listed with their settings
SAME_ANGLE: Final = 1e-9  # [deg]
MODULES: Final = ("cellplan.jobs.base_map.base_map",)
SHORTEST: Final = Best("cycle_s")
NOUN: Final = "tile"
TILE_LIMIT: Final = 900.0  # [s] of the processor for one tile


def base_map(
    cell: Cell, robot: str, grid: BaseGrid | None = None, *, certify: int = 0, progress: Progress = silent
) -> Record:
    """Judge the whole job of a cell with the base of one robot at each place of a grid.

    All other robots, the height and the tilt of the base stay. The motion of every place is worked out anew at 65 nodes
    or more with the pseudo-inverse of the cell, and judged by position limits, speeds, accelerations and, at up to 33
    nodes, by the distances that the cell demands. Of a program every phase of work is judged, no transfer.

    Of several start postures at a place the one that is nearest to the present
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
        NoSolutionError: The other robots have no start posture, or the part cannot be gripped or put down.
    """
    ready = prepared(cell, robot, grid or BaseGrid(), progress)
    progress("finding starts", 0.0)
    tiles = Tiles.of(ready.jobs, ready.starts())
    trials = []
    for place, values in enumerate(tiles.values):
        progress("judging places", place / len(tiles.values))
        trials.append({"values": values, **judged(ready.jobs, values).record})
    return finished_record(ready, tiles.verdicts(trials), certify=certify, progress=progress)


def map_study(
    request: MapRequest,
    folder: Path,
    *,
    workers: int | Executor = 1,
    resume: bool = False,
    certify: int = 0,
    progress: Progress = silent,
) -> Record:
    """Make a map as a study, whose trials are tiles of places, and write it into a folder.

    The folder holds ``study.jsonl``, a line for each tile that grows while the study runs, and at the end
    ``study.json`` and the files of ``write_base_map``. They are the same for any number of workers. The places of a
    tile whose process crashed or took too long are not judged, and say why.

    Args:
        request: What the map is made of.
        folder: Folder of the study; an earlier one is replaced, or continued with ``resume``.
        workers: Number of processes that judge places; or an executor, which stays open.
        resume: Whether tiles that the folder holds already are not judged again.
        certify: How many of the best places are solved and verified.
        progress: Called with the stage and the fraction done.

    Returns:
        The record of ``map.json``; see ``base_map``.

    Raises:
        InputError: The cell cannot be read or mapped, or the folder cannot be used.
        NoSolutionError: The other robots have no start posture, or the part cannot be gripped or put down.
        KeyboardInterrupt: It was interrupted; says how many tiles are recorded.
    """
    require_formats(request.formats)
    sent = request.anywhere
    cell = requested_cell(request)
    refuse_map(cell, request.robot, request.grid)
    header = {
        "kind": "map",
        "cell": cell.name,
        **request.record,
        "inputs": dict(cell.inputs),
        "versions": versions(),
        "best": SHORTEST.record,
    }
    study = Study(folder=folder, header=header, size=1, propose=lambda _: (), best=SHORTEST, noun=NOUN, total=0)
    study.refuse(resume=resume)
    with ExitStack() as opened:
        pool = workers
        if isinstance(workers, int):
            pool = opened.enter_context(Workers(workers, modules=MODULES, first=partial(prepared_request, sent)))
        ready = prepared_request(sent)
        progress("finding starts", 0.0)
        tiles = Tiles.of(ready.jobs, ready.starts())

        def propose(finished: Sequence[StudyTrial]) -> Sequence[Mapping[str, Any]]:
            return [] if finished else tiles.values

        count = len(tiles.values)
        limits = Limits(seconds=TILE_LIMIT)
        whole = replace(study, size=max(1, count), propose=propose, total=count)
        finished = whole.run(partial(evaluate, sent), workers=pool, limits=limits, resume=resume, progress=progress)
        trials = [trial.record for trial in finished.trials]
        record = finished_record(ready, tiles.verdicts(trials), certify=certify, progress=progress)
    files = map_files(record, request.formats)
    listed = [{"name": name, "sha256": digest(content)} for name, content in files.items()]
    tried = [{"trial": trial["trial"], "status": trial["status"], "reason": trial["reason"]} for trial in trials]
    result = {"schema": SCHEMA, **header, "trials": tried, "files": listed}
    write_results(folder, {RESULT: as_json(result).encode(), **files})
    return record


def finished_record(
    ready: PreparedMap, verdicts: Sequence[PlaceVerdict], *, certify: int = 0, progress: Progress = silent
) -> Record:
    """The record of a map whose places are judged, the best ``certify`` of them solved and verified."""
    cell = ready.cell
    best = best_first(verdicts)[: max(LISTED, certify)]
    settings = [place_settings(ready, verdicts[place], place) for place in best]
    certified = []
    for done, values in enumerate(settings[:certify]):
        progress("certifying", done / certify)
        outcome = solved_outcome(partial(cell.with_values, values), file=Path(cell.origin.file))
        certified.append({"status": str(outcome.status), "reason": outcome.reason, "figures": dict(outcome.figures)})
    return map_record(
        ready.jobs,
        verdicts,
        best=list(zip(best, settings, strict=True)),
        certified=certified,
        drawing=_drawing(ready),
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


def _drawing(ready: PreparedMap) -> dict[str, Any]:
    """The cell from above as the robot begins its first task, with the paths of all phases in which it works."""
    shown = [drawing(work.scene, work.start, work.schedule) for work in ready.phases]
    at_work = [one for one, job in zip(shown, ready.jobs, strict=True) if job.works]
    return {**shown[ready.first], "paths": [path for one in at_work for path in one["paths"]]}


def place_settings(ready: PreparedMap, verdict: PlaceVerdict, place: int) -> dict[str, Any]:
    """Values of the cell file that put the robot to a place, with its start postures there, by address.

    In a program the start posture of its first task is that of the robot, unless the task has one of its own.
    """
    job = ready.jobs[ready.first]
    robot, places = ready.cell.robot(job.robot), job.places
    xy, base = MM * places.X_WB[place, :2, 3], f"robots.{robot.name}.base"
    values: dict[str, Any] = {f"{base}.x_mm": number(xy[0]), f"{base}.y_mm": number(xy[1])}
    yaw = DEG * places.yaw[place]
    if abs(yaw - DEG * float(np.arctan2(robot.X_WB[1, 0], robot.X_WB[0, 0]))) > SAME_ANGLE:
        values[f"{base}.yaw_deg"] = number(yaw)
    starts = verdict.starts or ((verdict.start,) if verdict.start is not None else ())
    for phase, start in enumerate(starts):
        if ready.jobs[phase].works:
            work = ready.phases[phase].scene.cell
            task = next(task for task in work.tasks if task.robot == robot.name)
            is_first = phase == ready.first and ready.cell.task(task.name).start_posture is None
            where = f"robots.{robot.name}" if is_first else f"tasks.{task.name}"
            values |= {f"{where}.{key}": value for key, value in _written_start(work, robot, start).items()}
    return values


def _written_start(cell: Cell, robot: Robot, start: Array) -> dict[str, Any]:
    """A start posture of a robot as the cell file has it."""
    started = replace(robot, start=rounded(robot, start))
    others = tuple(started if other.name == robot.name else other for other in cell.robots)
    entry = written_document(replace(cell, robots=others))["robots"][robot.name]
    return {key: entry[key] for key in ("start", "start_deg") if key in entry}
