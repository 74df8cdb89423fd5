"""Weave whose tip stands at its edges: between them it travels faster, so that its mean travel keeps the feed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.arc_length import ArcLength
from cellplan.geometry.curves.curve import Curve, Interval
from cellplan.geometry.curves.orientation import Orientation
from cellplan.model.task.task import TimeLaw, TimeLawKind
from cellplan.model.task.time_law import advance, reached_at

TURN: Final = 0.25  # [-] of a move between two rests, in which it comes to its speed or from it: shorter ones jerk
MOVE_LAW: Final = TimeLaw(kind=TimeLawKind.STEADY, ramp=TURN)
FITTED: Final = 2  # moves before the end of a seam that are as fast as it takes to be there in time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StandingTravel:
    """Where on its seam a tip is that would be at a length of it if it travelled evenly, in moves and rests in turns.

    Attributes:
        line: The seam.
        arc: Its length.
        edges: Lengths in [m] of even travel at which moves and rests begin, and the last one ends, shape (K + 1,).
        reached: Lengths in [m] of the seam at which the tip is there, shape (K + 1,).
    """

    line: Curve
    arc: ArcLength
    edges: Array
    reached: Array

    @classmethod
    def of(cls, line: Curve, arc: ArcLength, rests: Sequence[tuple[float, float]], *, rate: float) -> "StandingTravel":
        """Travel with rests from one length of even travel to another in [m], in their order.

        ``rate`` is that of the moves between the rests. The last moves are as fast as it takes to end with the seam.
        """
        inner = np.minimum(np.array([it for it in rests if it[0] < arc.total]).ravel(), arc.total)
        edges = np.concatenate([[0.0], inner, [arc.total]])
        moves = np.diff(edges)[0::2]
        lengths = rate * moves
        rest = arc.total - lengths[:-FITTED].sum()
        lengths[-FITTED:] = rest * moves[-FITTED:] / moves[-FITTED:].sum()
        reached = np.insert(np.repeat(np.cumsum(lengths), 2)[:-1], 0, 0.0)
        is_long = np.append(True, np.diff(edges) > 0.0)
        return cls(line=line, arc=arc, edges=edges[is_long], reached=reached[is_long])

    @property
    def whole(self) -> tuple[float, float]:
        """First and last parameter of the seam."""
        return float(self.line.knots[0]), float(self.line.knots[-1])

    @property
    def joints(self) -> Array:
        """Lengths in [m] of even travel at which moves begin, end, or come to their speed, shape (M,)."""
        ramps = TURN * np.diff(self.edges)
        return np.unique(np.concatenate([self.edges, self.edges[:-1] + ramps, self.edges[1:] - ramps]))

    def knots(self, old: Array) -> Array:
        """Parameters of even travel at which the tip passes knots of the seam, shape (M,)."""
        s = self.arc.lengths(old)
        k = np.clip(np.searchsorted(self.reached, s, side="right") - 1, 0, len(self.edges) - 2)
        width, move = np.diff(self.edges)[k], np.diff(self.reached)[k]
        share = reached_at(MOVE_LAW, (s - self.reached[k]) / np.where(move > 0.0, move, 1.0))
        return self.arc.parameters(self.edges[k] + width * share, self.whole)

    def at(self, v: Array, interval: Interval) -> tuple[Array, Interval, Array]:  # noqa: ARG002
        """Parameters at which the tip is, shape (N,), the whole of the seam, and their rates by ``v``, shape (N, 1)."""
        s = self.arc.lengths(v)
        k = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.edges) - 2)
        width, move = np.diff(self.edges)[k], np.diff(self.reached)[k]
        law = advance(MOVE_LAW, np.clip((s - self.edges[k]) / width, 0.0, 1.0))
        real = self.arc.parameters(self.reached[k] + move * law.share, self.whole)
        even, here = (np.linalg.norm(self.line.evaluate(it, self.whole)[1], axis=1) for it in (v, real))
        return real, self.whole, (move / width * law.rate * even / here)[:, None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StandingFrame:
    """Another orientation where the tip is that stands; see `cellplan.geometry.curves.orientation.Orientation`."""

    frame: Orientation
    travel: StandingTravel

    @property
    def knots(self) -> Array:
        """Those of the other one, as the tip passes them."""
        first, last = self.travel.whole
        old = self.frame.knots
        return self.travel.knots(old[(old >= first) & (old <= last)])

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:
        """Tool frames and their turning rate; ``p`` and ``dp`` are those of even travel."""
        v, whole, rate = self.travel.at(u, interval)
        p, dp = self.travel.line.evaluate(v, whole)
        R, w = self.frame.frames(v, whole, p=p, dp=dp)
        return R, rate * w
