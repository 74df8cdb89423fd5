"""Schedule: all toolpaths on one common clock."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, TooFewStepsError
from cellplan.geometry.curves.arc_length import quickly
from cellplan.geometry.transforms import Array, rotation_vector
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Clock, Schedule, TaskSchedule
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.clocked_path import (
    ClockedPath,
    DemandedSpan,
    demanded_spans,
    leaves_at,
    process_spans,
    ramp_shares,
    ramp_times,
    stops_of,
    work_span,
)
from cellplan.model.task.task import TIME_TOLERANCE, ProgrammedPath, Task
from cellplan.model.task.time_law import peak_rate, reached_at, stand_off
from cellplan.model.task.toolpath import Toolpath
from cellplan.model.units import MM
from cellplan.planning.timing.stated_feeds import pace_of

MOST_SAMPLES: Final = 2_000_000  # tables longer than this fill disks, not controllers
ROTATIONS: Final = 3  # components of a task from here on are rotations
FEWEST_STEPS: Final = 10  # a task of fewer has so few samples that checks at them say nothing about its path
STEP_TOLERANCE: Final = 1e-9  # [-] share of a step by which the last task may outlast the clock: rounding of a quotient
WHOLE_TURN: Final = 1e-9  # [rad] a turn per cycle this near to whole turns brings the tool back
TIME_DECIMALS: Final = 12  # decimals kept of k * step, so that 0.001 * 3 reads 0.003
MOST_VALUES: Final = 10_000_000  # [-] samples times joints: 24 joints for seven minutes at 1 ms
BYTES_OF_A_VALUE: Final = 600  # [bytes] that a solve takes for each at most: measured 420 with few bodies
SAME_PERIOD: Final = 1e-9  # [s] difference of cycles that take equally long: rounding


def schedule_tasks(cell: Cell, toolpaths: Sequence[Toolpath]) -> Schedule:
    """Put toolpaths on the common clock and sample them: see `clock_path` and `schedule_paths`."""
    return schedule_paths(cell, [clock_path(cell, cell.task(toolpath.name), toolpath) for toolpath in toolpaths])


def schedule_paths(cell: Cell, paths: Sequence[ClockedPath]) -> Schedule:
    """Clocked paths with their common clock, sampled at its times."""
    times = clock_times(cell, paths)
    return Schedule(times=times, tasks=tuple(_on_clock(times, path) for path in paths), paths=tuple(paths))


def retimed_schedule(schedule: Schedule, clock: Clock) -> Schedule:
    """The same tasks on another clock: its nominal times are the times of the paths.

    Args:
        clock: Times of the new samples and their nominal times, which increase.
    """
    if clock.is_as_written:
        return schedule
    rate = np.gradient(clock.sigma, clock.times)[:, None]
    tasks = []
    for path in schedule.paths:
        nominal = _on_clock(clock.sigma, path)
        nominal_times = [path.task.start, nominal.end, *nominal.work, *nominal.cycle_ends, *nominal.stops]
        start, end, begins, ends, *rest = clock.reached_at(np.array(nominal_times)).tolist()
        cycles, demanded = len(nominal.cycle_ends), np.array(nominal.demanded).reshape(-1, 3)
        process_on = clock.reached_at(np.array(nominal.process_on).reshape(-1, 2)).tolist()
        tasks.append(
            replace(
                nominal,
                task=replace(path.task, start=start),
                V_PT_P=rate * nominal.V_PT_P,
                end=end,
                cycle_ends=tuple(rest[:cycles]),
                stops=tuple(rest[cycles:]),
                demanded=tuple(
                    map(DemandedSpan, *clock.reached_at(demanded[:, :2]).T.tolist(), demanded[:, 2].tolist())
                ),
                process_on=tuple((begin, end) for begin, end in process_on),
                work=(begins, ends),
            )
        )
    return Schedule(times=clock.times, tasks=tuple(tasks), paths=schedule.paths, clock=clock)


def clock_times(cell: Cell, paths: Sequence[ClockedPath]) -> Array:
    """Samples ``t = k step``, k = 0..n, of the common clock, which is as long as the cell says, shape (n + 1,).

    A cell that gives no duration has a clock that ends with its last task.

    Raises:
        InputError: A task does not fit the clock, or the clock would have more than two million samples.
    """
    return np.round(np.arange(_step_count(cell, paths) + 1) * cell.motion.step, TIME_DECIMALS)


def clock_paths(cell: Cell, toolpaths: Iterable[Toolpath]) -> dict[str, ClockedPath]:
    """Put toolpaths on the common clock, and check that it shows enough of each; by the names of their tasks.

    Raises:
        InputError: As `schedule_tasks` does, a task has too few samples to judge its motion by, or it settles for as
            long as it lasts.
    """
    paths = {toolpath.name: clock_path(cell, cell.task(toolpath.name), toolpath) for toolpath in toolpaths}
    _refuse_poor_sampling(cell, tuple(paths.values()))
    return paths


def clock_path(cell: Cell, task: Task, toolpath: Toolpath) -> ClockedPath:
    """Put a toolpath on the common clock.

    Each stretch between two stops takes its own start and stop of the task's time law: with a duration given in
    proportion to its length, with a feed in the time that brings its fastest moment to the feed. A path that is gone
    through several times stops where it has corners; without any, all cycles are one stretch. A trajectory keeps its
    own times, and a path whose file states feeds takes the time that these need. Before its start and after its end a
    tool rests on the part, or off it where the task says so.

    Raises:
        InputError: The task has no time left, or more stops than anybody counts.
    """
    if isinstance(task.path, ProgrammedPath):
        corners, behind, pace = pace_of(task, task.path, toolpath)
        return ClockedPath(
            task=task, toolpath=toolpath, corners=corners, behind=behind, quick=quickly(toolpath.arc), pace=pace
        )
    return ClockedPath(
        task=task,
        toolpath=toolpath,
        corners=_corner_times(cell, task, toolpath),
        behind=toolpath.behind,
        quick=quickly(toolpath.arc),
    )


def _refuse_poor_sampling(cell: Cell, paths: Sequence[ClockedPath]) -> None:
    """Refuse tasks that have too few samples, and joints that fail after the end."""
    end = _step_count(cell, paths) * cell.motion.step
    for index, lock in enumerate(cell.motion.locked):
        if lock.from_s >= end:
            where = cell.origin.at(f"motion.locked_joints[{index}].from_s")
            raise InputError(f"{where}: expected a time before the end at {end:g} s, got {lock.from_s:g}")
    least = FEWEST_STEPS * cell.motion.step
    for path in paths:
        task, whole = path.task, path.end - path.start
        duration = whole / task.repeat
        if duration < least * (1.0 - STEP_TOLERANCE) - TIME_TOLERANCE:
            key = "duration_s" if task.feed is None else task.feed_key
            entry_key = "path" if path.toolpath.is_timed else key
            what = "a task" if task.repeat == 1 else "a cycle"
            raise TooFewStepsError(
                f"{task.where(entry_key)}: expected {what} of at least {least:g} s "
                f"({FEWEST_STEPS} times motion.step_s), got {duration:g} s; slow the task down or shorten the step"
            )
        if task.settle > whole - least * (1.0 - STEP_TOLERANCE) + TIME_TOLERANCE:
            raise InputError(
                f"{task.where('settle_s')}: expected a time that leaves at least {least:g} s "
                f"({FEWEST_STEPS} times motion.step_s) of the task's {whole:g} s to be judged, got {task.settle:g}"
            )


def _step_count(cell: Cell, paths: Sequence[ClockedPath]) -> int:
    """Steps of the common clock; the last one is a whole step, also when the clock is no multiple of the step."""
    for path in paths:
        _examine_end(cell, path)
    clock = cell.motion.duration
    cycle = max((path.over for path in paths), default=cell.motion.step) if clock is None else clock
    steps = np.ceil(cycle / cell.motion.step - STEP_TOLERANCE)
    if not steps < MOST_SAMPLES:
        raise InputError(
            f"{cell.origin.at('motion.step_s')}: expected a step that makes at most {MOST_SAMPLES} samples, "
            f"got {cell.motion.step:g} s for a cycle of {cycle:g} s; make the step longer"
        )
    require_memory(cell, int(steps) + 1)
    return max(int(steps), 1)


def _examine_end(cell: Cell, path: ClockedPath) -> None:
    """Refuse a task that ends after the clock, with the time that it needs."""
    clock, task, length = cell.motion.duration, path.task, path.toolpath.length * path.task.repeat
    if clock is None or path.over <= clock * (1.0 + STEP_TOLERANCE):
        return
    key, why = "duration_s", ""
    if task.feed is not None:
        key, why = task.feed_key, f" ({1e3 * length:.4g} mm at up to {1e3 * task.feed:g} mm/s)"
    elif path.toolpath.is_timed:
        key, why = "path", " (by the times of its file)"
    raise InputError(
        f"{task.where(key)}: expected an end within the clock of {clock:g} s "
        f"(motion.duration_s), got an end at {path.over:.6g} s{why}; give the clock at least "
        f"{_rounded_up(path.over):g} s, or leave motion.duration_s out and it ends with the last task"
    )


def _rounded_up(seconds: float) -> float:
    """A time in [s] in milliseconds, never shorter than it is."""
    return float(np.ceil(1e3 * seconds - STEP_TOLERANCE) / 1e3)


def _on_clock(times: Array, path: ClockedPath) -> TaskSchedule:
    """Reference pose and twist of one tool at each sample; at a corner the later side counts, at the end the rest."""
    task, corners = path.task, path.corners
    X_PT, V_PT_P, travelled = path.targets(times)
    corners = corners[[0, -1]] if path.toolpath.is_timed else corners
    rests = (times < corners[0] - TIME_TOLERANCE) | (times > corners[-1] - TIME_TOLERANCE)
    V_PT_P[rests] = 0.0
    _even_out_jumps(times, corners, X_PT, V_PT_P=V_PT_P)
    stand_off(times, task, X_PT, V_PT_P=V_PT_P, end=leaves_at(task, path.corners))
    return TaskSchedule(
        task=task,
        X_PT=X_PT,
        V_PT_P=V_PT_P,
        travelled=travelled,
        length=path.toolpath.length,
        bulge=path.toolpath.bulge,
        end=path.end,
        cycle_ends=_cycle_ends(path, corners),
        stops=tuple((corners if path.pace is None else stops_of(path)).tolist()),
        demanded=demanded_spans(path),
        process_on=process_spans(path),
        work=work_span(path),
        runs=path.toolpath.runs,
    )


def _cycle_ends(path: ClockedPath, corners: Array) -> tuple[float, ...]:
    """Times at which the tool is back at its start; none when it does not come back, or turned."""
    task, toolpath = path.task, path.toolpath
    turn = np.pi - abs(abs(toolpath.turn) % (2.0 * np.pi) - np.pi)
    is_turned = turn > WHOLE_TURN and not task.is_spin_free and any(axis >= ROTATIONS for axis in task.axes)
    if not toolpath.is_closed or is_turned:
        return ()
    shares = np.arange(1, task.repeat + 1) / task.repeat
    if toolpath.runs_on and not toolpath.is_timed:
        shares = reached_at(task.time_law, shares, float(ramp_shares(path)[0, 0]))
    return tuple((corners[0] + shares * (corners[-1] - corners[0])).tolist())


def _even_out_jumps(times: Array, corners: Array, X_PT: Array, *, V_PT_P: Array) -> None:
    """Put mean twists, in place, where a tool starts, passes a corner or comes to rest between two times.

    The speed of a constant law jumps there: the twist at the sample before would miss the pose at the next one.
    """
    before = np.searchsorted(times, corners, side="right") - 1
    after = np.minimum(before + 1, len(times) - 1)
    is_between = (corners - times[before] > TIME_TOLERANCE) & (times[after] - corners > TIME_TOLERANCE)
    k = np.unique(before[is_between])
    step = np.diff(times)[k, None]
    turns = X_PT[k + 1, :3, :3] @ np.swapaxes(X_PT[k, :3, :3], 1, 2)
    V_PT_P[k, :3] = (X_PT[k + 1, :3, 3] - X_PT[k, :3, 3]) / step
    V_PT_P[k, 3:] = rotation_vector(turns) / step


def _corner_times(cell: Cell, task: Task, toolpath: Toolpath) -> Array:
    """Times in [s] at which the stretches of a path begin, and the one at which the last ends."""
    if toolpath.is_timed:
        return task.start + toolpath.duration * np.arange(task.repeat + 1.0)
    behind = _stops(task, toolpath)
    if task.process is not None:
        return _at_feed(task, task.process, toolpath, behind)
    if task.feed is not None:
        return task.start + peak_rate(task.time_law) / task.feed * behind
    duration = task.time_for_path(cell.motion.duration)
    if duration is None:
        raise InputError(
            f"{task.where()}: missing duration_s: expected duration_s or feed_mm_s, as "
            "motion.duration_s is not given either"
        )
    if not duration > 0.0:
        raise InputError(
            f"{task.where('start_s')}: expected a start before the end of the clock at "
            f"{cell.motion.duration:g} s, got {task.start:g}; make motion.duration_s longer"
        )
    return task.start + duration * (behind / behind[-1])


def _at_feed(task: Task, process: ProcessEntry, toolpath: Toolpath, behind: Array) -> Array:
    """Times in [s] of the stops of a path with a demanded feed: a ramp takes half of its time for its length."""
    lengths = np.diff(behind)
    ramps = ramp_times(process, toolpath, len(lengths))
    taken, on_work = 0.5 * ramps.sum(axis=1), lengths.copy()
    on_work[0] -= toolpath.runs[0]
    on_work[-1] -= toolpath.runs[1]
    k = int(np.argmin(on_work))
    if np.any(lengths * (1.0 + STEP_TOLERANCE) < process.feed * taken):
        most_mm = MM * on_work[k] / (2 - sum(run > 0.0 for run in toolpath.runs))
        key, got, most = "ramp_s", f"{process.ramp:g} s", f"{2.0 * most_mm / MM / process.feed:.3g} s"
        if process.ramp_mm is not None:
            key, got, most = "ramp_mm", f"{process.ramp_mm:g} mm", f"{most_mm:.4g} mm"
        raise InputError(
            f"{task.where(f'process.{key}')}: expected ramps that leave the feed of {MM * process.feed:g} mm/s some "
            f"of each side, got {got} for one of {MM * on_work[k]:.4g} mm; round the corners "
            f"(corners: {{blend_mm: 5}}) or make it shorter than {most}"
        )
    if process.lead_s > ramps[0, 0]:
        raise InputError(
            f"{task.where('process.lead_s')}: expected at most {ramps[0, 0]:.4g} s, which the tool takes along its "
            f"run-in, got {process.lead_s:g}; make run_in_mm longer"
        )
    return task.moves_from + np.append(0.0, np.cumsum(lengths / process.feed + taken))


def _stops(task: Task, toolpath: Toolpath) -> Array:
    """Length in [m] behind each stop of all cycles, from zero to the whole way."""
    if task.repeat == 1:
        return toolpath.behind
    if toolpath.runs_on:
        return np.array([0.0, task.repeat * toolpath.length])
    behind = toolpath.behind
    if task.repeat * len(behind) > MOST_SAMPLES:
        raise InputError(
            f"{task.where('repeat')}: expected at most {MOST_SAMPLES // len(behind)} cycles of "
            f"a path with {len(behind) - 1} stops, got {task.repeat}"
        )
    cycles = np.arange(task.repeat)[:, None] * toolpath.length
    return np.append((cycles + behind[:-1]).ravel(), task.repeat * toolpath.length)


def require_memory(cell: Cell, samples: int) -> None:
    """Refuse a clock whose samples do not fit an ordinary machine, with the memory and the shortest step that fits."""
    joints = sum(len(robot.model.joints) for robot in cell.robots)
    if samples * joints <= MOST_VALUES:
        return
    least = cell.motion.step * samples * joints / MOST_VALUES
    digits = 10.0 ** (math.floor(math.log10(least)) - 1)
    raise InputError(
        f"{cell.origin.at('motion.step_s')}: expected at most {MOST_VALUES} samples times joints, got {samples} x "
        f"{joints}, which take about {samples * joints * BYTES_OF_A_VALUE / 1e9:.2g} GB of memory; make the step at "
        f"least {math.ceil(least / digits) * digits:g} s"
    )


def common_cycles(schedule: Schedule) -> Array | None:
    """Times in [s] between which the cycles of all tasks lie, shape (cycles + 1,); None when they differ."""
    every = [np.array([task.begin, *task.cycle_ends]) for task in schedule.tasks]
    same = all(len(times) == len(every[0]) and np.max(np.abs(times - every[0])) <= SAME_PERIOD for times in every)
    return every[0] if same and len(every[0]) > 1 else None
