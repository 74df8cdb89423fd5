r"""Tool errors between the rows of the tables, where every joint moves linearly from one row to the next.

Let x(s) be a tool tip seen from the part while the joints go from one row to the next, s from 0 to 1, and
:math:`|\ddot x| \le M` (``scene.lever_arms``). In each half of the step x stays within :math:`M/32` of its chord, and
so does the desired point within its own sag. The error is then nowhere larger than

.. math:: \max(e_0, e_{1/2}, e_1) + M/32 + \sigma/2

with the errors at both rows and in the middle, and the distance :math:`\sigma` of the desired point in the middle from
the middle of both ends: a smooth path sags by a quarter of it in half a step, of which twice as much is taken.
Rotations likewise: as chords of unit vectors, with the square of the sum of all turns in place of M; where a tool's
axis may lean, as chords of its whole angle, of which what lies beyond the cone is the error. Where this bound
is wider than what is allowed, and where the motion of a tool is not smooth, the step is subdivided into ten parts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.measures.tool_errors import error_lengths, part_poses, relative_to_task_frame
from cellplan.model.cell.cell import Relation, RobotRows, stacked_positions
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.between_rows import BetweenError, BetweenRows
from cellplan.model.report.report import ClosureAccuracy, TaskAccuracy
from cellplan.model.task.task import TIME_TOLERANCE, Frame, Task
from cellplan.scene.scene import Scene

SUBDIVISION_COUNT: Final = 10  # [-] subdivisions of a step
WORST_COUNT: Final = 20  # [-] steps with the largest errors in their middle that are subdivided in any case
MAX_TIMES: Final = 4000  # [-] times evaluated at once
ESTIMATE_FRACTION: Final = 0.1  # [-] taken off a step that is estimated from a much longer one
SIDE_FRACTION: Final = 1e-4  # [-] of a step: how far on both sides of a time a change of velocity is measured
SIDES: Final = (-SIDE_FRACTION, 0.0, SIDE_FRACTION)
KINK_FRACTION: Final = 0.1  # [-] of what is allowed: a smaller error by a change of speed does not count
INSIDE: Final = 2.0 * TIME_TOLERANCE  # [s] from an end of a step: a run may end with a row
ROTATIONS: Final = (3, 4, 5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _MeasuredTool:
    """A tool that is to be somewhere relative to the part, or to the world."""

    relation: Relation  # the task or the grasp
    at_rows: Array  # position error in [m] and orientation error in [rad] at the rows, shape (N, 2)
    allowed: tuple[float, float]  # largest errors allowed between the rows
    place: int | None  # place of its task among those of the schedule; None for a grasp
    first: int  # first row from which on it is judged
    # by how much it may be off besides at the rows in [m] and [rad], shape (N, 2); None for nothing
    off: Array | None = None
    easing: Array | None = None  # share of its position error that counts, in each step, shape (N - 1,); None for all

    def counted(self, errors: Array, k: Indices) -> Array:
        """What counts of errors in [m] and [rad] in steps k, shape (M, 2)."""
        return errors if self.easing is None else errors * np.stack([self.easing[k], np.ones(len(k))], axis=1)

    def more(self, k: Indices, s: Array) -> Array:
        """By how much it may be off besides at shares s of steps k, shape (M, 2)."""
        if self.off is None:
            return np.zeros((len(k), 2))
        return (1.0 - s)[:, None] * self.off[k] + s[:, None] * self.off[k + 1]


class ErrorsBetweenRows:
    """A program between its rows."""

    def __init__(self, scene: Scene, schedule: Schedule, q: RobotRows) -> None:
        """Store the program."""
        self._scene, self._schedule, self._q = scene, schedule, q
        stacked = stacked_positions(scene.cell, q)
        self._arms = LeverArms(scene, stacked)
        self._moved = self._arms.steps(stacked)
        self._jumped, self._share = _within_steps(schedule.times, schedule.jumps)

    def errors_between(
        self, accuracy: Sequence[TaskAccuracy], closures: Sequence[ClosureAccuracy], off: Sequence[Array] | None = None
    ) -> tuple[list[BetweenRows], list[BetweenRows]]:
        """Largest errors between the rows of every task and of every closure.

        Args:
            off: By how much each tool may be off besides at the rows, in [m] and [rad], shape (N, 2) each. As it is no
                more between two rows than the value between both, it keeps the bound as it is: a chord of errors and
                an even length are no longer together than at an end.
        """
        tools = [*self._task_tools(accuracy), *self._closure_tools(closures)]
        if off is not None:
            tools = [
                replace(tool, off=error, at_rows=tool.at_rows + error) for tool, error in zip(tools, off, strict=True)
            ]
        count = len(self._schedule.times) - 1
        middle, sag = self._middles(tools, count)
        bounds = [self._bounds(tool, middle[:, place], sag[:, place]) for place, tool in enumerate(tools)]
        chosen = np.zeros(count, dtype=bool)
        chosen[self._jumped] = True
        for place, tool in enumerate(tools):
            judged = np.arange(count) >= tool.first
            chosen |= judged & np.any(bounds[place] > tool.allowed, axis=1)
            for kind in range(2):
                chosen[np.argsort(-middle[:, place, kind] * judged, kind="stable")[:WORST_COUNT]] = True
        k, s = _subdivided(np.flatnonzero(chosen), self._jumped, self._share)
        fine, (jump_times, corners) = self._errors(tools, k, s), self._corners(tools)
        measured = [
            _ToolErrors(
                tool, middle[:, place], bounds[place], chosen, k, s, fine[:, place], jump_times, corners[:, place]
            )
            for place, tool in enumerate(tools)
        ]
        every = [self._worst(one, kind) for one in measured for kind in range(2)]
        step = min((error.longest_step for error in every if error.longest_step is not None), default=None)
        if step is not None and _stops_at_once(tools, corners[jump_times > self._schedule.times[-1] - TIME_TOLERANCE]):
            step = _fitting(step, float(self._schedule.times[-1]))
        every = [error if error.longest_step is None else replace(error, longest_step=step) for error in every]
        results = [BetweenRows(position=a, orientation=b) for a, b in zip(every[::2], every[1::2], strict=True)]
        return results[: len(accuracy)], results[len(accuracy) :]

    def _task_tools(self, accuracy: Sequence[TaskAccuracy]) -> list[_MeasuredTool]:
        times = self._schedule.times
        return [
            _MeasuredTool(
                relation=scheduled.task,
                at_rows=_lengths(errors) * np.stack([scheduled.easing(times), np.ones(len(times))], axis=1),
                allowed=scheduled.task.tolerance.between,
                place=place,
                first=scheduled.task.first_judged(times),
                easing=np.maximum(scheduled.easing(times[:-1] + INSIDE), scheduled.easing(times[1:] - INSIDE)),
            )
            for place, (scheduled, errors) in enumerate(zip(self._schedule.tasks, accuracy, strict=True))
        ]

    def _closure_tools(self, closures: Sequence[ClosureAccuracy]) -> list[_MeasuredTool]:
        checks = self._scene.cell.checks
        allowed = checks.closure_mm.si, checks.closure_deg.si
        return [
            _MeasuredTool(relation=grasp, at_rows=_lengths(errors), allowed=allowed, place=None, first=0)
            for grasp, errors in zip(self._scene.cell.closures, closures, strict=True)
        ]

    def _middles(self, tools: Sequence[_MeasuredTool], count: int) -> tuple[Array, Array]:
        """Errors in the middle of each step, and sags of the desired tip and axes there, shape (count, tools, 2)."""
        errors, sags = np.empty((count, len(tools), 2)), np.zeros((count, len(tools), 2))
        for begin in range(0, count, MAX_TIMES):
            k = np.arange(begin, min(begin + MAX_TIMES, count))
            poses_desired = self._desired_poses(k, np.full(len(k), 0.5))
            errors[k] = self._errors_of(tools, k, np.full(len(k), 0.5), poses_desired)
            for place, tool in enumerate(tools):
                if tool.place is not None:
                    rows = self._schedule.tasks[tool.place].X_PT
                    chord = 0.5 * (rows[k] + rows[k + 1])
                    sags[k, place] = _sag(poses_desired[tool.place] - chord, tool.relation)
        return errors, sags

    def _errors(self, tools: Sequence[_MeasuredTool], k: Indices, s: Array) -> Array:
        """Errors at shares s of steps k, shape (M, tools, 2)."""
        errors = np.empty((len(k), len(tools), 2))
        for begin in range(0, len(k), MAX_TIMES):
            part = slice(begin, begin + MAX_TIMES)
            errors[part] = self._errors_of(tools, k[part], s[part], self._desired_poses(k[part], s[part]))
        return errors

    def _desired_poses(self, k: Indices, s: Array) -> tuple[Array, ...]:
        """Desired poses of all tasks at shares s of steps k, shape (M, 4, 4) each."""
        times = self._schedule.times
        return self._schedule.poses(times[k] + s * (times[k + 1] - times[k]))

    def _errors_of(self, tools: Sequence[_MeasuredTool], k: Indices, s: Array, poses_desired: Sequence[Array]) -> Array:
        """Errors of all tools against desired poses, shape (M, tools, 2)."""
        cell, chains = self._scene.cell, self._scene.chains
        q = {name: rows[k] + s[:, None] * (rows[k + 1] - rows[k]) for name, rows in self._q.items()}
        X_WP = part_poses(cell, chains, q)
        errors = np.empty((len(k), len(tools), 2))
        for place, tool in enumerate(tools):
            relation, X_WT = tool.relation, chains[tool.relation.robot].tool_poses(q[tool.relation.robot])
            desired = poses_desired[tool.place or 0] if isinstance(relation, Task) else relation.X_PT[None]
            X_PT = relative_to_task_frame(relation, X_WT, X_WP)
            errors[:, place] = tool.counted(error_lengths(X_PT, desired, relation) + tool.more(k, s), k)
        return errors

    def _bounds(self, tool: _MeasuredTool, middle: Array, sag: Array) -> Array:
        """No error in a step is larger, in [m] and [rad], shape (N - 1, 2)."""
        cell, relation = self._scene.cell, tool.relation
        in_world = isinstance(relation, Task) and relation.relative_to is Frame.WORLD
        holder = cell.part.held_by[0].robot if cell.part.held_by and not in_world else None
        chain = self._arms.tool(relation.robot, seen_by=holder)
        nearby = np.maximum(np.maximum(tool.at_rows[:-1], tool.at_rows[1:]), middle)
        bound = np.empty_like(nearby)
        bound[:, 0] = nearby[:, 0] + chain.bend(self._moved) / 32.0 + 0.5 * sag[:, 0]
        angles = nearby[:, 1] + relation.tilt
        chord = 2.0 * np.sin(0.5 * angles) + chain.turn_bend(self._moved) / 32.0 + 0.5 * sag[:, 1]
        bound[:, 1] = np.maximum(2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord)) - relation.tilt, nearby[:, 1])
        constrained = sum(axis in relation.axes for axis in ROTATIONS)
        if not constrained:
            bound[:, 1] = 0.0
        elif constrained < len(ROTATIONS) and not relation.is_spin_free:
            bound[:, 1] = np.inf
        return bound

    def _corners(self, tools: Sequence[_MeasuredTool]) -> tuple[Array, Array]:
        """Times at which tools may change their speed at once, and the error of each tool there.

        A change of speed by v at a share s of a step of length h makes an error of ``v h s (1 - s)``. Where the rows of
        a shorter step would lie does not matter: the error is that of a corner in the middle of a step.

        Returns:
            Times in [s], shape (J,), and errors with the present step in [m] and [rad], shape (J, tools, 2).
        """
        times, step = self._schedule.times, self._schedule.step
        jump_times = self._schedule.jumps
        jump_times = jump_times[(jump_times > times[0] + TIME_TOLERANCE) & (jump_times <= times[-1])]
        errors = np.zeros((len(jump_times), len(tools), 2))
        around = [self._schedule.poses(np.clip(jump_times + shift * step, times[0], times[-1])) for shift in SIDES]
        for place, tool in enumerate(tools):
            if tool.place is not None:
                before, at, after = (poses[tool.place] for poses in around)
                errors[:, place] = _sag(after - 2.0 * at + before, tool.relation) / (4.0 * SIDE_FRACTION)
        return jump_times, errors

    def _worst(self, measured: "_ToolErrors", kind: int) -> BetweenError:
        """The largest error of one kind, what bounds it, and the step that would keep what is allowed."""
        tool, allowed, times = measured.tool, measured.tool.allowed[kind], self._schedule.times
        count = len(times) - 1
        k = np.concatenate([np.arange(tool.first, count), measured.k[measured.k >= tool.first]])
        s = np.concatenate([np.full(count - min(tool.first, count), 0.5), measured.s[measured.k >= tool.first]])
        errors = np.concatenate([measured.middle[tool.first :, kind], measured.fine[measured.k >= tool.first, kind]])
        if not len(k):  # the last row alone is judged
            return BetweenError(largest=0.0, at_s=float(times[-1]), bound=0.0)
        worst = int(np.argmax(errors))
        at_s = float(times[k[worst]] + s[worst] * (times[k[worst] + 1] - times[k[worst]]))
        rows = np.maximum(tool.at_rows[k, kind], tool.at_rows[k + 1, kind])
        is_plain = np.ones(count, dtype=bool)
        is_plain[self._jumped] = False
        judged = measured.bounds[tool.first :, kind][is_plain[tool.first :]]
        wide = bool(judged.size) and float(judged.max()) > allowed
        known = measured.bounds[tool.first :, kind][~measured.chosen[tool.first :]]
        easing = np.ones(count) if tool.easing is None or kind else tool.easing
        return BetweenError(
            largest=float(errors[worst] / easing[k[worst]]),
            at_s=at_s,
            bound=None if wide else max(float(errors[worst]), float(known.max(initial=0.0))) / float(easing.min()),
            longest_step=self._longest_step(measured, kind, errors=errors, rows=rows, k=k),
            easing=float(easing[k[worst]]),
        )

    def _longest_step(
        self, measured: "_ToolErrors", kind: int, *, errors: Array, rows: Array, k: Indices
    ) -> float | None:
        """A step in [s] that meets the tolerance, as all shorter ones do; None when the present one does.

        Errors grow with the square of the step; near a corner they are taken to grow with the step itself.

        Args:
            kind: 0 for its position, 1 for its orientation.
            errors: Errors between the rows, shape (M,).
            rows: Larger error of both rows of the step of each, shape (M,).
            k: Their steps, shape (M,).
        """
        times, step, allowed = self._schedule.times, self._schedule.step, measured.tool.allowed[kind]
        if not np.any(errors > allowed) or np.any(rows >= allowed):
            return None
        corners = np.where(measured.corners[:, kind] > KINK_FRACTION * allowed, measured.corners[:, kind], 0.0)
        corners[
            (measured.jump_times < times[measured.tool.first]) | (measured.jump_times > times[-1] - TIME_TOLERANCE)
        ] = 0.0
        share = min(1.0, (allowed - float(rows.max())) / max(float(corners.max(initial=0.0)), allowed))
        near = np.searchsorted(times, measured.jump_times[corners > 0.0])
        over = errors > allowed
        shrink = (allowed - rows[over]) / (errors[over] - rows[over])
        is_near = np.isin(k[over], np.concatenate([near - 1, near]))
        share = min(share, float(np.where(is_near, shrink, np.sqrt(shrink)).min()))
        return _shorter(step, share)


@dataclass(frozen=True, slots=True, eq=False)
class _ToolErrors:
    """What was found of one tool."""

    tool: _MeasuredTool
    middle: Array  # errors in the middle of all steps, shape (N - 1, 2)
    bounds: Array  # no error in a step is larger, shape (N - 1, 2)
    chosen: Flags  # steps that were subdivided, shape (N - 1,)
    k: Indices  # indices of the times evaluated, shape (M,)
    s: Array  # shares of these steps, shape (M,)
    fine: Array  # errors there, shape (M, 2)
    jump_times: Array  # when the tool may change its speed at once, in [s], shape (J,)
    corners: Array  # the largest error that each makes with a step of this length, shape (J, 2)


def _lengths(errors: TaskAccuracy | ClosureAccuracy) -> Array:
    """Lengths of position and orientation errors, shape (N, 2)."""
    both = [np.linalg.norm(error, axis=1) for error in (errors.position_error, errors.orientation_error)]
    return np.stack(both, axis=1)


def _sag(off: Array, relation: Relation) -> Array:
    """How far the desired tip and the desired axes are off their chords, shape (M, 2), from differences of poses."""
    axes = [axis for axis in range(3) if axis in relation.axes]
    turned = off[:, :3, 2:3] if relation.is_spin_free else off[:, :3, :3]
    return np.stack([np.linalg.norm(off[:, axes, 3], axis=1), np.linalg.norm(turned, axis=(1, 2))], axis=1)


def _within_steps(times: Array, others: Array) -> tuple[Indices, Array]:
    """Steps and shares of them for those times that lie between two rows."""
    k = np.clip(np.searchsorted(times, others, side="right") - 1, 0, len(times) - 2)
    inside = (others > times[k] + TIME_TOLERANCE) & (others < times[k + 1] - TIME_TOLERANCE)
    k, others = k[inside], others[inside]
    return k, (others - times[k]) / (times[k + 1] - times[k])


def _subdivided(steps: Indices, jumped: Indices, share: Array) -> tuple[Indices, Array]:
    """Steps and shares of them: nine inner ones of each, and those at which the motion of a tool is not smooth."""
    inner = np.arange(1, SUBDIVISION_COUNT) / SUBDIVISION_COUNT
    k = np.concatenate([np.repeat(steps, len(inner)), jumped])
    return k, np.concatenate([np.tile(inner, len(steps)), share])


def _stops_at_once(tools: Sequence[_MeasuredTool], corners: Array) -> bool:
    """Whether tools end at a speed that would be an error to be seen, were the end no row; corners there, (J, T, 2)."""
    return bool(np.any(corners > KINK_FRACTION * np.array([tool.allowed for tool in tools])))


def _fitting(step: float, duration: float) -> float:
    """The longest step in [s] of two digits, no longer than one of two digits, with which the last row is the end."""
    digit = 10.0 ** (math.floor(math.log10(step)) - 1)
    steps = (float(f"{count * digit:.2g}") for count in range(round(step / digit), 0, -1))
    return next((one for one in steps if abs(duration - one * round(duration / one)) < TIME_TOLERANCE), step)


def _shorter(step: float, share: float) -> float:
    """A share of a step in [s], with two digits; less by what an estimate from a much longer step may miss."""
    shorter = step * share * (1.0 - ESTIMATE_FRACTION * (1.0 - share))
    digit = 10.0 ** (math.floor(math.log10(shorter)) - 1)
    return float(f"{math.floor(shorter / digit) * digit:.2g}")
