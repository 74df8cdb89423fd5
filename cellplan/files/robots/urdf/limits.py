"""Joint limits: those of the URDF, tightened or supplied by the cell."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import shown
from cellplan.files.robots.limits import StatedLimits, limit_findings, tightest
from cellplan.files.robots.urdf.document.document import UrdfJoint
from cellplan.files.robots.urdf.tree import in_user_unit, unit_of
from cellplan.files.yaml.writer import flow_text

BLANK: Final = "…"  # a value that the user has to state


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissingLimits:
    """What a driven joint lacks."""

    joint: UrdfJoint
    keys: tuple[str, ...]  # keys of the limits that the cell has to state, such as ``velocity_deg_s``
    reason: str  # what the URDF states instead


def missing_limits(joints: Iterable[UrdfJoint], cell: Mapping[str, StatedLimits]) -> tuple[MissingLimits, ...]:
    """The joints that have no complete limits, neither by the URDF nor by the cell."""
    entries = (_missing_of(joint, cell.get(joint.name, StatedLimits())) for joint in joints)
    return tuple(entry for entry in entries if entry.keys)


def missing_error(missing: Sequence[MissingLimits]) -> InputError:
    """What to write in the cell when limits are missing, in one line for all joints, at least one."""
    reasons: dict[str, list[str]] = {}
    for entry in missing:
        reasons.setdefault(entry.reason, []).append(entry.joint.name)
    limits = with_blanks(flow_text(limits_to_state(missing)))
    cure = f"state limits in the cell, with a number for each {BLANK}: `limits: {limits}`"
    if any(entry.joint.kind == "continuous" and len(entry.keys) > 1 for entry in missing):
        cure += "; a continuous joint turns without end with `wrap: true` in place of its lower and upper limit"
    if len(missing) == 1:
        return missing[0].joint.error(f"{missing[0].reason}: {cure}")
    why = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in reasons.items())
    return missing[0].joint.element.error(f"{len(missing)} joints lack limits ({why}): {cure}")


def limits_to_state(missing: Iterable[MissingLimits]) -> dict[str, dict[str, str]]:
    """The limits that a cell has to state, with … for every number."""
    return {entry.joint.name: dict.fromkeys(entry.keys, BLANK) for entry in missing}


def with_blanks(text: str) -> str:
    """YAML in which every … stands without quotes, for the user to replace it."""
    return text.replace(f'"{BLANK}"', BLANK)


def joint_range(joint: UrdfJoint, cell: StatedLimits, followers: Iterable[UrdfJoint]) -> StatedLimits:
    """Limits of a driven joint: the tightest of the URDF's, the cell's and those of the joints that follow it.

    Position and velocity are complete, with infinite positions where the joint may turn without end.

    ``InputError`` where one is missing or of an unlikely size, is widened by the cell, or leaves no range.
    """
    stated = joint.limit.stated
    for key, text in limit_findings(stated, cell, is_revolute=joint.kind != "prismatic"):
        raise joint.error(f"{key}: {text}")
    limits = tightest(stated, cell)
    if cell.wraps:
        lowest, highest = _endless(joint, cell)
        limits = replace(limits, lower=lowest, upper=highest)
    for follower in followers:
        limits = tightest(limits, _through(follower))
    lower, upper, velocity = limits.lower, limits.upper, limits.velocity
    if lower is None or upper is None or velocity is None:
        raise missing_error([_missing_of(joint, cell)])
    if not velocity > 0.0:
        raise joint.error(f"expected a positive velocity limit, got {in_user_unit(joint, velocity, '/s')}")
    if not lower < upper:
        ends = f"{in_user_unit(joint, lower)} and {in_user_unit(joint, upper)}"
        raise joint.error(f"expected a lower limit below the upper one, got {ends}")
    return limits


def _missing_of(joint: UrdfJoint, cell: StatedLimits) -> MissingLimits:
    """What one joint lacks; no keys where it is complete."""
    limits, unit = tightest(joint.limit.stated, cell), unit_of(joint).name
    ends = [] if cell.wraps else [name for name in ("lower", "upper") if getattr(limits, name) is None]
    keys = [f"{name}_{unit}" for name in ends] + ([f"velocity_{unit}_s"] if limits.velocity is None else [])
    reasons = [joint.limit.position_fault or _range_reason(joint)] if ends else []
    reasons += [joint.limit.velocity_fault or _stated(joint, "velocity")] if limits.velocity is None else []
    return MissingLimits(joint=joint, keys=tuple(keys), reason=" and ".join(dict.fromkeys(reasons)))


def _range_reason(joint: UrdfJoint) -> str:
    """Why a joint has no range."""
    return "is continuous" if joint.kind == "continuous" else _stated(joint, "lower", "upper")


def _stated(joint: UrdfJoint, *names: str) -> str:
    """What the file says where a limit is missing: ``states velocity="0"``."""
    limit = next(iter(joint.element.all("limit")), None)
    if limit is None:
        return "states no limits"
    given = {name: limit.attributes[name] for name in names if name in limit.attributes}
    text = " ".join(f'{name}="{shown(value)[1:-1]}"' for name, value in given.items())
    return f"states {text}" if text else f"states no {' and '.join(names)} limit"


def _endless(joint: UrdfJoint, cell: StatedLimits) -> tuple[float, float]:
    """Limits of a joint that the cell lets turn without end."""
    if joint.kind != "continuous":
        raise joint.error(f"expected `wrap: true` only for a continuous joint, got a {joint.kind} one")
    if cell.lower is not None or cell.upper is not None:
        raise joint.error("expected either `wrap: true` or limits, got both")
    return -np.inf, np.inf


def _through(follower: UrdfJoint) -> StatedLimits:
    """Limits of a leader that keep its follower within the follower's own."""
    mimic, limit = follower.mimic, follower.limit.stated
    if mimic is None or mimic.multiplier == 0.0:
        return StatedLimits()
    ratio = mimic.multiplier
    ends = [None if end is None else (end - mimic.offset) / ratio for end in (limit.lower, limit.upper)]
    lower, upper = ends if ratio > 0.0 else reversed(ends)
    rates = [None if rate is None else rate / abs(ratio) for rate in (limit.velocity, limit.acceleration, limit.jerk)]
    return StatedLimits(lower=lower, upper=upper, velocity=rates[0], acceleration=rates[1], jerk=rates[2])
