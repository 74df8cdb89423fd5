"""Accurate run: the joints of one cell as polynomials in time, by collocation."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.task import INSTANT_ROOM
from cellplan.planning.closures import closures
from cellplan.planning.collocation import Collocation, Indices, largest
from cellplan.planning.joint_path import JointPath
from cellplan.planning.lane_targets import LaneTargets
from cellplan.planning.lane_tasks import LaneTasks
from cellplan.planning.locked_joints import locked_since
from cellplan.planning.start_offset import start_offset
from cellplan.planning.timing import TimedTasks, distinct
from cellplan.planning.windows import Panel, Window, windows_between

SETTLING_STEPS: Final = 20  # of the clock, in which a tool that starts within its tolerance comes to its path
AT_ONCE: Final = 512  # [samples] looked at together: their arrays stay in the cache
ONLY: Final = np.zeros(1, dtype=np.intp)  # the one cell among all of a collocation


class AccurateRun:
    """One run of one cell.

    Attributes:
        end: End of the run in [s].
        accuracy: Largest tool error that is let pass, in [m] and [rad].
        worst: Largest tool error so far at the nodes and between them, in [m] or [rad].
        collocation: What resolves it, and counts how much that takes.
    """

    def __init__(
        self, cell: Cell, timed: TimedTasks, *, start: Array, moving: Sequence[str], progress: Progress = silent
    ) -> None:
        """Gather the tasks, and see how far the tools stand beside their paths at the start.

        Args:
            cell: The cell.
            timed: The tasks on the common clock.
            start: Stacked start posture, shape (nq,).
            moving: Names of the robots that may move.
            progress: Who wants to know how far it is.
        """
        grasps, self.accuracy = closures(cell, moving), cell.solver.accuracy
        tasks = LaneTasks(cell, [*(path.task for path in timed.paths), *grasps], moving)
        breaks = timed.breaks
        targets = LaneTargets(timed, grasps)
        X_WB = np.array([[robot.X_WB for robot in cell.robots]])
        X_FT = np.array([[robot.tool.X_FT for robot in cell.robots]])
        placement = tasks.chains.placement(X_WB, X_FT)
        until = _settled(cell, timed, len(grasps))
        wanted = targets.at(breaks[:1], breaks[:1], breaks[1:2])
        targets.offset = start_offset(tasks, wanted, placement, start=start, until=until, accuracy=self.accuracy)
        self.collocation = Collocation(tasks, targets, placement, accuracy=self.accuracy)
        self.collocation.shortest = cell.motion.step
        self.end, self.worst = float(timed.times[-1]), 0.0
        self._locked_since, self._progress = locked_since(cell), progress
        inner = np.concatenate([breaks, self._locked_since, *([] if targets.offset is None else [until])])
        self._breaks = distinct(inner[(inner > 0.0) & (inner < self.end)])
        self._tasks, self._targets, self._placement = tasks, targets, placement

    def path(self, q: Array, *, begin: float, end: float, drift: Array | None = None) -> JointPath:
        """Motion from a posture at ``begin``, shape (nq,), up to ``end``, or as far as a way leads.

        Args:
            q: The posture.
            begin: First instant in [s].
            end: Last instant in [s].
            drift: Joint speeds that are asked for in the null space of the tasks, shape (nq,).
        """
        panels: list[Panel] = []
        nodes: list[Array] = []

        def record(window: Window, _cells: Indices, q: Array, errors: Array) -> None:
            panels.extend(window.panels)
            nodes.extend(q[:, 0, place] for place in window.places)
            self.worst = max(self.worst, float(errors[0]))
            self._progress("planning", window.panels[-1].end / self.end)

        self.collocation.drift = drift
        at = q[:, None].copy()
        for breaks in self._stretches(begin, end):
            self.collocation.mobile = (self._locked_since > 0.5 * (breaks[0] + breaks[-1])).astype(float)
            if not len(self.collocation.carry(windows_between(breaks, whole=self.end), at, ONLY, record)):
                break
        return JointPath(q, begin, panels, nodes)

    def errors(self, schedule: Schedule, q: Array) -> Array:
        """Largest tool error at each instant of the clock in [m] or [rad], shape (N,), at postures, shape (N, nq)."""
        worst = np.empty(len(q))
        for first in range(0, len(q), AT_ONCE):
            some = slice(first, min(first + AT_ONCE, len(q)))
            wanted = self._targets.sampled(schedule, some)
            worst[some] = largest(self._tasks.errors(q[some].T, wanted, self._placement))
        return worst

    def look_closer(self, path: JointPath, times: Array, errors: Array) -> None:
        """Cut panels in which an instant of the clock has too large an error, at the worst, for the next path.

        Args:
            path: The path that was found.
            times: Instants in [s], shape (N,).
            errors: Errors at them, shape (N,).
        """
        ends = np.array([panel.end for panel in path.panels])
        panel = np.searchsorted(ends, times)
        is_rough = errors > self.accuracy
        worst = [int(np.argmax(np.where(panel == number, errors, -1.0))) for number in np.unique(panel[is_rough])]
        self._breaks = distinct(np.concatenate([self._breaks, times[worst]]))
        self.worst = 0.0

    def _stretches(self, begin: float, end: float) -> list[Array]:
        """Breaks between two instants, cut where a joint fails."""
        inner = self._breaks[(self._breaks > begin + INSTANT_ROOM) & (self._breaks < end - INSTANT_ROOM)]
        breaks = np.concatenate([[begin], inner, [end]])
        is_lock = np.min(np.abs(breaks[:, None] - self._locked_since), axis=1) <= INSTANT_ROOM
        cuts = [0, *(np.flatnonzero(is_lock[1:-1]) + 1).tolist(), len(breaks) - 1]
        return [breaks[low : high + 1] for low, high in pairwise(cuts)]


def _settled(cell: Cell, timed: TimedTasks, grasps: int) -> Array:
    """Instants in [s] until which each tool, and that of each further holder, may be on its way to where it belongs."""
    given = [path.task.start + path.task.settle if path.task.settle else 0.0 for path in timed.paths]
    soon = min(SETTLING_STEPS * cell.motion.step, 0.5 * float(timed.times[-1]))
    until: Array = np.maximum(np.array(given + [0.0] * grasps), soon)
    return until
