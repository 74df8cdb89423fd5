"""What a page may ask of the session: paths, and bodies that hold finite numbers and words of a fixed list only."""

import math
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from http import HTTPStatus
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.files.input.findings import shown
from cellplan.files.input.json_reader import parse_json

OPEN, CHANGE, DO, EVENTS = "/open", "/change", "/do", "/events"
ACTIONS: Final = frozenset(
    "undo redo reset save certify improve repair map stop take reload keep end".split()  # noqa: SIM905
)
FIELDS: Final = {
    OPEN: {"tab"},
    CHANGE: {"tab", "number", "block", "values"},
    DO: {"tab", "action", "argument"},
    EVENTS: {"tab"},
}  # keys of the body, by path
REQUEST: Final = "request"  # in place of a file name in messages

Reply = tuple[HTTPStatus, bytes]  # a status and JSON


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Job:
    """Something that a page asks for.

    Attributes:
        path: One of ``FIELDS``.
        tab: Number by which the page tells its stream of events from those of other tabs; None if it does not.
        number: Of a change, as the page counts them.
        block: Block that the page shows; None for the one shown before.
        values: Of a change: values by address, in file units.
        superseded: Values of older changes that were not made before this one came; they hold unless refused.
        action: One of ``ACTIONS``.
        argument: Of the action.
        reply: What is answered.
    """

    path: str
    tab: int | None = None
    number: int = 0
    block: int | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    superseded: Mapping[str, float] = field(default_factory=dict)
    action: str = ""
    argument: float | None = None
    reply: Future[Reply] = field(default_factory=Future)

    def after(self, older: "Job") -> "Job":
        """This change on top of an older one, which is not made by itself any more."""
        block = older.block if self.block is None else self.block
        return replace(self, block=block, superseded={**older.superseded, **older.values})


def parse_job(path: str, body: bytes) -> Job:
    """The job of a request.

    Raises:
        InputError: The body is no JSON object of the keys and kinds that the path takes.
    """
    content = parse_json(body, REQUEST)
    unknown = sorted(content.keys() - FIELDS[path])
    if unknown:
        expected = ", ".join(sorted(FIELDS[path]))
        raise InputError(f"{REQUEST}: {shown(unknown[0])}: unknown key, expected only {expected}")
    values = {key: _whole(content, key) for key in ("tab", "number", "block") if content.get(key) is not None}
    if path == CHANGE:
        return Job(path=path, **values, values=_values(content))  # type: ignore[arg-type]
    if path == DO:
        action, argument = content.get("action"), content.get("argument")
        if not isinstance(action, str) or action not in ACTIONS:
            raise InputError(f"{REQUEST}: action: expected one of {', '.join(sorted(ACTIONS))}, got {shown(action)}")
        number = None if argument is None else _finite("argument", argument)
        return Job(path=path, **values, action=action, argument=number)  # type: ignore[arg-type]
    return Job(path=path, **values)  # type: ignore[arg-type]


def _whole(content: Mapping[str, Any], key: str) -> int:
    """A number that counts."""
    value = content[key]
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**53:
        raise InputError(f"{REQUEST}: {key}: expected a whole number from 0, got {shown(value)}")
    return value


def _values(content: Mapping[str, Any]) -> dict[str, float]:
    """Values by address; none at all for another block alone."""
    values = content.get("values")
    if not isinstance(values, dict) or not (values or content.get("block") is not None):
        raise InputError(f"{REQUEST}: values: expected an object of numbers by address, got {shown(values)}")
    return {address: _finite(shown(address), value) for address, value in values.items()}


def _finite(name: str, value: object) -> float:
    """A finite number; never text."""
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value):
        return float(value)
    raise InputError(f"{REQUEST}: {name}: expected a finite number, got {shown(value)}")
