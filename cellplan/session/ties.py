"""Ties of a live cell: numbers that ``layout.equal`` and ``layout.mirrored`` of the cell tie to each other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.layout import VaryRange
from cellplan.search.variables.ties import Tied, into_turn


class Follower(NamedTuple):
    """A number that follows another one: ``slope`` times that one and ``shift``, in [m] or [rad]."""

    variable: VaryRange
    slope: float  # 1 or -1
    shift: float

    def value(self, leader: float) -> float:
        """Its value in [m] or [rad], an angle by whole turns within its range, with that of the other one."""
        return into_turn(self.variable, self.slope * leader + self.shift, self.variable.lower, self.variable.upper)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ties:
    """What the layout of a cell ties."""

    tied: Tied | None  # None without ties

    @classmethod
    def of(cls, cell: Cell) -> "Ties":
        """Those that the file of a cell states."""
        settings = cell.layout
        return cls(tied=Tied.of(settings) if settings is not None and (settings.equal or settings.mirrored) else None)

    def followers(self, address: str) -> Iterator[Follower]:
        """The numbers that follow one, by its address."""
        addresses = [] if self.tied is None else [it.address for it in self.tied.ranges]
        if self.tied is None or address not in addresses:
            return
        factors, terms, row = self.tied.factors, self.tied.terms, addresses.index(address)
        column = int(np.flatnonzero(factors[row])[0])
        for other in np.flatnonzero(factors[:, column]).tolist():
            if other != row:
                slope = float(factors[other, column] / factors[row, column])
                yield Follower(self.tied.ranges[other], slope, float(terms[other] - slope * terms[row]))

    def narrowed(self, variable: VaryRange) -> VaryRange:
        """A length with the range that those leave it which follow it; an angle as it is, as it may turn."""
        lower, upper = variable.lower, variable.upper
        for other, slope, shift in self.followers(variable.address) if not variable.is_angle else ():
            ends = sorted((end - shift) / slope for end in (other.lower, other.upper))
            lower, upper = max(lower, ends[0]), min(upper, ends[1])
        given = variable.given or 0.0
        return replace(variable, lower=min(lower, given), upper=max(upper, given))

    def steps(self, ranges: Sequence[VaryRange], moved: Sequence[int]) -> Array:
        """What steps of some numbers make of all of them with what follows, in [m] and [rad], shape (n, n).

        Args:
            ranges: The n numbers.
            moved: Places of those that are moved; the others only follow.
        """
        places = {it.address: place for place, it in enumerate(ranges)}
        matrix = np.zeros((len(ranges), len(ranges)))
        for place in moved:
            matrix[place, place] = 1.0
            for follower in self.followers(ranges[place].address):
                other = places.get(follower.variable.address)
                if other is not None and other not in moved:
                    matrix[other, place] = follower.slope
        return matrix
