"""Schedule: all toolpaths on one common clock."""

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, rotation_vector
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule, TaskSchedule
from cellplan.model.task import INSTANT_ROOM, Task
from cellplan.model.toolpath import Toolpath, Trajectory
from cellplan.planning.timing.approach_retract import stand_off
from cellplan.planning.timing.sample_memory import require_room
from cellplan.planning.timing.time_law import reached_at
from cellplan.planning.timing.timed_path import MOST_SAMPLES, ClockedPath, TimedTasks, clock_path

ROTATIONS: Final = 3  # components of a task from here on are rotations
FEWEST_STEPS: Final = 10  # a task of fewer has so few samples that checks at them say nothing about its path
STEP_ROOM: Final = 1e-9  # [-] share of a step by which the last task may outlast the clock: rounding of a quotient
WHOLE_TURN: Final = 1e-9  # [rad] a turn per cycle this near to whole turns brings the tool back
TIME_DECIMALS: Final = 12  # decimals kept of k * step, so that 0.001 * 3 reads 0.003


def schedule_tasks(cell: Cell, toolpaths: Sequence[Toolpath]) -> Schedule:
    """Put toolpaths on the common clock and sample them: see `time_tasks` and `sample`."""
    return sample(time_tasks(cell, [clock_path(cell, cell.task(toolpath.name), toolpath) for toolpath in toolpaths]))


def time_tasks(cell: Cell, paths: Sequence[ClockedPath]) -> TimedTasks:
    """Clocked paths with their common clock ``t = k step``, k = 0..n, which is as long as the cell says.

    A cell that gives no duration has a clock that ends with its last task.

    Each stretch between two stops takes its own start and stop of the task's time law: with a duration given in
    proportion to its length, with a feed in the time that brings its fastest moment to the feed. A path that is gone
    through several times stops where it has corners; without any, all cycles are one stretch. A trajectory keeps its
    own times. Before its start and after its end a tool rests on the part, or off it where the task says so.

    Args:
        cell: The cell; its tasks give times and laws, its motion the step and the length of the clock.
        paths: The paths to work on.

    Raises:
        InputError: A task does not fit the clock, or the clock would have more than two million samples.
    """
    times = np.round(np.arange(_step_count(cell, paths) + 1) * cell.motion.step, TIME_DECIMALS)
    return TimedTasks(times=times, paths=tuple(paths))


def sample(timed: TimedTasks) -> Schedule:
    """Sample all tasks at the times of their clock."""
    tasks = tuple(_on_clock(timed.times, path) for path in timed.paths)
    return Schedule(times=timed.times, tasks=tasks, desired=timed)


def clock_paths(cell: Cell, toolpaths: Iterable[Toolpath]) -> dict[str, ClockedPath]:
    """Put toolpaths on the common clock, and check that it shows enough of each; by the names of their tasks.

    Raises:
        InputError: As `schedule_tasks` does, a task has too few samples to judge its motion by, or it settles for as
            long as it lasts.
    """
    found = {each.name: clock_path(cell, cell.task(each.name), each) for each in toolpaths}
    _refuse_poor_sampling(cell, tuple(found.values()))
    return found


def _refuse_poor_sampling(cell: Cell, paths: Sequence[ClockedPath]) -> None:
    """Refuse tasks that have too few samples, and joints that fail after the end."""
    end = _step_count(cell, paths) * cell.motion.step
    for index, lock in enumerate(cell.motion.locked):
        if lock.since >= end:
            where = cell.origin.at(f"motion.locked_joints[{index}].from_s")
            raise InputError(f"{where}: expected a time before the end at {end:g} s, got {lock.since:g}")
    least = FEWEST_STEPS * cell.motion.step
    for path in paths:
        task, whole = path.task, path.end - path.start
        duration = whole / task.repeat
        if duration < least * (1.0 - STEP_ROOM) - INSTANT_ROOM:
            key = "duration_s" if task.feed is None else "feed_mm_s"
            own = "path" if isinstance(path.toolpath, Trajectory) else key
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


def _step_count(cell: Cell, paths: Sequence[ClockedPath]) -> int:
    """Steps of the common clock; the last one is a whole step, also when the clock is no multiple of the step."""
    for path in paths:
        _examine_end(cell, path)
    clock = cell.motion.duration
    cycle = max((path.over for path in paths), default=cell.motion.step) if clock is None else clock
    steps = np.ceil(cycle / cell.motion.step - STEP_ROOM)
    if not steps < MOST_SAMPLES:
        raise InputError(
            f"{cell.origin.at('motion.step_s')}: expected a step that makes at most {MOST_SAMPLES} samples, "
            f"got {cell.motion.step:g} s for a cycle of {cycle:g} s; make the step longer"
        )
    require_room(cell, int(steps) + 1)
    return max(int(steps), 1)


def _examine_end(cell: Cell, path: ClockedPath) -> None:
    """Refuse a task that ends after the clock, with the time that it needs."""
    clock, task, length = cell.motion.duration, path.task, path.toolpath.length * path.task.repeat
    if clock is None or path.over <= clock * (1.0 + STEP_ROOM):
        return
    key, why = "duration_s", ""
    if task.feed is not None:
        key, why = "feed_mm_s", f" ({1e3 * length:.4g} mm at up to {1e3 * task.feed:g} mm/s)"
    elif isinstance(path.toolpath, Trajectory):
        key, why = "path", " (by the times of its file)"
    raise InputError(
        f"{cell.origin.at(f'tasks.{task.name}.{key}')}: expected an end within the clock of {clock:g} s "
        f"(motion.duration_s), got an end at {path.over:.6g} s{why}; give the clock at least "
        f"{_rounded_up(path.over):g} s, or leave motion.duration_s out and it ends with the last task"
    )


def _rounded_up(seconds: float) -> float:
    """A time in [s] in milliseconds, never shorter than it is."""
    return float(np.ceil(1e3 * seconds - STEP_ROOM) / 1e3)


def _on_clock(times: Array, path: ClockedPath) -> TaskSchedule:
    """Reference pose and twist of one tool at each sample; at a corner the later side counts, at the end the rest."""
    task, corners = path.task, path.corners
    X_PT, V_PT_P, travelled = path.targets(times, path.stretches(times + INSTANT_ROOM))
    corners = corners[[0, -1]] if isinstance(path.toolpath, Trajectory) else corners
    rests = (times < corners[0] - INSTANT_ROOM) | (times > corners[-1] - INSTANT_ROOM)
    V_PT_P[rests] = 0.0
    _even_out_jumps(times, corners, X_PT, V_PT_P=V_PT_P)
    stand_off(times, task, X_PT, V_PT_P=V_PT_P, end=path.end)
    return TaskSchedule(
        task=task,
        X_PT=X_PT,
        V_PT_P=V_PT_P,
        travelled=travelled,
        length=path.toolpath.length,
        end=path.end,
        cycle_ends=_cycle_ends(task, path.toolpath, corners),
        stops=tuple(corners.tolist()),
    )


def _cycle_ends(task: Task, toolpath: Toolpath, corners: Array) -> tuple[float, ...]:
    """Times at which the tool is back at its start; none when it does not come back, or turned."""
    turn = np.pi - abs(abs(toolpath.turn) % (2.0 * np.pi) - np.pi)
    is_turned = turn > WHOLE_TURN and not task.is_spin_free and any(axis >= ROTATIONS for axis in task.axes)
    if not toolpath.is_closed or is_turned:
        return ()
    shares = np.arange(1, task.repeat + 1) / task.repeat
    if toolpath.runs_on and not isinstance(toolpath, Trajectory):
        shares = reached_at(task.time_law, shares)
    return tuple((corners[0] + shares * (corners[-1] - corners[0])).tolist())


def _even_out_jumps(times: Array, corners: Array, X_PT: Array, *, V_PT_P: Array) -> None:
    """Put mean twists, in place, where a tool starts, passes a corner or comes to rest between two times.

    The speed of a constant law jumps there: the twist at the sample before would miss the pose at the next one.
    """
    before = np.searchsorted(times, corners, side="right") - 1
    after = np.minimum(before + 1, len(times) - 1)
    is_between = (corners - times[before] > INSTANT_ROOM) & (times[after] - corners > INSTANT_ROOM)
    k = np.unique(before[is_between])
    step = np.diff(times)[k, None]
    turns = X_PT[k + 1, :3, :3] @ np.swapaxes(X_PT[k, :3, :3], 1, 2)
    V_PT_P[k, :3] = (X_PT[k + 1, :3, 3] - X_PT[k, :3, 3]) / step
    V_PT_P[k, 3:] = rotation_vector(turns) / step
