"""Notes beside the numbers of a report: clock, accuracy of bodies, open surfaces, grips, pairs left out, skew."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from cellplan.model.report.left_out import left_out_lines
from cellplan.model.report.skew import SkewLimit
from cellplan.report.record.common import Number, Record
from cellplan.report.record.phases import NEXT_STEP, TASKS, TIMING, instant_text
from cellplan.report.text.columns import Row

DIGITS = 3  # significant ones of a skew
JOINED: Final = frozenset({"grip_depth", "mount_depth"})  # checks of two bodies that are joined
MAX_NAMES: Final = 3  # links of a robot that a line names; further ones are counted
CLOCK_NOTES: Final = {
    TASKS: "no motion.duration_s: the clock ends with the last task",
    NEXT_STEP: "motion.duration_s is not a multiple of motion.step_s: the clock ends with the step after it",
    TIMING: "motion.timing: joints and feeds determine how long the program takes",
}


def clock_note(record: Record) -> str:
    """What determines the duration of the motion; empty if the cell file states it."""
    return CLOCK_NOTES.get(record.get("clock_from", ""), "")


def accuracy_note(pair: Sequence[str], accuracies: Sequence[Number] | None) -> str:
    """Accuracy of the two bodies of a pair; empty if it is unknown.

    A body that is taken as exact is not mentioned if the other is not.
    """
    if accuracies is None:
        return ""
    unknown = [name for name, value in zip(pair, accuracies, strict=True) if value is None]
    if unknown:
        return f"accuracy of {' and '.join(unknown)} not stated"
    stated = [(name, value) for name, value in zip(pair, accuracies, strict=True) if value]
    if not stated:
        return "between bodies assumed exact"
    if len(stated) == len(accuracies) and len(set(accuracies)) == 1:
        return f"between bodies accurate to {stated[0][1]:g} mm"
    return f"between bodies accurate to {' and '.join(f'{value:g} mm ({name})' for name, value in stated)}"


def left_out_notes(record: Record) -> list[str]:
    """One line for each kind of pairs that were not judged in full; none if the record has no such key."""
    if "left_out" not in record:
        return []
    return left_out_lines((entry["kind"], tuple(entry["bodies"]), entry["reason"]) for entry in record["left_out"])


def grip_notes(record: Record) -> list[str]:
    """Depth of each holder that is in the part: the messages of these checks, each once."""
    grips = (check for check in record["checks"] if check.get("name") == "grip_depth")
    return list(dict.fromkeys(check["message"] for check in grips if not reaches_nowhere(check)))


def reaches_nowhere(check: Record) -> bool:
    """Whether a check is about two bodies that are joined, of which none is in the other: nothing is to be said."""
    return check.get("name") in JOINED and check["value"] == 0.0


def open_surface_notes(entries: Iterable[Record]) -> Iterator[tuple[str, str]]:
    """A line for each open surface, one for all links of a robot, with the key of the cell that it is about."""
    links: dict[str, list[Record]] = {}
    for entry in entries:
        if entry["has_inside"]:
            links.setdefault(entry["key"], []).append(entry)
        else:
            edges = f"{entry['open_edges']} open edge{'s' if entry['open_edges'] != 1 else ''}"
            yield entry["key"], f"the mesh of {entry['body']} has {edges}: contact is detected, containment is not"
    for key, meshes in links.items():
        names = ", ".join(mesh["body"] for mesh in meshes[:MAX_NAMES]) + (", …" if len(meshes) > MAX_NAMES else "")
        count = f"{len(meshes)} meshes of links are" if len(meshes) > 1 else "the mesh of a link is"
        yield key, f"{count} open ({names}): points with a winding number above one half count as inside"


def skew_row(record: Record) -> Iterator[Row]:
    """The smallest skew that is allowed between two clocks, and what limits it; nothing without controllers."""
    if "skew" not in record or not record["skew"]["pairs"]:
        return
    pair = min(record["skew"]["pairs"], key=lambda pair: float(pair["allowed_ms"]))
    least = min(pair["limits"], key=lambda limit: float(limit["skew_ms"]))
    where = f"{pair['robots'][0]} - {pair['robots'][1]}"
    if least["subject"]:
        where = f"{where}, {demand_text(least['limit'], least['subject'])} {instant_text(least)}"
    yield "allowed skew", skew_text(float(pair["allowed_ms"]), or_more=pair["or_more"]), where


def demand_text(limit: str, subject: str) -> str:
    """What limits a skew: a demand of its subject, or what a subject does where the next phase begins."""
    return f"{subject} across the end of the phase" if limit == SkewLimit.END else f"{limit} of {subject}"


def skew_text(skew_ms: float, *, or_more: bool) -> str:
    """A skew in milliseconds, rounded down to three significant digits, so that a small one is not none."""
    if or_more:
        return f"{skew_ms:g} ms or more"
    if not skew_ms > 0.0:
        return "0 ms"
    unit = 10.0 ** (math.floor(math.log10(skew_ms)) + 1 - DIGITS)
    return f"{math.floor(skew_ms / unit * (1.0 + 1e-12)) * unit:.4g} ms"
