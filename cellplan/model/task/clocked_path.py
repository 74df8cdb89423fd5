"""Clocked path: the desired motion of one tool at any time, and the times at which it is not smooth."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.arrays import Flags
from cellplan.geometry.curves.arc_length import QuickParameters
from cellplan.geometry.curves.curve import Interval
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.transforms import Array, rotation_about
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.pace import Pace
from cellplan.model.task.task import TIME_TOLERANCE, Task, TimeLawKind
from cellplan.model.task.time_law import advance, reached_at, stand_off
from cellplan.model.task.toolpath import TOOL_Z, Toolpath

SAME_PLACE: Final = 1e-12  # [-] of the whole length: knots nearer to a stop lie on it
INSTANT: Final = 1e-5  # [s] before and after a time: what the tool travels between gives its speed
MOST_BREAKS: Final = 2_000_000  # smooth stretches of a motion; integration over more of them takes too long
Spans = tuple[tuple[float, float], ...]


class DemandedSpan(NamedTuple):
    """A stretch of time in which the feed of a process is demanded."""

    begin: float  # its begin in [s]
    end: float  # its end in [s]
    feed: float  # the feed in [m/s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClockedPath:
    """Toolpath of one task on the common clock."""

    task: Task  # the task
    toolpath: Toolpath  # where its tool must be
    # times in [s] at which the stretches begin, and the one at which the last ends: each takes its own start and stop
    # of the time law. The cycles of a trajectory are its stretches.
    corners: Array
    behind: Array  # length in [m] behind each stop of one cycle, shape (pieces + 1,)
    quick: QuickParameters  # way from lengths to parameters of the path for a few times at a time
    # speeds of the stretches of a path whose file states feeds; ``behind`` then has an entry for each of their ends
    pace: Pace | None = None

    @property
    def start(self) -> float:
        """Time in [s] at which the tool starts along its path; an approach and the delay of a process are over."""
        return float(self.corners[0])

    @property
    def end(self) -> float:
        """Time in [s] at which the path is done."""
        return float(self.corners[-1])

    @property
    def over(self) -> float:
        """Time in [s] from which on the tool rests: it is out of the way."""
        return self.end + self.task.leaving

    @property
    def breaks(self) -> Array:
        """Times in [s], increasing, at which the desired pose or one of its derivatives may jump, shape (B,).

        These are the ends of an approach, of the stretches, of the cycles, of the ramps of a trapezoid and of a
        retreat, and all knots of the tip's curve and of the orientation. Between two neighbours the motion is
        analytic: circles, sides, roundings, splines and their image on a box, a cylinder or a sphere are, between
        their knots. A path on a mesh is the cubic through its rays: each ray is a knot.

        Raises:
            InputError: There are more than two million.
        """
        knots = self.toolpath.knots
        if self.task.repeat * len(knots) > MOST_BREAKS:
            raise InputError(
                f"{self.task.where('path')}: expected at most {MOST_BREAKS} knots of the path in all cycles, got "
                f"{len(knots)} in each of {self.task.repeat}; repeat it less often, or write solver.integrator: euler"
            )
        return distinct(np.concatenate([self.jumps, self._instants(knots)]))

    @property
    def jumps(self) -> Array:
        """The breaks that do not come from knots of the path, in [s], increasing, shape (J,)."""
        breaks = [self.corners, np.array([self.over]), np.array(fixed_rests(self)).ravel()]
        if self.task.approach is not None:
            breaks.append(np.array([self.task.start - self.task.approach.duration]))
        if self.task.time_law.kind in {TimeLawKind.TRAPEZOID, TimeLawKind.STEADY} and not self.toolpath.is_timed:
            first, last = (ramp_shares(self) * np.diff(self.corners)[:, None]).T
            breaks += [self.corners[:-1] + first, self.corners[1:] - last]
        return distinct(np.concatenate(breaks))

    def at(self, times: Array, within: Interval) -> tuple[Array, Array]:
        """Reference poses and twists at times of a smooth stretch of time, its ends seen from inside.

        Args:
            times: Times in [s], shape (N,).
            within: Two neighbours of the `breaks`, of this path or of all, between which the times lie, ends
                included: one pair for all, or arrays of shape (N,) with a pair for each sample. At its ends the
                twist is the one inside: that of a moving tool where a constant law starts or passes a corner.

        Returns:
            Poses X_PT, shape (N, 4, 4), and twists V_PT_P, linear first, shape (N, 6), in [m/s] and [rad/s].
        """
        low, high = within
        inside = np.clip(times, low, high)
        middle = np.broadcast_to(np.asarray(0.5 * (low + high)), inside.shape)
        if self.toolpath.is_timed:
            X_PT, V_PT_P = self.toolpath.at(self._times_in_cycle(inside, self.toolpath.duration)[1])
        else:
            X_PT, V_PT_P, _ = self._by_time_law(inside, self._stretches(middle), quick=self.quick)
        V_PT_P[(middle < self.corners[0]) | (middle > self.corners[-1])] = 0.0
        stand_off(inside, self.task, X_PT, V_PT_P=V_PT_P, end=leaves_at(self.task, self.corners))
        return X_PT, V_PT_P

    def poses(self, times: Array) -> Array:
        """Reference poses X_PT with approach and retreat at times in [s], shape (M,), shape (M, 4, 4)."""
        X_PT, V_PT_P, _ = self.targets(times)
        stand_off(times, self.task, X_PT, V_PT_P=V_PT_P, end=leaves_at(self.task, self.corners))
        return X_PT

    def targets(self, times: Array) -> tuple[Array, Array, Array]:
        """Poses, twists and lengths behind the tool while it follows its path, without approach and retreat.

        Args:
            times: Times in [s], shape (N,); before and after the path its nearer end is taken, at a corner the later
                side.

        Returns:
            Poses X_PT, shape (N, 4, 4), twists V_PT_P, shape (N, 6), and lengths in [m] that grow from cycle to cycle,
            shape (N,).
        """
        path = self.toolpath
        if path.is_timed:
            cycle, t = self._times_in_cycle(times, path.duration)
            return *path.at(t), cycle * path.length + path.arc.lengths(t)
        return self._by_time_law(times, self._stretches(times + TIME_TOLERANCE))

    def _stretches(self, times: Array) -> NDArray[np.intp]:
        """Number of the stretch that times in [s] fall into, shape (N,); the nearest before and after all."""
        stretch = np.searchsorted(self.corners, times, side="right") - 1
        return np.clip(stretch, 0, len(self.corners) - 2)

    def _times_in_cycle(self, times: Array, period: float) -> tuple[Array, Array]:
        """Cycles of a trajectory and times within them, shape (N,); it passes from one to the next smoothly."""
        starts = self.corners
        elapsed = np.clip(times - starts[0], 0.0, starts[-1] - starts[0])
        cycle = np.minimum(elapsed // period, len(starts) - 2)
        return cycle, np.clip(elapsed - cycle * period, 0.0, period)

    def _by_time_law(
        self, times: Array, stretch: NDArray[np.intp], *, quick: QuickParameters | None = None
    ) -> tuple[Array, Array, Array]:
        """See `targets`; the stretch says which side counts at a corner."""
        task, toolpath, behind = self.task, self.toolpath, self.behind
        begin, duration = self.corners[stretch], self.corners[stretch + 1] - self.corners[stretch]
        elapsed = np.clip(times - begin, 0.0, duration)
        elapsed = np.where(
            elapsed <= TIME_TOLERANCE, 0.0, np.where(duration - elapsed <= TIME_TOLERANCE, duration, elapsed)
        )
        drops = None if self.pace is None else self.pace.drops[stretch]
        law = advance(task.time_law, elapsed / duration, ramp_shares(self)[stretch], drops)
        if toolpath.runs_on:
            length = np.full(len(times), task.repeat * behind[-1])
            cycle = np.clip((law.share * length) // behind[-1], 0, task.repeat - 1)
            piece = np.zeros(len(times), dtype=np.intp)
            s = law.share * length - cycle * behind[-1]
        else:
            cycle, piece = np.divmod(stretch, len(behind) - 1)
            length = np.diff(behind)[piece]
            s = behind[piece] + law.share * length
            piece = piece if self.pace is None else self.pace.pieces[piece]
        X_PT, twists = toolpath.targets(piece, s, quick=quick)
        if task.repeat > 1 and toolpath.turn:
            X_PT[:, :3, :3] = X_PT[:, :3, :3] @ rotation_about(TOOL_Z, cycle * toolpath.turn)
        return X_PT, twists * (law.rate * length / duration)[:, None], cycle * behind[-1] + s

    def _instants(self, knots: Array) -> Array:
        """Times in [s] at which the path passes its knots, of all cycles, shape (N,)."""
        path, law, ramps = self.toolpath, self.task.time_law, ramp_shares(self)
        cycles = np.arange(self.task.repeat)[:, None]
        if path.is_timed:
            return (self.corners[:-1, None] + knots).ravel()
        pieces = len(self.behind) - 1
        s = path.arc.lengths(knots)
        piece = np.clip(np.searchsorted(self.behind, s, side="right") - 1, 0, pieces - 1)
        tolerance = SAME_PLACE * self.behind[-1]
        is_inside = (s > self.behind[piece] + tolerance) & (
            s < self.behind[piece + 1] - tolerance
        )  # the stops are corners
        s, piece = s[is_inside], piece[is_inside]
        if path.runs_on:
            share = (cycles + np.append(0.0, s / self.behind[-1])).ravel() / self.task.repeat
            return self.start + (self.end - self.start) * reached_at(law, share, float(ramps[0, 0]))
        stretch = cycles * pieces + piece
        done = np.broadcast_to((s - self.behind[piece]) / np.diff(self.behind)[piece], stretch.shape)
        tau = reached_at(law, done, ramps[stretch], None if self.pace is None else self.pace.drops[stretch])
        return (self.corners[stretch] + np.diff(self.corners)[stretch] * tau).ravel()


def on_line(path: ClockedPath, travelled: Array) -> tuple[Array, Array]:
    """Points of a path without its weave, and how far the weave leads the tip from them.

    Args:
        travelled: Lengths in [m] behind the tool, which grow from cycle to cycle, shape (N,).

    Returns:
        Both in [m], shape (N, 3), expressed in P.
    """
    toolpath = path.toolpath
    s = travelled - toolpath.length * np.clip(travelled // toolpath.length, 0, path.task.repeat - 1)
    points: Array = toolpath.without_weave.poses(s)[:, :3, 3]
    return points, np.zeros_like(points) if toolpath.line is None else toolpath.poses(s)[:, :3, 3] - points


def seam_at(path: ClockedPath, travelled: Array) -> SeamLine | None:
    """The seam at lengths in [m] behind the tool, which grow from cycle to cycle, shape (N,); None without walls."""
    toolpath = path.toolpath
    s = travelled - toolpath.length * np.clip(travelled // toolpath.length, 0, path.task.repeat - 1)
    whole = (float(toolpath.stops[0]), float(toolpath.stops[-1]))
    return None if toolpath.seam is None else toolpath.seam.line(toolpath.arc.parameters(s, whole), whole)


def travel_speeds(path: ClockedPath, times: Array) -> Array:
    """Speed in [m/s] along the path, without a weave, at times in [s], shape (N,)."""
    if path.toolpath.line is None:
        return np.asarray(np.linalg.norm(path.targets(times)[1][:, :3], axis=1))
    low, high = (path.targets(np.clip(times + h, path.start, path.end))[2] for h in (-INSTANT, INSTANT))
    return (high - low) / (2.0 * INSTANT)


def distinct(times: Array) -> Array:
    """Times in increasing order, one for those that are nearer to each other than rounding, shape (n,)."""
    ordered = np.sort(times)
    return ordered[np.diff(ordered, prepend=-np.inf) > TIME_TOLERANCE]


def are_within(times: Array, spans: Iterable[tuple[float, float]]) -> Flags:
    """Which times in [s], shape (N,), lie in one of some stretches, ends included."""
    inside = np.zeros(len(times), dtype=bool)
    for begin, end in spans:
        inside |= (times >= begin - TIME_TOLERANCE) & (times <= end + TIME_TOLERANCE)
    return inside


def leaves_at(task: Task, corners: Array) -> float:
    """Time in [s] at which a tool leaves the end of its path: after the delay of its process, and a dwell.

    Corners are times in [s] at which the stretches of its path begin, and the one at which the last ends; so below.
    """
    return float(corners[-1]) + task.off_delay + task.dwell


def process_spans(path: ClockedPath) -> Spans:
    """Stretches of time in [s] in which a process is on; without one, that from the start of the path to its end."""
    task, corners, pace = path.task, path.corners, path.pace
    if pace is None:
        lead = 0.0 if task.process is None else task.process.lead_s
        begin, end = work_span(path)
        return ((begin - lead, end - lead),)
    edges = np.flatnonzero(np.diff(pace.is_on.astype(np.int8), prepend=0, append=0))  # on and off in turns
    ends = np.concatenate([[task.start], corners[1:-1], [path.end + task.off_delay]])[edges]
    ends -= 0.0 if task.process is None else task.process.lead_s
    return tuple(zip(ends[0::2].tolist(), ends[1::2].tolist(), strict=True))


def work_span(path: ClockedPath) -> tuple[float, float]:
    """Begin and end in [s] of the work: of the path with the delays of its process, or between its runs."""
    task, (run_in, run_out) = path.task, path.toolpath.runs
    first, last = (0.0, 0.0) if task.process is None else task.process.ramps(path.toolpath.runs)
    return path.start + first if run_in else task.start, path.end - last if run_out else path.end + task.off_delay


def run_easing(task: Task, path: tuple[float, float], work: tuple[float, float], times: Array) -> Array:
    """Share of a position error that counts against the tolerance of a task, less on its runs, shape (N,).

    ``path`` and ``work`` are the begins and ends in [s] of both; times are in [s], shape (N,).
    """
    stated = None if task.process is None else task.process.run_tolerance_mm
    off_work = (times < work[0] - TIME_TOLERANCE) | (times > work[1] + TIME_TOLERANCE)
    on_run = off_work & (times >= path[0] - TIME_TOLERANCE) & (times <= path[1] + TIME_TOLERANCE)
    return np.where(on_run, 1.0 if stated is None else task.tolerance.position_mm / stated, 1.0)


def fixed_rests(path: ClockedPath) -> Spans:
    """Stretches of time in [s] that a retimed program keeps: the delays of a process, and a dwell."""
    task, corners = path.task, path.corners
    off = path.end + task.off_delay
    ends = [(task.start, path.start), (path.end, off), (off, leaves_at(task, corners))]
    if path.pace is not None:
        ends += [(corners[k], corners[k + 1]) for k in np.flatnonzero(path.pace.tops == 0.0)]
    return tuple((float(begin), float(end)) for begin, end in ends if end - begin > TIME_TOLERANCE)


def demanded_spans(path: ClockedPath) -> tuple[DemandedSpan, ...]:
    """Stretches of time in [s] in which the feed of a process is demanded: between its ramps."""
    task, corners, pace = path.task, path.corners, path.pace
    if task.process is None:
        return ()
    if pace is None:
        first, last = (ramp_shares(path) * np.diff(corners)[:, None]).T
        both = zip(corners[:-1] + first, corners[1:] - last, strict=True)
        spans = [DemandedSpan(float(begin), float(end), task.process.feed) for begin, end in both]
    else:
        ramps = task.process.ramp * (pace.drops > 0.0)
        ends = zip(corners[:-1] + ramps[:, 0], corners[1:] - ramps[:, 1], pace.tops, strict=True)
        spans = [DemandedSpan(*map(float, it)) for it, has_feed in zip(ends, pace.is_at_feed, strict=True) if has_feed]
    return tuple(span for span in spans if span.end - span.begin > TIME_TOLERANCE)


def stated_feeds(path: ClockedPath, times: Array) -> Array:
    """Feeds in [m/s] that the file of a path states between times in [s], shape (N,), with ramps; NaN elsewhere.

    That is in rapids and rests, and where a stretch is too short for its feed; shape (N - 1,).
    """
    middle = 0.5 * (times[:-1] + times[1:])
    if path.pace is None:
        return np.full(len(middle), np.nan)
    stretch = np.clip(np.searchsorted(path.corners, middle, side="right") - 1, 0, len(path.pace.tops) - 1)
    on_path = (middle >= path.start) & (middle <= path.end) & path.pace.is_at_feed[stretch]
    return np.where(on_path, path.pace.tops[stretch], np.nan)


def stops_of(path: ClockedPath) -> Array:
    """Times in [s] at which a tool stands on its path, at the ends of its stretches, shape (n,)."""
    return path.corners if path.pace is None else path.corners[np.append(path.pace.drops[:, 0] == 1.0, True)]


def ramp_shares(path: ClockedPath) -> Array:
    """Shares of the time of each stretch that the ramps of its time law take, shape (corners - 1, 2)."""
    process, duration = path.task.process, np.diff(path.corners)
    if path.pace is not None or process is None:
        shares = np.full(len(duration), path.task.time_law.ramp) if path.pace is None else path.pace.ramps
        return np.repeat(shares[:, None], 2, axis=1)
    return ramp_times(process, path.toolpath, len(duration)) / duration[:, None]


def ramp_times(process: ProcessEntry, toolpath: Toolpath, count: int) -> Array:
    """Times in [s] of the ramps at the ends of each of some stretches of a path, shape (count, 2)."""
    ramps = np.full((count, 2), process.ramp)
    ramps[0, 0], ramps[-1, 1] = process.ramps(toolpath.runs)
    return ramps
