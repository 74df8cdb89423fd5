"""``cellplan map``: the base plane of one robot, coloured by what becomes of the whole job at each place."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from cellplan.cli.completion import robot_names
from cellplan.cli.errors import InterruptedWorkError
from cellplan.cli.options import AllowDirs, AsJson, CellFile, Mode, PlotFormats, Quiet, Settings
from cellplan.cli.output import json_failure, say, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.report.record.common import Record

SCHEMA = "cellplan.map/1"

RobotName = Annotated[
    str,
    typer.Option(
        "--robot", metavar="NAME", help="Operator whose base is tried.", show_default=False, autocompletion=robot_names
    ),
]
SpanX = Annotated[
    str | None,
    typer.Option("--x", metavar="FROM:TO", help="Range of x in mm (default: all within reach of the part)."),
]
SpanY = Annotated[str | None, typer.Option("--y", metavar="FROM:TO", help="Range of y in mm (default: likewise).")]
Step = Annotated[float, typer.Option("--grid", metavar="MM", help="Distance from one place to the next in mm.")]
Yaw = Annotated[
    str | None,
    typer.Option(
        "--yaw", metavar="DEG", help="yaw_deg of the base, or toward: x axis to the part (default: as it stands)."
    ),
]
Certify = Annotated[
    int, typer.Option("--certify", metavar="N", min=0, max=100, help="Solve and verify the N best places.")
]
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Study folder (default: outputs/<cell name>-map-<robot>)."),
]
WorkerCount = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", min=1, help="Processes that judge (default: one for each processor)."),
]
Resume = Annotated[bool, typer.Option("--resume", help="Continue the map in the folder.")]
Status = Annotated[bool, typer.Option("--status", help="Say how far the map in the folder is, and do nothing.")]


def base_map(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    robot: RobotName,
    x: SpanX = None,
    y: SpanY = None,
    grid: Step = 50.0,
    yaw: Yaw = None,
    certify: Certify = 0,
    output: Output = None,
    mode: Mode = None,
    settings: Settings = None,
    workers: WorkerCount = None,
    resume: Resume = False,
    status: Status = False,
    plots: PlotFormats = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Judge the whole job with the base of one robot at each place of a grid, and draw the plane from above.

    Exit status: 0 at least one place passes (with --certify: is verified), 1 none does, 2 bad input, 3 no start at the
    present base, 130 interrupted (--resume goes on).
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.guard import processors
        from cellplan.pipeline.base_map.grid import BaseGrid, read_span, read_yaw
        from cellplan.pipeline.base_map.prepared import MapRequest, requested_cell
        from cellplan.pipeline.base_map.study import NOUN, map_study
        from cellplan.study.status import read_status

        asked = BaseGrid(
            x=None if x is None else read_span("--x", x),
            y=None if y is None else read_span("--y", y),
            step=grid,
            yaw=None if yaw is None else read_yaw(yaw),
        )
        request = MapRequest(
            cell=cell,
            robot=robot,
            grid=asked,
            allow_dirs=tuple(allow_dir or ()),
            settings=tuple(settings or ()),
            mode=mode,
            formats=tuple(plots or ()),
        )
        folder = output or Path("outputs") / f"{requested_cell(request).name}-map-{robot}"
        if status:
            say(f"{folder}: {read_status(folder).text(NOUN)}")
            return
        with progress_listener(quiet=quiet) as progress:
            try:
                record = map_study(
                    request,
                    folder,
                    workers=workers or processors(),
                    resume=resume,
                    certify=certify,
                    progress=progress,
                )
            except KeyboardInterrupt as error:
                raise InterruptedWorkError(str(error) or "interrupted") from None
        _say(record, folder, is_certified=bool(certify), as_json=as_json)


def _say(record: "Record", folder: Path, *, is_certified: bool, as_json: bool) -> NoReturn:
    """Say what came of a map, and leave with the exit status."""
    from cellplan.pipeline.base_map.result import map_lines

    outcomes = [each["certified"]["status"] == "passed" for each in record["best"] if each["certified"] is not None]
    passes = any(outcomes) if is_certified else record["counts"]["passes"]
    outcome = ExitStatus.PASSED if passes else ExitStatus.CHECK_FAILED
    if as_json:
        where = {"folder": str(folder), "report_path": str(folder / "map.html")}
        say_json({"schema": SCHEMA, "exit": int(outcome), **where, "map": record})
    else:
        show(map_lines(record, folder), passed=outcome == ExitStatus.PASSED)
    raise typer.Exit(outcome)
