"""Clock: which nominal time of a program belongs to each row of its tables."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from cellplan.geometry.transforms import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clock:
    """Nominal time of every row; a program that runs as it is written has the nominal time as its time.

    Attributes:
        times: Times of the rows in [s], increasing from 0, shape (N,).
        sigma: Nominal time of each row in [s], shape (N,), from 0; it never falls, and stays the same in a dwell.
    """

    times: Array
    sigma: Array

    def __post_init__(self) -> None:
        """Check that both are clocks.

        Raises:
            ValueError: The times do not grow, or the nominal time falls.
        """
        if self.times.shape != self.sigma.shape or self.times.ndim != 1 or not len(self.times):
            raise ValueError(f"clock: {self.sigma.shape} nominal times for {self.times.shape} times")
        if not np.all(np.isfinite(self.times)) or not np.all(np.isfinite(self.sigma)):
            raise ValueError("clock: a time is not finite")
        if self.times[0] != 0.0 or not np.all(np.diff(self.times) > 0.0):
            raise ValueError("clock: expected times that increase from 0")
        if self.sigma[0] != 0.0 or not np.all(np.diff(self.sigma) >= 0.0):
            raise ValueError("clock: expected a nominal time that starts at 0 and never decreases")

    @classmethod
    def as_written(cls, times: Array) -> Self:
        """The clock of a program whose time is its nominal time."""
        return cls(times=times, sigma=times)

    @property
    def is_as_written(self) -> bool:
        """Whether the nominal time is the time in every row."""
        return bool(np.array_equal(self.times, self.sigma))

    def at(self, times: Array) -> Array:
        """Nominal times at times in [s] between the rows, linear from row to row, shape (M,)."""
        sigma: Array = np.interp(times, self.times, self.sigma)
        return sigma

    def reached_at(self, sigma: Array) -> Array:
        """Times in [s] at which nominal times are reached, shape (M,); the nearer end for those outside."""
        times: Array = np.interp(sigma, self.sigma, self.times)
        return times
