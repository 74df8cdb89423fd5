"""What a report tells of payloads: what each robot carries and may carry, and what could not be judged."""

from collections.abc import Iterable
from dataclasses import replace

from cellplan.model.payload import AxisUse, LoadUse
from cellplan.model.report import Report
from cellplan.report.record.run import Record, number

SHARED = "equally by all that hold it"  # how the part weighs on its holders


def loads_record(loads: Iterable[LoadUse]) -> Record:
    """What each robot carries, by robot; a figure that is not known is null."""
    return {use.robot: _load_record(use) for use in loads}


def worst_loads(runs: Iterable[Report]) -> list[LoadUse]:
    """What each robot carries over several runs, one after another: the largest figures of each axis, any run."""
    merged: dict[str, LoadUse] = {}
    for use in (use for run in runs for use in run.loads):
        merged[use.robot] = _merged(merged[use.robot], use) if use.robot in merged else use
    return list(merged.values())


def _merged(first: LoadUse, second: LoadUse) -> LoadUse:
    """The larger figures of two runs."""
    harder = max(first, second, key=lambda use: use.felt or 0.0)
    axes = []
    for one, other in zip(first.axes, second.axes, strict=True):
        static = max(one, other, key=lambda axis: axis.static_moment)
        moving = max(one, other, key=lambda axis: axis.moment)
        inert = max(one, other, key=lambda axis: axis.inertia)
        axes.append(
            replace(
                moving,
                static_moment=static.static_moment,
                static_at_s=static.static_at_s,
                inertia=inert.inertia,
                inertia_at_s=inert.inertia_at_s,
            )
        )
    return replace(harder, axes=tuple(axes))


def _load_record(use: LoadUse) -> Record:
    limits = use.limits
    return {
        "mass_kg": number(use.known_mass) if use.is_known else None,
        "tool_mass_kg": number(use.tool_mass),
        "part_mass_kg": number(use.part_mass),
        "part_shared": SHARED if use.holders > 1 else None,
        "centre_in_flange_mm": None if use.centre_F is None else [number(1e3 * float(x)) for x in use.centre_F],
        "felt_mass_kg": number(use.felt),
        "felt_at_s": number(use.felt_at_s),
        "axes": {axis.joint: _axis_record(axis, use) for axis in use.axes},
        "allowed": None
        if limits is None
        else {
            "mass_kg": number(limits.mass),
            "along_mm": None if limits.along is None else number(1e3 * limits.along),
            "across_mm": None if limits.across is None else number(1e3 * limits.across),
            "source": limits.source,
        },
    }


def _axis_record(axis: AxisUse, use: LoadUse) -> Record:
    """What the load does to one axis and what it may do."""
    limit = None if use.limits is None else use.limits.axis(axis.joint)
    return {
        "static_moment_nm": number(axis.static_moment),
        "static_moment_at_s": number(axis.static_at_s),
        "moment_nm": number(axis.moment),
        "moment_at_s": number(axis.moment_at_s),
        "moment_allowed_nm": None if limit is None else number(limit.moment),
        "inertia_kg_m2": number(axis.inertia),
        "inertia_at_s": number(axis.inertia_at_s),
        "inertia_allowed_kg_m2": None if limit is None else number(limit.inertia),
    }


def unjudged_loads(loads: Iterable[LoadUse]) -> list[str]:
    """One line on the payloads that could not be judged and why, one on those of which only the mass was."""
    reasons: dict[str, list[str]] = {}
    mass_only = []
    for use in loads:
        for reason in _missing(use):
            reasons.setdefault(reason, []).append(use.robot)
        if use.limits is not None and use.limits.is_mass_only and use.is_known and use.known_mass > 0.0:
            mass_only.append(use.robot)
    lines = []
    if reasons:
        words = [f"{reason} ({', '.join(robots)})" for reason, robots in reasons.items()]
        lines.append(f"payload not judged: {'; '.join(words)}")
    if mass_only:
        lines.append(f"payload judged by mass alone ({', '.join(mass_only)}): distances and wrist moments not stated")
    return lines


def _missing(use: LoadUse) -> list[str]:
    """What is not stated of what one robot carries and may carry; nothing for a robot that carries nothing."""
    if use.is_known and use.known_mass == 0.0:
        return []
    missing = ["mass of the tool not stated"] if use.tool_mass is None else []
    missing += ["mass of the part not stated"] if use.part_mass is None else []
    return missing + (["what the robot may carry not stated"] if use.limits is None else [])
