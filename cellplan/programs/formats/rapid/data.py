"""Declarations of RAPID programs: data types, values that the cell states, and references to them."""

import re
from typing import Any, Final

import numpy as np

from cellplan.geometry.transforms import Array, pose, pose_from, quaternion_to_rotation
from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.units import MM
from cellplan.programs.formats.rapid.text import Datum, RapidModule, RapidStatement, value_of
from cellplan.programs.formats.rapid.units import PartFrame, RapidUnit, listed_tasks

PLACE_TOL: Final = 1e-6  # [m] of a frame in a file against that of the cell
TURN_TOL: Final = 1e-5  # [-] largest entry by which a rotation in a file may differ from that of the cell
UNIT_TOL: Final = 1e-3  # [-] by which a quaternion in a file may miss unit length

MEETING: Final = re.compile(r"waitsynctask (\w+),(\w+)", re.I)
_POSE: Final = [["n"] * 3, ["n"] * 4]
_SHAPES: Final[dict[str, Any]] = {
    "tooldata": ["b", _POSE, ["n", ["n"] * 3, ["n"] * 4, "n", "n", "n"]],
    "wobjdata": ["b", "b", "s", _POSE, _POSE],
    "speeddata": ["n"] * 4,
    "zonedata": ["b", *["n"] * 6],
}
_STORAGE: Final = {"tooldata": "pers", "wobjdata": "pers", "tasks": "pers", "syncident": "var", "triggdata": "var"}


class RapidData:
    """Declarations of all modules of one robot, each of its type.

    Attributes:
        part: Where the part is held; None for a robot without targets on it.
    """

    def __init__(self, data: dict[str, Datum], part: PartFrame | None) -> None:
        """Keep the declarations by name in lower case."""
        self._data, self.part = data, part

    def require(self, statement: RapidStatement, name: str, kind: str) -> Datum:
        """The declaration, of this type, of a name that a statement refers to."""
        get = self._data.get(name.lower())
        if get is None or get.kind != kind:
            statement.refuse(f"{kind} that is declared", name if get is None else f"{name}, which is {get.kind}")
        return get

    def target(self, statement: RapidStatement, name: str, *, is_cartesian: bool) -> str:
        """Text of a target that is declared."""
        return self.require(statement, name, "robtarget" if is_cartesian else "jointtarget").value or ""

    def require_meeting(self, statement: RapidStatement) -> None:
        """What a statement refers to at which tasks wait for one another is declared."""
        if match := MEETING.fullmatch(statement.text):
            self.require(statement, match[1], "syncident")
            self.require(statement, match[2], "tasks")

    def tasks(self, name: str) -> list[str]:
        """Names in a list of tasks."""
        return [entry[0] for entry in value_of(self._data[name])]


def read_data(
    frame: ExportFrame, unit: RapidUnit, modules: list[tuple[str, RapidModule]], part: PartFrame | None
) -> RapidData:
    """Declarations of a robot, their values compared with the cell; ``part`` is None without targets on it."""
    data: dict[str, Datum] = {}
    for _, module in modules:
        for name, datum in module.data.items():
            if name in data or name in {other.name.lower() for _, other in modules}:
                datum.statement.refuse("a name that is used once", datum.name)
            data[name] = datum
    for datum in data.values():
        _examine(frame, unit, datum, part)
    return RapidData(data, part)


def _examine(frame: ExportFrame, unit: RapidUnit, datum: Datum, part: PartFrame | None) -> None:
    """One declaration: how it is stored, the shape of its value, and what the cell says of it."""
    needed = _STORAGE.get(datum.kind)
    if needed is not None and datum.storage.removeprefix("task ") != needed:
        datum.statement.refuse(f"{needed.upper()} {datum.kind}", datum.storage.upper())
    if (datum.count is not None) is not (datum.kind == "tasks"):
        datum.statement.refuse("a number of elements in a list of tasks, and nowhere else")
    if datum.kind in {"syncident", "triggdata"}:
        if datum.value is not None:
            datum.statement.refuse(f"a {datum.kind} without a value")
        return
    if datum.value is None:
        datum.statement.refuse(f"a value of {datum.name}")
    if datum.kind in {"jointtarget", "robtarget"}:
        return  # read where it is used
    value = value_of(datum)
    if datum.kind == "tasks":
        _examine_tasks(frame, unit, datum, value)
        return
    if not _has_shape(value, _SHAPES[datum.kind]):
        datum.statement.refuse(f"a value of {datum.kind}")
    if datum.kind == "tooldata":
        _examine_tool(unit, datum, value)
    elif datum.kind == "wobjdata" and frame.promise is not Promise.PACED:  # or else compared where it is used
        _examine_work_object(datum, value, part)
    elif datum.kind == "speeddata" and not all(number > 0.0 for number in value):
        datum.statement.refuse("speeds above 0")
    elif datum.kind == "zonedata" and not all(number >= 0.0 for number in value[1:]):
        datum.statement.refuse("zones of 0 or more")


def _examine_tasks(frame: ExportFrame, unit: RapidUnit, datum: Datum, value: Any) -> None:
    """A list of tasks names those of all robots that move together, or wait for one another without wires."""
    expected = listed_tasks(frame, unit.robot.name)
    if not expected:
        datum.statement.refuse("no list of tasks in programs that are not synchronised")
    if not _has_shape(value, [["s"]] * len(expected)) or datum.count != len(expected):
        datum.statement.refuse(f"a list of {len(expected)} tasks")
    names = [entry[0] for entry in value]
    if sorted(names) != sorted(expected):
        datum.statement.refuse(f"the tasks {', '.join(expected)}", ", ".join(names))


def _examine_tool(unit: RapidUnit, datum: Datum, value: Any) -> None:
    """Tool data hold the tool of the robot, and a load."""
    if value[0] is not True:
        datum.statement.refuse("a tool that the robot holds", "FALSE")
    if not value[2][0] > 0.0:
        datum.statement.refuse("a mass above 0", f"{value[2][0]:g}")
    if abs(np.linalg.norm(value[2][2]) - 1.0) > UNIT_TOL:
        datum.statement.refuse("a quaternion of unit length in the load")
    _require_frame(datum, value[1], unit.X_GT, what="the tool of the cell")


def _examine_work_object(datum: Datum, value: Any, part: PartFrame | None) -> None:
    """A work object is that of the part, moved by the unit that holds it."""
    if part is None:
        datum.statement.refuse("no work object in a program of joint targets")
    if value[0] is not False or value[1] is not False:
        datum.statement.refuse("FALSE,FALSE: held by another unit, with a user frame that moves")
    if value[2] != part.unit:
        datum.statement.refuse(f'the mechanical unit "{part.unit}"', f'"{value[2]}"')
    _require_frame(datum, value[3], pose(), what="the identity as user frame")
    _require_frame(datum, value[4], part.X_GP, what="the part in the flange frame as object frame")


def _require_frame(datum: Datum, value: Any, X: Array, *, what: str) -> None:
    """A frame in a file is that of the cell but for its decimals."""
    if abs(np.linalg.norm(value[1]) - 1.0) > UNIT_TOL:
        datum.statement.refuse("a quaternion of unit length")
    read = pose_from(quaternion_to_rotation(np.array(value[1])), np.array(value[0]) / MM)
    if np.max(np.abs(read[:3, 3] - X[:3, 3])) > PLACE_TOL or np.max(np.abs(read - X)[:3, :3]) > TURN_TOL:
        datum.statement.refuse(what)


def _has_shape(value: Any, shape: Any) -> bool:
    """Whether a value is made of the same lists, booleans, texts and numbers."""
    if isinstance(shape, list):
        return (
            isinstance(value, list)
            and len(value) == len(shape)
            and all(_has_shape(item, part) for item, part in zip(value, shape, strict=True))
        )
    if shape == "n":
        return isinstance(value, float) and abs(value) < 9e9
    return isinstance(value, bool if shape == "b" else str)
