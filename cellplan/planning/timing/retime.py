"""Retiming: the nominal time of a joint path as a function of the time, as fast as the limits of all joints allow.

The joints keep their path, all of them together, so the tools keep their paths on one another; only speeds change.
Without a limit of jerk the speed is the largest one from rest to rest (``speed_profile``). With one, its mean over a
window that all joints share is taken, so that accelerations change evenly over the window; this is not the fastest
motion with that jerk. The motion is then made slower as a whole until every limit holds in the rows of the tables.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final, Protocol, Self

import numpy as np

from cellplan.certify.point_speeds import PointSpeeds
from cellplan.geometry.transforms import Array
from cellplan.model.motion.joint_path import JointPath
from cellplan.planning.timing.fixed_rates import (
    FEWEST_STEPS,
    RATES,
    AtFixedRate,
    AtRest,
    FixedRate,
    least_steps,
    spans_within,
    whole_steps,
)
from cellplan.planning.timing.path_length import PathStretch, stretches
from cellplan.planning.timing.speed_profile import PathLoads, SpeedProfile, fastest_profile
from cellplan.planning.timing.torque_limits import TorqueLimits

POINTS_PER_ROW: Final = 5  # [-] lengths for every row of the tables at first; at least doubled once
FEWEST_POINTS: Final = 400  # [-] lengths of a stretch
MOST_POINTS: Final = 20_000  # [-] likewise: some seconds of computing
SETTLED: Final = 0.01  # [-] change of the duration when the lengths are doubled: a smaller one is accepted
WINDOWS: Final = (1.0, 1.4, 2.0, 2.4)  # [-] windows tried, in times that the jerk takes to the full acceleration
BEND_SHARES: Final = (0.8, 0.6, 0.4)  # [-] tried with them: what the bends of the path may take up of the jerk limits
RESERVE: Final = 0.95  # [-] share of the acceleration limits with a limit of jerk: the means take up the rest
MOST_STRETCHINGS: Final = 40  # [-] until every limit holds
MOST_TIGHTENINGS: Final = 6  # [-] times that the speed is lowered where tools miss their tolerances between rows
MOST_ROOTS: Final = 8  # [-] times that errors between rows are taken to grow with the square of the step
MARGIN: Final = 1e-7  # [-] by which a motion is made slower than the limits ask for
Slower = Callable[[Array, Array], float]  # nominal times and joints in the rows -> factor of time for the limits
TIME_DECIMALS: Final = 12  # decimals kept of nominal times


class StepTolerance(Protocol):
    """Errors of tools between rows, where the joints move linearly."""

    def largest(self, sigma: Array) -> Array:
        """Largest error in each step between nominal times in [s], as a share of what is allowed, shape (N - 1,)."""

    def tighten(self, sigma: Array) -> bool:
        """Lower the largest speeds where steps miss a tolerance; whether none does."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLimitsInTime:
    """Limits of all joints in [rad] or [m] and seconds, shape (nq,) each; infinite for none."""

    velocity: Array
    acceleration: Array
    jerk: Array
    points: tuple[PointSpeeds, ...] = ()  # points of the robots of which the speed in the world is limited too
    torques: tuple[TorqueLimits, ...] = ()  # of the robots of which torques are limited too

    def of(self, columns: slice) -> Self:
        """Those of some joints."""

        def is_among(others: slice) -> bool:
            return columns.start <= others.start and others.stop <= columns.stop

        return replace(
            self,
            velocity=self.velocity[columns],
            acceleration=self.acceleration[columns],
            jerk=self.jerk[columns],
            points=tuple(it.among(columns) for it in self.points if is_among(it.columns)),
            torques=tuple(it.among(columns) for it in self.torques if is_among(it.columns)),
        )

    def in_slow_motion(self, share: float) -> Self:
        """Limits within which every motion is one within these, only that time runs at a share of its speed."""
        rates = share * self.velocity, share**2 * self.acceleration, share**3 * self.jerk
        torques = tuple(it.in_slow_motion(share) for it in self.torques)
        return replace(self, velocity=rates[0], acceleration=rates[1], jerk=rates[2], torques=torques)

    @property
    def build_up(self) -> float:
        """Time in [s] in which every limited joint can build up its full acceleration; 0 without a limit of jerk."""
        limited = np.isfinite(self.jerk) & np.isfinite(self.acceleration)
        return float((self.acceleration[limited] / self.jerk[limited]).max(initial=0.0))


class TimedRows(Protocol):
    """Motion of one stretch: its rows for any number of steps."""

    def rows(self, count: int) -> Array:
        """Nominal times of its rows in [s] when it takes so many steps, both ends included, shape (count + 1,)."""

    @property
    def is_fixed(self) -> bool:
        """Whether it must take the steps that it takes."""


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
        """The same motion slower as a whole, so that all loads fall alike; what is fixed takes no more."""
        given = np.array(self.counts)
        free = np.array([not motion.is_fixed for motion in self.motions], dtype=bool)
        if not free.any():
            return self
        exact = np.where(free, given * ((steps - given[~free].sum()) / given[free].sum()), given)
        counts = np.floor(exact).astype(int)
        counts[np.argsort(counts - exact, kind="stable")[: steps - int(counts.sum())]] += 1
        return replace(self, counts=tuple(counts.tolist()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Retimer:
    """What a joint path is retimed by."""

    bounds: JointLimitsInTime  # limits of all joints
    step: float  # time between two rows in [s]
    # share of the tools' speed limits that is taken up at the speed of the nominal time, at nominal times in [s], shape
    # (N,) to shape (N,)
    feed_share: Callable[[Array], Array]
    slower: Slower  # factor by which rows must be slower for every limit to hold in them; at most 1 where all do
    fixed_rates: tuple[FixedRate, ...] = ()  # where the rate of the nominal time is demanded
    # errors of the tools between rows, which ``feed_share`` then bounds the speed by; None for no such limit. Where
    # they cannot be kept by a slower motion they are left to the checks.
    errors: StepTolerance | None = None

    def fastest(self, path: JointPath) -> RetimedPath:
        """The fastest motion found along a path."""
        made: list[tuple[int, TimedRows]] = []
        rest = 0.0
        for pieces in self._joined(stretches(path, self.bounds.velocity)):
            begin, end = float(pieces[0].sigma[0]), float(pieces[-1].sigma[-1])
            whole = self._at_fixed_rate(replace(pieces[0], sigma=np.array([begin, end]))) if len(pieces) > 1 else None
            if whole is not None:
                made += [*self._rest(rest, begin), whole]
                rest = end
                continue
            for piece in pieces:
                made += [*self._rest(rest, float(piece.sigma[0])), self._at_fixed_rate(piece) or self._settled(piece)]
                rest = float(piece.sigma[-1])
        made += self._rest(rest, path.end)
        retimed = RetimedPath(
            motions=tuple(motion for _, motion in made), counts=tuple(count for count, _ in made), end=path.end
        )
        for _ in range(MOST_STRETCHINGS):
            sigma = retimed.sigma
            factor = self.slower(sigma, path.at(sigma))
            if factor <= 1.0:
                return retimed
            both = zip(retimed.motions, retimed.counts, strict=True)
            counts = tuple(count if motion.is_fixed else _longer(count, factor) for motion, count in both)
            if counts == retimed.counts:
                return retimed
            retimed = replace(retimed, counts=counts)
        return retimed

    def _joined(self, pieces: Sequence[PathStretch]) -> list[list[PathStretch]]:
        """Stretches in groups, between which joints rest for a while within one stretch whose rate is demanded.

        A tool that stands at the edges of its weave does so: such a rest is passed at that rate like all around it, not
        rounded up to whole steps.
        """
        groups: list[list[PathStretch]] = []
        for piece in pieces:
            begin, end = float(groups[-1][-1].sigma[-1]) if groups else 0.0, float(piece.sigma[0])
            is_within = any(it.begin < begin and end < it.end for it in self.fixed_rates)
            is_short = piece.sigma[-1] - piece.sigma[0] < FEWEST_STEPS * self.step  # one in which joints hardly move
            if groups and is_within and (is_short or end - begin > MARGIN):
                groups[-1].append(piece)
            else:
                groups.append([piece])
        return groups

    def _rest(self, begin: float, end: float) -> list[tuple[int, TimedRows]]:
        """What is demanded of a rest of all joints with its steps; nothing where no time has to pass.

        Where errors between rows count, a rest takes a step at least: in a step into it or out of it the nominal time
        would run ahead of the joints.
        """
        spans = spans_within(self.fixed_rates, begin, end)
        waits = AtRest(begin, end, spans)
        takes_steps = len(spans) or (self.errors is not None and end - begin > MARGIN)
        return [(whole_steps(waits.seconds, self.step), waits)] if takes_steps else []

    def _at_fixed_rate(self, piece: PathStretch) -> tuple[int, TimedRows] | None:
        """The motion of one stretch with the demanded rates; None where nothing is demanded, or limits forbid it."""
        begin, end = float(piece.sigma[0]), float(piece.sigma[-1])
        spans = spans_within(self.fixed_rates, begin, end)
        spans = spans[np.diff(spans, axis=1)[:, 0] > FEWEST_STEPS * self.step]
        if not len(spans):
            return None
        left = min(
            fixed_rate.tolerance for fixed_rate in self.fixed_rates if fixed_rate.begin < end and fixed_rate.end > begin
        )
        for share in RATES:
            motion = AtFixedRate(piece, spans, 1.0 - left * (1.0 - share), self.step)
            count = least_steps(motion, lambda sigma: self.slower(sigma, piece.path.at(sigma)) <= 1.0)
            if count is not None:
                return count, motion
        return None

    def _settled(self, piece: PathStretch) -> tuple[int, TimedRows]:
        """The motion of one stretch with its steps, from so many lengths that twice as many change it little."""
        written = AsWritten(piece)
        count = max(2, round(float(piece.sigma[-1] - piece.sigma[0]) / self.step))
        sigma = written.rows(count)
        slow = self._steps(piece, written, count * self.step * self.slower(sigma, piece.path.at(sigma)))
        rough = self._profile(piece, FEWEST_POINTS).duration
        points = int(np.clip(POINTS_PER_ROW * rough / self.step, FEWEST_POINTS, MOST_POINTS // 4))
        count, motion = self._best(piece, points)
        while points < MOST_POINTS // 2:
            points, before = 2 * points, count
            count, motion = self._best(piece, points)
            if abs(count - before) <= max(1.0, SETTLED * before):
                break
        for _ in range(MOST_TIGHTENINGS):
            if self.errors is None or self.errors.tighten(motion.rows(count)):
                break
            count, motion = self._best(piece, points)
        count = self._tolerant(count, motion)
        slow = self._tolerant(slow, written) if slow < count else slow
        return (slow, written) if slow < count else (count, motion)

    def _tolerant(self, count: int, motion: TimedRows) -> int:
        """Steps of a motion made slower until no tool is farther off between rows than is allowed."""
        for number in range(MOST_STRETCHINGS):
            share = float(self.errors.largest(motion.rows(count)).max()) if self.errors else 0.0
            if share <= 1.0:
                break
            count = _longer(count, share**0.5) if number < MOST_ROOTS else count + 1
        return count

    def _best(self, piece: PathStretch, points: int) -> tuple[int, TimedRows]:
        """The shortest motion of one stretch among the windows and shares that are tried, and its steps."""
        build_up = self.bounds.build_up
        if build_up:
            profiles = [self._profile(piece, points, share) for share in BEND_SHARES]
            tried = [RestToRest(piece, profile, window * build_up) for profile in profiles for window in WINDOWS]
        else:
            tried = [RestToRest(piece, self._profile(piece, points), 0.0)]
        counts = [self._steps(piece, motion, motion.duration) for motion in tried]
        best = counts.index(min(counts))
        return counts[best], tried[best]

    def _profile(self, piece: PathStretch, points: int, bend_share: float | None = None) -> SpeedProfile:
        """Fastest motion along one stretch; lengths lie closer to each other near the rests.

        At a constant speed v of the path a joint has the jerk v^3 times its third derivative by the length: with a
        share for the bends of the path, v is bounded so that this takes up no more of any limit.
        """
        lengths = 0.5 * piece.length * (1.0 - np.cos(np.pi * np.arange(points + 1) / points))
        sigma = piece.at(lengths)
        share = self.feed_share(sigma)
        rates = np.interp(sigma, piece.sigma, piece.rates)
        highest = np.where(share > 0.0, rates / np.where(share > 0.0, share, 1.0), np.inf)
        highest[[0, -1]] = np.inf
        directions = piece.directions(sigma)
        if bend_share is not None:
            third = np.gradient(np.gradient(directions, lengths, axis=0), lengths, axis=0)
            with np.errstate(divide="ignore"):
                highest = np.minimum(highest, np.cbrt((bend_share * self.bounds.jerk / np.abs(third)).min(axis=1)))
        reserve = 1.0 if bend_share is None else RESERVE
        return fastest_profile(
            lengths,
            directions,
            velocity=self.bounds.velocity,
            acceleration=reserve * self.bounds.acceleration,
            highest=highest,
            further=self._torques(piece.path, sigma, lengths, directions, reserve),
        )

    def _torques(
        self, path: JointPath, sigma: Array, lengths: Array, directions: Array, reserve: float
    ) -> PathLoads | None:
        """Limited torques along a stretch, up to a share of what gravity leaves of the limits; None without any."""
        bent = np.gradient(directions, lengths, axis=0) if self.bounds.torques else directions
        limits, q = (it.in_slow_motion(reserve**0.5) for it in self.bounds.torques), path.at(sigma)
        loads = [it.along(q, directions, bent, sigma=sigma) for it in limits]
        return reduce(PathLoads.joined, loads) if loads else None

    def _steps(self, piece: PathStretch, motion: TimedRows, duration: float) -> int:
        """Steps that a motion of one stretch takes, made slower as a whole until every limit holds in its rows."""
        count = max(2, int(np.ceil(duration / self.step * (1.0 - MARGIN))))
        for _ in range(MOST_STRETCHINGS):
            sigma = motion.rows(count)
            factor = self.slower(sigma, piece.path.at(sigma))
            if factor <= 1.0:
                break
            count = _longer(count, factor)
        return count


def _longer(count: int, factor: float) -> int:
    """Steps of a motion that is slower by a factor: more than before."""
    return max(count + 1, int(np.ceil(count * factor * (1.0 - MARGIN))))


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
