"""Timing: when each tool is where on its path, at any time, and at which times its motion is not smooth."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.curves.arc_length import QuickParameters, quickly
from cellplan.geometry.curves.curve import Interval
from cellplan.geometry.transforms import Array, rotation_about
from cellplan.model.cell import Cell
from cellplan.model.task import INSTANT_ROOM, Task, TimeLawKind
from cellplan.model.toolpath import TOOL_Z, Toolpath, Trajectory
from cellplan.planning.timing.approach_retract import stand_off
from cellplan.planning.timing.time_law import advance, peak_rate, reached_at

MOST_SAMPLES: Final = 2_000_000  # tables longer than this fill disks, not controllers
SAME_PLACE: Final = 1e-12  # [-] of the whole length: knots nearer to a stop lie on it
MOST_BREAKS: Final = (
    2_000_000  # smooth stretches of a motion beyond which integration from one to the next takes too long
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClockedPath:
    """Toolpath of one task on the common clock.

    Attributes:
        task: The task.
        toolpath: Where its tool must be.
        corners: Times in [s] at which the stretches begin, and the one at which the last ends: each takes its own
            start and stop of the time law. The cycles of a trajectory are its stretches.
        behind: Length in [m] behind each stop of one cycle, shape (pieces + 1,).
        quick: Way from lengths to parameters of the path for a few times at a time.
        where: Place of the path in the cell file, for findings.
    """

    task: Task
    toolpath: Toolpath
    corners: Array
    behind: Array
    quick: QuickParameters
    where: str

    @property
    def start(self) -> float:
        """Time in [s] at which the path begins; an approach is over."""
        return float(self.corners[0])

    @property
    def end(self) -> float:
        """Time in [s] at which the path is done; leaving begins."""
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
        knots = self._knots()
        if self.task.repeat * len(knots) > MOST_BREAKS:
            raise InputError(
                f"{self.where}: expected at most {MOST_BREAKS} knots of the path in all cycles, got {len(knots)} in "
                f"each of {self.task.repeat}; repeat it less often, or write solver.integrator: euler"
            )
        return distinct(np.concatenate([self.jumps, self._instants(knots)]))

    @property
    def jumps(self) -> Array:
        """The breaks that do not come from knots of the path, in [s], increasing, shape (J,)."""
        found = [self.corners, np.array([self.over])]
        if self.task.approach is not None:
            found.append(np.array([self.start - self.task.approach.duration]))
        if self.task.time_law.kind is TimeLawKind.TRAPEZOID and not isinstance(self.toolpath, Trajectory):
            ramp = self.task.time_law.ramp * np.diff(self.corners)
            found += [self.corners[:-1] + ramp, self.corners[1:] - ramp]
        return distinct(np.concatenate(found))

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
        if isinstance(self.toolpath, Trajectory):
            X_PT, V_PT_P = self.toolpath.at(self._own_times(inside, self.toolpath.duration)[1])
        else:
            X_PT, V_PT_P, _ = self._by_time_law(inside, self.stretches(middle), quick=self.quick)
        V_PT_P[(middle < self.corners[0]) | (middle > self.corners[-1])] = 0.0
        stand_off(inside, self.task, X_PT, V_PT_P=V_PT_P, end=self.end)
        return X_PT, V_PT_P

    def stretches(self, times: Array) -> NDArray[np.intp]:
        """Number of the stretch that times in [s] fall into, shape (N,); the nearest before and after all."""
        stretch = np.searchsorted(self.corners, times, side="right") - 1
        return np.clip(stretch, 0, len(self.corners) - 2)

    def targets(self, times: Array, stretch: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Poses, twists and lengths behind the tool while it follows its path, without approach and retreat.

        Args:
            times: Times in [s], shape (N,); beyond its stretch the nearer end is taken.
            stretch: Stretch that each belongs to, shape (N,): it says which side counts at a corner.

        Returns:
            Poses X_PT, shape (N, 4, 4), twists V_PT_P, shape (N, 6), and lengths in [m] that grow from cycle to cycle,
            shape (N,).
        """
        path = self.toolpath
        if isinstance(path, Trajectory):
            cycle, t = self._own_times(times, path.duration)
            return *path.at(t), cycle * path.length + path.arc.lengths(t)
        return self._by_time_law(times, stretch)

    def _own_times(self, times: Array, period: float) -> tuple[Array, Array]:
        """Cycles of a trajectory and times within them, shape (N,); it passes from one to the next smoothly."""
        starts = self.corners
        elapsed = np.clip(times - starts[0], 0.0, starts[-1] - starts[0])
        cycle = np.minimum(elapsed // period, len(starts) - 2)
        return cycle, np.clip(elapsed - cycle * period, 0.0, period)

    def _by_time_law(
        self, times: Array, stretch: NDArray[np.intp], *, quick: QuickParameters | None = None
    ) -> tuple[Array, Array, Array]:
        """See `targets`, where each stretch takes its own start and stop of the time law."""
        task, toolpath, behind = self.task, self.toolpath, self.behind
        begin, duration = self.corners[stretch], self.corners[stretch + 1] - self.corners[stretch]
        elapsed = np.clip(times - begin, 0.0, duration)
        elapsed = np.where(
            elapsed <= INSTANT_ROOM, 0.0, np.where(duration - elapsed <= INSTANT_ROOM, duration, elapsed)
        )
        law = advance(task.time_law, elapsed / duration)
        if toolpath.runs_on:
            length = np.full(len(times), task.repeat * behind[-1])
            cycle = np.clip((law.share * length) // behind[-1], 0, task.repeat - 1)
            piece = np.zeros(len(times), dtype=np.intp)
            s = law.share * length - cycle * behind[-1]
        else:
            cycle, piece = np.divmod(stretch, len(behind) - 1)
            length = np.diff(behind)[piece]
            s = behind[piece] + law.share * length
        X_PT, twists = toolpath.targets(piece, s, quick=quick)
        if task.repeat > 1 and toolpath.turn:
            X_PT[:, :3, :3] = X_PT[:, :3, :3] @ rotation_about(TOOL_Z, cycle * toolpath.turn)
        return X_PT, twists * (law.rate * length / duration)[:, None], cycle * behind[-1] + s

    def _knots(self) -> Array:
        """Parameters of the path at which its tip or its orientation is joined, the ends included, shape (K,)."""
        path = self.toolpath
        knots: Array = np.unique(np.concatenate([path.tip.knots, path.orientation.knots, path.stops]))
        return knots[(knots >= path.stops[0]) & (knots <= path.stops[-1])]

    def _instants(self, knots: Array) -> Array:
        """Times in [s] at which the path passes its knots, of all cycles, shape (N,)."""
        path, law = self.toolpath, self.task.time_law
        cycles = np.arange(self.task.repeat)[:, None]
        if isinstance(path, Trajectory):
            return (self.corners[:-1, None] + knots).ravel()
        pieces = len(self.behind) - 1
        s = path.arc.lengths(knots)
        piece = np.clip(np.searchsorted(self.behind, s, side="right") - 1, 0, pieces - 1)
        room = SAME_PLACE * self.behind[-1]
        is_inside = (s > self.behind[piece] + room) & (s < self.behind[piece + 1] - room)  # the stops are corners
        s, piece = s[is_inside], piece[is_inside]
        if path.runs_on:
            share = (cycles + np.append(0.0, s / self.behind[-1])).ravel() / self.task.repeat
            return self.start + (self.end - self.start) * reached_at(law, share)
        tau = reached_at(law, (s - self.behind[piece]) / np.diff(self.behind)[piece])
        stretch = cycles * pieces + piece
        return (self.corners[stretch] + np.diff(self.corners)[stretch] * tau).ravel()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimedTasks:
    """All tasks on the common clock, before they are sampled.

    Attributes:
        times: Times of the clock in [s], evenly spaced from 0, shape (N,).
        paths: The paths of the tasks that are worked on.
        extra_breaks: Further times in [s] that count as jumps: ends of panels where errors were too large, shape (K,).
    """

    times: Array
    paths: tuple[ClockedPath, ...]
    extra_breaks: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def breaks(self) -> Array:
        """Times in [s], from zero to the end of the clock, between which the motion of all tools is smooth."""
        return self._within([path.breaks for path in self.paths])

    @property
    def jumps(self) -> Array:
        """Those of them that do not come from knots of the paths, which join pieces smoothly."""
        return self._within([path.jumps for path in self.paths])

    def poses(self, times: Array) -> tuple[Array, ...]:
        """Reference poses X_PT of all tasks at times in [s], shape (M,), shape (M, 4, 4) each."""
        found = []
        for path in self.paths:
            X_PT, V_PT_P, _ = path.targets(times, path.stretches(times + INSTANT_ROOM))
            stand_off(times, path.task, X_PT, V_PT_P=V_PT_P, end=path.end)
            found.append(X_PT)
        return tuple(found)

    def _within(self, found: Sequence[Array]) -> Array:
        """Times of all paths within the clock, and its ends."""
        end = float(self.times[-1])
        every = np.concatenate([self.extra_breaks, *found])
        inner = distinct(every[(every > INSTANT_ROOM) & (every < end - INSTANT_ROOM)])
        return np.concatenate([[0.0], inner, [end]])


def distinct(sample_times: Array) -> Array:
    """Times in increasing order, one for those that are nearer to each other than rounding, shape (n,)."""
    ordered = np.sort(sample_times)
    return ordered[np.diff(ordered, prepend=-np.inf) > INSTANT_ROOM]


def clock_path(cell: Cell, task: Task, toolpath: Toolpath) -> ClockedPath:
    """Put a toolpath on the common clock.

    Raises:
        InputError: The task has no time left, or more stops than anybody counts.
    """
    return ClockedPath(
        task=task,
        toolpath=toolpath,
        corners=_corner_times(cell, task, toolpath),
        behind=toolpath.behind,
        quick=quickly(toolpath.arc),
        where=cell.origin.at(f"tasks.{task.name}.path"),
    )


def _corner_times(cell: Cell, task: Task, toolpath: Toolpath) -> Array:
    """Times in [s] at which the stretches of a path begin, and the one at which the last ends."""
    if isinstance(toolpath, Trajectory):
        return task.start + toolpath.duration * np.arange(task.repeat + 1.0)
    behind = _stops(cell, task, toolpath)
    if task.feed is not None:
        return task.start + peak_rate(task.time_law) / task.feed * behind
    duration = task.time_for_path(cell.motion.duration)
    if duration is None:
        raise InputError(
            f"{cell.origin.at(f'tasks.{task.name}')}: missing duration_s: expected duration_s or feed_mm_s, as "
            "motion.duration_s is not given either"
        )
    if not duration > 0.0:
        raise InputError(
            f"{cell.origin.at(f'tasks.{task.name}.start_s')}: expected a start before the end of the clock at "
            f"{cell.motion.duration:g} s, got {task.start:g}; make motion.duration_s longer"
        )
    return task.start + duration * (behind / behind[-1])


def _stops(cell: Cell, task: Task, toolpath: Toolpath) -> Array:
    """Length in [m] behind each stop of all cycles, from zero to the whole way."""
    if task.repeat == 1:
        return toolpath.behind
    if toolpath.runs_on:
        return np.array([0.0, task.repeat * toolpath.length])
    behind = toolpath.behind
    if task.repeat * len(behind) > MOST_SAMPLES:
        raise InputError(
            f"{cell.origin.at(f'tasks.{task.name}.repeat')}: expected at most {MOST_SAMPLES // len(behind)} cycles of "
            f"a path with {len(behind) - 1} stops, got {task.repeat}"
        )
    cycles = np.arange(task.repeat)[:, None] * toolpath.length
    return np.append((cycles + behind[:-1]).ravel(), task.repeat * toolpath.length)
