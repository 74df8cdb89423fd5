"""Compare: one cell in every mode, or several cells and runs, side by side."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.cell.changes import plain_values, read_setting
from cellplan.files.cell.differences import document_differences
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.files.input.findings import listed
from cellplan.files.run.stored import CELL, StoredRun, read_stored_run
from cellplan.files.schema import CellDocument
from cellplan.files.yaml.reader import parse_yaml
from cellplan.geometry.transforms import Array
from cellplan.jobs.compare.result import comparison_files, comparison_record
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Report
from cellplan.report.plots.rendering import require_formats
from cellplan.report.record.common import Provenance, Record
from cellplan.report.record.series import series
from cellplan.report.record.summary import program_records
from cellplan.report.record.variant_figures import variant_curves, variant_figures
from cellplan.runs.gate.open_gate import open_gate
from cellplan.runs.outcome import solved_outcome
from cellplan.runs.overrides import feed_settings, require_task, with_overrides
from cellplan.runs.solution import Solution
from cellplan.runs.write_run import versions
from cellplan.study.bundle import Bundle
from cellplan.study.folder import run_folder, write_results
from cellplan.study.study import Study
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

MODE: Final = "motion.mode"
REPORT: Final = "report.json"
PROGRAM: Final = "program"  # key of the cell file that makes a program run from home to home


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareJob:
    """What is compared, in plain data that a worker process can be sent.

    Attributes:
        subjects: One cell file, to compare its modes; or several cell files and run folders.
        allow_dirs: Further folders that the files of cells may lie in.
        settings: Values set in every cell, each as ``KEY=VALUE``.
        feed: Feed of all processes of each cell, such as ``greatest``; None leaves them.
        task: Name of the only task to work on; None for all.
        runs: Folder of the study in which the run of every cell that is solved is kept; None to keep none.
        formats: Formats of the plots beside SVG.
    """

    subjects: tuple[Path, ...]
    allow_dirs: tuple[Path, ...] = ()
    settings: tuple[str, ...] = ()
    feed: str | None = None
    task: str | None = None
    runs: Path | None = None
    formats: tuple[str, ...] = ()


def compare(
    job: CompareJob, folder: Path, *, workers: int | Executor = 1, resume: bool = False, progress: Progress = silent
) -> Record:
    """Compare one cell in every mode, or several cells and runs, and write the study into a folder.

    Cells are solved; runs are read, and verified again where they passed. A mode that cannot be planned is a variant
    with its reason. The folder holds ``study.jsonl``, ``study.json``, ``study.csv``, ``study.html`` and plots.

    Args:
        job: What is compared.
        folder: Folder of the study; an earlier study there is replaced, or continued with ``resume``.
        workers: Number of processes that solve and verify, each with about the memory of ``cellplan solve``; or an
            executor.
        resume: Whether what the folder holds already is not computed again.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: A cell cannot be read, a folder is not a run, something is named twice, or the folder of the study
            cannot be used.
        KeyboardInterrupt: It was interrupted; says how many variants are recorded.
    """
    require_formats(job.formats)
    _refuse_unfitting(job)
    sources = [_source(job, path) for path in job.subjects]
    is_modes = len(sources) == 1
    variants = _modes(sources[0]) if is_modes else _subjects(job)
    names = [str(variant.values[MODE]) for variant in variants] if is_modes else _names(job.subjects)
    differences = {} if is_modes else _differences(job, sources)
    header = {
        "kind": "compare",
        "of": "modes" if is_modes else "cells",
        "cell": _cell_name(sources[0]),
        "names": names,
        "settings": plain_values(_listed_settings(job)),
        "task": job.task,
        "inputs": dict(zip(_names(job.subjects), map(_inputs, sources), strict=True)),
        "versions": versions(),
    }
    study = Study.of_variants(folder, header, variants)
    finished = study.run(partial(evaluate_subject, job), workers=workers, resume=resume, progress=progress)
    trials = [trial.record for trial in finished.trials]
    curves = [trial["figures"].pop("curves", None) for trial in trials]
    record = comparison_record(header, trials, differences)
    write_results(folder, comparison_files(record, curves, job.formats))
    return record


def first_name(job: CompareJob) -> str:
    """Name of the first cell that is compared.

    Raises:
        InputError: It cannot be read, or what is asked for cannot be compared.
    """
    _refuse_unfitting(job)
    return _cell_name(_source(job, job.subjects[0]))


def files_of(job: CompareJob) -> Bundle:
    """The files of the cells that are compared, and the whole of the runs."""
    cells = [path for path in job.subjects if not path.is_dir()]
    read = ((path, _cell(job, path)) for path in cells)
    return Bundle.of(read, allow_dirs=job.allow_dirs, runs=[path for path in job.subjects if path.is_dir()])


def evaluate_subject(job: CompareJob, variant: Variant) -> TrialOutcome:
    """Solve a cell or a mode of it, or read and verify a run.

    A mode that has no solution from home to home, or no starts for it, is solved without these moves, and says that
    they are missing.
    """
    is_mode = len(job.subjects) == 1
    path = job.subjects[0 if is_mode else variant.number]
    if path.is_dir():
        return _stored_outcome(job, path)
    folder = None if job.runs is None else run_folder(job.runs, variant.number)

    def solved(values: Mapping[str, object]) -> TrialOutcome:
        def cell() -> Cell:
            given = _cell(job, path)
            return given.with_values(values) if values else given

        return solved_outcome(cell, figures=_solved_figures, file=path, task=job.task, folder=folder)

    whole = solved(variant.values if is_mode else {})
    if whole.status not in (TrialStatus.NO_SOLUTION, TrialStatus.BAD_INPUT) or PROGRAM not in variant.values:
        return whole
    plain = solved({MODE: variant.values[MODE]})
    if not plain.figures:
        return whole
    return replace(plain, figures={**plain.figures, "not_in_program": [f"moves from and to homes: {whole.reason}"]})


def _refuse_unfitting(job: CompareJob) -> None:
    """Refuse subjects that cannot be compared with one another, and settings that cannot be made.

    Raises:
        InputError: There are such.
    """
    places: dict[Path, Path] = {}
    for path in job.subjects:
        if path.resolve() in places:
            raise InputError(f"{path}: expected every cell and run once, got it again")
        places[path.resolve()] = path
    runs = [path for path in job.subjects if path.is_dir()]
    if len(job.subjects) == 1 and runs:
        raise InputError(
            f"{runs[0]}: expected a cell file, to compare its modes, or several cells and runs, got one run; its cell "
            f"is {runs[0] / CELL}"
        )
    if runs and (job.settings or job.feed or job.task):
        option = "--set" if job.settings else "--feed" if job.feed else "--task"
        raise InputError(f"{option}: expected cell files only, as a run stays as it is, got the run {runs[0]}")
    if len(job.subjects) == 1 and MODE in dict(map(read_setting, job.settings)):
        raise InputError(f"--set: expected another key than {MODE}, as all modes are compared; use 'cellplan solve'")


def _cell(job: CompareJob, path: Path) -> Cell:
    """A cell with what is set."""
    cell = load_cell(path, allow_dirs=job.allow_dirs)
    return with_overrides(cell, feed_settings(cell, job.settings, job.feed))


def _listed_settings(job: CompareJob) -> dict[str, object]:
    """Values by address, and the feed of all processes."""
    return dict(map(read_setting, job.settings)) | ({} if job.feed is None else {"feed": job.feed})


def _source(job: CompareJob, path: Path) -> Cell | StoredRun:
    """A cell, or a run whose files are all as they were written."""
    if path.is_dir():
        return read_stored_run(path)
    cell = _cell(job, path)
    require_task(cell, job.task)
    return cell


def _modes(source: Cell | StoredRun) -> tuple[Variant, ...]:
    """A variant for each mode, as a program from home to home where cell files can have one."""
    from_home: dict[str, object] = {}
    if (
        isinstance(source, Cell)
        and PROGRAM in CellDocument.model_fields
        and source.origin.document.get(PROGRAM) is None
    ):
        from_home = {PROGRAM: {}}
    return tuple(Variant(number, {MODE: str(mode), **from_home}) for number, mode in enumerate(Mode))


def _subjects(job: CompareJob) -> tuple[Variant, ...]:
    """A variant for each cell and run."""
    kinds = ["run" if path.is_dir() else "cell" for path in job.subjects]
    return tuple(
        Variant(number, {kind: name})
        for number, (kind, name) in enumerate(zip(kinds, _names(job.subjects), strict=True))
    )


def _names(paths: Sequence[Path]) -> list[str]:
    """Paths below the innermost folder that holds all of them."""
    whole = [path.resolve() for path in paths]
    try:
        common = os.path.commonpath([path.parent for path in whole])
    except ValueError:  # on several drives
        return [path.as_posix() for path in paths]
    return [path.relative_to(common).as_posix() for path in whole]


def _cell_name(source: Cell | StoredRun) -> str:
    return source.name if isinstance(source, Cell) else source.manifest.cell


def _inputs(source: Cell | StoredRun) -> dict[str, str]:
    """Digests of what a cell or a run rests on; that of its manifest stands for the run itself."""
    if isinstance(source, Cell):
        return dict(source.inputs)
    return {"manifest.json": source.digest, **source.manifest.inputs}


def _differences(job: CompareJob, sources: Sequence[Cell | StoredRun]) -> dict[str, list[Any]]:
    """Inputs that differ: keys of the cell files with every default filled in, and files of the same name."""
    differences = document_differences([_document(source) for source in sources])
    worked_on = [_tasks(job, source) for source in sources]
    if any(tasks != worked_on[0] for tasks in worked_on):
        differences["tasks worked on"] = worked_on
    files = []
    for path, source in zip(job.subjects, sources, strict=True):
        cell_file = path.name if isinstance(source, Cell) else source.manifest.cell_file
        files.append({name: sha for name, sha in _inputs(source).items() if name not in {cell_file, "manifest.json"}})
    for name in dict.fromkeys(name for file in files for name in file):
        digests = [file.get(name) for file in files]
        if len({sha for sha in digests if sha is not None}) > 1:
            differences[f"inputs.{name}"] = digests
    return differences


def _tasks(job: CompareJob, source: Cell | StoredRun) -> list[str]:
    """Names of the tasks that are worked on: of a cell file all of them, or one."""
    if isinstance(source, Cell):
        return [task.name for task in source.tasks if job.task in {None, task.name}]
    return list(source.record["tasks"])


def _document(source: Cell | StoredRun) -> Mapping[str, Any]:
    """The cell as plain values, as it would be written or was written into the run folder."""
    if isinstance(source, Cell):
        return parse_yaml(render_cell(source).encode(), file=CELL).root
    return parse_yaml(source.content("", CELL), file=source.file("", CELL)).root


def _solved_figures(solution: Solution) -> Record:
    """The figures of a program that was just solved."""
    origin = Provenance(versions={}, digests={})
    reports = [run.report for run in solution.runs]
    records = program_records(solution.runs, cell=solution.cell, provenance=origin)
    curves = variant_curves(records.whole, list(map(series, reports)), _clearance(reports))
    return {**variant_figures(records.whole, records.phases, proof="solved"), "curves": curves}


def _stored_outcome(job: CompareJob, path: Path) -> TrialOutcome:
    """The figures of a run; one whose report lacks some of them is no run of this version."""
    try:
        return _verified_outcome(job, path)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        missing = f"got none or another one for {error}" if isinstance(error, KeyError) else "got something else"
        reason = f"{path / REPORT}: expected every figure of a run of this version, {missing}; solve the cell again"
        return TrialOutcome(status=TrialStatus.BAD_INPUT, reason=reason, figures={})


def _verified_outcome(job: CompareJob, path: Path) -> TrialOutcome:
    """The figures of a run, which is verified again where it passed."""
    stored = read_stored_run(path)
    status, proof, clearance = TrialStatus.FAILED, "it failed when it was solved", None
    failed = [check["message"] for check in stored.record["checks"] if not check["passed"]]
    if stored.manifest.status == TrialStatus.PASSED and stored.manifest.user_files:
        status = TrialStatus.PASSED
        proof = (
            f"it depends on files beside its cell file ({listed(stored.manifest.user_files)}); "
            f"cellplan verify {path} --cell {stored.manifest.cell_file} compares them"
        )
    elif stored.manifest.status == TrialStatus.PASSED:
        try:
            verified = open_gate(path, allow_dirs=job.allow_dirs)
            status, proof = TrialStatus.PASSED, "verified"
            clearance = _clearance([motion.report for motion in verified.motions])
        except NotVerifiedError as error:
            proof = str(error).splitlines()[0]
            failed = [proof]
        except InputError as error:
            status, proof = TrialStatus.PASSED, str(error).splitlines()[0]
    curves = variant_curves(stored.record, [stored.series(place) for place in stored.records], clearance)
    figures = variant_figures(stored.record, stored.records, proof=proof)
    reason = failed[0] if failed else ""
    return TrialOutcome(status=status, reason=reason, figures={**figures, "curves": curves})


def _clearance(reports: Sequence[Report]) -> tuple[Array, Array] | None:
    """Times and smallest distances of all bodies over phases that follow one another; None without a pair."""
    times, distances, begin = [], [], 0.0
    for report in reports:
        curves = list(report.clearance.curves.values())
        if curves:
            smallest = np.fmin.reduce(curves)
            known = np.isfinite(smallest)
            times.append(begin + report.clearance.curve_times[known])
            distances.append(smallest[known])
        begin += report.cycle_time
    return (np.concatenate(times), np.concatenate(distances)) if times else None
