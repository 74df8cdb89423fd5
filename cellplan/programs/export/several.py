"""Several formats of one run at once: what all of them need of it is worked out once, and each is all or nothing."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from cellplan.cache import without_cache
from cellplan.errors import InputError, NotVerifiedError, raise_findings, refusals
from cellplan.files.input.findings import listed
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.exported import Moves
from cellplan.model.report.verified_run import ReadRun, UnsolvedRun, VerifiedRun
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.export.choice import Choice, refuse_unknown_robots
from cellplan.programs.export.prepare import refuse_unfit
from cellplan.programs.export.program import (
    EXPORTERS,
    exported,
    exporter_of,
    refuse_choice,
    refuse_unless_exportable,
    require_format,
    write_export,
)
from cellplan.programs.shared import Shared

ALL: Final = "all"  # instead of the name of a format: every one that can take the run
EVERYTHING: Final = Choice()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exported:
    """What came of one format among several.

    Attributes:
        form: Name of the format.
        folder: Where its files go.
        is_named: Whether it was asked for by its name, not only as one of all.
        files: Paths of its programs in the folder; empty where it is refused.
        record: What its ``export.json`` says; None likewise.
        refusal: Why nothing was written; None where it was.
    """

    form: str
    folder: Path
    is_named: bool
    files: tuple[str, ...] = ()
    record: Mapping[str, Any] | None = None
    refusal: InputError | NotVerifiedError | None = None


def chosen_formats(formats: Sequence[str]) -> dict[str, bool]:
    """Formats that are meant, ``all`` for every one, and whether each was asked for by its name; at least one."""
    if not formats:
        raise InputError(f"--format: expected {ALL}, or one or more of {listed(EXPORTERS)}, got none")
    for name in formats:
        if name != ALL:
            require_format(name)
    every = list(EXPORTERS) if ALL in formats else []
    return {name: name in formats for name in dict.fromkeys([*formats, *every]) if name != ALL}


def export_programs(
    run: VerifiedRun,
    folder: Path,
    *,
    formats: Sequence[str] = (ALL,),
    choice: Choice = EVERYTHING,
    progress: Progress = silent,
) -> tuple[Exported, ...]:
    """Write the programs of a verified run in several formats, each in a folder of its own: ``folder/csv`` and so on.

    What holds of the run whatever the format is worked out once, and rows that are read back alike from two formats, to
    the last bit, are judged once. A format that cannot take the run is refused and does not keep others from being
    written; whether that is an error is for the caller to say.

    Args:
        run: The verified run.
        folder: Where the folders of the formats go; older exports in these are replaced.
        formats: Names of formats; ``all`` for every one there is.
        choice: What of the run, and how; a format that cannot hold it is refused.
        progress: Called with the stage and the fraction done.

    Returns:
        What came of each format, in the order in which they were asked for.

    Raises:
        InputError: There is no such format or robot, or a folder must not or cannot be written.
    """
    chosen = chosen_formats(formats)
    refuse_unless_writable([folder / form for form in chosen], run.folder)
    refuse_unknown_robots(run.cell, choice.robots)
    with without_cache():  # a proof rests on the files themselves
        return tuple(_exports(Shared(run), folder, chosen, choice, progress))


class NothingFitsError(NotVerifiedError):
    """None of several formats can take a run, as its files say already.

    Attributes:
        run: The run as it was read.
        refused: Why not, format by format.
    """

    def __init__(self, run: ReadRun, refused: tuple[Exported, ...]) -> None:
        """Join all that speaks against the formats."""
        super().__init__(
            [f"{refusal.form}: {line}" for refusal in refused for line in str(refusal.refusal).splitlines()]
        )
        self.run, self.refused = run, refused


def refuse_unfit_run(run: ReadRun, formats: Mapping[str, bool], choice: Choice, *, folder: Path) -> None:
    """Refuse an export to a folder where, as the files of the run say already, none of the formats can be written.

    Raises:
        InputError: There is no such robot; or the only format needs something that is not stated, or does not fit.
        NotVerifiedError: No promise of the only format can be kept with this motion.
        NothingFitsError: One of these holds of each of several formats.
    """
    refuse_unknown_robots(run.cell, choice.robots)
    refused: list[Exported] = []
    for form, is_named in formats.items():
        try:
            dialect = exporter_of(form, choice)
            refuse_choice(form, choice)
            if isinstance(dialect, Dialect):
                refuse_unfit(run, dialect, choice)
        except (InputError, NotVerifiedError) as error:
            refused.append(Exported(form=form, folder=folder / form, is_named=is_named, refusal=error))
            if len(formats) == 1 and is_named:
                raise
    if len(refused) == len(formats):
        raise NothingFitsError(run, tuple(refused))


def require_settings(cell: Cell, formats: Iterable[str]) -> None:
    """Require all that a cell has to state for programs in some formats; an ``InputError`` has a line for each.

    Where a task has a process these are programs of lines, if the format has them: no others begin it.
    """
    missing: list[InputError] = []
    has_process = any(task.process is not None for task in cell.tasks)
    for form in formats:
        require_format(form, option="--for")
        dialect = EXPORTERS[form]
        if isinstance(dialect, Dialect):
            choice = Choice(moves=Moves.LINEAR) if has_process and Moves.LINEAR in dialect.moves else EVERYTHING
            for finding in refusals(partial(refuse_unfit, UnsolvedRun(cell=cell), dialect, choice)):
                key, _, text = str(finding).partition(": ")
                is_bare = text == f"expected the controller that plays {form}, got none"
                cure = f"; state its id, and controllers of kind {listed(dialect.kinds)}" if is_bare else ""
                missing.append(InputError(f"{cell.origin.at(key)}: for {form}: {text}{cure}"))
    raise_findings(missing)


def refuse_unless_writable(folders: Iterable[Path], run: Path) -> None:
    """Refuse places in or around the run, or with something else than an export; call it before any long work."""
    for folder in folders:
        refuse_unless_exportable(folder, run)


def _exports(
    shared: Shared, folder: Path, formats: Mapping[str, bool], choice: Choice, progress: Progress
) -> Iterator[Exported]:
    """What comes of each format."""
    for form, is_named in formats.items():
        place = folder / form
        try:
            files, record = exported(shared.run, form, choice, shared=shared, progress=_of(form, progress))
        except (InputError, NotVerifiedError) as refusal:
            yield Exported(form=form, folder=place, is_named=is_named, refusal=refusal)
            continue
        write_export(place, files, record)
        yield Exported(form=form, folder=place, is_named=is_named, files=tuple(files), record=record)


def _of(form: str, progress: Progress) -> Progress:
    """Progress that names the format."""
    return lambda stage, share: progress(f"{form}: {stage}", share)
