"""Searches of ``cellplan layout`` and ``cellplan fastest --free``: requests and their units, work, and results."""

import math
import re
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar

from cellplan.cli.options.crew import crew
from cellplan.cli.terminal.errors import resumable
from cellplan.cli.terminal.output import Result, result_of_folder
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus, InputError
from cellplan.files.cell.load import load_cell, load_open_cell
from cellplan.files.input.findings import did_you_mean, listed, shown
from cellplan.files.run.folder import refuse_unless_replaceable
from cellplan.guard import processors
from cellplan.jobs.alternate import alternate, alternation_lines, alternation_record, best_step
from cellplan.jobs.layout.request import LayoutRequest, files_of
from cellplan.jobs.layout.result import layout_lines
from cellplan.jobs.layout.search import layout_workers, refuse_search, search_layout
from cellplan.jobs.repair.record import SCHEMA
from cellplan.jobs.repair.repair import repair
from cellplan.jobs.repair.result import advice_lines, write_repair
from cellplan.runs.overrides import feed_settings
from cellplan.search.programs.objective import CycleTiming, Objective
from cellplan.study.session import Stop

if TYPE_CHECKING:
    from cellplan.cli.improve.fastest import FastestOptions
    from cellplan.cli.improve.layout import LayoutOptions

QUANTITY: Final = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)\s*")
LENGTHS: Final[Mapping[str, float]] = {"mm": 1.0, "cm": 10.0, "m": 1000.0}  # [mm]
ANGLES: Final[Mapping[str, float]] = {"deg": 1.0, "rad": 180.0 / math.pi}  # [deg]
TIMES: Final[Mapping[str, float]] = {"s": 1.0, "min": 60.0, "h": 3600.0}  # [s]
SearchOptions: TypeAlias = "LayoutOptions | FastestOptions"
Choice = TypeVar("Choice", bound=StrEnum)
Value = TypeVar("Value")
SEARCHED: Final = {"certified": ExitStatus.PASSED, "no_start": ExitStatus.NO_SOLUTION}  # any other status: failed
REPAIRED: Final = {
    "passes": ExitStatus.PASSED,
    "repaired": ExitStatus.PASSED,
    "no_remedy": ExitStatus.CHECK_FAILED,
    "no_motion": ExitStatus.NO_SOLUTION,
}


def layout_request(options: SearchOptions, *, objective: str, **others: Any) -> LayoutRequest:
    """What is searched for, as the options say."""
    if options.feed is not None:
        cell = load_cell(options.cell, allow_dirs=options.allow_dirs)
        others["settings"] = feed_settings(cell, others.get("settings", options.settings), options.feed)
    return options.to(
        LayoutRequest,
        objective=_word("--objective", objective, Objective),
        timing=_word("--timing", options.timing, CycleTiming),
        clearance=_quantity("--clearance", options.clearance, read_length),
        margin=_quantity("--margin", options.margin, read_angle),
        misplacement=_quantity("--misplacement", options.misplacement, read_misplacement),
        **others,
    )


def searched(options: SearchOptions, request: LayoutRequest) -> Result:
    """Search, and write the folder.

    Raises:
        InputError: The cell cannot be searched.
        InterruptedWorkError: The search was interrupted.
    """
    stop = Stop(trials=options.trials, seconds=_quantity("--budget", options.budget, read_time))
    folder = study_folder(options, "fastest" if request.free else "layout")
    refuse_search(request, folder, resume=options.resume)
    with ExitStack() as opened:
        workers = opened.enter_context(crew(options.workers, options.scheduler, partial(files_of, request)))
        if isinstance(workers, int):
            workers = opened.enter_context(layout_workers(workers, request))
        progress = opened.enter_context(progress_listener(quiet=options.quiet))
        opened.enter_context(resumable())
        record = search_layout(
            request,
            folder,
            stop=None if stop == Stop() else stop,
            workers=workers,
            resume=options.resume,
            progress=progress,
        ).record
    status = SEARCHED.get(record["status"], ExitStatus.CHECK_FAILED)
    lines = layout_lines(record, folder)
    return result_of_folder(record["schema"], status, lines, folder / "study.html", study=record)


def repaired(options: "LayoutOptions", request: LayoutRequest) -> Result:
    """Repair a cell, and write the folder."""
    folder = study_folder(options, "repair")
    refuse_unless_replaceable(folder)
    with (
        crew(options.workers, options.scheduler, partial(files_of, request)) as workers,
        progress_listener(quiet=options.quiet) as progress,
    ):
        outcome = repair(request, workers=workers, progress=progress)
        record = write_repair(outcome, request, folder)
    lines = advice_lines(record, folder, request.cell)
    return result_of_folder(SCHEMA, REPAIRED[record["status"]], lines, folder / "advice.html", advice=record)


def alternated(options: "LayoutOptions", request: LayoutRequest) -> Result:
    """Assign the tasks of a cell and search its layout in turn.

    Raises:
        InputError: The options do not go together, or the cell cannot be assigned or searched.
    """
    others = {
        "--repair": options.repair,
        "--resume": options.resume,
        "--set": options.settings,
        "--scheduler": options.scheduler,
    }
    if unexpected := [option for option, value in others.items() if value]:
        raise InputError(f"{unexpected[0]}: unexpected beside --assign; leave it out, or write it into the cell")
    name = load_open_cell(options.cell, allow_dirs=options.allow_dirs)[0].name
    folder = options.output or Path("outputs") / f"{name}-layout"
    stop = Stop(trials=options.trials, seconds=_quantity("--budget", options.budget, read_time))
    with progress_listener(quiet=options.quiet) as progress:
        steps = alternate(
            request,
            folder,
            stop=None if stop == Stop() else stop,
            workers=options.workers or processors(),
            progress=progress,
        )
    best = best_step(steps)
    status = ExitStatus.CHECK_FAILED if best is None else ExitStatus.PASSED
    about = {"exit": int(status), "folder": str(folder)}
    return Result(status, alternation_lines(steps), {**alternation_record(steps), **about})


def study_folder(options: SearchOptions, what: str) -> Path:
    """Where a study is written: beside other results of the cell unless the options say otherwise."""
    return options.output or (Path("outputs") / f"{load_cell(options.cell, allow_dirs=options.allow_dirs).name}-{what}")


def _quantity(option: str, text: str | None, read: Callable[[str, str], Value]) -> Value | None:
    """A quantity with its unit; None where the option is not given."""
    return None if text is None else read(option, text)


def _word(option: str, text: str, kind: type[Choice]) -> Choice:
    known = [str(member) for member in kind]
    if text not in known:
        raise InputError(f"{option}: expected one of {listed(known)}, got {shown(text)}{did_you_mean(text, known)}")
    return kind(text)


def read_length(option: str, text: str) -> float:
    """A length in [mm] of a text such as ``10mm``; a plain number is in millimetres."""
    return _read(option, text, LENGTHS, "a length such as 10mm")


def read_angle(option: str, text: str) -> float:
    """An angle in [deg] of a text such as ``15deg``; a plain number is in degrees."""
    return _read(option, text, ANGLES, "an angle such as 15deg")


def read_misplacement(option: str, text: str) -> tuple[float, float]:
    """A length in [mm] and an angle in [deg] of a text such as ``10mm,1deg``."""
    length, comma, angle = text.partition(",")
    if not comma:
        raise InputError(f"{option}: expected a length and an angle such as 10mm,1deg, got {shown(text)}")
    misplacement = read_length(option, length), read_angle(option, angle)
    if not min(misplacement) > 0.0:
        raise InputError(f"{option}: expected a length and an angle above 0 such as 10mm,1deg, got {shown(text)}")
    return misplacement


def read_time(option: str, text: str) -> float:
    """A time in [s] of a text such as ``60s`` or ``10min``; a plain number is in seconds."""
    seconds = _read(option, text, TIMES, "a time such as 60s or 10min")
    if not seconds > 0.0:
        raise InputError(f"{option}: expected a time above 0 such as 60s or 10min, got {shown(text)}")
    return seconds


def _read(option: str, text: str, units: Mapping[str, float], expected: str) -> float:
    """A number of at least 0 in the first of the units."""
    match = QUANTITY.fullmatch(text)
    unit = match[2] or next(iter(units)) if match else ""
    value = float(match[1]) * units.get(unit, math.nan) if match else math.nan
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{option}: expected {expected} ({', '.join(units)}), got {shown(text)}")
    return value
