"""Moves of RAPID: which instruction, with which references, numbered and timed as MultiMove needs it."""

import re
from typing import Final, NamedTuple

from cellplan.programs.formats.rapid.data import RapidData
from cellplan.programs.formats.rapid.text import RapidStatement, value_of
from cellplan.programs.formats.rapid.units import RapidUnit

_NUMBER: Final = r"-?[0-9]{1,9}(?:\.[0-9]{1,12})?"
_MOVE: Final = re.compile(
    r"(moveabsj|moveextj|movel)(?: (\w+)|(\[\[[^\]]*\](?:,\[[^\]]*\])+\]))"
    rf"(?:\\id:=([0-9]{{1,8}}))?,(\w+)(?:\\t:=({_NUMBER}))?,(\w+)(?:,(\w+))?(?:\\wobj:=(\w+))?",
    re.I,
)
_SPEEDS: Final = frozenset(
    f"v{speed}" for speed in (5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000)
)
_EXTENDED: Final = {0: 0.3, 1: 1.0, 5: 8.0, 10: 15.0, 15: 23.0, 20: 30.0, 30: 45.0, 40: 60.0, 50: 75.0} | {
    size: 1.5 * size for size in (60, 80, 100, 150, 200)
}  # [mm] zones of the language with the size in which axes and orientation are rounded
TURN: Final = 0.1  # [deg] of a turn for each [mm] of a zone, as the zones of the language have it
_FINE: Final = "fine"
LARGEST_ID: Final = 2**24  # whole numbers up to it are exact in a num of the controller


class Place(NamedTuple):
    """Where a move stands in its program."""

    is_first: bool  # whether it is the first move
    is_between: bool  # whether it stands between ``SyncMoveOn`` and ``SyncMoveOff``
    is_synchronised: bool  # whether the program has these


class Zone(NamedTuple):
    """How near to a target another motion begins."""

    tool: float  # distance of the tool in [mm]
    turn: float  # of turning external axes in [deg]
    slide: float  # of sliding external axes in [mm]


STOP: Final = Zone(0.0, 0.0, 0.0)


class RapidMove(NamedTuple):
    r"""A move of a program."""

    statement: RapidStatement  # where it stands
    target: str  # text of its target
    is_cartesian: bool  # whether this is a target on the part
    number: int | None  # its ``\ID``; None without one
    duration: float  # its ``\T`` in [s]; 0 for the first move
    zone: Zone  # how it is rounded

    @property
    def is_fine(self) -> bool:
        """Whether it ends in a stop point."""
        return self.zone == STOP


def read_move(statement: RapidStatement, unit: RapidUnit, data: RapidData, place: Place) -> RapidMove:
    """One move; everything that it refers to is declared."""
    match = _MOVE.fullmatch(statement.text)
    if match is None:
        statement.refuse("a move")
    kind, named, target, number, speed, duration, zone, tool, work_object = match.groups()
    is_cartesian, is_fine = kind.lower() == "movel", zone.lower() == _FINE
    _require_kind(statement, kind, unit, data, place)
    if named is not None:
        target = data.target(statement, named, is_cartesian=is_cartesian)
    row_number = _number(statement, number, place)
    seconds = _duration(statement, duration, place)
    if place.is_first and not is_fine:
        statement.refuse("fine in the first move", zone)
    if speed.lower() not in _SPEEDS:
        data.require(statement, speed, "speeddata")
    blend = STOP if is_fine else _zone(statement, zone, data)
    _require_frames(statement, unit, data, tool=tool, work_object=work_object, is_cartesian=is_cartesian)
    return RapidMove(statement, target, is_cartesian, row_number, seconds, blend)


def _zone(statement: RapidStatement, name: str, data: RapidData) -> Zone:
    """A zone of the language, or one that is declared; what is rounded most of tool, orientation and axes counts."""
    if name.lower().startswith("z") and name[1:].isdigit() and int(name[1:]) in _EXTENDED:
        size = _EXTENDED[int(name[1:])]
        return Zone(size, TURN * size, size)
    is_fine, *sizes = value_of(data.require(statement, name, "zonedata"))
    if is_fine:
        statement.refuse("a zone that rounds, or fine", name)
    return Zone(max(sizes[:3]), sizes[5], sizes[4])


def _require_kind(statement: RapidStatement, kind: str, unit: RapidUnit, data: RapidData, place: Place) -> None:
    """A positioner moves its external axes; an arm its joints, or its tool on the part while robots are in step."""
    allowed = ["MoveAbsJ"] if unit.has_tool else ["MoveExtJ"]
    if unit.has_tool and data.part is not None and place.is_between:
        allowed.append("MoveL")
    if kind.lower() not in {kind.lower() for kind in allowed}:
        statement.refuse(f"{' or '.join(allowed)} of robot '{unit.robot.name}' here", kind)


def _number(statement: RapidStatement, number: str | None, place: Place) -> int | None:
    r"""The ``\ID`` of a move, which it has if and only if other tasks move with it."""
    if place.is_synchronised and not place.is_first and not place.is_between:
        statement.refuse("further moves between SyncMoveOn and SyncMoveOff")
    if place.is_between is not (number is not None):
        statement.refuse(r"\ID between SyncMoveOn and SyncMoveOff, and nowhere else")
    identifier = None if number is None else int(number)
    if identifier is not None and identifier > LARGEST_ID:
        statement.refuse(rf"\ID of at most {LARGEST_ID}", str(identifier))
    return identifier


def _duration(statement: RapidStatement, duration: str | None, place: Place) -> float:
    r"""The ``\T`` of a move in [s], which all have but the first, whose way is not known."""
    if place.is_first is not (duration is None):
        statement.refuse(r"\T with every move but the first")
    seconds = 0.0 if duration is None else float(duration)
    if duration is not None and not seconds > 0.0:
        statement.refuse(r"a duration \T above 0", duration)
    return seconds


def _require_frames(
    statement: RapidStatement,
    unit: RapidUnit,
    data: RapidData,
    *,
    tool: str | None,
    work_object: str | None,
    is_cartesian: bool,
) -> None:
    """An arm moves with its tool, and on the part with its work object."""
    if (tool is not None) is not unit.has_tool:
        statement.refuse("a tool with a move of an arm, and with no other", tool or "none")
    if tool is not None:
        data.require(statement, tool, "tooldata")
    if (work_object is not None) is not is_cartesian:
        statement.refuse(r"\WObj with targets on the part, and with no other")
    if work_object is not None:
        data.require(statement, work_object, "wobjdata")
