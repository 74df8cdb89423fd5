"""Accurate run: the joints of one cell as polynomials in time, by collocation."""

from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.task.clocked_path import distinct
from cellplan.model.task.task import TIME_TOLERANCE
from cellplan.planning.collocation.batch_targets import desired_motion, in_windows, sampled
from cellplan.planning.collocation.batch_tasks import BatchTasks
from cellplan.planning.collocation.joint_polynomials import CollocatedPath
from cellplan.planning.collocation.redundancy import redundancy
from cellplan.planning.collocation.solver import (
    CONFIGURATION_SHARE,
    Collocation,
    Drift,
    NullSpaceMotion,
    Precision,
    largest,
)
from cellplan.planning.collocation.start_offset import start_offset
from cellplan.planning.collocation.windows import Panel, Window, windows_between
from cellplan.planning.euler.cycle_closing import SAME_POSE, drift_pace
from cellplan.planning.tracking.given_path import GivenVelocities
from cellplan.planning.tracking.motion_task import MotionTask, locked_since
from cellplan.scene.kinematics.batched import CACHE_BLOCK

SETTLING_STEPS: Final = 20  # of the clock, in which a tool that starts within its tolerance comes to its path
SHORTEST_SHARE: Final = 1.0 / 4096.0  # of the motion: panels may be that short where steps of the clock are longer
TO_CLOSE: Final = 1e-7  # [m] and [rad]: what no tool is back to brings no joint back
STEADY: Final = 1e-11  # [rad] and [m]: so near to their limit, configurations depend smoothly on a drift
KINKED: Final = 1e-4  # [rad] and [m] to which passes settle where nearest points slide round edges: no nearer do they
ONLY: Final = np.zeros(1, dtype=np.intp)  # the one cell among all of a collocation


class AccurateRun:
    """One run of one cell.

    Attributes:
        end: End of the run in [s].
        sweeps: Passes over windows so far.
        solves: Systems of equations solved so far.
    """

    def __init__(self, motion: MotionTask, *, progress: Progress = silent) -> None:
        """Gather the tasks, and measure how far the tools stand beside their paths at the start."""
        cell, schedule, grasps = motion.cell, motion.schedule, motion.grasps
        if not schedule.is_continuous:
            raise TypeError("accurate run: expected a desired motion between samples, got none")
        accuracy = min(cell.solver.accuracy_mm.si, TO_CLOSE) if cell.motion.cyclic else cell.solver.accuracy_mm.si
        tasks = BatchTasks(cell, motion.relations, motion.moving, is_refined=cell.motion.cyclic)
        placement, self.end = tasks.chains.placement(cell), float(schedule.times[-1])
        breaks, jumps = schedule.breaks, schedule.jumps
        until, first = _settled(cell, schedule, len(grasps)), breaks[:2]
        on_paths = desired_motion(schedule.paths, grasps)
        desired = on_paths(first[:1], first[:1], first[1:])
        offset = start_offset(tasks, desired, placement, start=motion.start, until=until, accuracy=accuracy)
        self._precision = Precision(
            accuracy=accuracy,
            configuration_tol=_configuration_tol(cell),
            shortest=min(cell.motion.finer or cell.motion.step, SHORTEST_SHARE * self.end),
        )
        self.sweeps = self.solves = 0
        self._tasks, self._placement, self._grasps, self._offset = tasks, placement, grasps, offset
        self._on_paths, self._desired_at = on_paths, desired_motion(schedule.paths, grasps, offset)
        self._locked_since, self._progress = locked_since(cell), progress
        self._given = GivenVelocities.of(cell, self.end, motion.moving)
        knots = np.zeros(0) if self._given is None else self._given.knots
        self._redundancy = redundancy(motion, tasks)
        switched = np.zeros(0) if self._redundancy is None else self._redundancy.breaks
        inner = np.concatenate([jumps, self._locked_since, knots, switched, *([] if offset is None else [until])])
        self._breaks = distinct(inner[(inner > 0.0) & (inner < self.end)])
        self._knots = breaks

    def path(self, q: Array, *, begin: float, end: float, drift: Array | None = None) -> CollocatedPath:
        """Motion from a configuration at ``begin``, shape (nq,), up to ``end``, or as far as collocation converges.

        Args:
            begin: First time in [s].
            end: Last time in [s].
            drift: Mean joint velocities that are added in the null space of the tasks, shape (nq,); they begin and end
                with rest.
        """
        panels: list[Panel] = []
        nodes: list[Array] = []
        errors = [0.0]

        def record(window: Window, _cells: Indices, q: Array, worst: Array) -> None:
            panels.extend(window.panels)
            nodes.extend(q[:, 0, place] for place in window.places)
            errors.append(float(worst[0]))
            self._progress("planning", window.panels[-1].end / self.end)

        paced = None if drift is None else _paced(drift, begin, end)
        if self._given is not None:
            paced = self._given.at
        at = q[:, None].copy()
        for breaks in self._stretches(begin, end):
            mobile = (self._locked_since > 0.5 * (breaks[0] + breaks[-1])).astype(float)
            collocation = Collocation(
                self._tasks,
                self._desired_at,
                self._placement,
                self._precision,
                mobile=mobile,
                null_space=NullSpaceMotion(drift=paced, redundancy=self._redundancy),
            )
            windows = windows_between(breaks, whole=self.end, knots=self._knots)
            arrived = collocation.carry(windows, at, ONLY, record)
            self.sweeps, self.solves = self.sweeps + collocation.sweeps, self.solves + collocation.solves
            if not len(arrived):
                break
        return CollocatedPath(q, begin, panels, nodes, max(errors))

    def gaps(self, begin: float, end: float) -> Array:
        """How far each tool is desired at one time from where it is desired at a later one, in pose entries."""
        inside = np.array([begin, end - TIME_TOLERANCE])
        X, _ = self._on_paths(np.array([begin, end]), inside, inside + TIME_TOLERANCE)
        return np.abs(np.diff(X[:3]))[..., 0].max(axis=(0, 1))

    def errors(self, schedule: Schedule, q: Array) -> Array:
        """Largest tool errors in [m] or [rad] at the first N samples, at configurations of shape (N, nq)."""
        worst = np.empty(len(q))
        for first in range(0, len(q), CACHE_BLOCK):
            some = slice(first, min(first + CACHE_BLOCK, len(q)))
            X, _ = sampled(schedule, some, self._grasps, self._offset)
            worst[some] = largest(self._tasks.errors(q[some].T, X, self._placement))
        return worst

    def repeated(self, cycle: CollocatedPath, *, begin: float) -> CollocatedPath | None:
        """The motion of a cycle once more from another time on; None where its tasks ask for something else."""
        again = cycle.shifted(begin - cycle.begin)
        if np.any((self._locked_since > cycle.begin) & (self._locked_since < again.end)):
            return None
        windows = [Window(tuple(path.panels)) for path in (cycle, again)]
        (here, _), (there, _) = (in_windows(self._desired_at, [window])[0] for window in windows)
        return again if np.abs(here - there).max() <= SAME_POSE else None

    def _stretches(self, begin: float, end: float) -> list[Array]:
        """Breaks between two times, cut where a joint fails; none when there is no time between them."""
        if end - begin <= TIME_TOLERANCE:
            return []
        inner = self._breaks[(self._breaks > begin + TIME_TOLERANCE) & (self._breaks < end - TIME_TOLERANCE)]
        breaks = np.concatenate([[begin], inner, [end]])
        is_lock = np.min(np.abs(breaks[:, None] - self._locked_since), axis=1) <= TIME_TOLERANCE
        cuts = [0, *(np.flatnonzero(is_lock[1:-1]) + 1).tolist(), len(breaks) - 1]
        return [breaks[low : high + 1] for low, high in pairwise(cuts)]


def _configuration_tol(cell: Cell) -> float | None:
    """How near configurations have to be to their limit in [rad] and [m]; None for what goes with the accuracy."""
    if cell.motion.cyclic:
        return STEADY
    if cell.solver.secondary.obstacles is not None:
        return max(KINKED, CONFIGURATION_SHARE * cell.solver.accuracy_mm.si)
    return None


def _paced(drift: Array, begin: float, end: float) -> Drift:
    """Speeds at times in [s] that begin and end with rest, for mean ones of shape (nq,)."""

    def velocities(times: Array) -> Array:
        return drift[:, None] * drift_pace((times - begin) / (end - begin))

    return velocities


def _settled(cell: Cell, schedule: Schedule, grasps: int) -> Array:
    """Times in [s] until which each tool, and that of each further holder, may be on its way to where it belongs."""
    given = [path.task.start + path.task.settle if path.task.settle else 0.0 for path in schedule.paths]
    soon = min(SETTLING_STEPS * (cell.motion.finer or cell.motion.step), 0.5 * float(schedule.times[-1]))
    return np.maximum(np.array(given + [0.0] * grasps), soon)
