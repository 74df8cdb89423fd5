"""Addresses of a layout: what of a cell file a search may change."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from cellplan.files.cell.changes import COMPONENTS
from cellplan.files.input.findings import did_you_mean, listed, shown, unknown_name
from cellplan.files.schema.partial import ValidEntries
from cellplan.model.robot.robot import RobotModel, start_keys

OF_ROBOT: Final = ("base", "tool", "start_deg", "start", "weights", "path", "branch")
OF_TASK: Final = ("spin_deg", "robot")
ROD: Final = ("length_mm", "tilt_deg", "roll_deg")
FORMS: Final = (
    *(f"ROBOT.{what}" for what in OF_ROBOT),
    *(f"tasks.TASK.{what}" for what in OF_TASK),
    "part.held_by[0].at",
    "part.at",
    "motion.mode",
    "null_space",
)
ROBOT: Final = re.compile(r"(?:robots\.)?([^.\[\]]+)\.([^.\[\]]+)(.*)")
TASK: Final = re.compile(r"tasks\.([^.\[\]]+)\.([^.\[\]]+)(.*)")
GRASP: Final = re.compile(r"part\.held_by\[([0-9]{1,3})\]\.at(.*)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """Something of a cell file, or one number of it."""

    group: str  # what the number belongs to, as the file addresses it: ``robots.kuka.base``
    what: str  # its kind: the last key of the address as it may be written in a layout
    name: str  # robot or task; empty for the part at rest and the mode
    parts: tuple[str, ...] = ()  # endings of the addresses of all its numbers, such as ``.x_mm`` or ``[0]``
    keys: tuple[str, ...] = ()  # what these numbers are called in a mapping of ranges
    index: int | None = None  # which of them it is; None for all

    @property
    def numbers(self) -> tuple[str, ...]:
        """Addresses of all numbers that it names."""
        parts = self.parts if self.index is None else (self.parts[self.index],)
        return tuple(f"{self.group}{part}" for part in parts)


class AddressError(Exception):
    """An address leads to nothing that a layout may change; the argument says why."""


def read_address(text: str, valid: ValidEntries, models: Mapping[str, RobotModel]) -> Address | None:
    """What an address, with or without ``robots.``, names; None for a robot or a part that has findings of its own.

    ``AddressError`` where it names nothing that a layout may change.
    """
    if text in {"motion.mode", "null_space"}:
        return Address(group=text, what=text.removeprefix("motion."), name="")
    if text.startswith("tasks."):
        return _of_task(text, valid)
    if text.startswith("part."):
        return _of_part(text, valid)
    match = ROBOT.fullmatch(text)
    if match is None or match[2] not in OF_ROBOT:
        raise AddressError(f"expected one of {listed(FORMS)}, got {shown(text)}{did_you_mean(text, FORMS)}")
    name, what, rest = match.groups()
    if name not in valid.names["robots"]:
        raise AddressError(unknown_name("a robot of this cell", name, valid.names["robots"]))
    if name not in valid.robots or name not in models:
        return None
    if what == "tool":
        return _of_tool(text, name, rest, valid)
    return _narrowed(_of_robot(name, what, models[name]), rest, text)


def _of_robot(name: str, what: str, model: RobotModel) -> Address:
    """All numbers of a robot that a key stands for."""
    group, keys = f"robots.{name}.{what}", tuple(COMPONENTS) if what == "base" else ()
    parts = tuple(f".{key}" for key in keys)
    if what in {"start_deg", "weights"}:
        parts = tuple(f"[{index}]" for index in range(len(model.joints)))
    elif what == "start":
        keys = start_keys(model)
        parts = tuple(f".{key}" for key in keys)
    return Address(group=group, what=what, name=name, parts=parts, keys=keys)


def _of_tool(text: str, name: str, rest: str, valid: ValidEntries) -> Address:
    """Numbers of a tool with a rod."""
    if valid.robots[name].tool.rod is None:
        raise AddressError(
            f"expected a tool with a rod, got one whose tip is given by its pose; write robots.{name}.tool: {{rod: "
            "{length_mm: …, tilt_deg: …, roll_deg: …, radius_mm: …}}, so that its solids follow"
        )
    parts = tuple(f".{key}" for key in ROD)
    address = Address(group=f"robots.{name}.tool.rod", what="tool", name=name, parts=parts, keys=ROD)
    return _narrowed(address, rest.removeprefix(".rod"), text)


def _of_task(text: str, valid: ValidEntries) -> Address | None:
    """The spin of a task, or who does it."""
    match = TASK.fullmatch(text)
    if match is None or match[2] not in OF_TASK or match[3]:
        raise AddressError(f"expected tasks.TASK.spin_deg or tasks.TASK.robot, got {shown(text)}")
    name, what, _ = match.groups()
    if name not in valid.names["tasks"]:
        raise AddressError(unknown_name("a task of this cell", name, valid.names["tasks"]))
    if name not in valid.tasks:
        return None
    parts = ("",) if what == "spin_deg" else ()
    return Address(group=text, what=what, name=name, parts=parts, keys=parts)


def _of_part(text: str, valid: ValidEntries) -> Address | None:
    """A grasp, or the pose of the part at rest."""
    if valid.part is None:
        return None
    keys, match = tuple(COMPONENTS), GRASP.fullmatch(text)
    parts, held = tuple(f".{key}" for key in keys), valid.part.held_by
    if match is not None:
        if int(match[1]) >= len(held):
            raise AddressError(f"expected part.held_by[I].at with I below {len(held)}, got {shown(text)}")
        name = held[int(match[1])].robot
        return _narrowed(
            Address(group=f"part.held_by[{int(match[1])}].at", what="grasp", name=name, parts=parts, keys=keys),
            match[2],
            text,
        )
    if not text.startswith("part.at"):
        raise AddressError(f"expected part.held_by[0].at or part.at, got {shown(text)}")
    if held:
        raise AddressError("expected part.held_by[0].at, as the part is held, got part.at")
    return _narrowed(Address(group="part.at", what="part", name="", parts=parts, keys=keys), text[7:], text)


def _narrowed(address: Address, rest: str, text: str) -> Address:
    """One number of what an address names, or all of them where nothing follows."""
    if not rest:
        return address
    if rest not in address.parts:
        known = [f"{address.group}{part}" for part in address.parts] or [address.group]
        raise AddressError(f"expected one of {listed(known)}, got {shown(text)}{did_you_mean(text, known)}")
    return replace(address, index=address.parts.index(rest))
