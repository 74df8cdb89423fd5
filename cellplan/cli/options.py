"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import INTEGRATORS, METHODS, MODES, cell_files, one_of, run_folders, task_names

CellFile = Annotated[
    Path, typer.Argument(metavar="CELL", help="Cell file (YAML).", show_default=False, autocompletion=cell_files)
]
RunDir = Annotated[
    Path, typer.Argument(metavar="RUN", help="Run folder.", show_default=False, autocompletion=run_folders)
]
OriginalCell = Annotated[
    Path | None,
    typer.Option(
        "--cell",
        metavar="CELL",
        help="The cell file that was solved: it and its files are compared with the run.",
        autocompletion=cell_files,
    ),
]
AllowDirs = Annotated[
    list[Path] | None,
    typer.Option(
        "--allow-dir",
        metavar="DIR",
        help="Also read files below this folder; may be repeated.",
        show_default=False,
        exists=True,
        file_okay=False,
    ),
]
Mode = Annotated[
    str | None,
    typer.Option(
        "--mode",
        metavar="MODE",
        help="Which robots move: simultaneous, pairwise, part_at_rest or semi_coordinated.",
        autocompletion=one_of(MODES),
    ),
]
Method = Annotated[
    str | None,
    typer.Option(
        "--method",
        metavar="NAME",
        help="Resolution method: weighted_pseudo_inverse, damped_least_squares, jacobian_transpose, filtered_inverse, "
        "filtered_inverse_ii, heuristic_search, recursive_search or quadratic_program.",
        autocompletion=one_of(METHODS),
    ),
]
Integrator = Annotated[
    str | None,
    typer.Option(
        "--integrator",
        metavar="NAME",
        help="Integration of joint velocities: auto, accurate or euler.",
        autocompletion=one_of(INTEGRATORS),
    ),
]
Duration = Annotated[float | None, typer.Option("--duration", metavar="S", help="Duration of the motion in seconds.")]
Clearance = Annotated[
    float | None, typer.Option("--clearance-mm", metavar="MM", help="Required clearance in millimetres.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set any value of the cell file, such as robots.kuka.base.x_mm=900; may be repeated.",
        show_default=False,
    ),
]
PlotFormats = Annotated[
    list[str] | None,
    typer.Option(
        "--plots",
        metavar="FORMAT",
        help="Write the plots as png or pdf too; SVG is always written. May be repeated. Needs cellplan[plots].",
        show_default=False,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]
Watch = Annotated[
    bool, typer.Option("--watch", help="Do it again whenever the cell or a file that it names is saved; Ctrl-C ends.")
]
TaskName = Annotated[
    str | None,
    typer.Option("--task", metavar="NAME", help="Plan this task only.", autocompletion=task_names),
]
