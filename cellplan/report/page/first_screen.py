"""First screen of a report: process speeds, what was not judged, and the instant that its picture shows."""

from collections.abc import Iterator
from typing import Final

from cellplan.model.cell.cell import Cell
from cellplan.model.report.left_out import TITLES, LeftOutKind, left_out_lines
from cellplan.model.units import MM
from cellplan.report.page.checks import failure_groups
from cellplan.report.page.times import page_begin, phase_begins
from cellplan.report.record.common import Entries, Record
from cellplan.report.record.numbers import floored, small

BY_NAME: Final = frozenset({LeftOutKind.EXCLUDED, LeftOutKind.SRDF})  # excluded by someone, not by their nature
MAX_SPEEDS: Final = 4  # tasks on the first screen; all of them have a line in the table of process speeds


def worst_instant(record: Record) -> Record | None:
    """The instant of the first failed check that has one, else that of the closest pair; None without either.

    That is the one which the picture of the run shows: its ``at_s``, its ``phase`` and, as ``text``, what is worst.
    """
    for group in failure_groups(record):
        for row in group["rows"]:
            if row["at_s"] is not None:
                return {"at_s": row["at_s"], "phase": row["phase"], "text": f"{group['title']}: {row['where']}"}
    whole = record["clearance"]["whole"]
    if whole["at_s"] is None:
        return None
    pair, least = " – ".join(whole["pair"] or ()), "" if whole["exact"] else "at least "
    text = f"Closest pair: {pair}, {least}{floored(whole['minimum_mm'])} mm"
    return {"at_s": whole["at_s"], "phase": whole.get("phase", ""), "text": text}


def process_speeds(record: Record, cell: Cell) -> Entries:
    """Speed along its path of every task, with the feed that is demanded; failed ones first."""
    failed = {check["subject"] for check in record["checks"] if check["name"] == "process_feed" and not check["passed"]}
    rows = [
        {
            "task": name,
            "robot": task["robot"],
            "speed": task["process_speed"],
            "demanded": _demanded(cell, name),
            "shift": _begin_on_page(record, task),
            "is_bad": name in failed,
        }
        for name, task in record["tasks"].items()
    ]
    return sorted(rows, key=lambda row: not row["is_bad"])


def _begin_on_page(record: Record, task: Record) -> float | None:
    """Time in [s] on the clock of the page at which the phase of a task begins; None where it is in no phase."""
    phase = task.get("phase")
    begin = 0.0 if phase is None else phase_begins(record).get(phase)
    return None if begin is None else begin - page_begin(record)


def _demanded(cell: Cell, name: str) -> str:
    """Feed that the process of a task demands; empty without one."""
    process = next((task.process for task in cell.tasks if task.name == name), None)
    return "" if process is None else f"{small(MM * process.feed)} mm/s ± {small(process.tolerance_percent)} %"


def not_judged(record: Record) -> list[tuple[str, str]]:
    """What was not judged, in a few words each, with the part of the page that has the full lines."""
    return list(_not_judged(record))


def _not_judged(record: Record) -> Iterator[tuple[str, str]]:
    heads = dict.fromkeys(line.partition(": ")[0] for line in record["rests_on"]["lines"])
    yield from ((head, "#unstated") for head in heads)
    yield from _reduced_checks(record)
    for left_out in record["accelerations"]["not_judged"]:
        of = f" of {left_out['robot']}" if left_out["robot"] else ""
        yield f"{left_out['what']}{of}", "#accelerations"
    if record["open_surfaces"]:
        yield f"{len(record['open_surfaces'])} meshes are not closed", "#open-surfaces"
    if record.get("clearance_proof", {}).get("not_certified"):
        yield "distances of some pairs between the samples", "#assumptions"
    yield from _clocks(record)


def _clocks(record: Record) -> Iterator[tuple[str, str]]:
    """A stated skew that is more than the allowed one, which fails no check; a stop in which bodies touch, likewise."""
    for pair in record["skew"]["pairs"] if "skew" in record else ():
        if pair["stated_ms"] is not None and pair["stated_ms"] > pair["allowed_ms"]:
            robots, allowed = " and ".join(pair["robots"]), small(pair["allowed_ms"])
            yield f"stated skew of {robots}, {small(pair['stated_ms'])} ms, of which {allowed} ms are allowed", "#skew"
    for distance in record["stops"]["distances"] if "stops" in record else ():
        if distance["distance_mm"] == 0.0 and not any(check["name"].startswith("stop_") for check in record["checks"]):
            bodies = " and ".join(distance["bodies"] or distance["robots"])
            yield f"when one robot stops, {bodies} touch; nothing is demanded of stops", "#stops"


def _reduced_checks(record: Record) -> Iterator[tuple[str, str]]:
    """Pairs that were not checked in full: those that someone excluded by name, the others by their number."""
    entries = [(entry["kind"], tuple(entry["bodies"]), entry["reason"]) for entry in record.get("left_out", ())]
    by_name = [entry for entry in entries if entry[0] in BY_NAME]
    if by_name or not entries:
        yield from ((line, "#left-out") for line in left_out_lines(by_name))
    kinds = [kind for kind, _, _ in entries if kind not in BY_NAME]
    if kinds:
        named = ", ".join(f"{kinds.count(kind)} {TITLES[kind]}" for kind in TITLES if kind in kinds)
        yield f"{len(kinds)} {'pair' if len(kinds) == 1 else 'pairs'} with reduced checks ({named})", "#left-out"
