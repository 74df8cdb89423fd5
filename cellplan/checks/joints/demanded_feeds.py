"""Demanded feeds: speeds of tools along their paths between rows, and the joint that is nearest to its limit there."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.measures.accelerations import jerks, point_accelerations
from cellplan.measures.tool_errors import relative_to_task_frame
from cellplan.model.cell.cell import Cell, RobotRows, Timing
from cellplan.model.cell.joint_limits import acceleration_limit, retimed_jerk_limit
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.clocked_path import fixed_rests, on_line, process_span
from cellplan.model.task.task import TIME_TOLERANCE, Task
from cellplan.model.units import MM
from cellplan.scene.scene import Scene

NEIGHBOURS: Final = 2  # [-] rows on both sides of a place whose accelerations count there
PERCENT: Final = 100.0


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
            points = relative_to_task_frame(task, X_WT, X_WP)[:, :3, 3]
            path = schedule.woven(task)
            if path is not None:
                points = points - on_line(path, scheduled.travelled)[1]
            speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(schedule.times)
            yield _check(scene.cell, scheduled, task.process, times=schedule.times, speeds=speeds, q=q)
    clock = schedule.clock
    for path in schedule.paths if clock is not None else ():
        process, (on, off) = path.task.process, process_span(path.task, path.corners)
        for key, delay in (("on_delay", (on, path.start)), ("off_delay", (path.end, off))):
            if process is not None and clock is not None and delay in fixed_rests(path.task, path.corners):
                begin, end = clock.reached_at(np.array(delay)).tolist()
                yield _check_delay(path.task, process, key, (begin, end - begin), step=schedule.step)


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


def _check(
    cell: Cell, scheduled: TaskSchedule, process: ProcessEntry, *, times: Array, speeds: Array, q: RobotRows
) -> Check:
    """The largest difference of the speed from the feed, as a share of the feed."""
    task, off = scheduled.task, speeds / process.feed_mm_s.si - 1.0
    demanded = np.zeros(len(speeds), dtype=bool)
    for begin, end in scheduled.demanded:
        demanded |= (times[:-1] >= begin - TIME_TOLERANCE) & (times[1:] <= end + TIME_TOLERANCE)
    moves = (times[1:] > scheduled.begin + TIME_TOLERANCE) & (times[:-1] < scheduled.end - TIME_TOLERANCE)
    off = np.where(demanded, np.abs(off), np.where(moves, off, 0.0))
    worst, of = int(np.argmax(off)), f"feed of task '{task.name}'"
    limit = f"demanded {process.feed_mm_s:g} mm/s within {process.tolerance_percent:g} %"
    passed, value = bool(off[worst] <= process.tolerance), float(off[worst])
    message = (
        f"{of}: {MM * speeds[worst]:.4g} mm/s at {MM * scheduled.travelled[worst]:.4g} mm of its path, "
        f"{times[worst]:.3f} s, {limit}"
    )
    if not demanded.any():
        passed, value = False, 1.0
        message = f"{of}: expected two rows between its ramps, got none, {limit}; make the step or the ramps shorter"
    elif not passed:
        joint, kind, share = nearest_to_limit(cell, times, q, worst)
        message += f"; {joint} is at {PERCENT * share:.3g} % of its {kind} limit there"
    most, at_s = process.tolerance_percent, float(times[worst])
    return Check("process_feed", task.name, passed, message, value=PERCENT * value, limit=most, unit="%", at_s=at_s)
