"""Discrete choices of a layout, and joint paths of positioners that may change."""

from collections.abc import Mapping
from typing import Any, Final, get_args

from cellplan.io.cell.layout_addresses import Address
from cellplan.io.cell.layout_ranges import Context
from cellplan.io.input.findings import Finding, KeyPath, did_you_mean, listed, shown, unknown_name
from cellplan.io.schema.cell import MotionEntry
from cellplan.model.layout import ChoiceKind, LayoutChoice, PathRange

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
    if value is True:
        return PathRange(robot=address.name)
    if not isinstance(value, Mapping):
        return context.document.finding(path, f"expected true or {{coefficients: 14, degree: 5}}, got {shown(value)}")
    return _wrong_spline(value, path, context) or PathRange(robot=address.name, **value)


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
