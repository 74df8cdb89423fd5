"""Demanded feeds: speeds of tools along their paths between rows, and the joint that is nearest to its limit there."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.measures.accelerations import jerks, point_accelerations
from cellplan.measures.tool_errors import points_of_travel
from cellplan.model.cell.cell import Cell, RobotRows, Timing
from cellplan.model.cell.joint_limits import acceleration_limit, retimed_jerk_limit
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.clocked_path import ClockedPath, fixed_rests, process_spans
from cellplan.model.task.task import TIME_TOLERANCE, Task
from cellplan.model.units import MM
from cellplan.scene.scene import Scene

NEIGHBOURS: Final = 2  # [-] rows on both sides of a place whose accelerations count there
PERCENT: Final = 100.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Steps:
    """Speeds of a tool between rows, and what is demanded of them."""

    process: ProcessEntry
    times: Array  # times of the rows in [s], shape (N,)
    speeds: Array  # speeds along the path in [m/s], shape (N - 1,)
    demanded: Flags  # whether a feed is demanded, shape (N - 1,)
    short: int  # number of stretches that are too short for their feed
    most: Array  # this feed, elsewhere the greatest speed that is allowed, in [m/s], shape (N - 1,)


def check_feeds(scene: Scene, schedule: Schedule, q: RobotRows, X_WP: Array) -> Iterator[Check]:
    """The speed of every tool with a demanded feed against it; of one that weaves, that along its seam.

    Between the ramps of its path the speed between two rows must be within the tolerance; in the ramps it must not be
    larger. The delays of a retimed program must not be longer by more than that share, and a step.

    Args:
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    for scheduled in schedule.tasks:
        task = scheduled.task
        if task.process is not None:
            X_WT = scene.chains[task.robot].tool_poses(q[task.robot])
            points = points_of_travel(schedule, scheduled, X_WT, X_WP)
            speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(schedule.times)
            yield _check(scene.cell, scheduled, _steps(schedule, scheduled, task.process, speeds), q)
    clock = schedule.clock
    for path in schedule.paths if clock is not None else ():
        process = path.task.process
        for key, delay in _delays(path) if process is not None else ():
            if clock is not None and process is not None:
                begin, end = clock.reached_at(np.array(delay)).tolist()
                yield _check_delay(path.task, process, key, (begin, end - begin), step=schedule.step)


def _delays(path: ClockedPath) -> Iterator[tuple[str, tuple[float, float]]]:
    """Delays of a process and their nominal begin and end in [s]: rests at both ends of where it is on."""
    rests = fixed_rests(path)
    for on, off in process_spans(path):
        yield from (("on_delay", rest) for rest in rests if rest[0] == on)
        yield from (("off_delay", rest) for rest in rests if rest[1] == off)


def _check_delay(task: Task, process: ProcessEntry, key: str, took: tuple[float, float], *, step: float) -> Check:
    """The begin of a delay and the time that it takes in a retimed program, in [s]: at most what its rate allows."""
    delay = process.on_delay_s if key == "on_delay" else process.off_delay_s
    limit = delay / (1.0 - process.tolerance) + step
    at_s, passed = took[0], took[1] <= limit + TIME_TOLERANCE
    message = (
        f"{key}_s of task '{task.name}': {took[1]:.4g} s at {at_s:.3f} s, demanded {delay:g} s within "
        f"{process.tolerance_percent:g} % and a step"
    )
    return Check(f"process_{key}", task.name, passed, message, value=took[1], limit=limit, unit="s", at_s=at_s)


def nearest_to_limit(cell: Cell, times: Array, q: RobotRows, step: int) -> tuple[str, str, float]:
    """The joint that is nearest to one of its limits in a step: name, limit, and share of it.

    In a retimed program the jerk counts as well, as it is limited there.

    Args:
        times: Times of the rows in [s], shape (N,).
        step: Number of the first row of the step.
    """
    around = slice(max(0, step - NEIGHBOURS), step + NEIGHBOURS + 2)
    nearest = []
    for robot in cell.robots:
        positions, h = q[robot.name], times[step + 1] - times[step]
        velocity = np.abs(positions[step + 1] - positions[step]) / h
        signed = point_accelerations(times, positions)
        acceleration = np.abs(signed)[around].max(axis=0)
        jerk = jerks(times, signed[..., None], window=robot.controller_cycle)[around].max(axis=0)
        for index, joint in enumerate(robot.model.joints):
            name, limit = f"{robot.name} {joint.name}", acceleration_limit(robot, index)[0]
            nearest.append((float(velocity[index] / joint.velocity), name, "velocity"))
            most = None if cell.motion.timing is Timing.AS_WRITTEN else retimed_jerk_limit(cell, robot, index)
            if most is not None:
                nearest.append((float(jerk[index] / most), name, "jerk"))
            if limit is not None:
                nearest.append((float(acceleration[index] / limit), name, "acceleration"))
    share, joint_name, kind = max(nearest)
    return joint_name, kind, share


def _steps(schedule: Schedule, scheduled: TaskSchedule, process: ProcessEntry, speeds: Array) -> _Steps:
    """What is demanded in the steps between rows, in which a tool has speeds in [m/s], shape (N - 1,)."""
    times = schedule.times
    demanded, most = np.zeros(len(speeds), dtype=bool), np.full(len(speeds), process.feed)
    short = 0
    path = next((path for path in schedule.paths if path.task.name == scheduled.task.name), None)
    if path is not None and path.pace is not None:
        nominal = times if schedule.clock is None else schedule.clock.sigma
        stretch = np.clip(np.searchsorted(path.corners, nominal, side="right") - 1, 0, len(path.pace.tops) - 1)
        tops = np.where(path.pace.tops > 0.0, path.pace.tops, process.feed)
        most = np.maximum(tops[stretch[:-1]], tops[stretch[1:]])
        short = int(np.count_nonzero(path.pace.is_on & ~path.pace.is_at_feed & (path.pace.tops > 0.0)))
    for begin, end, feed in scheduled.demanded:
        first = int(np.searchsorted(times, begin - TIME_TOLERANCE))
        inside = slice(first, max(first, int(np.searchsorted(times, end + TIME_TOLERANCE, side="right")) - 1))
        demanded[inside], most[inside] = True, feed
    return _Steps(process=process, times=times, speeds=speeds, demanded=demanded, short=short, most=most)


def _check(cell: Cell, scheduled: TaskSchedule, steps: _Steps, q: RobotRows) -> Check:
    """The largest difference of the speed from the feed, as a share of the feed."""
    task, process, times, off = scheduled.task, steps.process, steps.times, steps.speeds / steps.most - 1.0
    moves = (times[1:] > scheduled.begin + TIME_TOLERANCE) & (times[:-1] < scheduled.end - TIME_TOLERANCE)
    off = np.where(steps.demanded, np.abs(off), np.where(moves, off, 0.0))
    worst, of = int(np.argmax(off)), f"feed of task '{task.name}'"
    limit = f"demanded {MM * steps.most[worst]:.6g} mm/s within {process.tolerance_percent:g} %"
    passed, value = bool(off[worst] <= process.tolerance), float(off[worst])
    message = (
        f"{of}: {MM * steps.speeds[worst]:.4g} mm/s at {MM * scheduled.travelled[worst]:.4g} mm of its path, "
        f"{times[worst]:.3f} s, {limit}"
    )
    if steps.short:
        message += f"; {steps.short} of its stretches are too short for their feed and are passed below it"
    if not steps.demanded.any():
        passed, value = False, 1.0
        message = f"{of}: expected two rows between its ramps, got none, {limit}; make the step or the ramps shorter"
    elif not passed:
        joint, kind, share = nearest_to_limit(cell, times, q, worst)
        message += f"; {joint} is at {PERCENT * share:.3g} % of its {kind} limit there"
    most, at_s = process.tolerance_percent, float(times[worst])
    return Check("process_feed", task.name, passed, message, value=PERCENT * value, limit=most, unit="%", at_s=at_s)
