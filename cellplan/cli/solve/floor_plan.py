"""``cellplan floorplan``: the cell from above, to scale, as SVG or DXF."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cellplan.cli.options import shared
from cellplan.cli.options.request import argument, option
from cellplan.cli.terminal.output import say, say_json
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus, InputError

FORMATS = ("svg", "dxf")


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorPlanOptions(shared.JobOptions):
    """What is drawn, and where it is written."""

    SCHEMA = "cellplan.floorplan/1"

    path: Annotated[Path, argument("RUN|CELL", "Run folder or cell file.")]
    output: Annotated[
        Path | None, option("-o, --output FILE", "The drawing (default: outputs/<cell name>-floor-plan.FORMAT).")
    ] = None
    form: Annotated[
        str | None, option("--format FORMAT", "svg or dxf (default: that of FILE by its ending, or svg).")
    ] = None
    frames: Annotated[bool, option("--frames", "Also the frames to type into the pendants, on A3.")] = False
    cell: shared.OriginalCell = None
    controllers: shared.Controllers = None
    settings: shared.Settings = ()


def floor_plan(options: FloorPlanOptions) -> None:
    """Draw the floor plan: outlines, reach, swept areas, paths, and dimensions between the bases in millimetres.

    Of a run it shows what its motion sweeps; of a cell that was not solved the start. DXF needs the package ezdxf, as
    pip install 'cellplan[dxf]' brings it. With --frames it also prints and shows what is typed into the pendants: base
    and tool of each robot, and the part in every pose in which the robot works on it, as its maker writes them. Exit
    status: 0 the drawing was written, 1 frames of a run that failed, 2 bad input, 4 internal error.
    """
    from cellplan.jobs.floor_plan.floor_plan_file import (
        FloorPlanRequest,
        PlanFormat,
        requested_floor_plan,
        target_of,
        write_floor_plan,
    )
    from cellplan.report.floor_plan.pendants import pendant_lines
    from cellplan.report.record.sections.base_reactions import base_reactions_record

    request = options.to(FloorPlanRequest, form=PlanFormat(_format(options.form, options.output)))
    with progress_listener(quiet=options.quiet) as progress:
        plan = requested_floor_plan(request, progress=progress)
    target = target_of(request, plan.cell)
    size = write_floor_plan(plan, target, request.form)
    if options.as_json:
        about: dict[str, Any] = {"cell": plan.cell, "drawing": str(target), "format": str(request.form), "bytes": size}
        about["base_reactions"] = base_reactions_record(robot.reaction for robot in plan.robots)
        if request.frames:
            about["frames"] = [pendant.record for pendant in plan.pendants]
        say_json({"schema": options.schema, "status": "written", "exit": int(ExitStatus.PASSED), **about})
    else:
        say(f"{plan.cell}: {target} ({size / 1e3:.0f} kB)")
        for line in pendant_lines(plan.pendants):
            say(line)


def _format(form: str | None, output: Path | None) -> str:
    ending = "" if output is None else output.suffix.removeprefix(".").lower()
    if form is not None and form not in FORMATS:
        raise InputError(f"--format: expected svg or dxf, got '{form}'")
    if form is None and ending and ending not in FORMATS:
        raise InputError(f"-o: expected a file that ends with .svg or .dxf, or --format with it, got '{output}'")
    if form is not None and ending in FORMATS and ending != form:
        raise InputError(f"--format: expected {ending} for '{output}', got '{form}'")
    return form or ending or FORMATS[0]
