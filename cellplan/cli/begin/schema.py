"""``cellplan schema``: JSON Schemas of the cell file and of the records of results."""

from dataclasses import dataclass
from typing import Annotated

import typer

from cellplan.cli.options.request import Options, option
from cellplan.cli.terminal.output import say_json


@dataclass(frozen=True, slots=True, kw_only=True)
class SchemaOptions(Options):
    """Whose schema is printed."""

    robot: Annotated[bool, option("--robot", "Print that of a joint-axis table of a robot.")] = False
    report: Annotated[bool, option("--report", "Print that of report.json.")] = False
    series: Annotated[bool, option("--series", "Print that of series.json.")] = False
    layout: Annotated[bool, option("--layout", "Print that of study.json of a layout search.")] = False


def schema(options: SchemaOptions) -> None:
    """Print the JSON Schema of the cell file, or of another file that people or scripts read and write."""
    if options.robot + options.report + options.series + options.layout > 1:
        raise typer.BadParameter("expected at most one of --robot, --report, --series and --layout")
    if options.robot:
        from cellplan.files.schema.json_schemas import robot_table_schema

        say_json(robot_table_schema())
    elif options.report or options.series or options.layout:
        from cellplan.jobs.layout.record import layout_schema
        from cellplan.report.record.schema import report_schema, series_schema

        say_json(report_schema() if options.report else series_schema() if options.series else layout_schema())
    else:
        from cellplan.files.robots.joint_table import bundled_names
        from cellplan.files.schema.json_schemas import json_schema

        say_json(json_schema(bundled_names()))
