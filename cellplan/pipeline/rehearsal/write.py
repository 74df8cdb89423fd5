"""Write a rehearsal: record, page, plots, and the corrected joint tables when there are any that may be used."""

from collections.abc import Collection
from pathlib import Path

from cellplan.io.cell.write import render_cell
from cellplan.io.run.folder import RunFolder
from cellplan.io.run.joint_tables import program_digest
from cellplan.model.progress import Progress, silent
from cellplan.model.rehearsal import Rehearsal
from cellplan.pipeline.write_run import versions
from cellplan.report.page.render import rehearsal_page
from cellplan.report.plots.rehearsal import rehearsal_figures
from cellplan.report.plots.rendering import pictures
from cellplan.report.record.common import Provenance, Record, as_json
from cellplan.report.record.rehearsal import rehearsal_record


def write_rehearsal(
    rehearsal: Rehearsal, folder: Path, *, formats: Collection[str] = (), progress: Progress = silent
) -> Record:
    """Write the folder of a rehearsal; it appears whole or not at all.

    It has ``rehearsal.json``, ``rehearsal.html``, ``plots/`` and ``cell.yaml``. Corrected tables stand under
    ``tables/``, or ``tables/<task>/`` where there is one run per task; only when everything passed.

    Args:
        rehearsal: The rehearsal.
        folder: The folder; an older rehearsal there is replaced.
        formats: Further formats of the plots beside SVG: ``png``, ``pdf``; both need matplotlib.
        progress: Called with the stage and the fraction done.

    Returns:
        The record in the ``rehearsal.json`` of the folder.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write; a format cannot be
            written.
    """
    progress("writing the rehearsal", 1.0)
    provenance = Provenance(versions=versions(), digests=_digests(rehearsal))
    plots = pictures(rehearsal_figures(rehearsal), formats)
    record = rehearsal_record(rehearsal, provenance=provenance)
    with RunFolder(folder) as target:
        for name, picture in plots.items():
            target.write_bytes(f"plots/{name}", picture)
        target.write_text("rehearsal.json", as_json(record))
        target.write_text("rehearsal.html", rehearsal_page(record, cell=rehearsal.cell, plots=plots))
        target.write_text("cell.yaml", render_cell(rehearsal.cell))
        for run in rehearsal.runs if rehearsal.is_released else ():
            place = "tables" if run.name is None else f"tables/{run.name}"
            for robot, text in run.corrected.program.tables.items() if run.corrected else ():
                target.write_text(f"{place}/{robot}.csv", text)
    return record


def _digests(rehearsal: Rehearsal) -> dict[str, str]:
    """Digest of the corrected program of each run."""
    return {
        "corrected program" if run.name is None else f"corrected program of {run.name}": program_digest(
            run.corrected.program.tables
        )
        for run in rehearsal.runs
        if run.corrected is not None and rehearsal.is_released
    }
