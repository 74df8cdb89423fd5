"""Schedule: all toolpaths on one common clock."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, rotation_about, rotation_vector
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule, TaskSchedule
from cellplan.model.task import INSTANT_ROOM, Task
from cellplan.model.toolpath import TOOL_Z, Toolpath, Trajectory
from cellplan.planning.stand_off import stand_off
from cellplan.planning.time_laws import advance, peak_rate, reached_at

ROTATIONS: Final = 3  # components of a task from here on are rotations
MOST_SAMPLES: Final = 2_000_000  # tables longer than this fill disks, not controllers
FEWEST_STEPS: Final = 10  # a task of fewer has so few samples that checks at them say nothing about its path
STEP_ROOM: Final = 1e-9  # [-] share of a step by which the last task may outlast the clock: rounding of a quotient
WHOLE_TURN: Final = 1e-9  # [rad] a turn per cycle this near to whole turns brings the tool back
TIME_DECIMALS: Final = 12  # decimals kept of k * step, so that 0.001 * 3 reads 0.003


def schedule_tasks(cell: Cell, toolpaths: Sequence[Toolpath]) -> Schedule:
    """Put toolpaths on the common clock ``t = k step``, k = 0..n, long enough for the last task to end.

    Each stretch between two stops takes its own start and stop of the task's time law: with a duration given in
    proportion to its length, with a feed in the time that brings its fastest moment to the feed. A path that is gone
    through several times stops where it has corners; without any, all cycles are one stretch. A trajectory keeps its
    own times. Before its start and after its end a tool rests on the part, or off it where the task says so.

    Args:
        cell: The cell; its tasks give times and laws, its motion the step and the default duration.
        toolpaths: The paths to work on, named after their tasks.

    Raises:
        InputError: A task has no time left, or the clock would have more than two million instants.
    """
    tasks = [cell.task(toolpath.name) for toolpath in toolpaths]
    corners = [_corner_times(cell, task, toolpath) for task, toolpath in zip(tasks, toolpaths, strict=True)]
    times = np.round(np.arange(_step_count(cell, _ends(tasks, corners)) + 1) * cell.motion.step, TIME_DECIMALS)
    planned = zip(tasks, toolpaths, corners, strict=True)
    return Schedule(times=times, tasks=tuple(_on_clock(times, *plan) for plan in planned))


def _corner_times(cell: Cell, task: Task, toolpath: Toolpath) -> Array:
    """Instants in [s] at which the stretches of a path begin, and the one at which the last ends."""
    if isinstance(toolpath, Trajectory):
        own: Array = task.start + toolpath.duration * np.arange(task.repeat + 1.0)
        return own
    behind = _stops(cell, task, toolpath)
    if task.feed is not None:
        fastest: Array = task.start + peak_rate(task.time_law) / task.feed * behind
        return fastest
    leaving = task.retract.duration if task.retract else 0.0
    duration = cell.motion.duration - task.start - leaving if task.duration is None else task.duration
    if not duration > 0.0:
        where = cell.origin.at(f"tasks.{task.name}.start_s")
        raise InputError(
            f"{where}: expected a start before the end of the motion at {cell.motion.duration:g} s, "
            f"got {task.start:g}; give the task its own duration_s or feed_mm_s to go on for longer"
        )
    corners: Array = task.start + duration * (behind / behind[-1])
    return corners


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


def examine_times(cell: Cell, toolpaths: Sequence[Toolpath]) -> None:
    """See that the tasks fit a clock that shows enough of each, without making it.

    Raises:
        InputError: As `schedule_tasks` does, a task has so few samples that nobody can judge its motion by them, or it
            settles for as long as it lasts.
    """
    tasks = [cell.task(toolpath.name) for toolpath in toolpaths]
    corners = [_corner_times(cell, task, toolpath) for task, toolpath in zip(tasks, toolpaths, strict=True)]
    _step_count(cell, _ends(tasks, corners))
    least = FEWEST_STEPS * cell.motion.step
    for task, toolpath, times in zip(tasks, toolpaths, corners, strict=True):
        whole = float(times[-1] - times[0])
        duration = whole / task.repeat
        if duration < least * (1.0 - STEP_ROOM) - INSTANT_ROOM:
            own = "path" if isinstance(toolpath, Trajectory) else "duration_s" if task.feed is None else "feed_mm_s"
            what = "a task" if task.repeat == 1 else "a cycle"
            raise InputError(
                f"{cell.origin.at(f'tasks.{task.name}.{own}')}: expected {what} of at least {least:g} s "
                f"({FEWEST_STEPS} times motion.step_s), got {duration:g} s; slow the task down or shorten the step"
            )
        if task.settle > whole - least * (1.0 - STEP_ROOM) + INSTANT_ROOM:
            raise InputError(
                f"{cell.origin.at(f'tasks.{task.name}.settle_s')}: expected a time that leaves at least {least:g} s "
                f"({FEWEST_STEPS} times motion.step_s) of the task's {whole:g} s to be judged, got {task.settle:g}"
            )


def _ends(tasks: Sequence[Task], corners: Sequence[Array]) -> list[float]:
    """Instants in [s] at which the tasks are over, the tools out of the way."""
    leaving = [task.retract.duration if task.retract else 0.0 for task in tasks]
    return [float(times[-1]) + more for times, more in zip(corners, leaving, strict=True)]


def _step_count(cell: Cell, ends: Sequence[float]) -> int:
    """Steps of the common clock; the last does not end before the last task."""
    cycle = max(ends, default=cell.motion.duration)
    steps = np.ceil(cycle / cell.motion.step - STEP_ROOM)
    if not steps < MOST_SAMPLES:
        raise InputError(
            f"{cell.origin.at('motion.step_s')}: expected a step that makes at most {MOST_SAMPLES} samples, "
            f"got {cell.motion.step:g} s for a cycle of {cycle:g} s; make the step longer"
        )
    return max(int(steps), 1)


def _on_clock(times: Array, task: Task, toolpath: Toolpath, corners: Array) -> TaskSchedule:
    """Wanted pose and twist of one tool at each instant."""
    if isinstance(toolpath, Trajectory):
        X_PT, V_PT_P, travelled = _on_own_clock(times, toolpath, corners)
        corners = corners[[0, -1]]
    else:
        X_PT, V_PT_P, travelled = _by_time_law(times, task, toolpath, corners=corners)
    rests = (times < corners[0] - INSTANT_ROOM) | (times > corners[-1] - INSTANT_ROOM)
    V_PT_P[rests] = 0.0
    _even_out_jumps(times, corners, X_PT, V_PT_P=V_PT_P)
    stand_off(times, task, X_PT, V_PT_P=V_PT_P, end=float(corners[-1]))
    return TaskSchedule(
        task=task,
        X_PT=X_PT,
        V_PT_P=V_PT_P,
        travelled=travelled,
        length=toolpath.length,
        end=float(corners[-1]),
        cycle_ends=_cycle_ends(task, toolpath, corners),
    )


def _on_own_clock(times: Array, path: Trajectory, starts: Array) -> tuple[Array, Array, Array]:
    """Poses, twists and lengths behind the tool on a trajectory whose cycles begin at ``starts``."""
    elapsed = np.clip(times - starts[0], 0.0, starts[-1] - starts[0])
    cycle = np.minimum(elapsed // path.duration, len(starts) - 2)
    t = np.clip(elapsed - cycle * path.duration, 0.0, path.duration)
    X_PT, V_PT_P = path.at(t)
    return X_PT, V_PT_P, cycle * path.length + path.arc.lengths(t)


def _by_time_law(times: Array, task: Task, toolpath: Toolpath, *, corners: Array) -> tuple[Array, Array, Array]:
    """Poses, twists and lengths behind the tool where each stretch takes its own start and stop of the time law."""
    lengths = np.diff(toolpath.behind)
    last = len(corners) - 2
    stretch = np.clip(np.searchsorted(corners, times + INSTANT_ROOM, side="right") - 1, 0, last)
    begin, duration = corners[stretch], np.diff(corners)[stretch]
    elapsed = np.clip(times - begin, 0.0, duration)
    elapsed = np.where(elapsed <= INSTANT_ROOM, 0.0, np.where(duration - elapsed <= INSTANT_ROOM, duration, elapsed))
    law = advance(task.time_law, elapsed / duration)
    if toolpath.runs_on:
        length = np.full(len(times), task.repeat * toolpath.length)
        cycle = np.clip((law.share * length) // toolpath.length, 0, task.repeat - 1)
        piece = np.zeros(len(times), dtype=np.intp)
        s = law.share * length - cycle * toolpath.length
    else:
        cycle, piece = np.divmod(stretch, len(lengths))
        length = lengths[piece]
        s = toolpath.behind[piece] + law.share * length
    X_PT, twists = toolpath.targets(piece, s)
    if task.repeat > 1 and toolpath.turn:
        X_PT[:, :3, :3] = X_PT[:, :3, :3] @ rotation_about(TOOL_Z, cycle * toolpath.turn)
    return X_PT, twists * (law.rate * length / duration)[:, None], cycle * toolpath.length + s


def _cycle_ends(task: Task, toolpath: Toolpath, corners: Array) -> tuple[float, ...]:
    """Instants at which the tool is back at its start; none when it does not come back, or turned."""
    turn = np.pi - abs(abs(toolpath.turn) % (2.0 * np.pi) - np.pi)
    is_turned = turn > WHOLE_TURN and not task.is_spin_free and any(axis >= ROTATIONS for axis in task.axes)
    if not toolpath.is_closed or is_turned:
        return ()
    shares = np.arange(1, task.repeat + 1) / task.repeat
    if toolpath.runs_on and not isinstance(toolpath, Trajectory):
        shares = reached_at(task.time_law, shares)
    return tuple((corners[0] + shares * (corners[-1] - corners[0])).tolist())


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
