"""One number of a cell that may be changed while its motion is shown."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from cellplan.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A number at an address of the cell file, in file units."""

    address: str  # as ``--set`` takes it
    label: str  # what a person calls it
    kind: str  # base_x, tool_length, obstacle_yaw, …
    subject: str  # robot, obstacle or part that it belongs to
    unit: str  # mm or deg
    given: float  # value in the file
    lower: float  # least value that is accepted
    upper: float  # greatest one
    step: float  # of one press of a key
    is_locked: bool = False  # whether a demand of the cell fixes it
    is_varied: bool = False  # whether ``layout.vary`` of the cell states its range

    def accepted(self, value: float) -> float:
        """A value that may stand there; others are refused.

        Raises:
            InputError: The variable is locked, or the value is not finite or out of its range.
        """
        if self.is_locked:
            raise InputError(f"{self.address}: is locked by layout.fixed of the cell; take it out there")
        if not math.isfinite(value) or not self.lower <= value <= self.upper:
            expected = f"a number from {self.lower:g} to {self.upper:g} {self.unit}"
            raise InputError(f"{self.address}: expected {expected}, got {value:g}")
        return value

    def record(self, *, value: float) -> dict[str, Any]:
        """The variable with its present value, for pages."""
        return {**asdict(self), "value": value}
