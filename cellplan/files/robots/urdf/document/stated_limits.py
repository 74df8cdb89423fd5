"""Limits that a joint of a URDF states: ``<limit>`` with acceleration and jerk, and ``<safety_controller>``."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from cellplan.files.input.findings import listed
from cellplan.files.robots.limits import LIMIT_TOL, StatedLimits, rates_of, tightest
from cellplan.files.robots.urdf.document.xml import Element, Remarks
from cellplan.model.units import joint_unit

TWO_TURNS: Final = 4.0 * np.pi  # [rad] limits beyond two turns each way are rare
MAX_RANGE: Final = 20.0 * np.pi  # [rad] limits beyond ten turns each way are mistakes of the unit
MAX_TRAVEL: Final = 20.0  # [m]
MAX_TURN_SPEED: Final = 100.0  # [rad/s] the fastest wrists reach 20
MAX_TRAVEL_SPEED: Final = 10.0  # [m/s]
INFINITE: Final = frozenset(sign + word for sign in ("", "+", "-") for word in ("inf", "infinity"))
DEGREES: Final = "expected position limits within {} turns, got {:g} rad (is the unit degrees?)"


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfLimit:
    """Limits as far as the file gives usable ones, in [rad] or [m] and their rates."""

    lower: float | None = None  # lowest position
    upper: float | None = None  # highest position
    velocity: float | None = None  # largest velocity
    acceleration: float | None = None  # largest acceleration, of speeding up and of slowing down
    jerk: float | None = None  # largest jerk
    torque: float | None = None  # largest torque or force; a cell decides whether the effort counts as such
    soft: StatedLimits = field(default_factory=StatedLimits)  # what the controller keeps within these limits
    position_fault: str = ""  # what is wrong with the positions of the file, if they were not taken for that
    velocity_fault: str = ""  # what is wrong with its velocity, if it was not taken for that

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest position that the joint can reach; infinite where the file gives none."""
        return -np.inf if self.lower is None else self.lower, np.inf if self.upper is None else self.upper

    @property
    def stated(self) -> StatedLimits:
        """All limits, the tighter of each kind."""
        return tightest(StatedLimits(**rates_of(self)), self.soft)


def read_limit(joint: Element, owner: str, *, kind: str, remarks: Remarks) -> UrdfLimit:
    """Limits of a joint; what leaves no room, is not positive or is beyond all machines goes into the remarks."""
    limit = joint.one("limit", owner)
    if kind == "fixed":
        return UrdfLimit()
    stated = UrdfLimit() if limit is None else _hard(limit, owner, kind=kind, remarks=remarks)
    controller = joint.one("safety_controller", owner)
    if controller is None:
        return stated
    names = ("soft_lower_limit", "soft_upper_limit")
    lower, upper = (_optional(controller, name, owner) for name in names)
    if kind == "continuous":
        if lower is not None or upper is not None:
            remarks.add("soft, continuous", f"{owner}: is continuous: its soft limits were not used", controller)
        return stated
    soft, fault = within_range(stated, lower, upper, slides=kind == "prismatic")
    if fault:
        remarks.add("soft", f"{owner}: soft limits {fault}", controller)
    return replace(stated, soft=soft)


def within_range(
    limit: UrdfLimit, lower: float | None, upper: float | None, *, slides: bool
) -> tuple[StatedLimits, str]:
    """A narrower range, None where no end is stated, as far as it makes sense, and what was not used of it."""
    unit, (lowest, highest) = joint_unit(is_revolute=not slides), limit.ends
    low, high = -np.inf if lower is None else lower, np.inf if upper is None else upper
    texts = [f"{unit.scale * value:.6g}" for value in (low, high)]
    if low >= high:
        return StatedLimits(), f"{texts[0]} to {texts[1]} {unit.name} leave no range and were not used"
    is_inside = [lowest - LIMIT_TOL <= end <= highest + LIMIT_TOL for end in (low, high)]
    given = [end is not None for end in (lower, upper)]
    soft = StatedLimits(lower=lower if is_inside[0] else None, upper=upper if is_inside[1] else None)
    outside = [text for text, fits, is_given in zip(texts, is_inside, given, strict=True) if is_given and not fits]
    return soft, f"outside the range of the joint ({listed(outside)} {unit.name}) were not used" if outside else ""


def without_slips_of_unit(turning: Sequence[tuple[str, Element, UrdfLimit]], remarks: Remarks) -> Iterator[UrdfLimit]:
    """The limits of turning joints; ranges of several turns count only where they are not a whole file's degrees."""
    widths = [max(map(abs, limit.ends)) for _, _, limit in turning if limit.lower is not None]
    wide = sum(width > TWO_TURNS for width in widths)
    is_slip = 1 < len(widths) < 2 * wide or any("degrees" in limit.position_fault for _, _, limit in turning)
    for name, element, limit in turning:
        width = 0.0 if limit.lower is None else max(map(abs, limit.ends))
        if width > TWO_TURNS and is_slip:
            fault = DEGREES.format("two", width)
            yield replace(limit, lower=None, upper=None, soft=StatedLimits(), position_fault=fault)
            continue
        if width > TWO_TURNS:
            text = f"joint '{name}': has a range of several turns, {np.degrees(width):.6g} deg (is its unit rad?)"
            remarks.add("several turns", text, element)
        yield limit


def _hard(limit: Element, owner: str, *, kind: str, remarks: Remarks) -> UrdfLimit:
    """What ``<limit>`` states."""
    velocity = _bound(limit, "velocity", owner)
    fastest, unit = (MAX_TRAVEL_SPEED, "m/s") if kind == "prismatic" else (MAX_TURN_SPEED, "rad/s")
    if velocity > fastest:
        hint = "mm/s" if kind == "prismatic" else "deg/s"
        fault = f"expected a velocity limit of at most {fastest:g} {unit}, got {velocity:g} {unit} (is it in {hint}?)"
        speed = UrdfLimit(velocity_fault=fault)
    else:
        speed = UrdfLimit(velocity=velocity if velocity > 0.0 else None)
    rates = {name: _rate(limit, name, owner, remarks) for name in ("acceleration", "deceleration", "jerk")}
    ramps = [rate for rate in (rates["acceleration"], rates["deceleration"]) if rate is not None]
    if rates["deceleration"] is not None and rates["deceleration"] != rates["acceleration"]:
        text = f"{owner}: the smaller one of acceleration and deceleration counts for both"
        remarks.add("deceleration", text, limit)
    speed = replace(speed, acceleration=min(ramps, default=None), jerk=rates["jerk"])
    if kind == "continuous":
        return speed
    lower, upper = (_bound(limit, name, owner) for name in ("lower", "upper"))
    fault = _position_fault(lower, upper, slides=kind == "prismatic")
    if fault or lower == upper:
        return replace(speed, position_fault=fault)
    return replace(speed, lower=lower, upper=upper)


def _rate(limit: Element, name: str, owner: str, remarks: Remarks) -> float | None:
    """An acceleration or jerk; None where none is stated."""
    value = _optional(limit, name, owner)
    if value is None or value > 0.0:
        return None if value is None or np.isinf(value) else value
    remarks.add(f"{name} not positive", f"{owner}: {name} {value:g} is not positive and was not used", limit)
    return None


def _bound(limit: Element, name: str, owner: str) -> float:
    """One limit, which may be infinite; zero when it is absent."""
    value = _optional(limit, name, owner)
    return 0.0 if value is None else value


def _optional(element: Element, name: str, owner: str) -> float | None:
    """A limit, which may be infinite; None when it is absent."""
    written = element.attributes.get(name)
    if written is None:
        return None
    return float(written) if written.strip().lower() in INFINITE else element.number(name, owner)


def _position_fault(lower: float, upper: float, *, slides: bool) -> str:
    """What is wrong with a pair of position limits: their order, or their unit; empty for nothing."""
    largest = max(abs(lower), abs(upper))
    if largest > (MAX_TRAVEL if slides else MAX_RANGE):
        metres = "expected position limits within 20 m, got {:g} m (is the unit mm?)"
        return metres.format(largest) if slides else DEGREES.format("ten", largest)
    return f"expected 'lower' below 'upper', got {lower:g} and {upper:g}" if lower > upper else ""
