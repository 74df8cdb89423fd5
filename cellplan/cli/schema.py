"""``cellplan schema``: JSON Schemas of the cell file and of the records of results."""

from typing import Annotated

import typer

from cellplan.cli.output import say_json

ReportSchema = Annotated[bool, typer.Option("--report", help="Print that of report.json.")]
RobotSchema = Annotated[bool, typer.Option("--robot", help="Print that of a joint-axis table of a robot.")]
LayoutSchema = Annotated[bool, typer.Option("--layout", help="Print that of study.json of a layout search.")]


def schema(robot: RobotSchema = False, report: ReportSchema = False, layout: LayoutSchema = False) -> None:
    """Print the JSON Schema of the cell file, or of another file that people or scripts read and write."""
    if robot + report + layout > 1:
        raise typer.BadParameter("expected at most one of --robot, --report and --layout")
    if robot:
        from cellplan.io.schema import robot_table_schema

        say_json(robot_table_schema())
    elif layout:
        from cellplan.report.record.schema import layout_schema

        say_json(layout_schema())
    elif report:
        from cellplan.report.record.schema import report_schema

        say_json(report_schema())
    else:
        from cellplan.io.robots.bundled import bundled_names
        from cellplan.io.schema import json_schema

        say_json(json_schema(bundled_names()))
