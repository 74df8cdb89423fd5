"""Data of VAL3 projects: arrays of values, refused with file and line where they are others."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from cellplan.errors import InputError
from cellplan.programs.formats.val3.names import BASE, FLANGE, NAME, PART, TOOL_NAME
from cellplan.programs.formats.val3.xml import DATA_SPACE, TYPE, Val3Element, parse

_JOINTS: Final = tuple(f"j{axis}" for axis in range(1, 7))
_POSE: Final = ("x", "y", "z", "rx", "ry", "rz")
_SHARES: Final = ("accel", "vel", "decel", "tmax", "rmax", "leave", "reach")
_FATHERS: Final = {"tool": FLANGE, "frame": BASE}
_BLENDS: Final = ("off", "joint", "Cartesian")


class _Kind(NamedTuple):
    """Attributes that the values of a type may have."""

    numbers: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()  # texts that must be there
    texts: tuple[str, ...] = ()  # texts that may be absent


_KINDS: Final = {
    "jointRx": _Kind(_JOINTS),
    "tool": _Kind(_POSE, needed=("fatherId",), texts=("ioLink",)),
    "frame": _Kind(_POSE, needed=("fatherId",)),
    "pointRx": _Kind(_POSE, needed=("fatherId",)),
    "mdesc": _Kind(_SHARES, texts=("blend",)),
    "dio": _Kind(needed=("link",)),
    "num": _Kind(("value",)),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Data:
    """An array of values."""

    element: Val3Element  # where it is declared
    kind: str  # type of its values
    values: Sequence[Mapping[str, str]]  # attributes of each value; one that is missing has its default

    @property
    def size(self) -> int:
        """Number of values."""
        return len(self.values)

    def error(self, expected: str, got: str) -> InputError:
        """An error at its declaration."""
        return self.element.error(expected, got)


def read_data(text: str, file: str) -> dict[str, Data]:
    """Data of a project by name."""
    database = parse(text, file, "Database", DATA_SPACE)
    database.require()
    database.only("Datas")
    variables: dict[str, Data] = {}
    for element in database.one("Datas").only("Data"):
        name, data = _data(element)
        if name in variables:
            raise element.error("names that differ", name)
        variables[name] = data
    return variables


def _data(element: Val3Element) -> tuple[str, Data]:
    """One array."""
    element.require(needed=("name", TYPE, "type", "size"), allowed=("access",))
    attributes = element.attributes
    name, kind, size = attributes["name"], attributes["type"], attributes["size"]
    longest = TOOL_NAME if kind == "tool" else NAME
    if (
        kind not in _KINDS
        or attributes[TYPE] != "array"
        or attributes.get("access", "public") not in {"public", "private"}
    ):
        raise element.error(f"a public or private array of one of {', '.join(_KINDS)}", f"{attributes[TYPE]} of {kind}")
    if not re.fullmatch(rf"[A-Za-z]\w{{0,{longest - 1}}}", name, re.ASCII):
        raise element.error(f"a name of at most {longest} letters and digits", name)
    if not re.fullmatch(r"[1-9][0-9]{0,6}", size):
        raise element.error("a size of 1 or more", size)
    values = element.only("Value")
    if len(values) != int(size) and (values or kind not in {"num", "mdesc"}):
        raise element.error(f"{size} values as its size says", str(len(values)))
    read = [_value(value, key, kind) for key, value in enumerate(values)]
    return name, Data(element=element, kind=kind, values=read or [{}] * int(size))


def _value(value: Val3Element, key: int, kind: str) -> Mapping[str, str]:
    """Attributes of one value."""
    numbers, needed, texts = _KINDS[kind]
    value.require(needed=("key", *needed), allowed=(*numbers, *texts))
    value.only()
    attributes = value.attributes
    if attributes["key"] != str(key):
        raise value.error(f'key="{key}"', attributes["key"])
    for name in numbers:
        if name in attributes and not re.fullmatch(r"-?[0-9]{1,7}(?:\.[0-9]{1,12})?", attributes[name]):
            raise value.error(f"a plain decimal number as {name}", attributes[name])
    if kind == "pointRx" and not re.fullmatch(rf"{PART}\[[0-9]{{1,3}}\]", attributes["fatherId"]):
        raise value.error(f'fatherId="{PART}[…]"', attributes["fatherId"])
    if kind in _FATHERS and attributes["fatherId"] != _FATHERS[kind]:
        raise value.error(f'fatherId="{_FATHERS[kind]}"', attributes["fatherId"])
    if kind == "mdesc":
        if not 0.0 < float(attributes.get("vel", "100")) <= 100.0:
            raise value.error("a speed above 0 and up to 100", attributes["vel"])
        if attributes.get("blend", "off") not in _BLENDS:
            raise value.error(f"one of {', '.join(_BLENDS)}", attributes["blend"])
    return attributes
