"""A repair as text, page, tables and files: what is shown, and in which order."""

import shlex
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, Final

from cellplan.files.run.folder import MANIFEST, RunFolder
from cellplan.files.run.manifest import render_manifest
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.result import figures_text, solve_best_line
from cellplan.jobs.layout.result_file import file_records, result_files
from cellplan.jobs.repair.record import AdviceRecord
from cellplan.jobs.repair.repair import Repair
from cellplan.model.report.report import CAUTION
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.record.common import CheckRecord, Record, as_json
from cellplan.report.record.numbers import seconds
from cellplan.report.record.rows import Tables, columns_of, flat, listed_table
from cellplan.runs.write_run import versions

MOST_FAILED: Final = 4  # [-] failed checks that are shown
MOST_EFFECTS: Final = 3  # [-] effects of a remedy that are shown
RECORD: Final = "advice.json"
PAGE: Final = "advice.html"


# Text


def advice_lines(record: Record, folder: Path, cell: Path) -> list[str]:
    """All lines about a repair of a cell file, as the user named it."""
    lines = [f"{record['cell']}: {verdict_line(record)}", *_given(record)]
    if record["remedies"]:
        lines.append("  remedies, each solved and verified; a cost of 1 stands for 100 mm, 10 deg or a tenth more time")
    for place, remedy in enumerate(record["remedies"]):
        lines += _remedy(place + 1, remedy, cell)
    groups = tried_groups(record)
    if groups:
        lines.append("  no remedy")
        lines += [f"    {texts}: {reason}" for texts, reason in groups]
    lines += [f"  {remark}" for remark in record["remarks"]]
    if record["remedies"]:
        lines.append(solve_best_line(folder))
    return [*lines, f"report: {folder / 'advice.html'}"]


def verdict_line(record: Record) -> str:
    """What came of the repair, in one line."""
    match record["status"]:
        case "passes":
            return "PASSES as it is given: nothing to repair"
        case "repaired":
            return f"REPAIRED: {record['remedies'][0]['text']}"
        case "no_motion":
            return "NO MOTION, and no remedy was found"
        case _:
            return "NO REMEDY was found"


def demands_text(record: Record) -> str:
    """What is demanded, in words."""
    margin = record["required_margin_deg"]
    demanded = f"at {seconds(record['duration_s'])} s, clearance {record['required_clearance_mm']:g} mm"
    return f"{demanded}, margins {margin:g} deg" if margin else demanded


def remedy_figures(remedy: Record) -> str:
    """Figures of a verified remedy, in words."""
    return figures_text(remedy["cycle_s"], remedy["smallest_margin_deg"], remedy["smallest_clearance_mm"])


def effects_text(remedy: Record) -> str:
    """What a remedy does to the failed checks, the first ones, in words."""
    texts = [effect["text"] for effect in remedy["effects"]]
    more = len(texts) - MOST_EFFECTS
    return "; ".join([*texts[:MOST_EFFECTS], *([f"and {more} more"] if more > 0 else [])])


def command_line(remedy: Record, cell: Path) -> str:
    """The line to type that gives the motion of a remedy."""
    settings = [word for option in remedy["options"] for word in ("--set", option)]
    return shlex.join(["cellplan", "solve", str(cell), *settings])


def tried_groups(record: Record) -> list[tuple[str, str]]:
    """What was tried and why it is no remedy, those with one reason together, in the order of the first of each."""
    order = {attempt["reason"]: place for place, attempt in reversed(list(enumerate(record["tried"])))}
    listed = sorted(record["tried"], key=lambda attempt: order[attempt["reason"]])
    return [
        ("; ".join(attempt["text"] for attempt in group), reason)
        for reason, group in groupby(listed, key=lambda attempt: str(attempt["reason"]))
    ]


def _given(record: Record) -> Iterator[str]:
    """How the cell fails as it is given."""
    if record["no_motion"]:
        yield f"  as given ({demands_text(record)}): no motion: {record['no_motion']}"
        return
    failed = record["failed"]
    if not failed:
        yield f"  {demands_text(record)}"
        return
    yield f"  as given ({demands_text(record)}): {len(failed)} {'check fails' if len(failed) == 1 else 'checks fail'}"
    yield from (f"    {check['message']}" for check in failed[:MOST_FAILED])
    if len(failed) > MOST_FAILED:
        yield f"    and {len(failed) - MOST_FAILED} more"


def _remedy(number: int, remedy: Record, cell: Path) -> Iterator[str]:
    yield f"    {number}. {remedy['text']} (cost {remedy['cost']:.2f})"
    if remedy["effects"]:
        yield f"       {effects_text(remedy)}"
    yield f"       {remedy_figures(remedy)}"
    yield f"       {command_line(remedy, cell)}"


# Page


def advice_page(record: Record) -> str:
    """The page of a repair."""
    return template("jobs/repair/advice.html").render(
        r=record,
        verdict=verdict_line(record),
        demands=demands_text(record),
        commands=[command_line(remedy, Path(record["file"])) for remedy in record["remedies"]],
        tried=tried_groups(record),
        caution=CAUTION,
    )


# Tables and files


def advice_tables(record: Record) -> Tables:
    """The tables of frames and notebooks; what a remedy does to each check is a table of its own."""

    def effects() -> dict[str, Any]:
        return columns_of(
            {"remedy": number, **flat(effect)}
            for number, remedy in enumerate(record["remedies"], start=1)
            for effect in remedy["effects"]
        )

    def remedies() -> dict[str, Any]:
        return columns_of(
            flat({key: value for key, value in remedy.items() if key != "effects"}) for remedy in record["remedies"]
        )

    return {
        "remedies": remedies,
        "effects": effects,
        "failed": listed_table(record, "failed", CheckRecord),
        "tried": listed_table(record, "tried"),
    }


def write_repair(repair: Repair, request: LayoutRequest, folder: Path) -> AdviceRecord:
    """Write a repair into a folder, which appears whole or not at all.

    It holds ``advice.json``, ``advice.html`` and, with a remedy, ``best.yaml``: the given cell file with the values of
    the first remedy, and the files beside it that it names.

    Args:
        repair: As ``repair`` returns it.
        request: What was repaired.
        folder: The folder; an earlier one is replaced.

    Returns:
        The record in ``advice.json``.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    record = repair.record
    with RunFolder(folder) as target:
        if repair.best is not None:
            files = result_files(repair.best, request.cell, folder, head=_head(record))
            record["files"] = {record["name"]: record["sha256"] for record in file_records(files)}
            for name, content in files.items():
                target.write_bytes(name, content)
        target.write_text(RECORD, as_json(record))
        target.write_text(PAGE, advice_page(record))
        passed = record["status"] in {"passes", "repaired"}
        manifest = render_manifest(repair.given, passed=passed, versions=versions(), files=target.written)
        target.write_text(MANIFEST, manifest)
    return record


def _head(record: AdviceRecord) -> str:
    """Comment above the repaired cell."""
    remedy = record["remedies"][0]
    return (
        f"{record['file']} repaired by cellplan layout --repair ({demands_text(record)}): {remedy['text']}.\n"
        f"Verified: {remedy_figures(remedy)}. Changed values say what they were."
    )


ADVICE: Final = ResultKind(
    name="advice",
    title="Repair",
    file=RECORD,
    tables=advice_tables,
    shown={"remedies": ("text", "kind", "cost", "cycle_s", "smallest_margin_deg", "smallest_clearance_mm")},
    good=("passes", "repaired"),
)
