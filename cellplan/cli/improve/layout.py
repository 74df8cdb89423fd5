"""``cellplan layout``: search the placement of all robots, and all else that may change, for the whole job at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import cell_files, one_of
from cellplan.cli.options.request import option
from cellplan.cli.terminal.output import Result, say


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutOptions(shared.JobOptions):
    """What is searched for, by whom, and where it is written."""

    SCHEMA = "cellplan.layout/1"

    cell: shared.CellFile
    output: Annotated[
        Path | None, option("-o, --output DIR", "Study folder (default: outputs/<cell name>-layout).")
    ] = None
    objective: Annotated[
        str,
        option(
            "--objective NAME",
            "conforming: the first layout that passes; cycle: the shortest cycle; clearance: the largest distances; "
            "change: the least change from the given layout. All but cycle are at the duration of the cell.",
            autocompletion=one_of("cellplan.search.programs.objective:Objective"),
        ),
    ] = "cycle"
    timing: shared.HowTimed = "laws"
    duration: Annotated[float | None, option("--duration S", "Duration at which the limits must hold, in seconds.")] = (
        None
    )
    clearance: shared.Distance = None
    margin: shared.Margin = None
    misplacement: Annotated[
        str | None,
        option(
            "--misplacement LENGTH,ANGLE",
            "The layout must pass, in one cycle and with its motion planned anew, with every base off by so much along "
            "each axis and about the vertical, such as 10mm,1deg.",
        ),
    ] = None
    vary: Annotated[
        tuple[str, ...],
        option(
            "--vary KEY[=RANGES]",
            "What may change beside what the cell says, such as 'kuka.base={x_mm: [0, 2000]}'; may be repeated.",
        ),
    ] = ()
    fixed: Annotated[
        tuple[str, ...], option("--fix KEY", "What may not change, such as kuka.base.z_mm; may be repeated.")
    ] = ()
    settings: shared.Settings = ()
    feed: shared.Feed = None
    attempts: Annotated[
        tuple[Path, ...],
        option("--try CELL2", "A cell file whose layout is tried too; may be repeated.", autocompletion=cell_files),
    ] = ()
    budget: shared.Budget = None
    trials: shared.Trials = None
    seed: shared.Seed = 0
    workers: Annotated[
        int | None, option("--workers N", "Processes that search (default: one for each processor).", min=1)
    ] = None
    scheduler: shared.Scheduler = None
    repair: Annotated[
        bool, option("--repair", "Find the smallest change with which the cell passes, and other remedies.")
    ] = False
    assign: Annotated[
        bool, option("--assign", "Assign open tasks (robot: any) and search the layout in turn, until neither gains.")
    ] = False
    resume: shared.ResumeSearch = False
    status: Annotated[bool, option("--status", "Say how far the search in the folder is, and do nothing.")] = False


def layout(options: LayoutOptions) -> Result | None:
    """Search for the best layout: bases, start postures, tools and whatever the key layout of the cell says may change.

    The best layout is a new cell file, best.yaml, that passed every check of solve. Limits of acceleration count: a
    layout that is the fastest by velocity alone may be slow. Exit status: 0 a certified layout was found, 1 none
    passed, 2 bad input, 3 no start at all, 130 interrupted (--resume goes on).
    """
    from cellplan.cli.improve.layout_search import alternated, layout_request, repaired, searched, study_folder
    from cellplan.study.status import read_status

    if options.status:
        folder = study_folder(options, "layout")
        say(f"{folder}: {read_status(folder).text()}")
        return None
    request = layout_request(options, objective="change" if options.repair else options.objective)
    if options.assign:
        return alternated(options, request)
    return repaired(options, request) if options.repair else searched(options, request)
