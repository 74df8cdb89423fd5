"""Write the shortest cycles of a cell: record, page, production curve, and a run folder for every program."""

from pathlib import Path
from typing import Any, Final

from cellplan.io.cell.changes import plain_values
from cellplan.io.cell.write import render_cell
from cellplan.io.run.folder import RunFolder
from cellplan.io.yaml.writer import flow_text
from cellplan.model.progress import Progress, silent
from cellplan.pipeline.fastest.demand import MetDemand
from cellplan.pipeline.fastest.shortest import ShortestCycles
from cellplan.pipeline.fastest.timed_program import TimedProgram
from cellplan.pipeline.write_run import versions, write_run
from cellplan.report.page.fastest import fastest_page
from cellplan.report.record.common import Record, as_json, number
from cellplan.report.record.fastest import (
    SCHEMA,
    DemandRecord,
    FastestRecord,
    ProgramRecord,
    curve_table,
    program_figures,
    savings,
)

RECORD: Final = "fastest.json"
PAGE: Final = "fastest.html"
CURVE: Final = "curve.csv"
DEMAND: Final = "demand.yaml"


def write_fastest(found: ShortestCycles, folder: Path, *, progress: Progress = silent) -> Record:
    """Write the shortest cycles into a folder, which appears whole or not at all.

    It holds ``fastest.json``, ``fastest.html``, ``curve.csv``, a run folder for every program by its name, and for a
    demand ``demand.yaml``: the cell of which ``cellplan solve`` gives that program. It names files as the cell does, so
    it loads from the folder of that cell.

    Args:
        found: As ``fastest`` returns it.
        folder: The folder; an earlier one is replaced.
        progress: Called with the stage and the fraction done.

    Returns:
        The record in ``fastest.json``.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    record = fastest_record(found)
    with RunFolder(folder) as target:
        target.write_text(RECORD, as_json(record))
        target.write_text(PAGE, fastest_page(record))
        target.write_text(CURVE, curve_table(record))
        if found.demand is not None:
            target.write_text(DEMAND, render_cell(found.demand.program.solution.cell))
        for name, program in found.programs.items():
            write_run(program.solution, target.within(name), progress=progress)
    return record


def fastest_record(found: ShortestCycles) -> FastestRecord:
    """The shortest cycles in printed units."""
    cell, written = found.by_time_laws.solution.cell, found.as_written.cycle
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if found.passed else "failed",
        "written_s": number(written),
        "as_written": found.as_written.figures,
        "cycles": {name: _program(program, written) for name, program in found.programs.items() if name != "demand"},
        "remark": found.remark,
        "curve": [
            {
                "law": str(point.law),
                "settings": plain_values(point.values),
                "figures": dict(point.figures),
                "reason": point.reason,
            }
            for point in found.curve
        ],
        "demand": None if found.demand is None else _demand(found, found.demand),
        "inputs": dict(cell.inputs),
        "versions": versions(),
    }


def _program(program: TimedProgram, written: float) -> ProgramRecord:
    """One program."""
    record: Any = {
        "law": str(program.law),
        "cycle_s": number(program.cycle),
        "share_of_written": number(program.cycle / written),
        "settings": plain_values(program.values),
        "options": [f"{address}={flow_text(value)}" for address, value in plain_values(program.values).items()],
        "binding": [
            {
                "phase": each.phase,
                "robot": each.robot,
                "joint": each.joint,
                "limit": each.kind,
                "percent": number(100.0 * each.share),
                "time_percent": number(100.0 * each.time_share),
                "text": each.text,
            }
            for each in program.bindings
        ],
        "figures": program.figures,
        **program_figures([run.report for run in program.solution.runs], program.cycle),
    }
    return record


def _demand(found: ShortestCycles, demand: MetDemand) -> DemandRecord:
    """The demand, its program and what that saves."""
    program, shortest = demand.program, min(found.by_time_laws, found.by_common_speed, key=lambda each: each.cycle)
    return {
        "parts_per_h": number(demand.per_hour),
        "allowed_cycle_s": number(demand.allowed),
        "idle_s": number(max(0.0, round(demand.allowed - program.cycle, 9))),
        "program": _program(program, found.as_written.cycle),
        "saving_against_shortest": savings(program.figures, shortest.figures),
        "saving_against_written": savings(program.figures, found.as_written.figures),
    }
