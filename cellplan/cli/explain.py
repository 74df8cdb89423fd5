"""``cellplan explain``: structure of a cell: robots, joints, circuits, graph, matrix blocks, redundancy."""

from cellplan.cli.options import AllowDirs, AsJson, CellFile, Settings
from cellplan.cli.output import json_failure, say_json, show
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.explain/1"


def explain(cell: CellFile, settings: Settings = None, as_json: AsJson = False, allow_dir: AllowDirs = None) -> None:
    """Show the structure of a cell without solving it: robots, joints, circuits, graph, matrix, redundancy.

    Exit status: 0 shown, 2 bad input, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.cell.load import load_cell
        from cellplan.pipeline.explain import explain as explain_cell
        from cellplan.pipeline.overrides import with_overrides
        from cellplan.report.record.structure import structure_record
        from cellplan.report.text.structure import structure_lines

        record = structure_record(
            explain_cell(with_overrides(load_cell(cell, allow_dirs=allow_dir or ()), settings or ()))
        )
    if as_json:
        say_json({"schema": SCHEMA, "status": "passed", "exit": int(ExitStatus.PASSED), **record})
    else:
        show(structure_lines(record))
