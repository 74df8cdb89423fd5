"""A layout search as text: the verdict, the best layout, what changed, what holds it back, and the line to type."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cellplan.report.record.common import Entries, Record
from cellplan.report.record.numbers import floored, plain, seconds

MOST: Final = 6  # [-] lines of what binds, of what the given layout breaks, and of reasons
SAME: Final = 1e-3  # [mm] or [deg] by which a variable may differ and count as unchanged


def layout_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a layout search.

    Args:
        record: As ``layout_record`` returns it.
    """
    lines = [f"{record['cell']}: {verdict_line(record)}", f"  {_given(record)}"]
    lines += [f"    {each['text']}" for each in record["given"]["violations"][:MOST]]
    if record["best"] is not None:
        changes = list(_changes(record))
        lines.append("  what changed" if changes else "  nothing changed")
        lines += [f"    {line}" for line in changes]
        if record["binding"]:
            lines.append("  what holds it back")
            lines += [f"    {each['text']}" for each in record["binding"][:MOST]]
    else:
        rejected = [each for each in record["top"] if each["status"] == "rejected"]
        lines += [f"  rejected by solve: {each['reason']}" for each in rejected[:MOST]]
        lines += [f"  {each['reason']} ({_trials(each['count'])})" for each in record["dropped"][:MOST]]
    lines += [f"  {line}" for line in map(_choice, record["choices"])]
    lines += [f"  {line}" for line in _misplaced(record)]
    lines += [f"  {remark}" for remark in record["remarks"]]
    rounds = "1 round" if record["rounds"] == 1 else f"{record['rounds']} rounds"
    lines.append(f"  {_trials(record['trials'])} in {rounds}, {record['solves']} solved in full")
    if record["best"] is not None:
        lines.append(solve_best_line(folder))
    return [*lines, f"report: {folder / 'study.html'}"]


def solve_best_line(folder: Path) -> str:
    """The line to type for the best cell of a folder; its run does not replace that of the given cell."""
    words = ["cellplan", "solve", str(folder / "best.yaml"), "-o", f"{folder}-run"]
    return f"next: {shlex.join(words)}"


def verdict_line(record: Record) -> str:
    """What came of the search, in one line."""
    best = record["best"]
    if best is None and record["status"] == "no_start":
        return "NO START: no layout was found in which all tools reach the starts of their paths"
    if best is None:
        return "NO LAYOUT CERTIFIED"
    figures = [f"cycle {seconds(best['cycle_s'])} s"]
    if best["margin_deg"] is not None:
        figures.append(f"smallest margin {plain(floored(best['margin_deg']))} deg")
    if best["clearance_mm"] is not None:
        figures.append(f"smallest clearance {floored(best['clearance_mm'])} mm")
    return f"CERTIFIED: {', '.join(figures)}"


def changed_variables(record: Record) -> Entries:
    """Variables whose value in the best layout is another one than in the given one."""
    return [
        dict(each)
        for each in record["variables"]
        if None not in (each["given"], each["best"]) and abs(each["best"] - each["given"]) > SAME
    ]


def _misplaced(record: Record) -> Iterator[str]:
    """What was sampled with displaced bases."""
    found = record["misplacement"]
    if found is None:
        return
    by = f"{found['position_mm']:g} mm and {found['orientation_deg']:g} deg"
    yield f"with every base off by {by}, sampled, motion planned anew, in this one cycle:"
    yield (
        f"  {found['seeded_kept']} of {found['seeded']} seeded corners, {found['by_derivatives_kept']} of "
        f"{found['by_derivatives']} worst corners by derivatives, {found['ends_kept']} of {found['ends']} single "
        f"displacements passed every check"
    )


def _given(record: Record) -> str:
    """The given layout in one line."""
    given = record["given"]
    if given["reason"]:
        return f"as given: no motion: {given['reason']}"
    state = "conforms" if given["status"] == "conforming" else "does not conform"
    cycle = "" if given["cycle_s"] is None else f"; shortest cycle of its motion {seconds(given['cycle_s'])} s"
    return f"as given: {state}{cycle}"


def _changes(record: Record) -> Iterator[str]:
    """Changed variables, those of one entry of the cell file on one line."""
    groups: dict[str, list[str]] = {}
    for each in changed_variables(record):
        entry, _, name = each["name"].removeprefix("robots.").rpartition(".")
        unit = f" {each['unit']}" if each["unit"] else ""
        groups.setdefault(entry, []).append(
            f"{name.removesuffix('_mm').removesuffix('_deg')} {each['given']:.5g} -> {each['best']:.5g}{unit}"
        )
    yield from (f"{entry}: {', '.join(texts)}" for entry, texts in groups.items())
    if record["path"] is not None:
        yield path_text(record["path"])


def path_text(path: Record) -> str:
    """A joint path in one line, and how far it is from the given motion."""
    parts = ((path["departure_deg"], "deg"), (path["departure_mm"], "mm"))
    departures = " and ".join(f"{value:.3g} {unit}" for value, unit in parts if value is not None)
    given = "path" if path["is_given"] else "motion"
    return (
        f"{path['robot']}.path: {path['coefficients']} coefficients a joint, largest departure {departures} from the "
        f"given {given}"
    )


def _choice(each: Record) -> str:
    """A combination of discrete choices in one line."""
    cycle = "" if each["cycle_s"] is None else f", cycle {seconds(each['cycle_s'])} s"
    reason = f": {each['reason']}" if each["reason"] else ""
    return f"{each['choice']}: {each['status'].replace('_', ' ')} ({_trials(each['trials'])}{cycle}){reason}"


def _trials(count: int) -> str:
    """A number of trials in words."""
    return f"{count} trial" if count == 1 else f"{count} trials"
