"""Write a solution: report, plots, the resolved cell and, when every check passed, the joint tables."""

from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

import cellplan
from cellplan.io.cell.write import render_cell
from cellplan.io.run.folder import MANIFEST, RunFolder
from cellplan.io.run.joint_tables import parse_header, program_digest, replace_header
from cellplan.io.run.manifest import render_manifest
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.pipeline.background_plots import BackgroundPlots
from cellplan.pipeline.solution import Run, Solution
from cellplan.report.page.render import overview_html, report_html
from cellplan.report.record.run import Provenance
from cellplan.report.record.series import series_json
from cellplan.report.record.write import report_json, summary_json

ENGINES: Final = (
    "numpy",
    "pin",
    "python-fcl",
    "coal",
    "daqp",
    "trimesh",
)  # packages whose arithmetic the result rests on


def write_run(
    solution: Solution,
    folder: Path,
    *,
    keep_rejected: bool = False,
    progress: Progress = silent,
    plots: BackgroundPlots | None = None,
) -> None:
    """Write a run folder; it appears whole or not at all.

    Every run has ``report.json``, ``series.json``, ``report.html``, ``plots/`` and ``cell.yaml``; ``tables/`` only if the
    solution passed. A cell with one run per task gets a subfolder for each and an overview above them. Last comes
    ``manifest.json``, which names every file.

    Args:
        solution: What was solved.
        folder: The run folder; an older run there is replaced.
        keep_rejected: Write the tables of a failed solution too, under ``rejected/``, marked in every header.
        progress: Called with the stage and the fraction done.
        plots: Draws the plots; those that it has begun are not drawn again.

    Raises:
        InputError: The folder cannot be written, or holds something else than a run.
    """
    background = plots or BackgroundPlots()
    with RunFolder(folder) as target:
        for index, run in enumerate(solution.runs):
            progress("writing the report", index / len(solution.runs))
            _write_one(target, solution.cell, run, background)
            if solution.passed:
                _write_tables(target, run, "tables")
            elif keep_rejected:
                _write_tables(target, run, "rejected")
        reports = {run.name: run.report for run in solution.runs if run.name is not None}
        if reports:
            provenance = Provenance(versions=versions(), digests={})
            target.write_text("report.json", summary_json(reports, cell=solution.cell, provenance=provenance))
            target.write_text("report.html", overview_html(reports, cell=solution.cell, provenance=provenance))
            target.write_text("cell.yaml", render_cell(solution.cell))
        manifest = render_manifest(solution.cell, passed=solution.passed, versions=versions(), files=target.written)
        target.write_text(MANIFEST, manifest)


def versions() -> dict[str, str]:
    """Version of cellplan and of every engine, by package name."""
    found = {"cellplan": cellplan.__version__}
    for package in ENGINES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found


def _write_one(target: RunFolder, cell: Cell, run: Run, plots: BackgroundPlots) -> None:
    """Report, plots and resolved cell of one run."""
    place = _place(run)
    provenance = Provenance(versions=versions(), digests={"program": program_digest(run.program.tables)})
    begun = plots.pictures(run.report, cell=cell)
    record = report_json(run.report, cell=cell, provenance=provenance, motion=run.motion)
    target.write_text(f"{place}report.json", record)
    target.write_text(f"{place}series.json", series_json(run.report, run.motion))
    pictures = begun()
    for name, picture in pictures.items():
        target.write_bytes(f"{place}plots/{name}", picture)
    page = report_html(run.report, cell=cell, provenance=provenance, plots=pictures, motion=run.motion)
    target.write_text(f"{place}report.html", page)
    target.write_text(f"{place}cell.yaml", render_cell(cell))


def _write_tables(target: RunFolder, run: Run, folder: str) -> None:
    """Joint tables of one run; none of a failed solution says that it passed."""
    for robot, text in run.program.tables.items():
        if folder == "rejected" and run.report.passed:
            header = replace(parse_header(text, robot), verdict="REJECTED: another run of the same job failed")
            text = replace_header(text, header=header)  # noqa: PLW2901
        target.write_text(f"{_place(run)}{folder}/{robot}.csv", text)


def _place(run: Run) -> str:
    """Where in the run folder a run is written: a run with a name has a subfolder."""
    return "" if run.name is None else f"{run.name}/"
