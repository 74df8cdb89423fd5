"""Options of ``cellplan layout`` as the search takes them."""

from concurrent.futures import Executor
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import typer

from cellplan.cli.errors import InterruptedWorkError
from cellplan.cli.output import say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus, InputError
from cellplan.guard import processors
from cellplan.io.input.findings import did_you_mean, listed, shown
from cellplan.pipeline.layout.quantities import read_angle, read_length, read_misplacement, read_time
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.layout.workers import layout_workers
from cellplan.search.programs.objective import Objective, Timing
from cellplan.study.session import Stop
from cellplan.study.status import read_status

Choice = TypeVar("Choice", bound=StrEnum)


class Work(NamedTuple):
    """How much is searched, by how many."""

    stop: Stop | None  # where the search ends; None for what is usual
    workers: int | str  # number of processes, or the address of a scheduler
    resume: bool  # whether an earlier search in the folder goes on


def read_request(
    cell: Path,
    *,
    objective: str,
    timing: str,
    clearance: str | None,
    margin: str | None,
    misplacement: str | None = None,
    **others: Any,
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
        misplacement=None if misplacement is None else read_misplacement("--misplacement", misplacement),
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


def search_and_say(
    request: LayoutRequest,
    output: Path | None,
    work: Work,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """Search, write the folder, say what came of it, and leave with the exit status; arguments as the options say.

    Raises:
        InputError: The cell cannot be searched.
        InterruptedWorkError: The search was interrupted.
        Exit: Always, at the end.
    """
    from cellplan.pipeline.layout.result import layout_lines
    from cellplan.pipeline.layout.search import refuse_search, search_layout

    folder = output or default_folder(request.cell, request.allow_dirs, is_free=bool(request.free))
    refuse_search(request, folder, resume=work.resume)
    with ExitStack() as opened:
        pool = opened.enter_context(_pool(work.workers, request))
        progress = opened.enter_context(progress_listener(quiet=quiet))
        try:
            record = search_layout(
                request,
                folder,
                stop=work.stop,
                workers=pool,
                resume=work.resume,
                progress=progress,
            ).record
        except KeyboardInterrupt as error:
            raise InterruptedWorkError(str(error) or "interrupted") from None
    statuses = {"certified": ExitStatus.PASSED, "no_start": ExitStatus.NO_SOLUTION}
    outcome = statuses.get(record["status"], ExitStatus.CHECK_FAILED)
    if as_json:
        place = {"folder": str(folder), "report_path": str(folder / "study.html")}
        say_json({"schema": record["schema"], "exit": int(outcome), **place, "study": record})
    else:
        show(layout_lines(record, folder), passed=outcome == ExitStatus.PASSED)
    raise typer.Exit(outcome)


def _pool(by: int | str, request: LayoutRequest) -> Executor:
    """The processes that search, here or of a cluster."""
    if isinstance(by, int):
        return layout_workers(by, request)
    from cellplan.study.cluster import Cluster

    return Cluster(by)


def default_folder(cell: Path, allow_dirs: tuple[Path, ...] = (), *, is_free: bool = False) -> Path:
    """Where the study of a cell is written unless the user says otherwise."""
    from cellplan.io.cell.load import load_cell

    return Path("outputs") / f"{load_cell(cell, allow_dirs=allow_dirs).name}-{'fastest' if is_free else 'layout'}"


def status_lines(cell: Path, output: Path | None, allow_dirs: tuple[Path, ...] = ()) -> list[str]:
    """How far a search is."""
    folder = output or default_folder(cell, allow_dirs)
    return [f"{folder}: {read_status(folder).text()}"]


def _word(option: str, text: str, kind: type[Choice]) -> Choice:
    """One of the words of an option."""
    known = [str(each) for each in kind]
    if text not in known:
        raise InputError(f"{option}: expected one of {listed(known)}, got {shown(text)}{did_you_mean(text, known)}")
    return kind(text)
