"""``cellplan schema``: JSON Schemas of the cell file and of the records of results."""

from typing import Annotated

import typer

from cellplan.cli.output import say_json

ReportSchema = Annotated[bool, typer.Option("--report", help="Print the JSON Schema of report.json instead.")]
SeriesSchema = Annotated[bool, typer.Option("--series", help="Print that of series.json.")]
LayoutSchema = Annotated[bool, typer.Option("--layout", help="Print that of study.json of a layout search.")]


def schema(report: ReportSchema = False, series: SeriesSchema = False, layout: LayoutSchema = False) -> None:
    """Print the JSON Schema of the cell file, or of a result."""
    asked = [name for name, desired in (("report", report), ("series", series), ("layout", layout)) if desired]
    if len(asked) > 1:
        raise typer.BadParameter(f"expected one of --report, --series and --layout, got {len(asked)}")
    if not asked:
        from cellplan.io.schema import json_schema

        say_json(json_schema())
        return
    from cellplan.report.record.schema import layout_schema, report_schema, series_schema

    say_json({"report": report_schema, "series": series_schema, "layout": layout_schema}[asked[0]]())
