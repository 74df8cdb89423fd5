"""Arguments and options that several commands share."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cellplan.cli.options.completion import cell_files, one_of, run_folders, task_names
from cellplan.cli.options.request import Options, argument, option

CellFile = Annotated[Path, argument("CELL", "Cell file (YAML).", autocompletion=cell_files)]
RunDir = Annotated[Path, argument("RUN", "Run folder.", autocompletion=run_folders)]
OriginalCell = Annotated[
    Path | None,
    option(
        "--cell CELL",
        "The cell file that was solved: it and its files are compared with the run.",
        autocompletion=cell_files,
    ),
]
Controllers = Annotated[
    Path | None,
    option("--controllers FILE", "Names of tasks, signals, tools and frames in place of those of the cell (YAML)."),
]
AllowDirs = Annotated[
    tuple[Path, ...],
    option("--allow-dir DIR", "Also read files below this folder; may be repeated.", exists=True, file_okay=False),
]
Mode = Annotated[
    str | None,
    option(
        "--mode MODE",
        "Which robots move: simultaneous, pairwise, part_at_rest or semi_coordinated.",
        autocompletion=one_of("cellplan.model.cell.cell:Mode"),
    ),
]
Method = Annotated[
    str | None,
    option(
        "--method NAME",
        "Resolution method: weighted_pseudo_inverse, damped_least_squares, jacobian_transpose, filtered_inverse, "
        "filtered_inverse_ii, heuristic_search, recursive_search or quadratic_program.",
        autocompletion=one_of("cellplan.model.solver:METHODS"),
    ),
]
Settings = Annotated[
    tuple[str, ...],
    option("--set KEY=VALUE", "Set any value of the cell file, such as robots.kuka.base.x_mm=900; may be repeated."),
]
Feed = Annotated[
    str | None,
    option("--feed FEED", "Feed of all tasks with a process: a number in mm/s, greatest, or a range such as [40, 90]."),
]
PlotFormats = Annotated[
    tuple[str, ...],
    option("--plots FORMAT", "Write the plots as png or pdf too; SVG is always written. May be repeated."),
]
TaskName = Annotated[str | None, option("--task NAME", "Plan this task only.", autocompletion=task_names)]
WithoutCell = Annotated[
    bool, option("--without-cell", "Use the run's own copy of the cell, without comparison with the original.")
]
Watch = Annotated[
    bool, option("--watch", "Do it again whenever the cell or a file that it names is saved; Ctrl-C ends.")
]
AsJson = Annotated[bool, option("--json", "Print one JSON object and nothing else.")]
Quiet = Annotated[bool, option("--quiet, -q", "Show no progress.")]
Verbose = Annotated[bool, option("--verbose, -v", "Show stages with their times, and counts, on the error stream.")]

HowTimed = Annotated[
    str,
    option(
        "--timing NAME",
        "laws: by the time laws of the cell; retimed: as fast as the limits allow everywhere.",
        autocompletion=one_of("cellplan.search.programs.objective:CycleTiming"),
    ),
]
Distance = Annotated[str | None, option("--clearance LENGTH", "Required clearance, such as 10mm.")]
Margin = Annotated[str | None, option("--margin ANGLE", "Demanded margin of all turning joints, such as 15deg.")]
Budget = Annotated[
    str | None, option("--budget TIME", "Begin no round after this time (default: 60s without --trials).")
]
Trials = Annotated[int | None, option("--trials N", "Number of trials; repeats a search byte for byte.", min=1)]
Seed = Annotated[int, option("--seed N", "Seed of starts and perturbations.", min=0)]
ResumeSearch = Annotated[bool, option("--resume", "Continue the search in the folder.")]
ResumeStudy = Annotated[bool, option("--resume", "Continue the study in the folder.")]
KeepRuns = Annotated[bool, option("--keep-runs", "Keep the run folder of every variant below runs/.")]
Scheduler = Annotated[
    str | None,
    option(
        "--scheduler ADDRESS",
        "Dask scheduler whose workers do the work, such as tcp://10.0.0.5:8786 (extra: cellplan[cluster]); the files "
        "of the cell travel to them.",
    ),
]
Solvers = Annotated[int | None, option("--workers N", "Processes that solve (default: one for each processor).", min=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class JobOptions(Options):
    """What every command has that does something with a cell; last in its help."""

    as_json: AsJson = False
    quiet: Quiet = False
    allow_dirs: AllowDirs = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyOptions(JobOptions):
    """What every study has of variants that are solved."""

    settings: Settings = ()
    task: TaskName = None
    workers: Solvers = None
    scheduler: Scheduler = None
    resume: ResumeStudy = False
    keep_runs: KeepRuns = False
    formats: PlotFormats = ()


def sources(options: Any) -> dict[str, Any]:
    """Files beside a run that it is compared with, or named by, as arguments of ``open_gate``."""
    return {"cell": options.cell, "controllers": options.controllers, "allow_dirs": options.allow_dirs}
