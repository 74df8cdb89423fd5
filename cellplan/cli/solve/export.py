"""``cellplan export``: controller programs of a verified run."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import one_of
from cellplan.cli.options.given_options import require_choice
from cellplan.cli.options.request import Options, option
from cellplan.cli.solve.exported import SCHEMA, promise_lines, result_of_one, result_of_several
from cellplan.cli.terminal.output import Result, notes
from cellplan.cli.terminal.progress import Listener, progress_listener
from cellplan.errors import ExitStatus, InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cellplan.model.report.verified_run import VerifiedRun
    from cellplan.programs.export.choice import Choice


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOptions(Options):
    """What is exported, and where it is written."""

    SCHEMA = SCHEMA

    run: shared.RunDir
    forms: Annotated[
        tuple[str, ...],
        option(
            "--format NAME",
            "Format: csv, json or ros2 for any controller; fanuc_ls, inform, krl, rapid, urscript or val3 for those of "
            "a maker; stream: rows at the cycle of each controller; wide: one table of all robots. May be repeated; "
            "all: every one that can take the run.",
            autocompletion=one_of("cellplan.programs.dialects:DIALECTS", "wide", "all"),
        ),
    ]
    output: Annotated[
        Path | None,
        option("-o, --output DIR", "Folder (default: RUN/programs/<format>); for several formats DIR/<format> each."),
    ] = None
    robots: Annotated[
        tuple[str, ...],
        option("--robot NAME", "Only this robot; may be repeated (default: all whose controller plays the format)."),
    ] = ()
    moves: Annotated[
        str,
        option(
            "--moves KIND",
            "How tools move where they work: joints, linear (lines and arcs in a frame of the part), or auto: linear "
            "where it can be.",
            autocompletion=one_of("cellplan.model.report.exported:Moves"),
        ),
    ] = "joints"
    promise: Annotated[
        str | None,
        option(
            "--promise WORD",
            "Only this promise: timed, synchronised, paced or sequence (default: the best that holds).",
            autocompletion=one_of("cellplan.model.report.exported:Promise"),
        ),
    ] = None
    split: Annotated[int | None, option("--split N", "Most rows of a file or routine (default: of the format).")] = None
    thin_mm: Annotated[
        float | None, option("--thin-mm MM", "How far a tool may be off where rows are left out (default: 0.05).")
    ] = None
    thin_deg: Annotated[
        float | None, option("--thin-deg DEG", "How far a turning joint may be off there (default: 0.05).")
    ] = None
    escape: Annotated[
        bool,
        option(
            "--escape",
            "Programs keep a step register, and escape programs beside them (DIR-escape) bring all robots home from "
            "wherever they stand between two marks.",
        ),
    ] = False
    cell: shared.OriginalCell = None
    without_cell: shared.WithoutCell = False
    controllers: shared.Controllers = None
    as_json: shared.AsJson = False
    quiet: shared.Quiet = False
    allow_dirs: shared.AllowDirs = ()


def export(options: ExportOptions) -> Result:
    """Write controller programs, from a verified run only.

    The run is verified first, and the rounded numbers of the programs after that. Exit status: 0 written, 1 a check
    fails, 2 bad input, or a run that is changed or stale, 4 internal error. One format is written only if it is 0. Of
    several each is written or refused by itself; 1 or 2 if one that was named is refused, or all are.
    """
    from cellplan.files.cell.reader_process import begin_reading

    begin_reading(options.cell)
    from cellplan.programs.export.exporters import chosen_formats, refuse_choice

    formats = chosen_formats(options.forms)
    from cellplan.files.run.folder import PROGRAMS
    from cellplan.programs.export.refusals import (
        NothingFitsError,
        default_folder,
        refuse_unfit_run,
        refuse_unless_writable,
    )
    from cellplan.runs.gate.open_gate import open_gate

    if options.escape and not all(formats.values()):
        raise InputError("--escape: expected the formats by name, got all")
    require_choice(options.cell, without_cell=options.without_cell)
    choice = _choice(options)
    single = next(iter(formats)) if list(formats.values()) == [True] else None
    if single:
        refuse_choice(single, choice)
    folder = options.output or (default_folder(options.run, single) if single else options.run / PROGRAMS)
    refuse_unless_writable([folder] if single else [folder / name for name in formats], options.run)
    unfit = partial(refuse_unfit_run, formats=formats, choice=choice, folder=folder)
    with progress_listener(quiet=options.quiet) as progress:
        try:
            run = open_gate(options.run, **shared.sources(options), refuse=unfit, progress=progress)
        except NothingFitsError as nothing:
            return result_of_several(nothing.run, folder, nothing.refused)
        if options.escape:
            return _escapes(run, folder, formats, choice, progress)
        from cellplan.programs.export.program import export_program, export_programs
        from cellplan.programs.export.stored import read_stored_export

        if single:
            files = export_program(run, folder, form=single, choice=choice, progress=progress)
            return result_of_one(run, folder, single, files=list(files), record=read_stored_export(folder).record)
        exports = export_programs(run, folder, formats=options.forms, choice=choice, progress=progress)
        return result_of_several(run, folder, exports, run.remarks)


def _escapes(
    run: "VerifiedRun", folder: Path, formats: "Mapping[str, bool]", choice: "Choice", progress: Listener
) -> Result:
    """Programs with escape programs, in each format that was named: all are written or none."""
    from cellplan.jobs.recover.escape import escape_lines, escape_programs, write_escape
    from cellplan.programs.shared import Shared

    shared_results = Shared(run)
    escapes = {
        form: escape_programs(run, form, choice, shared=shared_results, progress=progress)
        for form, is_named in formats.items()
        if is_named
    }
    places = {form: folder if len(formats) == 1 else folder / form for form in escapes}
    lines, exports = [f"{run.cell.name}: exported {', '.join(escapes)} with escape programs"], []
    for form, escape in escapes.items():
        escape_folder = write_escape(places[form], escape)
        lines += [f"  {form}: {places[form]}", *(f"  {line}" for line in promise_lines(escape.record))]
        lines += [f"    escape: {escape_folder}", *(f"    {line}" for line in escape_lines(escape.escape_record))]
        exports.append({"format": form, "folder": str(places[form]), "escape": escape.escape_record})
    about = {"schema": SCHEMA, "status": "exported", "exit": int(ExitStatus.PASSED), "folder": str(folder)}
    what = {"run": run.digest, "remarks": list(run.remarks), "exports": exports}
    return Result(ExitStatus.PASSED, [*lines, *notes(run.remarks)], {**about, **what})


def _choice(options: ExportOptions) -> "Choice":
    from cellplan.model.report.exported import Moves, Promise
    from cellplan.programs.export.choice import Choice

    moves = {str(kind): kind for kind in Moves}
    promises = {None: None} | {promise.split()[0]: promise for promise in Promise}
    for name, word, known in (("moves", options.moves, moves), ("promise", options.promise, promises)):
        if word not in known:
            raise InputError(f"--{name}: expected one of {', '.join(filter(None, known))}, got '{word}'")
    usual = ("paced" if moves[options.moves] is not Moves.JOINTS else "sequence") if options.escape else None
    promise = promises[options.promise or usual]
    return options.to(Choice, moves=moves[options.moves], promise=promise, steps=options.escape)
