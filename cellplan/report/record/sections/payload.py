"""Payloads in the record of a run: load and rated load of each robot, and what could not be judged."""

from collections.abc import Iterable
from typing import Annotated, Final, TypedDict

from cellplan.model.report.report import Report
from cellplan.model.robot.payload import AxisUse, LoadUse
from cellplan.model.units import MM
from cellplan.report.record.common import Number, entry_record, number

SHARED: Final = "equally by all that hold it"  # distribution of the part's weight over its holders


class AxisLoadRecord(TypedDict):
    """Load on one of the last three revolute axes."""

    static_moment_nm: Annotated[Number, "largest moment by gravity alone"]
    static_moment_at_s: Annotated[Number, "its time"]
    moment_nm: Annotated[Number, "largest moment with the accelerations of the written motion"]
    moment_at_s: Annotated[Number, "its time"]
    moment_allowed_nm: Annotated[Number, "admissible moment; null if it is not stated"]
    inertia_kg_m2: Annotated[Number, "largest moment of inertia"]
    inertia_at_s: Annotated[Number, "its time"]
    inertia_allowed_kg_m2: Annotated[Number, "admissible moment of inertia; null if it is not stated"]


class RatedLoadRecord(TypedDict):
    """Rated load of a robot."""

    mass_kg: Annotated[Number, "mass"]
    along_mm: Annotated[Number, "distance of the centre of mass from the flange, along its axis"]
    across_mm: Annotated[Number, "distance of the centre of mass from the axis of the flange"]
    source: Annotated[str, "source of these values"]


class LoadRecord(TypedDict):
    """Load of a robot; an unknown value is null."""

    mass_kg: Annotated[Number, "mass of the tool and of the share of the part"]
    tool_mass_kg: Annotated[Number, "mass of the tool"]
    part_mass_kg: Annotated[Number, "share of the part"]
    part_shared: Annotated[str | None, "distribution of the part's weight over several holders"]
    centre_in_flange_mm: Annotated[list[Number] | None, "centre of mass in the flange frame"]
    felt_mass_kg: Annotated[Number, "mass whose weight equals the largest force that holds and moves the load"]
    felt_at_s: Annotated[Number, "its time"]
    axes: Annotated[dict[str, AxisLoadRecord], "by joint: the last three revolute axes"]
    allowed: Annotated[RatedLoadRecord | None, "rated load; null if it is not stated"]


def loads_record(loads: Iterable[LoadUse]) -> dict[str, LoadRecord]:
    """Load of each robot, by robot."""
    return {use.robot: _load_record(use) for use in loads}


def hardest_loads(runs: Iterable[Report]) -> list[LoadUse]:
    """Load of each robot in that of several runs in which it is felt most."""
    uses: dict[str, list[LoadUse]] = {}
    for use in (use for run in runs for use in run.loads):
        uses.setdefault(use.robot, []).append(use)
    return [max(of_robot, key=lambda use: use.felt or 0.0) for of_robot in uses.values()]


def _load_record(use: LoadUse) -> LoadRecord:
    limits = use.limits
    return {
        "mass_kg": number(use.known_mass) if use.is_known else None,
        "tool_mass_kg": number(use.tool_mass),
        "part_mass_kg": number(use.part_mass),
        "part_shared": SHARED if use.holders > 1 else None,
        "centre_in_flange_mm": None if use.centre_F is None else [number(MM * float(x)) for x in use.centre_F],
        "felt_mass_kg": number(use.felt),
        "felt_at_s": number(use.felt_at_s),
        "axes": {axis.joint: _axis_record(axis, use) for axis in use.axes},
        "allowed": None if limits is None else entry_record(limits, without={"axes"}),
    }


def _axis_record(axis: AxisUse, use: LoadUse) -> AxisLoadRecord:
    limit = None if use.limits is None else use.limits.axes.get(axis.joint)
    return {
        "static_moment_nm": number(axis.static_moment),
        "static_moment_at_s": number(axis.static_at_s),
        "moment_nm": number(axis.moment),
        "moment_at_s": number(axis.moment_at_s),
        "moment_allowed_nm": None if limit is None else number(limit.moment_nm),
        "inertia_kg_m2": number(axis.inertia),
        "inertia_at_s": number(axis.inertia_at_s),
        "inertia_allowed_kg_m2": None if limit is None else number(limit.inertia_kg_m2),
    }


def unjudged_loads(loads: Iterable[LoadUse]) -> list[str]:
    """One line on payloads that could not be judged, one on those of which only the mass was judged."""
    reasons: dict[str, list[str]] = {}
    mass_only = []
    for use in loads:
        for reason in _missing(use):
            reasons.setdefault(reason, []).append(use.robot)
        if use.limits is not None and use.limits.is_mass_only and use.is_known and use.known_mass > 0.0:
            mass_only.append(use.robot)
    lines = []
    if reasons:
        texts = [f"{reason} ({', '.join(robots)})" for reason, robots in reasons.items()]
        lines.append(f"payload not judged: {'; '.join(texts)}")
    if mass_only:
        lines.append(f"payload judged by mass alone ({', '.join(mass_only)}): distances and wrist moments not stated")
    return lines


def _missing(use: LoadUse) -> list[str]:
    """Values of load and rated load that are not stated; nothing for a robot without load."""
    if use.is_known and use.known_mass == 0.0:
        return []
    missing = ["mass of the tool not stated"] if use.tool_mass is None else []
    missing += ["mass of the part not stated"] if use.part_mass is None else []
    return missing + (["rated load of the robot not stated"] if use.limits is None else [])
