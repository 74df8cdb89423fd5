"""Stretches of a path in which the nominal time keeps its rate: processes with a demanded feed, delays and dwells.

Where all joints rest, rows are put into the rest. Where joints move, the whole motion runs at the nominal speed, or at
one that is lower by the same factor throughout, and its rate changes smoothly where nothing demands it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.timing.path_length import PathStretch

RATES: Final = (1.0, 0.5, 0.05)  # [-] of the tolerance left: rates tried, the demanded one first
SLOWEST: Final = 16.0  # [-] times the nominal time for what is not demanded: tried at most
POINTS: Final = 4000  # [-] nominal times at which a rate is integrated
CHANGE_SHARE: Final = 0.5  # [-] of what lies between a process and a rest: there the rate changes
FASTEST: Final = 1e6  # [-] rate of the nominal time that takes no time
HALVINGS: Final = 60  # of the logarithm of a rate: down to the last digit
FEWEST_STEPS: Final = 3  # [-] steps: a shorter overlap of a stretch with a rest is rounding of where joints rest
MARGIN: Final = 1e-9  # [-] of a number of steps: rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedRate:
    """A stretch of nominal time whose rate is demanded."""

    begin: float  # its begin in [s]
    end: float  # its end in [s]
    tolerance: float = 1.0  # share by which the rate may be lower; 1 for any


@dataclass(frozen=True, slots=True, eq=False)
class AtRest:
    """All joints rest; time passes in the stretches that are demanded only, or in a single step."""

    begin: float  # nominal time in [s] at which the rest begins
    end: float  # nominal time in [s] at which it ends
    spans: Array  # stretches of nominal time in [s] whose time is kept, shape (n, 2), in their order

    @property
    def seconds(self) -> float:
        """Time that is kept in [s]."""
        return float(np.diff(self.spans, axis=1).sum())

    def rows(self, count: int) -> Array:
        """See ``TimedRows``."""
        if not len(self.spans):
            return np.linspace(self.begin, self.end, count + 1)
        passed = np.append(0.0, np.cumsum(np.diff(self.spans, axis=1).ravel()))
        wait = np.linspace(0.0, passed[-1], count + 1)
        k = np.clip(np.searchsorted(passed, wait, side="left") - 1, 0, len(self.spans) - 1)
        nominal: Array = self.spans[k, 0] + wait - passed[k]
        nominal[0], nominal[-1] = self.begin, self.end
        return nominal

    @property
    def is_fixed(self) -> bool:
        """See ``TimedRows``."""
        return True


@dataclass(frozen=True, slots=True, eq=False)
class AtFixedRate:
    """Motion of a stretch between two rests at one rate of the nominal time in all that is demanded."""

    piece: PathStretch
    spans: Array  # stretches of nominal time in [s] within it, shape (n, 2), in their order, that do not overlap
    rate: float  # rate of the nominal time in these
    step: float  # time between two rows in [s]

    @property
    def is_fixed(self) -> bool:
        """See ``TimedRows``: whether all of the stretch is demanded."""
        return bool((self._freedom(self._grid()) == 0.0).all())

    def rows(self, count: int) -> Array:
        """See ``TimedRows``; the rate where nothing is demanded is that which takes so many steps."""
        sigma, share = np.linspace(self.piece.sigma[0], self.piece.sigma[-1], count + 1), np.arange(count + 1)
        if self.is_fixed:
            return sigma
        grid = self._grid()
        freedom, middle = self._freedom(grid), self._freedom(0.5 * (grid[:-1] + grid[1:]))
        low, high = np.log(1.0 / FASTEST), np.log(FASTEST)
        for _ in range(HALVINGS):
            free = np.exp(0.5 * (low + high))
            times = self._times(grid, freedom, middle, free=free)
            low, high = (0.5 * (low + high), high) if times[-1] > count * self.step else (low, 0.5 * (low + high))
        slopes = self.rate + (free - self.rate) * freedom
        nominal = _cubic(share / count * times[-1], times, grid, slopes)
        nominal[0], nominal[-1] = sigma[0], sigma[-1]
        return nominal

    def _grid(self) -> Array:
        """Nominal times in [s] with all ends of spans among them, increasing."""
        even = np.linspace(self.piece.sigma[0], self.piece.sigma[-1], POINTS + 1)
        inner = self.spans[(self.spans > even[0]) & (self.spans < even[-1])]
        return np.unique(np.concatenate([even, inner]))

    def _freedom(self, sigma: Array) -> Array:
        """How far the rate may differ from that of the spans, 0..1: 0 in them, smoothly growing beside them."""
        freedom = np.zeros(len(sigma))
        ends = np.concatenate([[-np.inf], self.spans.ravel(), [np.inf]]).reshape(-1, 2)
        for before, after in ends:
            low, high = max(before, self.piece.sigma[0]), min(after, self.piece.sigma[-1])
            inside = (sigma > low) & (sigma < high)
            length = CHANGE_SHARE * (high - low)
            distance = np.minimum(sigma - before, after - sigma)[inside] / length if high > low else np.zeros(0)
            x = np.clip(distance, 0.0, 1.0)
            freedom[inside] = x**3 * (10.0 - x * (15.0 - 6.0 * x))
        return freedom

    def _times(self, grid: Array, freedom: Array, middle: Array, *, free: float) -> Array:
        """Times in [s] at which the nominal times of the grid are passed, by Simpson's rule, from 0."""
        at, between = (1.0 / (self.rate + (free - self.rate) * share) for share in (freedom, middle))
        return np.append(0.0, np.cumsum(np.diff(grid) * (at[:-1] + 4.0 * between + at[1:]) / 6.0))


def least_steps(motion: AtFixedRate, is_allowed: Callable[[Array], bool]) -> int | None:
    """Fewest steps in which all limits hold, by nominal times in [s]; None when slower rates beside it do not help."""
    low = whole_steps(float(np.diff(motion.spans, axis=1).sum()) / motion.rate, motion.step)
    if motion.is_fixed:
        return low if is_allowed(motion.rows(low)) else None
    nominal = float(motion.piece.sigma[-1] - motion.piece.sigma[0]) / motion.rate
    high, most = whole_steps(nominal, motion.step) + 1, low + SLOWEST * nominal / motion.step
    while not is_allowed(motion.rows(high)):
        low, high = high, 2 * high - low
        if high > most:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_allowed(motion.rows(middle)) else (middle, high)
    return high


def spans_within(fixed_rates: Sequence[FixedRate], begin: float, end: float) -> Array:
    """What is demanded between two nominal times in [s]: stretches in their order that do not overlap, shape (n, 2)."""
    spans: list[list[float]] = []
    for fixed_rate in sorted(fixed_rates, key=lambda one: one.begin):
        low, high = max(fixed_rate.begin, begin), min(fixed_rate.end, end)
        if high <= low:
            continue
        if spans and low <= spans[-1][1]:
            spans[-1][1] = max(spans[-1][1], high)
        else:
            spans.append([low, high])
    return np.array(spans).reshape(-1, 2)


def whole_steps(seconds: float, step: float) -> int:
    """Steps that take at least some seconds, at least one."""
    return max(1, int(np.ceil(seconds / step - MARGIN)))


def _cubic(times: Array, knots: Array, values: Array, slopes: Array) -> Array:
    """The cubic through values with slopes at knots, at times, shape (N,)."""
    k = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    width, rise = knots[k + 1] - knots[k], values[k + 1] - values[k]
    u = (times - knots[k]) / width
    curved = u * (1.0 - u) * ((1.0 - u) * slopes[k] - u * slopes[k + 1]) * width
    return values[k] + u * u * (3.0 - 2.0 * u) * rise + curved
