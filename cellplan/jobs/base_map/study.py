"""The study of a map: tiles judged by worker processes, recorded as they end, continued after an interruption."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from cellplan.files.input.files import digest
from cellplan.jobs.base_map.judged import finished_record
from cellplan.jobs.base_map.prepared import MapRequest, prepared_request, refuse_map, requested_cell
from cellplan.jobs.base_map.result import map_files
from cellplan.jobs.base_map.tiles import Tiles, evaluate
from cellplan.model.progress import Progress, silent
from cellplan.report.plots.rendering import require_formats
from cellplan.report.record.common import Record, as_json
from cellplan.runs.write_run import versions
from cellplan.study.folder import RESULT, SCHEMA, write_results
from cellplan.study.status import Best
from cellplan.study.study import Study
from cellplan.study.trial import StudyTrial
from cellplan.study.workers import Limits, Workers

MODULES: Final = ("cellplan.jobs.base_map.tiles",)
BEST: Final = Best("cycle_s")
NOUN: Final = "tile"
TILE_LIMIT: Final = 900.0  # [s] of the processor for one tile


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
        StartNotFoundError: A start posture is to be found, and there is none at the present base.
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
        "best": BEST.record,
    }
    study = Study(folder=folder, header=header, size=1, propose=lambda _: (), best=BEST, noun=NOUN, total=0)
    study.refuse(resume=resume)
    with ExitStack() as opened:
        pool = workers
        if isinstance(workers, int):
            pool = opened.enter_context(Workers(workers, modules=MODULES, first=partial(prepared_request, sent)))
        ready = prepared_request(sent)
        progress("finding starts", 0.0)
        tiles = Tiles.of(ready.job, *ready.starts())

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
