"""Options of ``cellplan layout`` as the search takes them."""

from concurrent.futures import Executor
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

from cellplan.errors import InputError
from cellplan.guard import processors
from cellplan.io.cell.load import load_cell
from cellplan.io.input.findings import did_you_mean, listed, shown
from cellplan.model.progress import Progress
from cellplan.pipeline.layout.quantities import read_angle, read_length, read_time
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.layout.search import search_layout
from cellplan.report.record.common import Record
from cellplan.search.programs.objective import Objective, Timing
from cellplan.study.cluster import Cluster
from cellplan.study.status import read_status
from cellplan.study.study import Stop

Choice = TypeVar("Choice", bound=StrEnum)


def read_request(
    cell: Path, *, objective: str, timing: str, clearance: str | None, margin: str | None, **others: Any
) -> LayoutRequest:
    """The request of the options.

    Raises:
        InputError: A word or a quantity cannot be read.
    """
    return LayoutRequest(
        cell=cell,
        objective=_word("--objective", objective, Objective),
        timing=_word("--timing", timing, Timing),
        clearance=None if clearance is None else read_length("--clearance", clearance),
        margin=None if margin is None else read_angle("--margin", margin),
        **others,
    )


def read_stop(budget: str | None, trials: int | None) -> Stop | None:
    """Where the search ends; None where no option says it.

    Raises:
        InputError: The budget is no time.
    """
    if budget is None and trials is None:
        return None
    return Stop(trials=trials, seconds=None if budget is None else read_time("--budget", budget))


def read_workers(workers: int | None, scheduler: str | None) -> int | str:
    """Who searches: a number of processes, or the address of a scheduler.

    Raises:
        InputError: Both are given.
    """
    if workers is not None and scheduler is not None:
        raise InputError("--workers: unexpected beside --scheduler, whose workers search; leave one of them out")
    return scheduler or workers or processors()


def run_search(
    request: LayoutRequest,
    output: Path | None,
    *,
    stop: Stop | None,
    workers: int | str,
    resume: bool,
    progress: Progress,
) -> tuple[Record, Path]:
    """The record of the search and its folder; arguments as the options give them."""
    folder = output or default_folder(request.cell, request.allow_dirs)
    with ExitStack() as opened:
        pool: int | Executor = opened.enter_context(Cluster(workers)) if isinstance(workers, str) else workers
        found = search_layout(request, folder, stop=stop, workers=pool, resume=resume, progress=progress)
    return found.record, folder


def default_folder(cell: Path, allow_dirs: tuple[Path, ...] = ()) -> Path:
    """Where the study of a cell is written unless the user says otherwise."""
    return Path("outputs") / f"{load_cell(cell, allow_dirs=allow_dirs).name}-layout"


def status_lines(cell: Path, output: Path | None) -> list[str]:
    """How far a search is."""
    folder = output or default_folder(cell)
    return [f"{folder}: {read_status(folder).text()}"]


def _word(option: str, text: str, kind: type[Choice]) -> Choice:
    """One of the words of an option."""
    known = [str(each) for each in kind]
    if text not in known:
        raise InputError(f"{option}: expected one of {listed(known)}, got {shown(text)}{did_you_mean(text, known)}")
    return kind(text)
