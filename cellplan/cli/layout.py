"""``cellplan layout``: search the placement of all robots, and all else that may change, for the whole job at once."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import OBJECTIVES, TIMINGS, cell_files, one_of
from cellplan.cli.options import AllowDirs, AsJson, CellFile, Quiet, Settings
from cellplan.cli.output import json_failure, say

SCHEMA = "cellplan.layout/1"

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Study folder (default: outputs/<cell name>-layout)."),
]
Goal = Annotated[
    str,
    typer.Option(
        "--objective",
        metavar="NAME",
        help="conforming: the first layout that passes; cycle: the shortest cycle; clearance: the largest distances; "
        "change: the least change from the given layout. All but cycle are at the duration of the cell.",
        autocompletion=one_of(OBJECTIVES),
    ),
]
HowTimed = Annotated[
    str,
    typer.Option(
        "--timing",
        metavar="NAME",
        help="laws: by the time laws of the cell; retimed: as fast as the limits allow everywhere.",
        autocompletion=one_of(TIMINGS),
    ),
]
Duration = Annotated[
    float | None, typer.Option("--duration", metavar="S", help="Duration at which the limits must hold, in seconds.")
]
Distance = Annotated[
    str | None, typer.Option("--clearance", metavar="LENGTH", help="Required clearance, such as 10mm.")
]
Margin = Annotated[
    str | None,
    typer.Option("--margin", metavar="ANGLE", help="Demanded margin of all turning joints, such as 15deg."),
]
Displaced = Annotated[
    str | None,
    typer.Option(
        "--misplacement",
        metavar="LENGTH,ANGLE",
        help="The layout must pass, in one cycle and with its motion planned anew, with every base off by so much "
        "along each axis and about the vertical, such as 10mm,1deg.",
    ),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="KEY[=RANGES]",
        help="What may change beside what the cell says, such as 'kuka.base={x_mm: [0, 2000]}'; may be repeated.",
        show_default=False,
    ),
]
Fix = Annotated[
    list[str] | None,
    typer.Option(
        "--fix", metavar="KEY", help="What may not change, such as kuka.base.z_mm; may be repeated.", show_default=False
    ),
]
Attempts = Annotated[
    list[Path] | None,
    typer.Option(
        "--try",
        metavar="CELL2",
        help="A cell file whose layout is tried too; may be repeated.",
        show_default=False,
        autocompletion=cell_files,
    ),
]
Budget = Annotated[
    str | None,
    typer.Option("--budget", metavar="TIME", help="Begin no round after this time (default: 60s without --trials)."),
]
Trials = Annotated[
    int | None, typer.Option("--trials", metavar="N", min=1, help="Number of trials; repeats a search byte for byte.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Seed of starts and perturbations.")]
WorkerCount = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", min=1, help="Processes that search (default: one for each processor)."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask scheduler whose workers search, such as tcp://10.0.0.5:8786 (extra: cellplan[cluster]). They read "
        "the cell file under the same path.",
    ),
]
Repair = Annotated[
    bool, typer.Option("--repair", help="Find the smallest change with which the cell passes, and other remedies.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Continue the search in the folder.")]
Status = Annotated[bool, typer.Option("--status", help="Say how far the search in the folder is, and do nothing.")]


def layout(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    output: Output = None,
    objective: Goal = "cycle",
    timing: HowTimed = "laws",
    duration: Duration = None,
    clearance: Distance = None,
    margin: Margin = None,
    misplacement: Displaced = None,
    vary: Vary = None,
    fix: Fix = None,
    settings: Settings = None,
    attempts: Attempts = None,
    budget: Budget = None,
    trials: Trials = None,
    seed: Seed = 0,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    repair: Repair = False,
    resume: Resume = False,
    status: Status = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Search for the best layout: bases, start postures, tools and whatever the key layout of the cell says may change.

    The best layout is a new cell file, best.yaml, that passed every check of solve. Limits of acceleration count: a
    layout that is the fastest by velocity alone may be slow. Exit status: 0 a certified layout was found, 1 none
    passed, 2 bad input, 3 no start at all, 130 interrupted (--resume goes on).
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.cli.layout_options import (
            Work,
            read_request,
            read_stop,
            read_workers,
            search_and_say,
            status_lines,
        )

        if status:
            say("\n".join(status_lines(cell, output, tuple(allow_dir or ()))))
            return
        request = read_request(
            cell,
            objective="change" if repair else objective,
            timing=timing,
            duration=duration,
            clearance=clearance,
            margin=margin,
            misplacement=misplacement,
            vary=tuple(vary or ()),
            fixed=tuple(fix or ()),
            settings=tuple(settings or ()),
            attempts=tuple(attempts or ()),
            seed=seed,
            allow_dirs=tuple(allow_dir or ()),
        )
        if repair:
            from cellplan.cli.layout_repair import run_repair

            run_repair(request, output, workers=workers, as_json=as_json, quiet=quiet)
        stop = read_stop(budget, trials)
        work = Work(stop, read_workers(workers, scheduler), resume)
        search_and_say(request, output, work, as_json=as_json, quiet=quiet)
