"""``cellplan schema``: JSON Schemas of the cell file and of the records of results."""

from typing import Annotated

import typer

from cellplan.cli.output import say_json

ReportSchema = Annotated[bool, typer.Option("--report", help="Print the JSON Schema of report.json instead.")]
LayoutSchema = Annotated[bool, typer.Option("--layout", help="Print that of study.json of a layout search.")]


def schema(report: ReportSchema = False, layout: LayoutSchema = False) -> None:
    """Print the JSON Schema of the cell file, of report.json or of the study.json of a layout search."""
    if report and layout:
        raise typer.BadParameter("expected one of --report and --layout, got both")
    if layout:
        from cellplan.report.record.schema import layout_schema

        say_json(layout_schema())
        return
    if report:
        from cellplan.report.record.schema import report_schema

        say_json(report_schema())
        return
    from cellplan.io.schema import json_schema

    say_json(json_schema())
