"""What all records share: printed numbers, provenance, and verified statements."""

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypedDict

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check
from cellplan.model.settings.entry import Entry

Number = float | None
Record = Mapping[str, Any]  # a record as consumers read it, from memory or from a file
Entries = list[dict[str, Any]]  # what pages and screens list

SIGNIFICANT: Final = 12  # digits: hides the noise of unit conversion (-185.00000000000003) and nothing else
AXES: Final = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Origin of a result."""

    versions: Mapping[str, str]  # version by package, cellplan's own first
    digests: Mapping[str, str]  # SHA-256 by name (``program``, or a file of the run)


class CheckRecord(TypedDict):
    """A verified statement."""

    name: Annotated[str, "name of the check"]
    subject: Annotated[str, "robot and joint, task, or pair of bodies"]
    passed: Annotated[bool, "the verdict"]
    value: Annotated[Number, "worst value, in `unit`"]
    limit: Annotated[Number, "admissible value, in `unit`"]
    unit: Annotated[str, "unit of `value` and `limit`"]
    at_s: Annotated[Number, "time of the worst value"]
    message: Annotated[str, "the statement as one line of text"]


class RunCheckRecord(CheckRecord):
    """A verified statement about one of several runs."""

    phase: Annotated[str, "name of its phase"]


class OriginRecord(TypedDict):
    """Inputs and programs that a result was computed from."""

    inputs: Annotated[dict[str, str], "SHA-256 of every input file, by name"]
    digests: Annotated[
        dict[str, str], "SHA-256 of what was written: `program`, the rows of all joint tables; files: see manifest.json"
    ]
    versions: Annotated[dict[str, str], "versions of cellplan and of the packages that the numbers depend on"]
    seed: Annotated[int, "seed of every random search"]


class ExtremeRecord(TypedDict):
    """Smallest value along the motion."""

    minimum: Annotated[Number, "smallest value"]
    at_s: Annotated[Number, "its time"]


def number(value: float | None, scale: float = 1.0) -> Number:
    """The scaled value with ``SIGNIFICANT`` digits and without -0; None if it is not finite."""
    return (
        None if value is None or not math.isfinite(scale * value) else float(f"{scale * value:.{SIGNIFICANT}g}") + 0.0
    )


def entry_record(entry: Entry, without: Collection[str] = ()) -> Any:
    """The values of an entry under the keys of its file."""
    values = entry.model_dump(mode="json", exclude=set(without))
    return {key: number(value) if isinstance(value, float) else value for key, value in values.items()}


def smallest(values: Array, times: Array) -> ExtremeRecord:
    """Smallest value of a series of shape (N,) and its time."""
    if not len(values):
        return {"minimum": None, "at_s": None}
    index = int(np.argmin(values))
    return {"minimum": number(values[index]), "at_s": number(times[index])}


def origin_record(cell: Cell, provenance: Provenance) -> OriginRecord:
    """Inputs and versions of a result."""
    return {
        "inputs": dict(cell.inputs),
        "digests": dict(provenance.digests),
        "versions": dict(provenance.versions),
        "seed": cell.solver.seed,
    }


def check_record(check: Check) -> CheckRecord:
    """One verified statement."""
    return {
        "name": check.name,
        "subject": check.subject,
        "passed": check.passed,
        "value": number(check.value),
        "limit": number(check.limit),
        "unit": check.unit,
        "at_s": number(check.at_s),
        "message": check.message,
    }


def as_json(record: Mapping[str, object]) -> str:
    """A record as JSON text; a number that is not finite is refused."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def shortened(name: str, letters: int) -> str:
    """A name with its middle left out where it has more letters than there is room for."""
    if len(name) <= letters:
        return name
    tail = letters // 3
    return f"{name[: letters - tail - 1]}…{name[-tail:]}"
