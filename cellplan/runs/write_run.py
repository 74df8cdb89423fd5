"""Write a solution: report, plots, the resolved cell and, when every check passed, the joint tables."""

from collections.abc import Collection, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePath, PurePosixPath
from typing import Final

import cellplan
from cellplan.files.cell.write import render_cell
from cellplan.files.run.folder import MANIFEST, RunFolder
from cellplan.files.run.joint_tables import program_digest
from cellplan.files.run.manifest import render_manifest, user_files
from cellplan.files.run.stored import CLOCK
from cellplan.model.motion.motion import Program
from cellplan.model.progress import Progress, silent
from cellplan.report.page.render import VIEW_PAGE, report_page
from cellplan.report.page.view import unmade_view_page
from cellplan.report.plots.rendering import pictures, require_formats
from cellplan.report.plots.run import run_figures
from cellplan.report.record.common import Provenance, Record, as_json
from cellplan.report.record.sections.solver import PlanningFacts
from cellplan.report.record.series import series_json
from cellplan.report.record.summary import ProgramRecords, program_records
from cellplan.runs.drawings.picture import FLOOR_PLAN, STILL, drawings_by_place
from cellplan.runs.solution import Run, Solution

# packages whose arithmetic the result rests on
ENGINES: Final = ("numpy", "pin", "python-fcl", "coal", "daqp")


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
        plots = {}
        for index, run in enumerate(solution.runs):
            progress("writing the report", index / len(solution.runs))
            plots[run.name or ""] = _write_phase(target, run, formats)
        planning = [PlanningFacts(motion=run.motion, transfers=run.transfers, moved=run.moved) for run in solution.runs]
        records = program_records(solution.runs, cell=cell, provenance=provenance, planning=planning)
        _write_pages(target, solution, records, plots, tables)
        target.write_text("cell.yaml", render_cell(cell))
        if has_tables:
            _write_tables(target, program, released)
        manifest = render_manifest(cell, passed=solution.passed, versions=versions(), files=target.written)
        target.write_text(MANIFEST, manifest)
        file = PurePath(cell.origin.file).name
        target.write_text(
            VIEW_PAGE, unmade_view_page(cell.name, cell_file=file if user_files(cell.inputs, file) else "")
        )
    return records.whole


_version = cache(version)


def versions() -> dict[str, str]:
    """Version of cellplan and of every engine, by package name."""
    packages = {"cellplan": cellplan.__version__}
    for package in ENGINES:
        try:
            packages[package] = _version(package)
        except PackageNotFoundError:
            packages[package] = "unknown"
    return packages


def _write_phase(target: RunFolder, run: Run, formats: Collection[str]) -> dict[str, bytes]:
    """Series and plots of one phase, in a subfolder if it has a name; returns the plots by file name."""
    place = PurePosixPath(run.name or "")
    target.write_text(str(place / "series.json"), series_json(run.report, run.motion))
    plots = pictures(run_figures(run.report, cell=run.cell), formats)
    for name, picture in plots.items():
        target.write_bytes(str(place / "plots" / name), picture)
    return plots


def _write_pages(
    target: RunFolder,
    solution: Solution,
    records: ProgramRecords,
    plots: Mapping[str, Mapping[str, bytes]],
    tables: Collection[str],
) -> None:
    """Report, drawings and page of each phase in its subfolder, and those of the program above them."""
    for name, drawings in drawings_by_place(solution.cell, solution.runs).items():
        place, record = PurePosixPath(name), records.by_place[name]
        target.write_text(str(place / "report.json"), as_json(record))
        for file, text in drawings.items():
            target.write_text(str(place / file), text)
        page = report_page(
            record,
            cell=records.cells[name],
            plots=plots.get(name, {}),
            still=drawings[STILL],
            floor_plan=drawings[FLOOR_PLAN],
            files=tables,
        )
        target.write_text(str(place / "report.html"), page)


def _write_tables(target: RunFolder, program: Program, folder: str) -> None:
    """The tables of the whole program: one of each robot, and the clock."""
    for robot, text in program.tables.items():
        target.write_text(f"{folder}/{robot}.csv", text)
    target.write_text(f"{folder}/{CLOCK}.csv", program.clock)
