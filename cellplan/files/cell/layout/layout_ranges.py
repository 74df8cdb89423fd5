"""Ranges of a layout: each number of a cell file that may change, with its bounds in SI units."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from cellplan.files.cell.layout.layout_addresses import Address
from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, listed, shown
from cellplan.files.robots.rules import start_posture
from cellplan.files.schema.partial import ValidEntries
from cellplan.files.schema.robot import WEIGHT_RANGE, RobotEntry
from cellplan.files.schema.tool import RodEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.cell.layout import VariableKind, VaryRange
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.entry import PoseEntry
from cellplan.model.settings.units import Deg, Mm

KINDS: Final[Mapping[str, VariableKind]] = {
    "base": VariableKind.BASE,
    "tool": VariableKind.TOOL,
    "start_deg": VariableKind.START,
    "start": VariableKind.START,
    "weights": VariableKind.WEIGHT,
    "spin_deg": VariableKind.SPIN,
    "grasp": VariableKind.GRASP,
    "part": VariableKind.PART,
}
WEIGHT_FACTOR: Final = 20.0  # [-] by which weights change where no range is given
LIMIT_TOL: Final = 1e-9  # [rad] or [m] by which a range may exceed the limits of a joint: rounding of degrees
ALL: Final = "a range [low, high]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Context:
    """What ranges are read against: the entries of the file, the models of its robots, the file itself."""

    valid: ValidEntries
    models: Mapping[str, RobotModel]
    document: YamlDocument


RangeOrFinding = VaryRange | Finding


def read_ranges(address: Address, value: Any, path: KeyPath, context: Context) -> Iterator[RangeOrFinding]:
    """Ranges that a value under ``layout.vary`` gives, and what is wrong with it.

    The value is true, a range, a list of ranges by joint, or a mapping of ranges.
    """
    finding = context.document.finding
    if address.index is not None or address.what in {"spin_deg", "weights"}:
        yield from _of_one_range(address, value, path, context)
    elif value is True:
        yield from _of_true(address, path, context)
    elif isinstance(value, Mapping):
        for key, bounds in value.items():
            place = (*path, key)
            if key not in address.keys:
                text = f"unknown key{did_you_mean(key, address.keys)}; allowed: {listed(address.keys) or 'none'}"
                yield context.document.key_finding(place, text)
            elif not isinstance(bounds, tuple):
                yield finding(place, f"expected {ALL}, got {shown(bounds)}")
            else:
                yield range_at(address, address.keys.index(key), (bounds, place), context)
    elif address.what == "start_deg":
        yield from _by_joint(address, value, path, context)
    else:
        yield finding(path, f"expected a mapping of ranges ({listed(address.keys)}), got {shown(value)}")


def _of_one_range(address: Address, value: Any, path: KeyPath, context: Context) -> Iterator[RangeOrFinding]:
    """A range for one number, or for all weights of a robot alike."""
    if value is True and address.what in {"spin_deg", "weights", "start", "start_deg"}:
        yield from _of_true(address, path, context)
    elif isinstance(value, tuple) and len(value) == 2 and all(isinstance(item, int | float) for item in value):
        for index in range(len(address.parts)) if address.index is None else (address.index,):
            yield range_at(address, index, (value, path), context)
    else:
        words = f"true or {ALL}" if address.what in {"spin_deg", "weights", "start", "start_deg"} else ALL
        yield context.document.finding(path, f"expected {words}, got {shown(value)}")


def _of_true(address: Address, path: KeyPath, context: Context) -> Iterator[RangeOrFinding]:
    """The whole range of each number."""
    if address.what in {"tool", "grasp", "part", "base"}:
        text = f"expected a mapping of ranges ({listed(address.keys)}), got true"
        yield context.document.finding(path, text)
        return
    for index in range(len(address.parts)) if address.index is None else (address.index,):
        yield _checked(_whole_range(address, index, context), path, context)


def _by_joint(address: Address, value: tuple[Any, ...], path: KeyPath, context: Context) -> Iterator[RangeOrFinding]:
    count = len(address.parts)
    if len(value) != count:
        yield context.document.finding(path, f"expected {count} ranges [low, high], one per joint, got {len(value)}")
        return
    for index, bounds in enumerate(value):
        if isinstance(bounds, tuple):
            yield range_at(address, index, (bounds, (*path, index)), context)
        else:
            yield context.document.finding((*path, index), f"expected {ALL}, got {shown(bounds)}")


def range_at(address: Address, index: int, at: tuple[tuple[float, float], KeyPath], context: Context) -> RangeOrFinding:
    """One range with its bounds in the unit of the file, and the place where they stand."""
    bounds, path = at
    low, high = bounds
    if not low < high:
        return context.document.finding((*path, 1), f"expected a number above {low:g}, got {high:g}")
    given, is_angle = _given(address, index, context)
    lower, upper = (in_si_of(address, bound, is_angle=is_angle) for bound in (low, high))
    range_ = _named(address, index, (lower, upper), given=given, is_angle=is_angle)
    return _checked(range_, path, context)


def in_si_of(address: Address, value: float, *, is_angle: bool) -> float:
    """A bound in SI units; weights have none."""
    if address.what == "weights":
        return value
    return Deg(value).si if is_angle else Mm(value).si


def _named(
    address: Address, index: int, bounds: tuple[float, float], *, given: float | None, is_angle: bool
) -> VaryRange:
    return VaryRange(
        address=f"{address.group}{address.parts[index]}",
        kind=KINDS[address.what],
        name=address.name,
        index=index,
        is_angle=is_angle,
        lower=bounds[0],
        upper=bounds[1],
        given=given,
    )


def _given(address: Address, index: int, context: Context) -> tuple[float | None, bool]:
    """Value of a number in the file in SI units, None where it is to be found; and whether it is an angle."""
    valid, name = context.valid, address.name
    if address.what == "spin_deg":
        return valid.tasks[name].spin_deg.si, True
    if address.what in {"grasp", "part"}:
        held = {grasp.robot: grasp.at for grasp in valid.part.held_by} if valid.part else {}
        pose = held.get(name) if address.what == "grasp" else valid.part and valid.part.at
        return _of_pose(pose or PoseEntry(), index)
    entry, model = valid.robots[name], context.models[name]
    if address.what == "base":
        return _of_pose(entry.base, index)
    if address.what == "tool":
        rod = _rod(entry)
        return (rod.length_mm.si, rod.tilt_deg.si, rod.roll_deg.si)[index], index > 0
    if address.what == "weights":
        return 1.0 if entry.weights is None else entry.weights[index], False
    start = start_posture(entry, model)
    return None if start is None else float(start[index]), model.joints[index].is_revolute


def _of_pose(pose: PoseEntry, index: int) -> tuple[float, bool]:
    """A component of a pose in SI units, and whether it is an angle."""
    return (pose.xyz_mm[index].si, False) if index < 3 else (pose.rpy_deg[index - 3].si, True)


def _rod(entry: RobotEntry) -> RodEntry:
    if entry.tool.rod is None:
        raise ValueError("a tool without a rod")
    return entry.tool.rod


def _whole_range(address: Address, index: int, context: Context) -> VaryRange:
    """A number in all the range that it may have."""
    given, is_angle = _given(address, index, context)
    lower, upper = -math.pi, math.pi
    if address.what == "weights":
        weight = 1.0 if given is None else given
        lower, upper = max(weight / WEIGHT_FACTOR, WEIGHT_RANGE[0]), min(weight * WEIGHT_FACTOR, WEIGHT_RANGE[1])
    elif address.what != "spin_deg":
        joint = context.models[address.name].joints[index]
        about = 0.0 if given is None else given
        lower = joint.lower if math.isfinite(joint.lower) else about - math.pi
        upper = joint.upper if math.isfinite(joint.upper) else about + math.pi
    return _named(address, index, (lower, upper), given=given, is_angle=is_angle)


def _checked(range_: VaryRange, path: KeyPath, context: Context) -> RangeOrFinding:
    """The range, or what does not go with its bounds."""
    text = _refusal(range_, context)
    return range_ if text is None else context.document.finding(path, text)


def _refusal(range_: VaryRange, context: Context) -> str | None:
    """What is wrong with the bounds of a range; None if nothing is."""
    valid, name = context.valid, range_.name
    text = None
    match range_.kind:
        case VariableKind.BASE if range_.index in {3, 4} and _stays_upright(valid.robots[name]):
            text = "expected no range of roll or pitch for a base so mounted; to tilt it, use mount: {tilted: …}"
        case VariableKind.TOOL:
            shortest = _rod(valid.robots[name]).shortest_mm
            if range_.index == 0 and range_.lower <= Mm(shortest).si:
                text = f"expected lengths above {shortest:g} mm, which leave a rod between its round ends"
            elif range_.index == 1 and max(-range_.lower, range_.upper) > math.pi:
                text = "expected angles from -180 to 180 deg"
        case VariableKind.WEIGHT if not WEIGHT_RANGE[0] <= range_.lower < range_.upper <= WEIGHT_RANGE[1]:
            text = f"expected weights from {WEIGHT_RANGE[0]:g} to {WEIGHT_RANGE[1]:g}"
        case VariableKind.START:
            text = _start_refusal(range_, context)
        case VariableKind.SPIN if valid.tasks[name].free:
            text = "expected a task whose spin is prescribed, got one with free: [spin]; leave out one of them"
        case VariableKind.SPIN if (
            valid.program is None and [task.robot for task in valid.tasks.values()].count(valid.tasks[name].robot) > 1
        ):
            text = "expected a task of a robot that has no other, or a program, got one of several"
        case VariableKind.PART if any(it.relative_to == "world" for it in valid.tasks.values()):
            text = "expected tasks on the part only, got one that is relative to the world"
    return text


def _stays_upright(entry: RobotEntry) -> bool:
    """Whether the base is mounted so that it cannot be tilted."""
    return entry.pedestal is not None or (entry.mount is not None and entry.mount.tilted is None)


def _start_refusal(range_: VaryRange, context: Context) -> str | None:
    """What is wrong with the range of a joint at the start; None if nothing is."""
    name, model = range_.name, context.models[range_.name]
    joint, unit = model.joints[range_.index], Deg if range_.is_angle else Mm
    if not range_.address.startswith(f"robots.{name}.start_deg") and all(joint.is_revolute for joint in model.joints):
        return f"expected {name}.start_deg, as all joints of '{name}' turn"
    if range_.address.startswith(f"robots.{name}.start_deg") and not all(joint.is_revolute for joint in model.joints):
        return f"expected {name}.start: {{…}} with one key per joint, as not all joints of '{name}' turn"
    if range_.lower < joint.lower - LIMIT_TOL or range_.upper > joint.upper + LIMIT_TOL:
        scale = 1000.0 if unit is Mm else math.degrees(1.0)
        limits = f"{joint.lower * scale:g} to {joint.upper * scale:g} {'deg' if range_.is_angle else 'mm'}"
        return f"expected a range within the limits of the joint '{joint.name}', {limits}"
    if _follows(name, model, context.valid):
        return (
            f"expected a robot that holds the part, or one with more joints than its task prescribes: the start of "
            f"'{name}' follows from its task; write {name}.branch: true to try all branches of it"
        )
    return None


def _follows(name: str, model: RobotModel, valid: ValidEntries) -> bool:
    """Whether a robot has no start posture of its own to choose: its tool is where its task or grasp puts it."""
    held = valid.part.held_by if valid.part is not None else ()
    if any(grasp.robot == name for grasp in held[:1]):
        return False
    counts = [len(task.axes) - bool(task.free) for task in valid.tasks.values() if task.robot == name]
    counts += [len(grasp.axes) for grasp in held if grasp.robot == name]
    return not counts or len(model.joints) <= min(counts)
