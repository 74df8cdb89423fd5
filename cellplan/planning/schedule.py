"""Schedule: all toolpaths on one common clock."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, rotation_vector
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule, TaskSchedule
from cellplan.model.task import Task
from cellplan.model.toolpath import Toolpath
from cellplan.planning.time_laws import advance, peak_rate

MOST_SAMPLES: Final = 2_000_000  # tables longer than this fill disks, not controllers
FEWEST_STEPS: Final = 10  # a task of fewer has so few samples that checks at them say nothing about its path
STEP_ROOM: Final = 1e-9  # [-] share of a step by which the last task may outlast the clock: rounding of a quotient
INSTANT_ROOM: Final = 1e-9  # [s] instants nearer than this are the same: rounding of sums of durations
TIME_DECIMALS: Final = 12  # decimals kept of k * step, so that 0.001 * 3 reads 0.003


def schedule_tasks(cell: Cell, toolpaths: Sequence[Toolpath]) -> Schedule:
    """Put toolpaths on the common clock ``t = k step``, k = 0..n, long enough for the last task to end.

    Each piece of a path takes its own start and stop of the task's time law: with a duration given in proportion to
    its length, with a feed in the time that brings its fastest moment to the feed. Before its start and after its end
    a tool rests on the part.

    Args:
        cell: The cell; its tasks give times and laws, its motion the step and the default duration.
        toolpaths: The paths to work on, named after their tasks.

    Raises:
        InputError: A task has no time left, or the clock would have more than two million instants.
    """
    tasks = [cell.task(toolpath.name) for toolpath in toolpaths]
    corners = [_corner_times(cell, task, toolpath) for task, toolpath in zip(tasks, toolpaths, strict=True)]
    times = np.round(np.arange(_step_count(cell, corners) + 1) * cell.motion.step, TIME_DECIMALS)
    planned = zip(tasks, toolpaths, corners, strict=True)
    return Schedule(times=times, tasks=tuple(_follow_clock(times, *plan) for plan in planned))


def _corner_times(cell: Cell, task: Task, toolpath: Toolpath) -> Array:
    """Instants in [s] at which the pieces of a path begin, and the one at which the last ends."""
    behind = toolpath.behind
    if task.feed is not None:
        fastest: Array = task.start + peak_rate(task.time_law) / task.feed * behind
        return fastest
    duration = cell.motion.duration - task.start if task.duration is None else task.duration
    if not duration > 0.0:
        where = cell.origin.at(f"tasks.{task.name}.start_s")
        raise InputError(
            f"{where}: expected a start before the end of the motion at {cell.motion.duration:g} s, "
            f"got {task.start:g}; give the task its own duration_s or feed_mm_s to go on for longer"
        )
    corners: Array = task.start + duration * (behind / behind[-1])
    return corners


def examine_times(cell: Cell, toolpaths: Sequence[Toolpath]) -> None:
    """See that the tasks fit a clock that shows enough of each, without making it.

    Raises:
        InputError: As `schedule_tasks` does, or a task has so few samples that nobody can judge its motion by them.
    """
    tasks = [cell.task(toolpath.name) for toolpath in toolpaths]
    corners = [_corner_times(cell, task, toolpath) for task, toolpath in zip(tasks, toolpaths, strict=True)]
    _step_count(cell, corners)
    least = FEWEST_STEPS * cell.motion.step
    for task, times in zip(tasks, corners, strict=True):
        duration = float(times[-1] - times[0])
        if duration < least * (1.0 - STEP_ROOM) - INSTANT_ROOM:
            where = cell.origin.at(f"tasks.{task.name}.{'duration_s' if task.feed is None else 'feed_mm_s'}")
            raise InputError(
                f"{where}: expected a task of at least {least:g} s ({FEWEST_STEPS} times motion.step_s), "
                f"got {duration:g} s; slow the task down or shorten the step"
            )


def _step_count(cell: Cell, corners: Sequence[Array]) -> int:
    """Steps of the common clock; the last does not end before the last task."""
    cycle = max((float(times[-1]) for times in corners), default=cell.motion.duration)
    steps = np.ceil(cycle / cell.motion.step - STEP_ROOM)
    if not steps < MOST_SAMPLES:
        raise InputError(
            f"{cell.origin.at('motion.step_s')}: expected a step that makes at most {MOST_SAMPLES} samples, "
            f"got {cell.motion.step:g} s for a cycle of {cycle:g} s; make the step longer"
        )
    return max(int(steps), 1)


def _follow_clock(times: Array, task: Task, toolpath: Toolpath, corners: Array) -> TaskSchedule:
    """Wanted pose and twist of one tool at each instant."""
    last = len(corners) - 2
    pieces = np.clip(np.searchsorted(corners, times + INSTANT_ROOM, side="right") - 1, 0, last)
    begin, duration = corners[pieces], np.diff(corners)[pieces]
    elapsed = np.clip(times - begin, 0.0, duration)
    elapsed = np.where(elapsed <= INSTANT_ROOM, 0.0, np.where(duration - elapsed <= INSTANT_ROOM, duration, elapsed))
    law = advance(task.time_law, elapsed / duration)
    length = np.diff(toolpath.behind)[pieces]
    travelled = toolpath.behind[pieces] + law.share * length
    X_PT, twists = toolpath.targets(pieces, travelled)
    V_PT_P = twists * (law.rate * length / duration)[:, None]
    rests = (times < corners[0] - INSTANT_ROOM) | (times > corners[-1] - INSTANT_ROOM)
    V_PT_P[rests] = 0.0
    _even_out_jumps(times, corners, X_PT, V_PT_P=V_PT_P)
    return TaskSchedule(
        task=task, X_PT=X_PT, V_PT_P=V_PT_P, travelled=travelled, length=toolpath.length, end=float(corners[-1])
    )


def _even_out_jumps(times: Array, corners: Array, X_PT: Array, *, V_PT_P: Array) -> None:
    """Put mean twists, in place, where a tool starts, passes a corner or comes to rest between two instants.

    The speed of a constant law jumps there: the twist at the instant before would miss the pose at the next one.
    """
    before = np.searchsorted(times, corners, side="right") - 1
    after = np.minimum(before + 1, len(times) - 1)
    is_between = (corners - times[before] > INSTANT_ROOM) & (times[after] - corners > INSTANT_ROOM)
    k = np.unique(before[is_between])
    step = np.diff(times)[k, None]
    turns = X_PT[k + 1, :3, :3] @ np.swapaxes(X_PT[k, :3, :3], 1, 2)
    V_PT_P[k, :3] = (X_PT[k + 1, :3, 3] - X_PT[k, :3, 3]) / step
    V_PT_P[k, 3:] = rotation_vector(turns) / step
