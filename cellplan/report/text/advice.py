"""Advice as text: the verdict, remedies with the lines to type, and what was tried besides."""

import shlex
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Final

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import floored, plain, seconds
from cellplan.report.text.layout import solve_best_line

MOST_FAILED: Final = 4  # [-] failed checks that are shown
MOST_EFFECTS: Final = 3  # [-] effects of a remedy that are shown


def advice_lines(record: Record, folder: Path, cell: Path) -> list[str]:
    """All lines about a repair.

    Args:
        record: As ``advice_record`` returns it.
        cell: The cell file, as the user named it.
    """
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


def figures_text(remedy: Record) -> str:
    """Figures of a verified remedy, in words."""
    figures = [f"cycle {seconds(remedy['cycle_s'])} s"]
    if remedy["smallest_margin_deg"] is not None:
        figures.append(f"smallest margin {plain(floored(remedy['smallest_margin_deg']))} deg")
    if remedy["smallest_clearance_mm"] is not None:
        figures.append(f"smallest clearance {floored(remedy['smallest_clearance_mm'])} mm")
    return ", ".join(figures)


def effects_text(remedy: Record) -> str:
    """What a remedy does to the failed checks, the first ones, in words."""
    texts = [each["text"] for each in remedy["effects"]]
    more = len(texts) - MOST_EFFECTS
    return "; ".join([*texts[:MOST_EFFECTS], *([f"and {more} more"] if more > 0 else [])])


def command_line(remedy: Record, cell: Path) -> str:
    """The line to type that gives the motion of a remedy."""
    settings = [word for each in remedy["options"] for word in ("--set", each)]
    return shlex.join(["cellplan", "solve", str(cell), *settings])


def tried_groups(record: Record) -> list[tuple[str, str]]:
    """What was tried and why it is no remedy, those with one reason together, in the order of the first of each."""
    order = {each["reason"]: place for place, each in reversed(list(enumerate(record["tried"])))}
    listed = sorted(record["tried"], key=lambda each: order[each["reason"]])
    return [
        ("; ".join(each["text"] for each in group), reason)
        for reason, group in groupby(listed, key=lambda each: str(each["reason"]))
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
    yield from (f"    {each['message']}" for each in failed[:MOST_FAILED])
    if len(failed) > MOST_FAILED:
        yield f"    and {len(failed) - MOST_FAILED} more"


def _remedy(number: int, remedy: Record, cell: Path) -> Iterator[str]:
    """One remedy."""
    yield f"    {number}. {remedy['text']} (cost {remedy['cost']:.2f})"
    if remedy["effects"]:
        yield f"       {effects_text(remedy)}"
    yield f"       {figures_text(remedy)}"
    yield f"       {command_line(remedy, cell)}"
