"""``cellplan fastest``: the shortest cycle of a cell within the limits of all joints."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cellplan.cli.options import AllowDirs, AsJson, CellFile, Method, Mode, Quiet, Settings
from cellplan.cli.output import json_failure, say, say_json
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.pipeline.fastest import ShortestCycle, ShortestCycles

SCHEMA = "cellplan.fastest/1"
TITLES = {"time_laws": "by its time laws", "common_speed": "by the best common speed"}

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Write the run folders DIR/time_laws and DIR/common_speed."),
]
TaskName = Annotated[str | None, typer.Option("--task", metavar="NAME", help="Work on this task only.")]


def fastest(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    output: Output = None,
    mode: Mode = None,
    method: Method = None,
    settings: Settings = None,
    task: TaskName = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Find the shortest cycle that keeps velocity, acceleration and jerk of all joints, and verify it.

    First with the time laws of the cell, all faster by one factor; then along the same path with the best speed that
    all robots share. Exit status: 0 both programs passed every check, 1 a check failed, 2 bad input, 3 no solution,
    4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.cell.load import load_cell
        from cellplan.io.run.folder import refuse_unless_replaceable
        from cellplan.pipeline.fastest import fastest as shortest
        from cellplan.pipeline.overrides import require_task, with_overrides
        from cellplan.pipeline.write_run import write_run

        given = load_cell(cell, allow_dirs=allow_dir or ())
        changed = with_overrides(given, settings or (), mode=mode, method=method)
        require_task(changed, task)
        folders = {} if output is None else {name: output / name for name in TITLES}
        for folder in folders.values():
            refuse_unless_replaceable(folder)
        with progress_listener(quiet=quiet) as progress:
            found = shortest(changed, task=task, progress=progress)
            cycles = {"time_laws": found.by_time_laws, "common_speed": found.by_common_speed}
            for name, folder in folders.items():
                write_run(cycles[name].solution, folder, progress=progress)
    record = _record(changed.name, found, cycles)
    status = ExitStatus.PASSED if found.passed else ExitStatus.CHECK_FAILED
    if as_json:
        where = {"folders": {name: str(folder) for name, folder in folders.items()}}
        say_json({"schema": SCHEMA, "status": record["status"], "exit": int(status), **where, **record})
    else:
        say("\n".join(_lines(record) + [f"{name}: {folder}" for name, folder in folders.items()]))
    raise typer.Exit(status)


def _record(name: str, found: ShortestCycles, cycles: dict[str, ShortestCycle]) -> dict[str, Any]:
    """The result in printed units."""
    from cellplan.report.record.common import number

    return {
        "cell": name,
        "status": "passed" if found.passed else "failed",
        "written_s": number(found.written),
        "cycles": {kind: _cycle(cycle, found.written) for kind, cycle in cycles.items()},
    }


def _cycle(cycle: ShortestCycle, written: float) -> dict[str, Any]:
    """One shortest cycle."""
    from cellplan.model.units import DEG, MM
    from cellplan.pipeline.fastest import figures
    from cellplan.report.record.common import number

    found = figures(cycle.solution)
    scales = (("position_error_mm", "position", MM), ("orientation_error_deg", "orientation", DEG))
    clearance = found["clearance"]
    failed = [check.message for run in cycle.solution.runs for check in run.report.checks if not check.passed]
    return {
        "status": "passed" if cycle.solution.passed else "failed",
        "cycle_s": number(cycle.cycle),
        "share_of_written": number(cycle.cycle / written),
        "binding": [
            {
                "phase": each.phase,
                "robot": each.robot,
                "joint": each.joint,
                "limit": each.kind,
                "percent": number(100.0 * each.share),
            }
            for each in cycle.bindings
        ],
        **{f"largest_{key}": number(scale * (found[name] or 0.0)) for key, name, scale in scales},
        "smallest_clearance_mm": None if clearance is None else number(MM * clearance),
        "failed": failed,
    }


def _lines(record: dict[str, Any]) -> list[str]:
    """The result as lines of text."""
    lines = [f"{record['cell']}: {record['status']}", f"  as written: {record['written_s']:g} s"]
    for kind, cycle in record["cycles"].items():
        lines.append(
            f"  {TITLES[kind]}: {cycle['cycle_s']:g} s, {100.0 * cycle['share_of_written']:.3g} % of the written time"
        )
        for each in cycle["binding"]:
            phase = "" if len(cycle["binding"]) == 1 else f"phase {each['phase']}: "
            limit = f"{each['percent']:.4g} % of its {each['limit']}{'' if each['limit'] == 'feed' else ' limit'}"
            lines.append(f"    {phase}{each['robot']} {each['joint']} binds at {limit}")
        clearance = cycle["smallest_clearance_mm"]
        distance = "nothing to keep clear of" if clearance is None else f"smallest clearance {clearance:.4g} mm"
        lines.append(
            f"    largest tool error {cycle['largest_position_error_mm']:.2g} mm, "
            f"{cycle['largest_orientation_error_deg']:.2g} deg; {distance}"
        )
        lines += [f"    FAILED {message}" for message in cycle["failed"]]
    return lines
