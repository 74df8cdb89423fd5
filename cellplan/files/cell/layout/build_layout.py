"""The layout of a cell file: what a search may change, as data or as findings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, get_args

import numpy as np

from cellplan.files.cell.layout.layout_addresses import Address, AddressError, read_address
from cellplan.files.cell.layout.layout_ranges import Context, read_ranges
from cellplan.files.cell.layout.layout_ties import Ties
from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, listed, shown, unknown_name
from cellplan.files.schema.cell import MotionEntry
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.shapes import Box, Cylinder
from cellplan.geometry.transforms import Array
from cellplan.model.cell.layout import (
    ChoiceKind,
    KeepOut,
    LayoutChoice,
    LayoutSettings,
    PathRange,
    VariableKind,
    VaryRange,
)
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.layout import KeepOutEntry, LayoutEntry
from cellplan.model.settings.units import in_si
from cellplan.model.units import MM

NEAR_MM: Final = 1000.0  # x and y of a base may change by so much where no range is given
FAR_MM: Final = 2500.0  # a base that stands farther than this from the first holder or the part may come nearer to it
CLOSE_MM: Final = 500.0  # how near
HIGHEST_MM: Final = 600.0  # z of a base where no range is given
CHOICES: Final = ("robot", "mode", "branch")
SIDES: Final = ("x", "y")
KINDS: Final[Mapping[str, ChoiceKind]] = {
    "robot": ChoiceKind.ROBOT,
    "mode": ChoiceKind.MODE,
    "branch": ChoiceKind.BRANCH,
}
MODES: Final = get_args(MotionEntry.model_fields["mode"].annotation)
PATH_KEYS: Final = ("coefficients", "degree")
DEGREES: Final = (3, 5)
FEWEST: Final = 7  # coefficients: three at rest at either end, and one between
MOST: Final = 200


@dataclass(slots=True)
class _Reading:
    """What was read so far."""

    ranges: dict[str, VaryRange] = field(default_factory=dict)
    paths: list[PathRange] = field(default_factory=list)
    null_space: list[PathRange] = field(default_factory=list)
    choices: list[LayoutChoice] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def read_layout(
    valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument
) -> tuple[LayoutSettings, list[Finding]]:
    """What a layout search may change, and what is wrong with it.

    A file that says nothing lets the bases of all operators and the start of the first holder change; its base too
    where it grips the part, or puts it down, at a place in the world.
    """
    entry = valid.layout or LayoutEntry()
    context, reading = Context(valid=valid, models=models, document=document), _Reading()
    vary = entry.vary if entry.vary is not None else _usual(context)
    for key, value in vary.items():
        _read_one(key, value, context, reading)
    if reading.null_space and reading.paths:
        text = f"unexpected key beside {reading.paths[0].robot}.path: leave one of them out"
        reading.findings.append(document.key_finding(("layout", "vary", "null_space"), text))
    ties = Ties(entry, reading.ranges, context, reading.findings)
    fixed = ties.fixed()
    _keep_on_floor(entry, reading, document)
    settings = LayoutSettings(
        ranges=tuple(reading.ranges.values()),
        paths=tuple(path for path in reading.paths if f"robots.{path.robot}.path" not in fixed),
        null_space=next(iter(reading.null_space), None),
        choices=tuple(choice for choice in reading.choices if choice.address not in fixed),
        equal=ties.equal(),
        mirrored=ties.mirrored(),
        keep_out=tuple(_keep_out(name, area) for name, area in entry.keep_out.items()),
        floor=_floor(entry),
        margin=entry.margin_deg.si,
        margin_sliding=entry.margin_mm.si,
        cost=ties.cost(),
        singular=entry.singular_share,
        misplacement=entry.misplacement,
        is_default=entry.vary is None,
    )
    return settings, reading.findings


def _read_one(key: str, value: Any, context: Context, reading: _Reading) -> None:
    """One entry of ``vary``."""
    path: KeyPath = ("layout", "vary", key)
    try:
        address = read_address(key, context.valid, context.models)
    except AddressError as error:
        reading.findings.append(context.document.key_finding(path, str(error)))
        return
    if address is None:
        return
    if address.what == "null_space":
        _keep(reading.null_space, _read_spline(address.name, value, path, context), reading)
    elif address.what == "path":
        _keep(reading.paths, read_path(address, value, path, context), reading)
    elif address.what in CHOICES:
        _keep(reading.choices, read_choice(address, value, path, context), reading)
    else:
        for range_ in read_ranges(address, value, path, context):
            if isinstance(range_, VaryRange) and range_.address in reading.ranges:
                text = f"expected each variable once, got '{range_.address}' twice"
                range_ = context.document.key_finding(path, text)  # noqa: PLW2901
            if isinstance(range_, Finding):
                reading.findings.append(range_)
            else:
                reading.ranges[range_.address] = range_


def _keep(into: list[Any], entry: Any, reading: _Reading) -> None:
    """What was read goes into its list, a finding to the findings."""
    (reading.findings if isinstance(entry, Finding) else into).append(entry)


def _usual(context: Context) -> dict[str, Any]:
    """Ranges of a file that gives none: bases near their places, and the start of the first holder."""
    valid, usual = context.valid, dict[str, Any]()
    holders = [grasp.robot for grasp in valid.part.held_by] if valid.part is not None else []
    movable = {task.robot for task in valid.tasks.values()} - set(holders)
    if valid.program is not None and (valid.program.attach or valid.program.detach):
        movable |= set(holders[:1])
    planes = [it.plane.z_mm for it in valid.environment.values() if it.plane is not None]
    middle = _middle(valid, holders)
    for name, entry in valid.robots.items():
        mount = entry.mount
        if name not in movable or (mount is not None and mount.wall is not None):
            continue
        z = entry.base.xyz_mm[2]
        ranges = {f"{side}_mm": _near(entry.base.xyz_mm[i], middle[i]) for i, side in enumerate(SIDES)}
        if mount is None and not any(abs(z - plane) <= 1e-3 for plane in planes):
            ranges["z_mm"] = (min(0.0, z), max(HIGHEST_MM, z))
        yaw = entry.base.rpy_deg[2]
        ranges["yaw_deg"] = (yaw - 180.0, yaw + 180.0)
        usual[f"robots.{name}.base"] = ranges
    for name in holders[:1]:
        if name in context.models:
            turns = all(joint.is_revolute for joint in context.models[name].joints)
            usual[f"robots.{name}.{'start_deg' if turns else 'start'}"] = True
    return usual


def _middle(valid: ValidEntries, holders: Sequence[str]) -> tuple[float, ...]:
    """Where the work is done in [mm]: the base of the first holder, else the part at rest."""
    at = valid.part.at if valid.part is not None else None
    if at is None and holders and holders[0] in valid.robots:
        at = valid.robots[holders[0]].base
    return (math.nan, math.nan, math.nan) if at is None else tuple(at.xyz_mm)


def _near(value: float, middle: float) -> tuple[float, float]:
    """Range of x or y of a base in [mm]: near its place, and from far away on to the work."""
    lower, upper = value - NEAR_MM, value + NEAR_MM
    if abs(value - middle) > FAR_MM:
        lower, upper = min(lower, middle + CLOSE_MM), max(upper, middle - CLOSE_MM)
    return lower, upper


def _keep_on_floor(entry: LayoutEntry, reading: _Reading, document: YamlDocument) -> None:
    """Narrow the ranges of all bases to the floor."""
    floor = _floor(entry)
    for address, span in list(reading.ranges.items()) if floor is not None else ():
        if floor is None or span.kind is not VariableKind.BASE or span.index > 1:
            continue
        lower, upper = (float(bound) for bound in floor[:, span.index])
        if max(span.lower, lower) < min(span.upper, upper):
            reading.ranges[address] = replace(span, lower=max(span.lower, lower), upper=min(span.upper, upper))
        else:
            text = (
                f"expected bounds that overlap the range of {address}, {MM * span.lower:g} to {MM * span.upper:g} mm, "
                f"got {MM * lower:g} to {MM * upper:g}"
            )
            reading.findings.append(document.finding(("layout", "floor", f"{SIDES[span.index]}_mm"), text))


def _floor(entry: LayoutEntry) -> Array | None:
    """Lowest and highest x and y of all bases in [m]; None without bounds."""
    if entry.floor is None:
        return None
    bounds = [entry.floor.x_mm, entry.floor.y_mm]
    return np.array([[-math.inf, math.inf] if bound is None else in_si(bound) for bound in bounds]).T


def _keep_out(name: str, entry: KeepOutEntry) -> KeepOut:
    """An area without bases, one metre high."""
    if entry.cylinder is not None:
        return KeepOut(name=name, shape=Cylinder(entry.cylinder.radius_mm.si, 1.0), X_WS=entry.at.matrix)
    x, y = (size.si for size in entry.box.size_mm[:2]) if entry.box is not None else (0.0, 0.0)
    return KeepOut(name=name, shape=Box((x, y, 1.0)), X_WS=entry.at.matrix)


def read_choice(address: Address, value: Any, path: KeyPath, context: Context) -> LayoutChoice | Finding:
    """A choice between robots, modes or branches."""
    kind = KINDS[address.what]
    if kind is ChoiceKind.BRANCH:
        if value is not True:
            return context.document.finding(path, f"expected true, got {shown(value)}")
        return LayoutChoice(address=address.group, kind=kind, name=address.name)
    wrong = _wrong_options(address, value, path, context)
    return wrong or LayoutChoice(address=address.group, kind=kind, name=address.name, options=value)


def _wrong_options(address: Address, value: Any, path: KeyPath, context: Context) -> Finding | None:
    """What is wrong with a list of robots or modes; None if nothing is."""
    finding, valid, is_mode = context.document.finding, context.valid, address.what == "mode"
    held = {grasp.robot for grasp in valid.part.held_by} if valid.part is not None else set()
    robots = tuple(name for name in valid.names["robots"] if name not in held)
    known: tuple[str, ...] = MODES if is_mode else robots
    if not isinstance(value, tuple) or not value:
        return finding(path, f"expected a list of what may be chosen ({listed(known)}), got {shown(value)}")
    for index, option in enumerate(value):
        if option not in known:
            what = "a mode" if is_mode else "a robot that does not hold the part"
            return finding((*path, index), unknown_name(what, option, known))
        if option in value[:index]:
            return finding((*path, index), f"expected each once, got '{option}' twice")
    present = (valid.motion and valid.motion.mode) if is_mode else valid.tasks[address.name].robot
    if present is not None and present not in value:
        return finding(path, f"expected a list with the present choice '{present}', got {listed(value)}")
    return None


def read_path(address: Address, value: Any, path: KeyPath, context: Context) -> PathRange | Finding:
    """The joint path of the first holder, as splines."""
    part = context.valid.part
    holder = part.held_by[0].robot if part is not None and part.held_by else None
    if address.name != holder:
        return context.document.key_finding(path, f"expected the first holder of the part, got '{address.name}'")
    return _read_spline(address.name, value, path, context)


def _read_spline(robot: str, value: Any, path: KeyPath, context: Context) -> PathRange | Finding:
    """Settings of splines of a robot, or of all of them in the null space."""
    if value is True:
        return PathRange(robot=robot)
    if not isinstance(value, Mapping):
        return context.document.finding(path, f"expected true or {{coefficients: 14, degree: 5}}, got {shown(value)}")
    return _wrong_spline(value, path, context) or PathRange(robot=robot, **value)


def _wrong_spline(value: Mapping[str, Any], path: KeyPath, context: Context) -> Finding | None:
    """What is wrong with the settings of a spline; None if nothing is."""
    finding = context.document.finding
    for key, number in value.items():
        if key not in PATH_KEYS:
            text = f"unknown key{did_you_mean(key, PATH_KEYS)}; allowed: {listed(PATH_KEYS)}"
            return context.document.key_finding((*path, key), text)
        if not isinstance(number, int):
            return finding((*path, key), f"expected a whole number, got {shown(number)}")
    if value.get("degree", 5) not in DEGREES:
        return finding((*path, "degree"), f"expected 3 or 5, got {value['degree']}")
    if not FEWEST <= value.get("coefficients", FEWEST) <= MOST:
        text = f"expected from {FEWEST} to {MOST} coefficients, got {value['coefficients']}"
        return finding((*path, "coefficients"), text)
    return None
