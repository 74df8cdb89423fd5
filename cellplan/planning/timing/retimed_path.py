"""Retimed path: motions of its stretches in whole numbers of steps, and the nominal times of their rows."""

from dataclasses import dataclass, replace
from typing import Final, Protocol, Self

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.timing.path_length import PathStretch
from cellplan.planning.timing.speed_profile import SpeedProfile

TIME_DECIMALS: Final = 12  # decimals kept of nominal times


class TimedRows(Protocol):
    """Motion of one stretch: its rows for any number of steps."""

    def rows(self, count: int) -> Array:
        """Nominal times of its rows in [s] when it takes so many steps, both ends included, shape (count + 1,)."""

    @property
    def is_fixed(self) -> bool:
        """Whether it must take the steps that it takes."""


@dataclass(frozen=True, slots=True, eq=False)
class AsWritten:
    """The motion that the time laws give, slower or faster as a whole."""

    piece: PathStretch

    def rows(self, count: int) -> Array:
        """See ``TimedRows``."""
        return np.linspace(self.piece.sigma[0], self.piece.sigma[-1], count + 1)

    @property
    def is_fixed(self) -> bool:
        """See ``TimedRows``."""
        return False


@dataclass(frozen=True, slots=True, eq=False)
class RestToRest:
    """The fastest motion of one stretch, its speed averaged over a window in [s]."""

    piece: PathStretch
    profile: SpeedProfile
    window: float

    @property
    def duration(self) -> float:
        """Time that it takes in [s]."""
        return self.profile.duration + self.window

    def rows(self, count: int) -> Array:
        """See ``TimedRows``."""
        share = np.arange(count + 1) / count
        lengths = self.profile.at(share * self.duration, self.window)
        lengths[-1] = self.piece.length
        return self.piece.at(np.maximum.accumulate(lengths))

    @property
    def is_fixed(self) -> bool:
        """See ``TimedRows``."""
        return False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RetimedPath:
    """Motion along a whole path; every rest of all joints is a row."""

    motions: tuple[TimedRows, ...]  # the motion of each stretch
    counts: tuple[int, ...]  # steps that each of them takes
    end: float  # last nominal time in [s]

    @property
    def steps(self) -> int:
        """Steps that the whole takes; 1 where no joint moves at all."""
        return max(1, sum(self.counts))

    @property
    def sigma(self) -> Array:
        """Nominal times of the rows in [s], shape (steps + 1,)."""
        rows = [motion.rows(count)[1:] for motion, count in zip(self.motions, self.counts, strict=True)]
        sigma = np.concatenate([[0.0], *rows]) if rows else np.array([0.0, self.end])
        sigma[-1] = self.end
        return np.round(sigma, TIME_DECIMALS)

    def lasting(self, steps: int) -> Self:
        """The same motion slower as a whole, so that all loads fall alike; what is fixed takes no more.

        Args:
            steps: What it is to take, at least as many as it takes.
        """
        given = np.array(self.counts)
        free = np.array([not motion.is_fixed for motion in self.motions], dtype=bool)
        if not free.any():
            return self
        exact = np.where(free, given * ((steps - given[~free].sum()) / given[free].sum()), given)
        counts = np.floor(exact).astype(int)
        counts[np.argsort(counts - exact, kind="stable")[: steps - int(counts.sum())]] += 1
        return replace(self, counts=tuple(counts.tolist()))
