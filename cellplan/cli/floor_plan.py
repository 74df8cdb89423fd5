"""``cellplan floorplan``: the cell from above, to scale, as SVG or DXF."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, Settings
from cellplan.cli.output import json_failure, say, say_json
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus, InputError

SCHEMA = "cellplan.floorplan/1"
FORMATS = ("svg", "dxf")

Shown = Annotated[Path, typer.Argument(metavar="RUN|CELL", help="Run folder or cell file.")]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", metavar="FILE", help="The drawing (default: outputs/<cell name>-floor-plan.FORMAT)."
    ),
]
Format = Annotated[
    str | None,
    typer.Option("--format", metavar="FORMAT", help="svg or dxf (default: that of FILE by its ending, or svg)."),
]


def floor_plan(  # noqa: PLR0913, PLR0917 - the options of the command
    path: Shown,
    output: Output = None,
    form: Format = None,
    cell: OriginalCell = None,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Draw the floor plan: outlines, reach, swept areas, paths, and dimensions between the bases in millimetres.

    Of a run it shows what its motion sweeps; of a cell that was not solved the start. DXF needs the package ezdxf, as
    pip install 'cellplan[dxf]' brings it. Exit status: 0 the drawing was written, 2 bad input, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.pipeline.floor_plan_file import (
            FloorPlanRequest,
            PlanFormat,
            requested_floor_plan,
            target_of,
            write_floor_plan,
        )

        kind = PlanFormat(_format(form, output))
        request = FloorPlanRequest(
            path=path, output=output, form=kind, cell=cell, settings=settings or (), allow_dirs=allow_dir or ()
        )
        with progress_listener(quiet=quiet) as progress:
            plan = requested_floor_plan(request, progress=progress)
        target = target_of(request, plan.cell)
        size = write_floor_plan(plan, target, kind)
    if as_json:
        about = {"cell": plan.cell, "drawing": str(target), "format": str(kind), "bytes": size}
        say_json({"schema": SCHEMA, "status": "written", "exit": int(ExitStatus.PASSED), **about})
        return
    say(f"{plan.cell}: {target} ({size / 1e3:.0f} kB)")


def _format(form: str | None, output: Path | None) -> str:
    """The format that is asked for.

    Raises:
        InputError: It is neither, or not that of the file.
    """
    ending = "" if output is None else output.suffix.removeprefix(".").lower()
    if form is not None and form not in FORMATS:
        raise InputError(f"--format: expected svg or dxf, got '{form}'")
    if form is None and ending and ending not in FORMATS:
        raise InputError(f"-o: expected a file that ends with .svg or .dxf, or --format with it, got '{output}'")
    if form is not None and ending in FORMATS and ending != form:
        raise InputError(f"--format: expected {ending} for '{output}', got '{form}'")
    return form or ending or FORMATS[0]
