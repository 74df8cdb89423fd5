"""Limits of joints as MoveIt states them: ``joint_limits.yaml`` beside an SRDF, in [rad], [m] and seconds."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.files.input.findings import Finding, KeyPath, listed, raise_findings, shown
from cellplan.files.robots.limits import StatedLimits, tightest
from cellplan.files.robots.urdf.document.document import UrdfDocument
from cellplan.files.robots.urdf.document.stated_limits import UrdfLimit, within_range
from cellplan.files.yaml.reader import YamlDocument, read_yaml

ABOVE: Final = "robot_description_planning"  # a key that some files have above all others
TOP: Final = "joint_limits"
RATES: Final = ("velocity", "acceleration", "deceleration", "jerk")
ENDS: Final = ("min_position", "max_position")
KNOWN: Final = {*ENDS, *(f"max_{name}" for name in RATES), *(f"has_{name}_limits" for name in ("position", *RATES))}


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveitLimits:
    """What a file states: limits by joint name, and the names that it has beside them."""

    file: str  # name in messages
    joints: Mapping[str, StatedLimits] = field(default_factory=dict)
    unused: tuple[str, ...] = ()  # keys that are no limits here


def read_moveit_limits(path: Path, file: str) -> MoveitLimits:
    """Read the limits that a file states; with ``has_velocity_limits: false`` it states no velocity, and so on."""
    document = read_yaml(path, file=file)
    top: KeyPath = (ABOVE, TOP) if ABOVE in document.root else (TOP,)
    root = document.root.get(ABOVE, document.root)
    entries = root.get(TOP) if isinstance(root, dict) else None
    if not isinstance(entries, dict) or not all(isinstance(entry, dict) for entry in entries.values()):
        text = f"{file}: expected limits of MoveIt, joints by name below the key {TOP}"
        raise InputError(text)
    findings = [*document.findings]
    for name, entry in entries.items():
        findings += _findings((*top, name), entry, document)
    raise_findings(file, findings)
    unused = {key for key in document.root if key not in (ABOVE, TOP)}
    unused |= {key for entry in entries.values() for key in entry if key not in KNOWN}
    joints = {name: _limits(entry) for name, entry in entries.items()}
    return MoveitLimits(file=file, joints=joints, unused=tuple(sorted(unused)))


def with_moveit_limits(document: UrdfDocument, moveit: MoveitLimits | None) -> UrdfDocument:
    """The document whose joints keep the limits of MoveIt too, with remarks on what was not used.

    ``InputError`` where the robot has none of the joints: the file is another robot's.
    """
    if moveit is None:
        return document
    known = {name: limits for name, limits in moveit.joints.items() if name in document.joints}
    if moveit.joints and not known:
        text = f"expected the limits of '{document.name}', got some of none of its joints"
        raise InputError(f"{moveit.file}: {text}: {listed(moveit.joints)}")
    remarks, joints = [], dict(document.joints)
    for name, limits in known.items():
        slides = joints[name].kind == "prismatic"
        limit, fault = _narrowed(joints[name].limit, limits, slides=slides, turns_on=joints[name].kind == "continuous")
        joints[name] = replace(joints[name], limit=limit)
        remarks += [f"{moveit.file}: joint '{name}': positions {fault}"] if fault else []
    missing = [name for name in moveit.joints if name not in known]
    remarks += [f"{moveit.file}: '{document.name}' does not have the joints {listed(missing)}"] if missing else []
    remarks += [f"{moveit.file}: no limits, not used: {listed(moveit.unused)}"] if moveit.unused else []
    return replace(document, joints=joints, remarks=(*document.remarks, *remarks))


def _narrowed(limit: UrdfLimit, moveit: StatedLimits, *, slides: bool, turns_on: bool) -> tuple[UrdfLimit, str]:
    """The tighter of both limits of each kind, and what is wrong with the positions of MoveIt; empty for nothing."""
    soft, fault = (StatedLimits(), "") if turns_on else within_range(limit, moveit.lower, moveit.upper, slides=slides)
    if turns_on and (moveit.lower is not None or moveit.upper is not None):
        fault = "of a continuous joint were not used"
    both = tightest(limit.stated, replace(moveit, lower=None, upper=None))
    rates = {name: getattr(both, name) for name in ("velocity", "acceleration", "jerk")}
    return replace(limit, **rates, soft=tightest(limit.soft, soft)), fault


def _limits(entry: Mapping[str, Any]) -> StatedLimits:
    rates = {name: float(entry[f"max_{name}"]) if _states(entry, name) else None for name in RATES}
    lower, upper = (float(entry[end]) if _states(entry, "position") and end in entry else None for end in ENDS)
    ramps = [rate for rate in (rates["acceleration"], rates["deceleration"]) if rate is not None]
    return StatedLimits(
        lower=lower,
        upper=upper,
        velocity=rates["velocity"],
        acceleration=min(map(abs, ramps), default=None),
        jerk=rates["jerk"],
    )


def _states(entry: Mapping[str, Any], name: str) -> bool:
    """Whether a limit is stated: it is there, and not said to be none."""
    keys = ENDS if name == "position" else (f"max_{name}",)
    return any(key in entry for key in keys) and entry.get(f"has_{name}_limits", True) is not False


def _findings(path: KeyPath, entry: Mapping[str, Any], document: YamlDocument) -> Iterator[Finding]:
    """Limits that are no numbers of a possible size."""
    for name in ("position", *RATES):
        flag = entry.get(f"has_{name}_limits", False)
        if not isinstance(flag, bool):
            yield document.finding((*path, f"has_{name}_limits"), f"expected true or false, got {shown(flag)}")
        for key in ENDS if name == "position" else (f"max_{name}",):
            value = entry.get(key, 1.0)
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
            what = "a finite number" if name == "position" else "a positive number"
            is_fit = is_number and (name in ("position", "deceleration") or value > 0.0)
            if _states(entry, name) and not is_fit:
                yield document.finding((*path, key), f"expected {what}, got {shown(value)}")
            if flag is True and key not in entry:
                yield document.finding(path, f"states has_{name}_limits: true, but no {key}")
