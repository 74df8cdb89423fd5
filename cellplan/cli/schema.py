"""``cellplan schema``: JSON Schemas of the cell file and of ``report.json``."""

from typing import Annotated

import typer

from cellplan.cli.output import say_json

ReportSchema = Annotated[bool, typer.Option("--report", help="Print the JSON Schema of report.json instead.")]


def schema(report: ReportSchema = False) -> None:
    """Print the JSON Schema of the cell file, or of report.json."""
    if report:
        from cellplan.report.record.schema import report_schema

        say_json(report_schema())
        return
    from cellplan.io.schema import json_schema

    say_json(json_schema())
