"""Sweep: solve a cell with every combination of some values, and keep a line for each."""

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from cellplan.errors import InputError
from cellplan.files.cell.changes import plain_values, read_setting
from cellplan.files.cell.load import load_cell
from cellplan.jobs.sweep.result import study_files, study_record
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.report.plots.rendering import require_formats
from cellplan.runs.outcome import solved_outcome
from cellplan.runs.overrides import require_task, with_overrides
from cellplan.runs.write_run import versions
from cellplan.study.bundle import Bundle
from cellplan.study.folder import run_folder, write_results
from cellplan.study.study import Study
from cellplan.study.trial import TrialOutcome, Variant
from cellplan.study.variants import Axis, combinations


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepJob:
    """What every variant starts from, in plain data that a worker process can be sent.

    Attributes:
        cell: The cell file.
        allow_dirs: Further folders that the files it names may lie in.
        settings: Values set in it for all variants, each as ``KEY=VALUE``.
        task: Name of the only task to work on; None for all.
        runs: Folder of the study in which the run of every variant is kept; None to keep none.
        formats: Formats of the plot beside SVG.
    """

    cell: Path
    allow_dirs: tuple[Path, ...] = ()
    settings: tuple[str, ...] = ()
    task: str | None = None
    runs: Path | None = None
    formats: tuple[str, ...] = ()


def sweep(
    job: SweepJob,
    axes: Sequence[Axis],
    folder: Path,
    *,
    workers: int | Executor = 1,
    resume: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Solve a cell with every combination of values and write the study into a folder.

    The folder holds ``study.jsonl``, a line for each variant that grows while the study runs, and at the end
    ``study.json``, ``study.csv`` and ``study.html``. The files are the same for any number of workers.

    Args:
        job: The cell and what is set in it for all variants.
        axes: Keys that vary and their values.
        folder: Folder of the study; an earlier study there is replaced, or continued with ``resume``.
        workers: Number of processes that solve, each with about the memory of ``cellplan solve``; or an executor.
        resume: Whether variants that the folder holds already are not solved again.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be read, an address does not exist, or the folder cannot be used.
        KeyboardInterrupt: It was interrupted; says how many variants are recorded.
    """
    require_formats(job.formats)
    base = _base_cell(job)
    require_task(base, job.task)
    variants = combinations(axes)
    settings = dict(map(read_setting, job.settings))
    for axis in axes:
        if axis.address in settings:
            raise InputError(
                f"--vary: expected a key that nothing else sets, got '{axis.address}', which is set to "
                f"{settings[axis.address]} already (--set, --mode)"
            )
        _require_a_valid_value(base, axis)
    header = {
        "kind": "sweep",
        "cell": base.name,
        "settings": plain_values(settings),
        "task": job.task,
        "vary": {axis.address: list(axis.values) for axis in axes},
        "inputs": dict(base.inputs),
        "versions": versions(),
    }
    study = Study.of_variants(folder, header, variants)
    finished = study.run(partial(evaluate_variant, job), workers=workers, resume=resume, progress=progress)
    record = study_record(header, [trial.record for trial in finished.trials])
    write_results(folder, study_files(record, job.formats))
    return record


def files_of(job: SweepJob, axes: Sequence[Axis]) -> Bundle:
    """The files that the variants read, those that only a value of a key names among them."""
    base = _base_cell(job)
    cells = [base]
    for axis in axes:
        for value in axis.values:
            with suppress(InputError):  # the variant says what is wrong
                cells.append(base.with_values({axis.address: value}))
    return Bundle.of([(job.cell, cell) for cell in cells], allow_dirs=job.allow_dirs)


def evaluate_variant(job: SweepJob, variant: Variant) -> TrialOutcome:
    """Solve one variant; what is wrong with it becomes its reason."""
    return solved_outcome(
        lambda: _base_cell(job).with_values(variant.values),
        file=job.cell,
        task=job.task,
        folder=None if job.runs is None else run_folder(job.runs, variant.number),
    )


@lru_cache(maxsize=1)
def _base_cell(job: SweepJob) -> Cell:
    """The cell with what is set for all variants; read once in each process."""
    return with_overrides(load_cell(job.cell, allow_dirs=job.allow_dirs), job.settings)


def _require_a_valid_value(base: Cell, axis: Axis) -> None:
    """Refuse a key none of whose values can stand in the cell, with the error of the first one."""
    first: InputError | None = None
    for value in axis.values:
        try:
            base.with_values({axis.address: value})
        except InputError as error:
            first = first or error
        else:
            return
    if first is not None:
        raise first
