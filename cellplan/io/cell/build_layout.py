"""The layout of a cell file: what a search may change, as data or as findings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from cellplan.geometry.shapes import Box, Cylinder
from cellplan.geometry.transforms import Array
from cellplan.io.cell.layout_addresses import AddressError, read_address
from cellplan.io.cell.layout_choices import read_choice, read_path
from cellplan.io.cell.layout_ranges import Context, read_ranges
from cellplan.io.cell.layout_ties import Ties
from cellplan.io.input.findings import Finding, KeyPath
from cellplan.io.schema.partial import ValidEntries
from cellplan.io.yaml.reader import YamlDocument
from cellplan.model.layout import KeepOut, LayoutChoice, LayoutSettings, PathRange, VariableKind, VaryRange
from cellplan.model.robot import RobotModel
from cellplan.model.settings.layout import KeepOutEntry, LayoutEntry
from cellplan.model.settings.units import in_si
from cellplan.model.units import MM

NEAR_MM: Final = 1000.0  # x and y of a base may change by so much where no range is given
FAR_MM: Final = 2500.0  # a base that stands farther than this from the first holder or the part may come nearer to it
CLOSE_MM: Final = 500.0  # how near
HIGHEST_MM: Final = 600.0  # z of a base where no range is given
CHOICES: Final = ("robot", "mode", "branch")
SIDES: Final = ("x", "y")


@dataclass(slots=True)
class _Reading:
    """What was read so far."""

    ranges: dict[str, VaryRange] = field(default_factory=dict)
    paths: list[PathRange] = field(default_factory=list)
    choices: list[LayoutChoice] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def read_layout(
    valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument
) -> tuple[LayoutSettings, list[Finding]]:
    """What a layout search may change, and what is wrong with it.

    A file that says nothing lets the bases of all operators and the start of the first holder change.
    """
    entry = valid.layout or LayoutEntry()
    context, reading = Context(valid=valid, models=models, document=document), _Reading()
    vary = entry.vary if entry.vary is not None else _usual(context)
    for key, value in vary.items():
        _read_one(key, value, context, reading)
    ties = Ties(entry, reading.ranges, context, reading.findings)
    fixed = ties.fixed()
    _keep_on_floor(entry, reading, document)
    settings = LayoutSettings(
        ranges=tuple(reading.ranges.values()),
        paths=tuple(path for path in reading.paths if f"robots.{path.robot}.path" not in fixed),
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
    if address.what == "path":
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
    """Ranges of a file that gives none: bases of the operators near their places, and the start of the first holder."""
    valid, usual = context.valid, dict[str, Any]()
    holders = [grasp.robot for grasp in valid.part.held_by] if valid.part is not None else []
    operators = {task.robot for task in valid.tasks.values()} - set(holders)
    planes = [it.plane.z_mm for it in valid.environment.values() if it.plane is not None]
    middle = _middle(valid, holders)
    for name, entry in valid.robots.items():
        mount = entry.mount
        if name not in operators or (mount is not None and mount.wall is not None):
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
