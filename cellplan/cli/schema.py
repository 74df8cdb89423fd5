"""``cellplan schema``: JSON Schemas of the cell file and of the records of results."""

from typing import Annotated

import typer

from cellplan.cli.output import say_json

RobotSchema = Annotated[bool, typer.Option("--robot", help="Print that of a joint-axis table of a robot.")]
ReportSchema = Annotated[bool, typer.Option("--report", help="Print that of report.json.")]
SeriesSchema = Annotated[bool, typer.Option("--series", help="Print that of series.json.")]
LayoutSchema = Annotated[bool, typer.Option("--layout", help="Print that of study.json of a layout search.")]


def schema(
    robot: RobotSchema = False,
    report: ReportSchema = False,
    series: SeriesSchema = False,
    layout: LayoutSchema = False,
) -> None:
    """Print the JSON Schema of the cell file, or of another file that people or scripts read and write."""
    if robot + report + series + layout > 1:
        raise typer.BadParameter("expected at most one of --robot, --report, --series and --layout")
    if robot:
        from cellplan.io.schema import robot_table_schema

        say_json(robot_table_schema())
    elif report or series or layout:
        from cellplan.pipeline.layout.record import layout_schema
        from cellplan.report.record.schema import report_schema, series_schema

        say_json(report_schema() if report else series_schema() if series else layout_schema())
    else:
        from cellplan.io.robots.bundled import bundled_names
        from cellplan.io.schema import json_schema

        say_json(json_schema(bundled_names()))
