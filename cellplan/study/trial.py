"""Trial: one variant of a cell, what came of it, and its line in a study."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Self


@dataclass(frozen=True, slots=True)
class Variant:
    """One combination of values."""

    number: int  # its place among all combinations, from 0
    values: Mapping[str, object]  # value by address


class TrialStatus(StrEnum):
    """What came of a variant; a crashed one raised an error, ended its process or took too long."""

    PASSED = "passed"
    FAILED = "failed"
    NO_SOLUTION = "no_solution"
    BAD_INPUT = "bad_input"
    CRASHED = "crashed"


STATUS_TEXTS: Final = {
    status: f"{'✓' if status is TrialStatus.PASSED else '✗'} {status.replace('_', ' ')}" for status in TrialStatus
}


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialOutcome:
    """What came of a variant."""

    status: TrialStatus  # its verdict
    reason: str = ""  # the first check that failed or the reason why there is no result; empty where it passed
    figures: Mapping[str, object]  # key figures by name, with their unit in the name; none where there is no motion

    @property
    def record(self) -> dict[str, Any]:
        """The outcome as plain data."""
        return {"status": str(self.status), "reason": self.reason, "figures": dict(self.figures)}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Self:
        """The outcome of plain data."""
        return cls(status=TrialStatus(record["status"]), reason=str(record["reason"]), figures=dict(record["figures"]))


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyTrial:
    """A variant and its outcome: one line of a study."""

    variant: Variant
    outcome: TrialOutcome

    @property
    def number(self) -> int:
        """Its number, from 0."""
        return self.variant.number

    @property
    def passed(self) -> bool:
        """Whether it passed."""
        return self.outcome.status is TrialStatus.PASSED

    @property
    def figures(self) -> Mapping[str, Any]:
        """Its key figures; none where there is no motion."""
        return self.outcome.figures

    @property
    def record(self) -> dict[str, Any]:
        """The trial as plain data."""
        return {"trial": self.variant.number, "values": dict(self.variant.values), **self.outcome.record}

    @property
    def line(self) -> str:
        """The trial as one line of JSON."""
        return json.dumps(self.record, ensure_ascii=False, allow_nan=False)

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Self:
        """The trial of a line."""
        variant = Variant(int(record["trial"]), dict(record["values"]))
        return cls(variant=variant, outcome=TrialOutcome.from_record(record))
