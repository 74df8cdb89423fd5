"""Varied: what every part of a search asks of its variables."""

from dataclasses import dataclass, field
from typing import Final, Protocol

from cellplan.geometry.arrays import Array
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions


class Varied(Protocol):
    """Variables, n of them, in [m] or [rad] unless their names say otherwise."""

    @property
    def names(self) -> tuple[str, ...]:
        """Their addresses in the cell file."""

    @property
    def lower(self) -> Array:
        """Their lower bounds, shape (n,)."""

    @property
    def upper(self) -> Array:
        """Their upper bounds, shape (n,)."""

    @property
    def scale(self) -> Array:
        """A usual step of each, shape (n,)."""

    @property
    def cost(self) -> Array:
        """Cost of a change by one unit of each, shape (n,)."""

    @property
    def given(self) -> Array:
        """Values from which a change is counted, shape (n,)."""


class KernelVariables(Varied, Protocol):
    """Variables of which the kernel makes candidates."""

    def layouts(self, x: Array, start: Array) -> Layouts:
        """Candidates at values of shape (K, n), with start postures near the right ones, shape (K, nq)."""

    def directions(self, x: Array) -> Directions:
        """What each variable does to a candidate, at values of shape (n,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VariedFields:
    """What variables work out when they are made; see ``Varied``."""

    names: tuple[str, ...] = field(init=False)
    lower: Array = field(init=False)
    upper: Array = field(init=False)
    scale: Array = field(init=False)
    cost: Array = field(init=False)
    given: Array = field(init=False)


VARIED: Final = tuple(VariedFields.__dataclass_fields__)
