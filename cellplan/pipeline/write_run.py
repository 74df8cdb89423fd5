"""Write a solution: report, plots, the resolved cell and, when every check passed, the joint tables."""

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

import cellplan
from cellplan.io.cell_writer import render_cell
from cellplan.io.run_folder import RunFolder
from cellplan.io.tables import program_digest
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.pipeline.solution import Run, Solution
from cellplan.report.html import overview_html, report_html
from cellplan.report.json_report import report_json, summary_json
from cellplan.report.plots import draw_plots
from cellplan.report.record import Provenance

ENGINES: Final = ("numpy", "pin", "python-fcl", "trimesh")  # packages whose arithmetic the result rests on


def write_run(solution: Solution, folder: Path, *, keep_rejected: bool = False, progress: Progress = silent) -> None:
    """Write a run folder; it appears whole or not at all.

    Every run has ``report.json``, ``report.html``, ``plots/`` and ``cell.yaml``, and ``tables/`` when it passed. A cell
    with one run per task gets a subfolder for each and an overview above them.

    Args:
        solution: What was solved.
        folder: The run folder; an older run there is replaced.
        keep_rejected: Write the tables of a failed run too, under ``rejected/``, marked in every header.
        progress: Who wants to know how far it is.

    Raises:
        InputError: The folder cannot be written, or holds something else than a run.
    """
    with RunFolder(folder) as target:
        for index, run in enumerate(solution.runs):
            progress("writing the report", index / len(solution.runs))
            _write_one(target, solution.cell, run, keep_rejected=keep_rejected)
        reports = {run.name: run.report for run in solution.runs if run.name is not None}
        if reports:
            provenance = Provenance(versions=versions(), digests={})
            target.write_text("report.json", summary_json(reports, cell=solution.cell, provenance=provenance))
            target.write_text("report.html", overview_html(reports, cell=solution.cell, provenance=provenance))
            target.write_text("cell.yaml", render_cell(solution.cell))


def versions() -> dict[str, str]:
    """Version of cellplan and of every engine, by package name."""
    found = {"cellplan": cellplan.__version__}
    for package in ENGINES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found


def _write_one(target: RunFolder, cell: Cell, run: Run, *, keep_rejected: bool) -> None:
    """Files of one run, in its subfolder when it has a name."""
    prefix = "" if run.name is None else f"{run.name}/"
    provenance = Provenance(versions=versions(), digests={"program": program_digest(run.program.tables)})
    plots = draw_plots(run.report, cell=cell)
    for name, picture in plots.items():
        target.write_bytes(f"{prefix}plots/{name}", picture)
    page = report_html(run.report, cell=cell, provenance=provenance, plots=plots)
    target.write_text(f"{prefix}report.html", page)
    target.write_text(f"{prefix}report.json", report_json(run.report, cell=cell, provenance=provenance))
    target.write_text(f"{prefix}cell.yaml", render_cell(cell))
    if run.report.passed or keep_rejected:
        kept_in = "tables" if run.report.passed else "rejected"
        for robot, text in run.program.tables.items():
            target.write_text(f"{prefix}{kept_in}/{robot}.csv", text)
