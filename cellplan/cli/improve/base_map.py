"""``cellplan map``: the base plane of one robot, coloured by whether the whole job passes at each place."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import robot_names
from cellplan.cli.options.request import option
from cellplan.cli.terminal.errors import resumable
from cellplan.cli.terminal.output import Result, result_of_folder, say
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class MapOptions(shared.JobOptions):
    """Whose base is tried where, and where the map is written."""

    SCHEMA = "cellplan.map/1"

    cell: shared.CellFile
    robot: Annotated[str, option("--robot NAME", "Operator whose base is tried.", autocompletion=robot_names)]
    x: Annotated[str | None, option("--x FROM:TO", "Range of x in mm (default: all within reach of the part).")] = None
    y: Annotated[str | None, option("--y FROM:TO", "Range of y in mm (default: likewise).")] = None
    grid: Annotated[float, option("--grid MM", "Distance from one place to the next in mm.")] = 50.0
    yaw: Annotated[
        str | None, option("--yaw DEG", "yaw_deg of the base, or toward: x axis to the part (default: as it stands).")
    ] = None
    certify: Annotated[int, option("--certify N", "Solve and verify the N best places.", min=0, max=100)] = 0
    output: Annotated[
        Path | None, option("-o, --output DIR", "Study folder (default: outputs/<cell name>-map-<robot>).")
    ] = None
    mode: shared.Mode = None
    settings: shared.Settings = ()
    workers: Annotated[
        int | None, option("--workers N", "Processes that judge (default: one for each processor).", min=1)
    ] = None
    scheduler: shared.Scheduler = None
    resume: Annotated[bool, option("--resume", "Continue the map in the folder.")] = False
    status: Annotated[bool, option("--status", "Say how far the map in the folder is, and do nothing.")] = False
    formats: shared.PlotFormats = ()


def base_map(options: MapOptions) -> Result | None:
    """Judge the whole job with the base of one robot at each place of a grid, and draw the plane from above.

    Exit status: 0 at least one place passes (with --certify: is verified), 1 none does, 2 bad input, 3 no start at the
    present base, 130 interrupted (--resume goes on).
    """
    from cellplan.cli.options.crew import crew
    from cellplan.jobs.base_map.base_map import NOUN, map_study
    from cellplan.jobs.base_map.grid import BaseGrid, read_span, read_yaw
    from cellplan.jobs.base_map.prepared import MapRequest, files_of, requested_cell
    from cellplan.jobs.base_map.result import map_lines
    from cellplan.study.status import read_status

    grid = BaseGrid(
        x=None if options.x is None else read_span("--x", options.x),
        y=None if options.y is None else read_span("--y", options.y),
        step=options.grid,
        yaw=None if options.yaw is None else read_yaw(options.yaw),
    )
    request = options.to(MapRequest, grid=grid)
    folder = options.output or Path("outputs") / f"{requested_cell(request).name}-map-{options.robot}"
    if options.status:
        say(f"{folder}: {read_status(folder).text(NOUN)}")
        return None
    with (
        crew(options.workers, options.scheduler, partial(files_of, request)) as workers,
        progress_listener(quiet=options.quiet) as progress,
        resumable(),
    ):
        record = map_study(
            request, folder, workers=workers, resume=options.resume, certify=options.certify, progress=progress
        )
    verified = [place["certified"]["status"] == "passed" for place in record["best"] if place["certified"] is not None]
    passes = any(verified) if options.certify else record["counts"]["passes"]
    status = ExitStatus.PASSED if passes else ExitStatus.CHECK_FAILED
    return result_of_folder(options.schema, status, map_lines(record, folder), folder / "map.html", map=record)
