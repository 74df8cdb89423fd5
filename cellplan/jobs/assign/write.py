"""Assignments as folders, which appear whole or not at all, and what is recorded while they are made."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

from cellplan.files.cell.changes import plain_values
from cellplan.files.cell.load import CellFile, load_cell
from cellplan.files.run.content import ASSIGNMENT
from cellplan.files.run.folder import RunFolder, refuse_unless_replaceable
from cellplan.jobs.assign.assign import Assignment
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.result import assign_page, assign_record
from cellplan.jobs.layout.result_file import BEST, result_files
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.report.record.common import Record, as_json
from cellplan.runs.overrides import read_settings
from cellplan.runs.solution import Solution
from cellplan.runs.solve import with_verdict
from cellplan.runs.write_run import versions, write_run
from cellplan.search.assign.schedules.solver import solver_version
from cellplan.study.answers import UNFINISHED, RecordedAnswers, recorded_answers
from cellplan.study.folder import JOURNAL


def recorded_assignment(
    draft: AssignmentDraft, folder: Path, *, settings: Sequence[str], resume: bool, **options: object
) -> AbstractContextManager[RecordedAnswers]:
    """Answers for an assignment, recorded in the folder of its result, for a ``with`` statement.

    Args:
        folder: The folder; an earlier result there stays until the new one is written.
        settings: Values in place of those of the file, as ``KEY=VALUE``.
        resume: Whether the answers that the folder has are not worked out again.
        **options: All else that decides the answers, plain data.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write; or its record is that
            of another cell, of other options or other versions.
    """
    refuse_unless_replaceable(folder, unlisted=UNFINISHED)
    header = {
        "kind": "assign",
        "cell": draft.cell.name,
        "settings": plain_values(read_settings(settings)),
        **options,
        "inputs": dict(draft.cell.inputs),
        "versions": versions() | solver_version(),
    }
    return recorded_answers(folder, header, resume=resume)


def write_bound(record: dict[str, Any], folder: Path, *, journal: bytes = b"") -> None:
    """Write the record of a bound into a folder, which appears whole or not at all.

    Args:
        journal: What was recorded while it was made, with which ``--resume`` goes on; nothing where nothing was.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    with RunFolder(folder, unlisted=UNFINISHED) as target:
        _write_listed(target, record, journal)


def write_assignment(
    assignment: Assignment, given: Path, folder: Path, *, journal: bytes = b"", progress: Progress = silent
) -> Record:
    """Write an assignment into a folder, which appears whole or not at all.

    It holds ``assign.json``, ``assign.html``, ``best.yaml`` with the files that it names, and its run.

    Args:
        assignment: As ``assign`` returns it.
        given: The cell file that it was made from.
        folder: The folder; an earlier one is replaced.
        journal: What was recorded while it was made, with which ``--resume`` goes on; nothing where nothing was.
        progress: Called with the stage and the fraction done.

    Returns:
        The record in ``assign.json``.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    record, source = assign_record(assignment), assignment.cell.origin.source
    allowed = (given.parent, *(source.allow_dirs if isinstance(source, CellFile) else ()))
    head = f"Assigned by cellplan assign: {record['cycle_time_s']:g} s from home to home."
    if assignment.left_out:
        head += f" PARTIAL: {len(assignment.left_out)} tasks that no robot can do, and all after them, are left out."
    with RunFolder(folder, unlisted=UNFINISHED) as target:
        files = result_files(assignment.cell, given, folder, head=head)
        for name, content in files.items():
            target.write_bytes(name, content)
        best = load_cell(target.within(BEST), allow_dirs=allowed)
        solution = read_from(assignment.solution, best, folder / BEST)
        run = write_run(solution, target.within("run"), progress=progress)
        target.write_text("assign.html", assign_page(record, run, solution.cell))
        _write_listed(target, record, journal)
    return record


def _write_listed(target: RunFolder, record: dict[str, Any], journal: bytes) -> None:
    """Write a record into a folder, which lists all files there, and what was recorded before."""
    if journal:
        target.write_bytes(JOURNAL, journal)
    record["files"] = {name: sha256 for name, (_, sha256) in target.written.items()}
    target.write_text(ASSIGNMENT, as_json(record))


def read_from(solution: Solution, cell: Cell, file: Path) -> Solution:
    """A solution as that of a cell file which says the same in place of the one that it was changed from.

    Args:
        cell: The cell of the file.
        file: Where the file will stand.
    """
    origin = replace(cell.origin, file=str(file))

    def renamed(whole: Cell) -> Cell:
        return replace(whole, origin=origin, inputs=cell.inputs)

    solved, runs = renamed(solution.cell), solution.runs
    program = with_verdict(solved, solution.program, [run.phase for run in runs], [run.report for run in runs])
    scenes = [replace(run.scene, cell=renamed(run.cell)) for run in runs]
    named = (replace(run, scene=scene, program=program) for run, scene in zip(runs, scenes, strict=True))
    return replace(solution, cell=solved, runs=tuple(named))
