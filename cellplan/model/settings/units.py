"""Numbers with a unit: each keeps the number that the file writes, and ``si`` is the same quantity in SI units."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.units import DEG, MM, joint_unit

if TYPE_CHECKING:  # robots are read by processes of their own, without schemas of files
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

NEIGHBOURS: Final = 3  # units in the last place round the quotient in which the written number is sought


class Quantity(float):
    """A number in the unit of a file, thousandths unless its class says otherwise; it prints as that number."""

    @property
    def si(self) -> float:
        """The quantity in SI units, by one division, which rounds only once."""
        return self / MM

    @classmethod
    def __get_pydantic_core_schema__(cls, source: type[Self], handler: "GetCoreSchemaHandler") -> "CoreSchema":
        """A number without bounds, which then gets its unit."""
        from pydantic_core import core_schema

        return core_schema.no_info_after_validator_function(cls, core_schema.float_schema())


class Mm(Quantity):
    """Millimetres."""


class MmPerS(Quantity):
    """Millimetres per second."""


class MmPerS2(Quantity):
    """Millimetres per second²."""


class MmPerS3(Quantity):
    """Millimetres per second³."""


class Ms(Quantity):
    """Milliseconds."""


class Deg(Quantity):
    """Degrees."""

    @property
    def si(self) -> float:
        """The quantity in [rad] and its rates."""
        return math.radians(self)


class DegPerS(Deg):
    """Degrees per second."""


class DegPerS2(Deg):
    """Degrees per second²."""


class DegPerS3(Deg):
    """Degrees per second³."""


class InSi(Quantity):
    """A number that is in its SI unit already, such as newton metres."""

    @property
    def si(self) -> float:
        """The number itself."""
        return float(self)


class NPerMm(Quantity):
    """Newtons per millimetre."""

    @property
    def si(self) -> float:
        """The quantity in [N/m]."""
        return self * MM


class NmPerDeg(Quantity):
    """Newton metres per degree."""

    @property
    def si(self) -> float:
        """The quantity in [N m/rad]."""
        return self * DEG


@dataclass(frozen=True, slots=True, kw_only=True)
class Within:
    """Bounds of a quantity in the unit of the file, as in ``Annotated[Mm, Within(ge=0.0, le=1000.0)]``."""

    ge: float | None = None
    gt: float | None = None
    le: float

    def __get_pydantic_core_schema__(self, source: type[Quantity], handler: "GetCoreSchemaHandler") -> "CoreSchema":
        """A number within the bounds, which then gets its unit."""
        from pydantic_core import core_schema

        number = core_schema.float_schema(ge=self.ge, gt=self.gt, le=self.le)
        return core_schema.no_info_after_validator_function(source, number)


def in_si(values: Iterable[Quantity]) -> Array:
    """Quantities in SI units, shape (n,)."""
    return np.array([value.si for value in values])


def si_or_none(value: Quantity | None) -> float | None:
    """A quantity in SI units; None stays None."""
    return None if value is None else value.si


def file_number(value: float, *, is_revolute: bool, within: tuple[float, float] | None = None) -> float:
    """Number of degrees or millimetres with the fewest digits that reads back to the value, or else nearly so.

    The value is in [rad] or [m], and so are the lowest and highest one that it may read back to instead.
    """
    quotient = value * joint_unit(is_revolute=is_revolute).scale
    candidates = [float(f"{quotient:.{digits}g}") for digits in range(1, 18)]
    above = below = quotient
    for _ in range(NEIGHBOURS):
        above, below = float(np.nextafter(above, np.inf)), float(np.nextafter(below, -np.inf))
        candidates += [above, below]
    unit = Deg if is_revolute else Mm
    lower, upper = within or (value, value)
    return next((number for number in candidates if lower <= unit(number).si <= upper), quotient)
