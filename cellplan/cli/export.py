"""``cellplan export``: controller programs from a verified run."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cellplan.cli.completion import FORMATS, PROMISES, TARGETS, one_of
from cellplan.cli.errors import error_lines, exit_status
from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, RunDir
from cellplan.cli.output import Result, json_failure, present
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus, InputError

if TYPE_CHECKING:
    from cellplan.model.exported import Promise, Targets
    from cellplan.model.progress import Progress
    from cellplan.model.verified_run import ReadRun, VerifiedRun
    from cellplan.pipeline.export.several import Exported

SCHEMA = "cellplan.exported/1"

Formats = Annotated[
    list[str],
    typer.Option(
        "--format",
        metavar="NAME",
        help="Format: csv, json or ros2 for any controller; krl, rapid, urscript or val3 for those of a maker; stream: "
        "rows at the cycle of each controller; wide: one table of all robots. May be repeated; all: every one that can "
        "take the run.",
        show_default=False,
        autocompletion=one_of((*FORMATS, "all")),
    ),
]
Robots = Annotated[
    list[str] | None,
    typer.Option(
        "--robot",
        metavar="NAME",
        help="Only this robot; may be repeated (default: all whose controller plays the format).",
        show_default=False,
    ),
]
TargetsOf = Annotated[
    str,
    typer.Option(
        "--targets",
        metavar="KIND",
        help="What rows state: joints, or part: tool poses on the part.",
        autocompletion=one_of(TARGETS),
    ),
]
PromiseOf = Annotated[
    str | None,
    typer.Option(
        "--promise",
        metavar="WORD",
        help="Only this promise: timed, synchronised or sequence (default: the best that holds).",
        show_default=False,
        autocompletion=one_of(PROMISES),
    ),
]
Split = Annotated[
    int | None, typer.Option("--split", metavar="N", help="Most rows of a file or routine (default: of the format).")
]
ThinMm = Annotated[
    float | None,
    typer.Option("--thin-mm", metavar="MM", help="How far a tool may be off where rows are left out (default: 0.05)."),
]
ThinDeg = Annotated[
    float | None,
    typer.Option("--thin-deg", metavar="DEG", help="How far a turning joint may be off there (default: 0.05)."),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help="Folder (default: RUN/programs/<format>); for several formats DIR/<format> each.",
    ),
]
WithoutCell = Annotated[
    bool,
    typer.Option("--without-cell", help="Use the run's own copy of the cell, without comparison with the original."),
]


def export(  # noqa: PLR0913, PLR0917 - the options of the command
    run: RunDir,
    form: Formats,
    output: Output = None,
    robot: Robots = None,
    targets: TargetsOf = "joints",
    promise: PromiseOf = None,
    split: Split = None,
    thin_mm: ThinMm = None,
    thin_deg: ThinDeg = None,
    cell: OriginalCell = None,
    without_cell: WithoutCell = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Write controller programs, from a verified run only.

    The run is verified first, and the rounded numbers of the programs after that. Exit status: 0 written, 1 a check
    fails, 2 bad input, or a run that is changed or stale, 4 internal error. One format is written only if it is 0. Of
    several each is written or refused by itself; 1 or 2 if one that was named is refused, or all are.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.run.folder import PROGRAMS
        from cellplan.pipeline.export.choice import Choice
        from cellplan.pipeline.export.program import default_folder, refuse_choice
        from cellplan.pipeline.export.several import (
            NothingFitsError,
            chosen_formats,
            refuse_unfit_run,
            refuse_unless_writable,
        )
        from cellplan.pipeline.gate.open_gate import open_gate

        formats = chosen_formats(form)
        require_choice(cell, without_cell=without_cell)
        choice: dict[str, Any] = {"robots": tuple(robot or ()), "targets": _targets(targets), "split": split}
        choice |= {"thin_mm": thin_mm, "thin_deg": thin_deg, "promise": _promise(promise)}
        single = next(iter(formats)) if list(formats.values()) == [True] else None
        if single:
            refuse_choice(single, Choice(**choice))
        folder = output or (default_folder(run, single) if single else run / PROGRAMS)
        refuse_unless_writable([folder] if single else [folder / name for name in formats], run)
        with progress_listener(quiet=quiet) as progress:
            unfit = partial(refuse_unfit_run, formats=formats, choice=Choice(**choice), folder=folder)
            try:
                verified = open_gate(run, cell=cell, allow_dirs=allow_dir or (), refuse=unfit, progress=progress)
                if single:
                    result = _one(verified, folder, single, choice=choice, progress=progress)
                else:
                    result = _several(verified, folder, form, choice=choice, progress=progress)
            except NothingFitsError as nothing:
                result = _result_of_several(nothing.run, folder, nothing.refused)
    present(result, as_json=as_json)
    raise typer.Exit(result.status)


def _one(verified: "VerifiedRun", folder: Path, form: str, *, choice: dict[str, Any], progress: "Progress") -> Result:
    """Write one format into a folder."""
    from cellplan.pipeline.export.choice import Choice
    from cellplan.pipeline.export.program import export_program
    from cellplan.pipeline.export.stored import read_stored_export

    files = export_program(verified, folder, form=form, choice=Choice(**choice), progress=progress)
    record = read_stored_export(folder).record
    status = {"status": "exported", "exit": int(ExitStatus.PASSED)}
    about = {"folder": str(folder), "format": form, "run": verified.digest, "files": list(files)}
    remarks = {"remarks": list(verified.remarks), "export": record}
    lines = [
        f"{verified.cell.name}: exported",
        *promise_lines(record),
        *_notes(verified.remarks),
        f"programs: {folder}",
    ]
    return Result(status=ExitStatus.PASSED, lines=lines, record={"schema": SCHEMA, **status, **about, **remarks})


def _several(
    verified: "VerifiedRun", folder: Path, forms: Sequence[str], *, choice: dict[str, Any], progress: "Progress"
) -> Result:
    """Write several formats, each into a folder of its own within a folder."""
    from cellplan.pipeline.export.choice import Choice
    from cellplan.pipeline.export.several import export_programs

    exports = export_programs(verified, folder, formats=forms, choice=Choice(**choice), progress=progress)
    return _result_of_several(verified, folder, exports, remarks=verified.remarks)


def _result_of_several(
    run: "VerifiedRun | ReadRun", folder: Path, found: "Sequence[Exported]", *, remarks: Sequence[str] = ()
) -> Result:
    """What to say of several formats."""
    status, written = _status(found), [each.form for each in found if each.refusal is None]
    word = "exported" if status == ExitStatus.PASSED else "refused"
    about = {"status": word, "exit": int(status), "folder": str(folder) if written else None, "run": run.digest}
    record = {
        "schema": SCHEMA,
        **about,
        "remarks": list(remarks),
        "exports": [_record(each) for each in found],
    }
    lines = [f"{run.cell.name}: exported {', '.join(written) or 'nothing'}"]
    for each in found:
        lines += [f"  {each.form}: {'refused' if each.refusal else each.folder}"]
        lines_of_it = error_lines(each.refusal) if each.refusal else promise_lines(each.record or {"files": ()})
        lines += [f"  {line}" if each.record else f"    {line.removeprefix('error: ')}" for line in lines_of_it]
    place = [f"programs: {folder}"] if written else []
    return Result(status=status, lines=[*lines, *_notes(remarks), *place], record=record)


def _status(found: Sequence["Exported"]) -> ExitStatus:
    """How the command ends: what was named must be written, and something of all."""
    refused = [each.refusal for each in found if each.refusal is not None]
    if len(refused) < len(found) and not any(each.is_named and each.refusal for each in found):
        return ExitStatus.PASSED
    if len(refused) == len(found) and all(isinstance(each, InputError) for each in refused):
        return ExitStatus.BAD_INPUT
    return ExitStatus.CHECK_FAILED


def _record(each: "Exported") -> dict[str, Any]:
    """What came of one format among several, for machines."""
    if each.refusal is not None:
        return {
            "format": each.form,
            "folder": None,
            "status": "refused",
            "exit": int(exit_status(each.refusal)),
            "errors": error_lines(each.refusal),
        }
    about = {"format": each.form, "folder": str(each.folder)}
    return {**about, "status": "exported", "exit": 0, "files": list(each.files), "export": each.record}


def _notes(remarks: Sequence[str]) -> list[str]:
    """What to know before relying on the run."""
    return [f"  note: {remark}" for remark in remarks]


def promise_lines(record: Mapping[str, Any]) -> Iterator[str]:
    """What is promised of exported programs and why not more, and what was found in them.

    Args:
        record: What their ``export.json`` says.
    """
    if "promise" in record:
        yield f"  promise: {record['promise']}"
        yield from (f"    {reason}" for reason in [*record["reasons"], *record["remarks"]])
        if record["allowed_skew"] is not None:
            yield f"  {record['allowed_skew']['line']}"
        if record["marks"]:
            count = sum(len(marks["times_s"]) for marks in record["marks"])
            yield f"  marks: all robots of the cell wait for one another at {count}"
        yield f"  {record['deviation']}"
        yield from (f"  not judged: {text}" for text in record["not_judged"])
    yield f"  files: {len(record['files'])}"


def _targets(word: str) -> "Targets":
    """What rows state.

    Raises:
        InputError: There is no such kind of row.
    """
    from cellplan.model.exported import Targets

    if word not in TARGETS:
        raise InputError(f"--targets: expected one of {', '.join(TARGETS)}, got '{word}'")
    return Targets(word)


def _promise(word: str | None) -> "Promise | None":
    """The promise of a word of the command line; each begins with its word.

    Raises:
        InputError: There is no such promise.
    """
    from cellplan.model.exported import Promise

    if word is None:
        return None
    if word not in PROMISES:
        raise InputError(f"--promise: expected one of {', '.join(PROMISES)}, got '{word}'")
    return next(each for each in Promise if each.startswith(word))


def require_choice(cell: Path | None, *, without_cell: bool) -> None:
    """Require exactly one of the cell file that was solved and ``--without-cell``.

    Raises:
        InputError: Neither or both were given.
    """
    if cell is None and not without_cell:
        raise InputError(
            "--cell: expected the cell file that was solved, so that it and its files are compared with the run, got "
            "none; use --without-cell for the run's own copy of it"
        )
    if cell is not None and without_cell:
        raise InputError("--without-cell: expected no --cell beside it")
