"""Write a repair: record, page, and the repaired cell with the files that it names."""

from pathlib import Path
from typing import Final

from cellplan.io.run.folder import MANIFEST, RunFolder
from cellplan.io.run.manifest import render_manifest
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.layout.result_file import file_records, result_files
from cellplan.pipeline.repair.repair import Repair
from cellplan.pipeline.write_run import versions
from cellplan.report.page.advice import advice_page
from cellplan.report.record.advice import AdviceRecord
from cellplan.report.record.common import as_json
from cellplan.report.text.advice import demands_text, figures_text

RECORD: Final = "advice.json"
PAGE: Final = "advice.html"


def write_repair(found: Repair, request: LayoutRequest, folder: Path) -> AdviceRecord:
    """Write a repair into a folder, which appears whole or not at all.

    It holds ``advice.json``, ``advice.html`` and, with a remedy, ``best.yaml``: the given cell file with the values of
    the first remedy, and the files beside it that it names.

    Args:
        found: As ``repair`` returns it.
        request: What was repaired.
        folder: The folder; an earlier one is replaced.

    Returns:
        The record in ``advice.json``.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    record = found.record
    with RunFolder(folder) as target:
        if found.best is not None:
            beside = result_files(found.best, request.cell, folder, head=_head(record))
            record["files"] = {each["name"]: each["sha256"] for each in file_records(beside)}
            for name, content in beside.items():
                target.write_bytes(name, content)
        target.write_text(RECORD, as_json(record))
        target.write_text(PAGE, advice_page(record))
        passed = record["status"] in {"passes", "repaired"}
        manifest = render_manifest(found.given, passed=passed, versions=versions(), files=target.written)
        target.write_text(MANIFEST, manifest)
    return record


def _head(record: AdviceRecord) -> str:
    """Comment above the repaired cell."""
    remedy = record["remedies"][0]
    return (
        f"{record['file']} repaired by cellplan layout --repair ({demands_text(record)}): {remedy['text']}.\n"
        f"Verified: {figures_text(remedy)}. Changed values say what they were."
    )
