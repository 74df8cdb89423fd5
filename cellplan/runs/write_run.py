"""Write a solution: report, plots, the resolved cell and, when every check passed, the joint tables."""

from collections.abc import Collection, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePath
from typing import Final

import cellplan
from cellplan.files.cell.write import render_cell
from cellplan.files.run.folder import MANIFEST, RunFolder
from cellplan.files.run.joint_tables import program_digest
from cellplan.files.run.manifest import render_manifest, user_files
from cellplan.files.run.stored import CLOCK
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Program
from cellplan.model.progress import Progress, silent
from cellplan.report.page.render import VIEW_PAGE, PageFiles, overview_page, report_page
from cellplan.report.page.view import unmade_view_page
from cellplan.report.plots.rendering import pictures, require_formats
from cellplan.report.plots.run import run_figures
from cellplan.report.record.common import Provenance, Record, as_json
from cellplan.report.record.run import run_record
from cellplan.report.record.series import series_json
from cellplan.report.record.summary import summary_record
from cellplan.runs.drawings.picture import FLOOR_PLAN, STILL, DepictedPhase, phase_drawings, program_drawings
from cellplan.runs.solution import Run, Solution

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
    formats: Collection[str] = (),
) -> Record:
    """Write a run folder; it appears whole or not at all.

    The folder holds ``report.json``, ``series.json``, ``report.html``, ``plots/`` and ``cell.yaml``; as drawings
    ``still.svg`` and ``floor_plan.svg``; ``tables/`` only if every check passed. The phases of a program with one for
    each task have reports, drawings and plots of their own in subfolders, and an overview above them. After them comes
    ``manifest.json``, which names every file but ``view.html``: there stands the 3-D page once ``write_view`` made it,
    and until then how to make it.

    Args:
        solution: The solution.
        folder: The run folder; an older run there is replaced.
        keep_rejected: Write the tables of a failed solution too, under ``rejected/``, marked in every header.
        progress: Called with the stage and the fraction done.
        formats: Further formats of the plots beside SVG: ``png``, ``pdf``; both need matplotlib.

    Returns:
        The record in the ``report.json`` of the folder.

    Raises:
        InputError: The folder cannot be written, or contains something other than a run; a format cannot be written.
    """
    require_formats(formats)
    cell, program = solution.cell, solution.program
    provenance = Provenance(versions=versions(), digests={"program": program_digest(program.tables)})
    released = "tables" if solution.passed else "rejected"
    has_tables = solution.passed or keep_rejected
    tables = [f"{released}/{name}.csv" for name in (*program.tables, CLOCK)] if has_tables else []
    with RunFolder(folder) as target:
        for index, run in enumerate(solution.runs):
            progress("writing the report", index / len(solution.runs))
            record = _write_report(target, run.cell_of(cell), run, provenance, formats, PageFiles(files=tables))
        reports = {run.name: run.report for run in solution.runs if run.name is not None}
        if reports:
            transfers = {name: text for run in solution.runs for name, text in run.transfers.items()}
            moved = dict.fromkeys(start for run in solution.runs for start in run.moved)
            record = summary_record(reports, cell=cell, provenance=provenance, transfers=transfers, moved=moved)
            target.write_text("report.json", as_json(record))
            phases = [DepictedPhase(run.cell_of(cell), run.schedule, run.report) for run in solution.runs]
            extra = PageFiles(files=tables) | _write_drawings(target, "", program_drawings(cell, phases))
            target.write_text("report.html", overview_page(record, cell=cell, **extra))
        target.write_text("cell.yaml", render_cell(cell))
        if has_tables:
            _write_tables(target, program, released)
        manifest = render_manifest(cell, passed=solution.passed, versions=versions(), files=target.written)
        target.write_text(MANIFEST, manifest)
        file = PurePath(cell.origin.file).name
        target.write_text(
            VIEW_PAGE, unmade_view_page(cell.name, cell_file=file if user_files(cell.inputs, file) else "")
        )
    return record


def versions() -> dict[str, str]:
    """Version of cellplan and of every engine, by package name."""
    packages = {"cellplan": cellplan.__version__}
    for package in ENGINES:
        try:
            packages[package] = version(package)
        except PackageNotFoundError:
            packages[package] = "unknown"
    return packages


def _write_report(
    target: RunFolder, cell: Cell, run: Run, provenance: Provenance, formats: Collection[str], extra: PageFiles
) -> Record:
    """Report, series and plots of one phase, in a subfolder if it has a name; returns its record."""
    place = "" if run.name is None else f"{run.name}/"
    record = run_record(
        run.report, cell=cell, provenance=provenance, motion=run.motion, transfers=run.transfers, moved=run.moved
    )
    target.write_text(f"{place}report.json", as_json(record))
    target.write_text(f"{place}series.json", series_json(run.report, run.motion))
    plots = pictures(run_figures(run.report, cell=cell), formats)
    for name, picture in plots.items():
        target.write_bytes(f"{place}plots/{name}", picture)
    extra |= _write_drawings(target, place, phase_drawings(DepictedPhase(cell, run.schedule, run.report)))
    page = report_page(record, run.report.checks, cell=cell, plots=plots, **extra)
    target.write_text(f"{place}report.html", page)
    return record


def _write_drawings(target: RunFolder, place: str, drawings: Mapping[str, str]) -> PageFiles:
    """Write the drawings of the cell; returns them by what a page calls them."""
    for name, text in drawings.items():
        target.write_text(f"{place}{name}", text)
    return {"still": drawings[STILL], "floor_plan": drawings[FLOOR_PLAN]}


def _write_tables(target: RunFolder, program: Program, folder: str) -> None:
    """The tables of the whole program: one of each robot, and the clock."""
    for robot, text in program.tables.items():
        target.write_text(f"{folder}/{robot}.csv", text)
    target.write_text(f"{folder}/{CLOCK}.csv", program.clock)
