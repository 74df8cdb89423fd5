"""``cellplan fastest``: the shortest cycle of a cell, its production curve, and the calmest program for a demand."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from cellplan.cli.options import shared
from cellplan.cli.options.request import option
from cellplan.cli.terminal.output import Result
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus, InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class FastestOptions(shared.JobOptions):
    """Whose cycle is shortened, and by what."""

    SCHEMA = "cellplan.fastest/1"
    misplacement: ClassVar[None] = None  # which layout searches have beside these
    scheduler: ClassVar[None] = None

    cell: shared.CellFile
    output: Annotated[
        Path | None, option("-o, --output DIR", "Write record, page, curve and a run folder per program.")
    ] = None
    demand: Annotated[
        str | None, option("--demand N/h", "Parts per hour (or N/min): choose the calmest program for them.")
    ] = None
    points: Annotated[
        int, option("--points N", "Calmer cycles of each law on the production curve.", min=0, max=50)
    ] = 4
    mode: shared.Mode = None
    method: shared.Method = None
    settings: shared.Settings = ()
    feed: shared.Feed = None
    task: shared.TaskName = None
    workers: Annotated[
        int | None,
        option("--workers N", "Processes for the production curve (default: one for each processor).", min=1),
    ] = None
    free: Annotated[
        str | None,
        option(
            "--free WORDS",
            "Search the shortest cycle over some of start,weights,path,spin, bases and tools as they are: the start "
            "posture of the positioner, and of operators that their tasks leave free, weights of joints, the "
            "positioner's joint path or motion in the null space, turns of tools about their axes. The options below "
            "--free belong to it.",
        ),
    ] = None
    timing: shared.HowTimed = "laws"
    clearance: shared.Distance = None
    margin: shared.Margin = None
    budget: shared.Budget = None
    trials: shared.Trials = None
    seed: shared.Seed = 0
    resume: shared.ResumeSearch = False

    @property
    def schema(self) -> str:
        """Schema of the JSON object; with ``--free`` that of a layout search."""
        return self.SCHEMA if self.free is None else "cellplan.layout/1"


def fastest(options: FastestOptions) -> Result:
    """Find the shortest cycle that keeps velocity, acceleration and jerk of all joints, and verify it.

    First with the time laws of the cell, all faster by one factor; then along the same path with the best speed that
    all robots share; then with no tool faster than 250 mm/s. Exit status: 0 every program passed every check, 1 a
    check failed, 2 bad input, 3 no solution or a demand that cannot be met, 4 internal error. With --free the study
    folder of cellplan layout is written, with the fastest cell as best.yaml.
    """
    if options.free is not None:
        return _free(options, options.free)
    from cellplan.files.cell.load import load_cell
    from cellplan.files.run.folder import refuse_unless_replaceable
    from cellplan.guard import processors
    from cellplan.jobs.fastest.demand import read_demand
    from cellplan.jobs.fastest.result import fastest_lines, fastest_record, write_fastest
    from cellplan.jobs.fastest.shortest import fastest as shortest
    from cellplan.runs.overrides import feed_settings, require_task, with_overrides

    demand = None if options.demand is None else read_demand(options.demand)
    given = load_cell(options.cell, allow_dirs=options.allow_dirs)
    settings = feed_settings(given, options.settings, options.feed)
    cell = with_overrides(given, settings, mode=options.mode, method=options.method)
    require_task(cell, options.task)
    folder, workers = options.output, options.workers or processors()
    if folder is not None:
        refuse_unless_replaceable(folder)
    with progress_listener(quiet=options.quiet) as progress:
        cycles = shortest(
            cell, task=options.task, demand=demand, points=options.points, workers=workers, progress=progress
        )
        record = fastest_record(cycles) if folder is None else write_fastest(cycles, folder, progress=progress)
    status = ExitStatus.PASSED if cycles.passed else ExitStatus.CHECK_FAILED
    record, lines = {**record, "exit": int(status)}, fastest_lines(record)
    if folder is not None:
        record |= {"folder": str(folder), "report_path": str(folder / "fastest.html")}
        lines = [*lines, f"report: {folder / 'fastest.html'}", f"curve: {folder / 'curve.csv'}"]
    return Result(status, lines, record)


def _free(options: FastestOptions, text: str) -> Result:
    """Search the shortest cycle over what the words of ``--free`` name."""
    from cellplan.cli.improve.layout_search import layout_request, searched

    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise InputError("--free: expected some of start, weights, path, spin, got none")
    changes = {"motion.mode": options.mode, "solver.method": options.method}
    settings = (*options.settings, *(f"{key}={value}" for key, value in changes.items() if value))
    return searched(options, layout_request(options, objective="cycle", free=words, settings=settings))
