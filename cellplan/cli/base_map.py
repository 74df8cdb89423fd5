"""``cellplan map``: the base plane of one robot, coloured by what becomes of the whole job at each place."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.options import AllowDirs, AsJson, CellFile, Mode, Quiet, Settings
from cellplan.cli.output import json_failure, say, say_json
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.map/1"

RobotName = Annotated[
    str, typer.Option("--robot", metavar="NAME", help="Operator whose base is tried.", show_default=False)
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
    typer.Option("-o", "--output", metavar="DIR", help="Folder of the map (default: outputs/<cell name>-map-<robot>)."),
]


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
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Judge the whole job with the base of one robot at each place of a grid, and draw the plane from above.

    Exit status: 0 at least one place passes (with --certify: is verified), 1 none does, 2 bad input, 3 no start at the
    present base.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.cell.load import load_cell
        from cellplan.io.run.folder import refuse_unless_replaceable
        from cellplan.pipeline.base_map.grid import BaseGrid, read_span, read_yaw
        from cellplan.pipeline.base_map.judged import base_map as judged_map
        from cellplan.pipeline.base_map.judged import write_base_map
        from cellplan.pipeline.overrides import with_overrides
        from cellplan.report.text.base_map import map_lines

        asked = BaseGrid(
            x=None if x is None else read_span("--x", x),
            y=None if y is None else read_span("--y", y),
            step=grid,
            yaw=None if yaw is None else read_yaw(yaw),
        )
        changed = with_overrides(load_cell(cell, allow_dirs=allow_dir or ()), settings or (), mode=mode)
        folder = output or Path("outputs") / f"{changed.name}-map-{robot}"
        refuse_unless_replaceable(folder)
        with progress_listener(quiet=quiet) as progress:
            record = judged_map(changed, robot, asked, certify=certify, progress=progress)
        write_base_map(record, folder)
    outcomes = [each["certified"]["status"] == "passed" for each in record["best"] if each["certified"] is not None]
    status = (
        ExitStatus.PASSED if (any(outcomes) if certify else record["counts"]["passes"]) else ExitStatus.CHECK_FAILED
    )
    if as_json:
        where = {"folder": str(folder), "report_path": str(folder / "map.html")}
        say_json({"schema": SCHEMA, "exit": int(status), **where, "map": record})
    else:
        say("\n".join(map_lines(record, folder)))
    raise typer.Exit(status)
