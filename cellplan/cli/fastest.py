"""``cellplan fastest``: the shortest cycle of a cell, its production curve, and the calmest program for a demand."""

from pathlib import Path
from typing import Annotated, Any

import typer

from cellplan.cli.fastest_free import read_words, search_free
from cellplan.cli.layout import Budget, Distance, HowTimed, Margin, Resume, Seed, Trials
from cellplan.cli.options import AllowDirs, AsJson, CellFile, Method, Mode, Quiet, Settings, TaskName
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.fastest/1"

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Write record, page, curve and a run folder per program."),
]
Demand = Annotated[
    str | None,
    typer.Option("--demand", metavar="N/h", help="Parts per hour (or N/min): choose the calmest program for them."),
]
Free = Annotated[
    str | None,
    typer.Option(
        "--free",
        metavar="WORDS",
        help="Search the shortest cycle over some of start,weights,path,spin, bases and tools as they are: the start "
        "posture of the positioner, weights of joints, the positioner's joint path, turns of tools about their axes. "
        "The options below --free belong to it.",
    ),
]
Points = Annotated[
    int, typer.Option("--points", metavar="N", min=0, max=50, help="Calmer cycles of each law on the production curve.")
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--workers", metavar="N", min=1, help="Processes for the production curve (default: one for each processor)."
    ),
]


def fastest(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    output: Output = None,
    demand: Demand = None,
    points: Points = 4,
    mode: Mode = None,
    method: Method = None,
    settings: Settings = None,
    task: TaskName = None,
    workers: Workers = None,
    free: Free = None,
    timing: HowTimed = "laws",
    clearance: Distance = None,
    margin: Margin = None,
    budget: Budget = None,
    trials: Trials = None,
    seed: Seed = 0,
    resume: Resume = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Find the shortest cycle that keeps velocity, acceleration and jerk of all joints, and verify it.

    First with the time laws of the cell, all faster by one factor; then along the same path with the best speed that
    all robots share; then with no tool faster than 250 mm/s. Exit status: 0 every program passed every check, 1 a
    check failed, 2 bad input, 3 no solution or a demand that cannot be met, 4 internal error. With --free the study
    folder of cellplan layout is written, with the fastest cell as best.yaml.
    """
    if free is not None:
        words = read_words(free)
        chosen = [f"{key}={value}" for key, value in (("motion.mode", mode), ("solver.method", method)) if value]
        options: dict[str, Any] = {"timing": timing, "clearance": clearance, "margin": margin, "seed": seed}
        options |= {"free": words, "settings": (*(settings or ()), *chosen), "allow_dirs": tuple(allow_dir or ())}
        search_free(cell, output, options, (budget, trials, workers, resume), as_json=as_json, quiet=quiet)
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.guard import processors
        from cellplan.io.cell.load import load_cell
        from cellplan.io.run.folder import refuse_unless_replaceable
        from cellplan.pipeline.fastest.demand import read_demand
        from cellplan.pipeline.fastest.result import fastest_lines, fastest_record, write_fastest
        from cellplan.pipeline.fastest.shortest import fastest as shortest
        from cellplan.pipeline.overrides import require_task, with_overrides

        per_hour = None if demand is None else read_demand(demand)
        given = load_cell(cell, allow_dirs=allow_dir or ())
        changed = with_overrides(given, settings or (), mode=mode, method=method)
        require_task(changed, task)
        if output is not None:
            refuse_unless_replaceable(output)
        with progress_listener(quiet=quiet) as progress:
            found = shortest(
                changed, task=task, demand=per_hour, points=points, workers=workers or processors(), progress=progress
            )
            record = fastest_record(found) if output is None else write_fastest(found, output, progress=progress)
    status = ExitStatus.PASSED if found.passed else ExitStatus.CHECK_FAILED
    if as_json:
        where = {} if output is None else {"folder": str(output), "report_path": str(output / "fastest.html")}
        say_json({**record, "exit": int(status), **where})
    else:
        written = [] if output is None else [f"report: {output / 'fastest.html'}", f"curve: {output / 'curve.csv'}"]
        show([*fastest_lines(record), *written], passed=found.passed)
    raise typer.Exit(status)
