"""``cellplan explain``: structure of a cell: robots, joints, circuits, graph, matrix blocks, redundancy."""

from dataclasses import dataclass

from cellplan.cli.options import shared
from cellplan.cli.options.request import Options
from cellplan.cli.terminal.output import Result
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplainOptions(Options):
    """What is explained."""

    SCHEMA = "cellplan.explain/1"

    cell: shared.CellFile
    settings: shared.Settings = ()
    as_json: shared.AsJson = False
    allow_dirs: shared.AllowDirs = ()


def explain(options: ExplainOptions) -> Result:
    """Show the structure of a cell without solving it: robots, joints, circuits, graph, matrix, redundancy.

    Exit status: 0 shown, 2 bad input, 4 internal error.
    """
    from cellplan.files.cell.load import load_cell
    from cellplan.jobs.explain.explain import explain as explain_cell
    from cellplan.jobs.explain.result import structure_lines, structure_record
    from cellplan.runs.overrides import with_overrides

    cell = with_overrides(load_cell(options.cell, allow_dirs=options.allow_dirs), options.settings)
    record = structure_record(explain_cell(cell))
    about = {"schema": options.schema, "status": "passed", "exit": int(ExitStatus.PASSED)}
    return Result(ExitStatus.PASSED, structure_lines(record), {**about, **record}, is_verdict=False)
