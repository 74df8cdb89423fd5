"""Refusals: what speaks against an export before anything is computed, all of it at once."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from cellplan.errors import InputError, InvalidFileError, NotVerifiedError, raise_findings, refusals
from cellplan.files.input.findings import listed
from cellplan.files.run.folder import EXPORT, PROGRAMS, refuse_unless_replaceable
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ExportFrame, Moves, Promise
from cellplan.model.report.verified_run import AnyRun, ReadRun, UnsolvedRun
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.frames import require_frame_numbers
from cellplan.programs.elements.handshake import require_signals
from cellplan.programs.elements.timed_rows import cycle_of
from cellplan.programs.export.choice import Choice, exported_robots, refuse_unknown_robots
from cellplan.programs.export.exporters import EXPORTERS, exporter_of, refuse_choice
from cellplan.programs.promises.promises import require_promise, unstated_processes
from cellplan.programs.promises.run_programs import holders_rest, program_names, run_programs
from cellplan.programs.promises.stations import stations
from cellplan.programs.rows.resample import lead_time

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
        dialect = EXPORTERS[form]
        if isinstance(dialect, Dialect):
            choice = Choice(moves=Moves.LINEAR) if has_process and Moves.LINEAR in dialect.moves else EVERYTHING
            for finding in refusals(partial(refuse_unfit, UnsolvedRun(cell=cell), dialect, choice)):
                key, _, text = str(finding).partition(": ")
                is_bare = text == f"expected the controller that plays {form}, got none"
                cure = f"; state its id, and controllers of kind {listed(dialect.kinds)}" if is_bare else ""
                missing.append(InputError(f"{cell.origin.at(key)}: for {form}: {text}{cure}"))
    raise_findings(missing)


def settings_remarks(cell: Cell, formats: Iterable[str]) -> list[tuple[str, str]]:
    """What programs in some formats would leave out though nothing is missing: keys of a cell, and a remark on each."""
    linear = [EXPORTERS[form] for form in formats if form in EXPORTERS]
    kinds = {kind for it in linear if isinstance(it, Dialect) and Moves.LINEAR in it.moves for kind in it.kinds}
    robots = (it.name for it in cell.robots if it.control and cell.controllers[it.control.id].kind in kinds)
    return list(unstated_processes(cell, robots))


def default_folder(run: Path, form: str) -> Path:
    """Where programs are written by default: inside the run folder."""
    return run / PROGRAMS / form


def refuse_unless_exportable(folder: Path, run: Path) -> None:
    """Refuse what is part of the run, holds it, or holds anything but an export; call it before any long work."""
    place, source = folder.resolve(), run.resolve()
    inside = place.relative_to(source).parts if place.is_relative_to(source) else None
    if source.is_relative_to(place) or (inside is not None and (len(inside) < 2 or inside[0] != PROGRAMS)):
        raise InputError(f"{folder}: expected a folder outside the run, or below '{run / PROGRAMS}'")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / EXPORT).is_file():
        raise InputError(f"{folder}: contains files other than exported programs; choose another folder")
    refuse_unless_replaceable(folder)


def refuse_unless_writable(folders: Iterable[Path], run: Path) -> None:
    """Refuse places in or around the run, or with something else than an export; call it before any long work."""
    for folder in folders:
        refuse_unless_exportable(folder, run)


def frame_of(run: AnyRun, dialect: Dialect, robots: Sequence[str], promise: Promise, choice: Choice) -> ExportFrame:
    """What a reader may know of an export of a run."""
    frame = ExportFrame(
        cell=run.cell,
        robots=tuple(robots),
        programs=program_names(run),
        promise=promise,
        moves=choice.moves,
        split=choice.split,
    )
    return replace(frame, stations=stations(run)) if dialect.has_seams(frame) else frame


def refuse_unfit(run: ReadRun | UnsolvedRun, dialect: Dialect, choice: Choice) -> None:
    """Refuse an export of which the files of a run, or a cell, say already that it cannot be.

    Raises:
        InputError: All that is not stated in the cell, or does not fit.
        NotVerifiedError: No promise of the format can be kept with this motion.
    """
    choice.refuse_for(dialect)
    unmet = list(refusals(partial(exported_robots, run.cell, dialect, choice.robots)))
    chosen = choice.robots or [robot.name for robot in run.cell.robots]
    robots = tuple(robot.name for robot in run.cell.robots if robot.control is None and robot.name in chosen)
    if not unmet:
        robots = exported_robots(run.cell, dialect, choice.robots)
    elif not robots:  # or else what those need that have no controller yet is said too
        raise_findings(unmet)
    if not unmet and isinstance(run, ReadRun):
        _refuse_unstated(run, dialect, robots, choice)
    usual = dialect.promises[0 if dialect.most_arms is None else -1]  # arms of controllers that are not known yet
    best = promise = choice.promise or usual
    try:
        best = require_promise(run, dialect, robots, requested=choice.promise, moves=choice.moves)
    except InputError as error:
        unmet += error.findings if isinstance(error, InvalidFileError) else [error]
    except NotVerifiedError as error:
        raise_findings(unmet)
        frame = frame_of(run, dialect, robots, choice.promise or dialect.promises[-1], choice)
        needed = {f"  needed too: {finding}": None for finding in unmet_demands(run, dialect, frame, choice)}
        raise NotVerifiedError([*error.findings, *needed]) from None
    frame = frame_of(run, dialect, robots, promise if unmet else best, choice)
    raise_findings([*unmet, *unmet_demands(run, dialect, frame, choice)])


def _refuse_unstated(run: ReadRun, dialect: Dialect, robots: Sequence[str], choice: Choice) -> None:
    """Refuse what a cell does not state before the rows of its run are read, where these decide no promise.

    A promise that they keep a format from making is refused first: what is missing is said beside it.
    """
    if not holders_rest(run.cell, run.phases):
        return
    unsolved = UnsolvedRun(cell=run.cell)
    try:
        promise = require_promise(unsolved, dialect, robots, requested=choice.promise, moves=choice.moves)
    except (InputError, NotVerifiedError):
        return
    if promise.waits:
        raise_findings(unmet_demands(unsolved, dialect, frame_of(unsolved, dialect, robots, promise, choice), choice))


def unmet_demands(run: AnyRun, dialect: Dialect, frame: ExportFrame, choice: Choice) -> Iterator[InputError]:
    """All that a format still needs of a cell, and choices that do not go with what is promised."""
    if is_at_cycle(dialect, frame.promise):
        if choice.is_thinned:
            yield InputError(f"--thin-mm, --thin-deg: expected no thinning of a timed {dialect.name} program")
        yield from refusals(partial(lead_time, {robot.name: cycle_of(robot) for robot in frame.cell.robots}))
    cycles = frame.cell.program.cycles
    if dialect.has_seams(frame) and cycles > 1 and not dialect.repeats_seams:
        yield InputError(
            f"program.cycles: expected 1, as {dialect.name} programs of lines pass each seam once, got {cycles}; "
            "repeat the program on the controller, or write joints (--moves joints)"
        )
    if frame.promise.waits:
        yield from refusals(*(partial(require_signals, frame, robot.name) for robot in frame.cell.robots))

    yield from refusals(*_frame_demands(dialect, frame))

    def rows() -> int:
        return max((len(program.times) for program in run_programs(run)), default=0)

    yield from refusals(lambda: raise_findings(refusals(*dialect.demands(frame, rows))))


def _frame_demands(dialect: Dialect, frame: ExportFrame) -> Iterator[Callable[[], object]]:
    """What programs of lines need of the numbers of frames, of robots that work."""
    needed = dialect.frame_numbers if frame.promise is Promise.PACED else None
    for name in dict.fromkeys(task.robot for task in frame.cell.tasks if task.robot in frame.robots):
        control = frame.robot(name).control
        if control is None or frame.cell.controllers[control.id].kind in dialect.kinds:
            yield partial(require_frame_numbers, frame.robot(name), frame.stations.get(name, ()), needed=needed)


def is_at_cycle(dialect: Dialect, promise: Promise) -> bool:
    """Whether the rows of an export lie on the cycle of the controller."""
    return dialect.at_cycle and promise is Promise.TIMED
