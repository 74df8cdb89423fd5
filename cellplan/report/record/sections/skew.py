"""Allowed skew of the clocks of controllers in printed units."""

from collections.abc import Iterable
from typing import Annotated, Final, TypedDict

from cellplan.model.report.report import Report
from cellplan.model.report.skew import MOST_SKEW, AllowedSkew, PairSkew, SkewReport, ToolSkew
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Number, number
from cellplan.report.record.phases import in_phase

MS: Final = 1e3  # [ms/s]


class SkewLimitRecord(TypedDict):
    """What one demand allows."""

    limit: Annotated[
        str, "`tool tolerance`, `tool depth`, `clearance`, or `phase end` for what the end of a phase allows"
    ]
    skew_ms: Annotated[Number, "largest skew that is proved to keep it, at most 200"]
    or_more: Annotated[bool, "whether nothing limits it up to 200 ms"]
    subject: Annotated[str, "task, grasp or bodies that limit it; empty without a limit"]
    at_s: Annotated[Number, "its time; null without a limit"]


class PairSkewRecord(TypedDict):
    """Two robots that share no clock."""

    robots: Annotated[list[str], "the two"]
    allowed_ms: Annotated[Number, "largest skew that is proved to keep all demands, at most 200"]
    or_more: Annotated[bool, "whether nothing limits it up to 200 ms"]
    stated_ms: Annotated[Number, "largest difference of their clocks that the cell states; null for none"]
    limits: Annotated[list[SkewLimitRecord], "by demand"]


class ToolSkewRecord(TypedDict):
    """What a skew costs a tool on a part that another clock carries."""

    robot: Annotated[str, "robot of the tool"]
    carrier: Annotated[str, "robot that carries the part"]
    error_per_ms_mm: Annotated[Number, "largest position error for each millisecond of skew"]
    by_position_ms: Annotated[Number, "largest skew that keeps the tolerance in position, at most 200"]
    by_orientation_ms: Annotated[Number, "largest skew that keeps the tolerance in orientation, at most 200"]
    at_s: Annotated[Number, "time that limits the smaller of the two; null without a limit"]
    position_error_at_stated_mm: Annotated[Number, "upper bound at the skew that is stated; null for none"]
    orientation_error_at_stated_deg: Annotated[Number, "likewise"]
    shortest_cycle_s: Annotated[
        Number, "duration at which the tolerance is kept with the skew that is stated; null for none, or if none does"
    ]


class SkewRecord(TypedDict):
    """How far the clocks of controllers may be apart."""

    allowed_ms: Annotated[Number, "largest skew of any two clocks that is proved to keep all demands, at most 200"]
    or_more: Annotated[bool, "whether nothing limits it up to 200 ms"]
    each_ms: Annotated[Number, "largest shift of each clock by itself, forward or back: half of that"]
    clocks: Annotated[list[list[str]], "robots that share a clock"]
    pairs: Annotated[list[PairSkewRecord], "robots that share none"]
    tools: Annotated[dict[str, ToolSkewRecord], "by task, or `robot@part` for a further holder"]


class SkewKey(TypedDict, total=False):
    """Only of a cell that states controllers, with robots on more than one clock."""

    skew: Annotated[
        SkewRecord,
        "how far the clocks of controllers may be apart, of several runs in the one that allows least; only if the "
        "cell states controllers",
    ]


def least_skew_record(reports: Iterable[Report]) -> SkewKey:
    """The allowed skew of that phase of several, one after another, that allows least; see ``skew_record``."""
    known = [(report.skew.allowed, report) for report in reports if report.skew is not None]
    _, least = min(known, key=lambda pair: pair[0], default=(None, None))
    return {} if least is None else in_phase(skew_record(least), str(least.phase))


def skew_record(report: Report) -> SkewKey:
    """The allowed skew of a run, under its key; nothing where it was not evaluated."""
    return {} if report.skew is None else {"skew": _record(report.skew)}


def _record(skew: SkewReport) -> SkewRecord:
    return {
        "allowed_ms": number(MS * skew.allowed),
        "or_more": skew.allowed >= MOST_SKEW,
        "each_ms": number(MS * skew.alone),
        "clocks": [list(group) for group in skew.groups],
        "pairs": [_pair_record(pair) for pair in skew.pairs],
        "tools": {tool.name: _tool_record(tool) for tool in skew.tools},
    }


def _pair_record(pair: PairSkew) -> PairSkewRecord:
    return {
        "robots": [pair.first, pair.second],
        "allowed_ms": number(MS * pair.allowed),
        "or_more": pair.allowed >= MOST_SKEW,
        "stated_ms": number(pair.stated, MS),
        "limits": [_limit_record(limit) for limit in pair.limits],
    }


def _limit_record(limit: AllowedSkew) -> SkewLimitRecord:
    return {
        "limit": str(limit.limit),
        "skew_ms": number(MS * limit.skew),
        "or_more": limit.skew >= MOST_SKEW,
        "subject": limit.subject,
        "at_s": number(limit.at_s),
    }


def _tool_record(tool: ToolSkew) -> ToolSkewRecord:
    return {
        "robot": tool.robot,
        "carrier": tool.carrier,
        "error_per_ms_mm": number(tool.speed),  # m/s are mm/ms
        "by_position_ms": number(MS * tool.by_position),
        "by_orientation_ms": number(MS * tool.by_orientation),
        "at_s": number(tool.at_s),
        "position_error_at_stated_mm": number(tool.position, MM),
        "orientation_error_at_stated_deg": number(tool.orientation, DEG),
        "shortest_cycle_s": number(tool.shortest_cycle),
    }
