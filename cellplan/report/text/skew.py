"""Allowed skew as text: one row of a summary, and lines for the heads of exported files."""

import math
from collections.abc import Iterator

from cellplan.model.report.skew import MOST_SKEW, PairSkew, SkewLimit, SkewReport
from cellplan.report.record.common import Record
from cellplan.report.record.phases import instant_text
from cellplan.report.text.columns import Row

DIGITS = 3  # significant ones of a skew


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


def skew_notes(skew: SkewReport) -> tuple[str, ...]:
    """Lines for the head of an exported file, in ASCII: what every two clocks and each by itself may be off by."""
    if not skew.pairs:
        return ("all robots share one clock",)
    lines = [
        f"allowed skew between any two clocks: {_skew(skew.allowed)}; of each clock alone: +-{_skew(skew.alone, 0.5)}"
    ]
    lines += [_pair_line(pair) for pair in skew.pairs]
    lines += [
        f"task {tool.name}: 1 ms of skew costs up to {tool.speed:.2f} mm, the position tolerance allows "
        f"{_skew(tool.by_position)}, the orientation tolerance {_skew(tool.by_orientation)}"
        for tool in skew.tools
    ]
    return tuple(line.encode("ascii", "replace").decode("ascii") for line in lines)


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


def _pair_line(pair: PairSkew) -> str:
    """What two clocks may be apart, and why."""
    least, stated = pair.least, ""
    why = "" if least is None or not least.subject else f" ({demand_text(least.limit, least.subject)})"
    if pair.stated is not None:
        stated = f", stated {1e3 * pair.stated:g} ms: {'kept' if pair.is_met else 'NOT KEPT'}"
    return f"{pair.first} - {pair.second}: {_skew(pair.allowed)}{why}{stated}"


def _skew(skew: float, share: float = 1.0) -> str:
    return skew_text(1e3 * skew, or_more=skew >= share * MOST_SKEW)
