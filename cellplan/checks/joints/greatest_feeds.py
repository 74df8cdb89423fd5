r"""Greatest feeds: how fast each process could run along its path, place by place, and what binds where it is least.

With the ratio of all speeds fixed, everything scales with time: at a share :math:`\lambda` of a limit of velocity,
acceleration or jerk the feed could be greater by :math:`\lambda^{-1}`, :math:`\lambda^{-1/2}` or
:math:`\lambda^{-1/3}`. Errors of a tool between rows grow with the square of its speed; of their tolerance as much
is left as programs for controllers may put the tool off by the decimals of joint positions.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.limit_shares import KINDS, ORDERS, rate_limits, row_loads
from cellplan.model.cell.cell import Robot, RobotRows
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.greatest_feed import BETWEEN_ROWS, TOOL_SPEED, GreatestFeed
from cellplan.model.report.report import TaskAccuracy
from cellplan.model.settings.controllers import RobotControlEntry
from cellplan.model.settings.units import si_or_none
from cellplan.model.task.clocked_path import are_within
from cellplan.model.task.task import TIME_TOLERANCE, Frame, SampledPath, Task
from cellplan.scene.scene import Scene

LEAST_SHARE: Final = 1e-12  # [-] of a limit: less is rounding of a joint at rest
FEWEST_DECIMALS: Final = (4, 3)  # of a degree and a millimetre, in the languages of controllers where none are stated
MOST_ROUNDED: Final = 0.5  # [-] of a tolerance that is left for rounding


class _Load(NamedTuple):
    """What one limit asks for."""

    name: str  # joint with its robot, tool or task
    kind: str  # the limit
    shares: Array  # share of the time of each row that it asks for, shape (N,)


def greatest_feeds(
    scene: Scene, schedule: Schedule, q: RobotRows, accuracy: Sequence[TaskAccuracy]
) -> tuple[GreatestFeed, ...]:
    """The greatest feed of every task whose process has one feed all along, and holds it in these rows."""
    feeds, times = [], schedule.times
    for scheduled, errors in zip(schedule.tasks, accuracy, strict=True):
        task = scheduled.task
        if task.process is None or not task.has_one_feed:
            continue
        feed = _mean_speed(times, scheduled)
        if abs(feed - task.process.feed) <= task.process.tolerance * task.process.feed:
            robots = dict.fromkeys((task.robot, *scene.cell.positioners))
            loads = [load for name in robots for load in _loads(scene, name, times, q[name])]
            feeds.append(_greatest(times, scheduled, feed, [*loads, _between(scene, scheduled, errors, times, q)]))
    return tuple(feeds)


def _mean_speed(times: Array, scheduled: TaskSchedule) -> float:
    """Speed in [m/s] along the path in the longest stretch between ramps; nan where it has no rows."""
    begin, end, _ = max(scheduled.demanded, key=lambda span: span.end - span.begin, default=(0.0, 0.0, 0.0))
    inside = np.flatnonzero(are_within(times, [(begin, end)]))
    if len(inside) < 2:
        return np.nan
    first, last = inside[[0, -1]]
    return float((scheduled.travelled[last] - scheduled.travelled[first]) / (times[last] - times[first]))


def _loads(scene: Scene, name: str, times: Array, q: Array) -> list[_Load]:
    """What the limits of the joints and of the tool of one robot ask for."""
    cell = scene.cell
    robot = cell.robot(name)
    limits = rate_limits(cell)[:, cell.columns(name)]
    shares = (row_loads(robot, times, q) / limits[:, None, :]) ** ORDERS[:, None, None] / robot.controller_share
    loads = [
        _Load(f"{name} {joint.name}", kind, shares[row, :, column])
        for column, joint in enumerate(robot.model.joints)
        for row, kind in enumerate(KINDS)
    ]
    limit = si_or_none(cell.checks.tool_speed_mm_s)
    if limit is not None:
        moves = np.linalg.norm(np.diff(scene.chains[name].tool_poses(q)[:, :3, 3], axis=0), axis=1)
        loads.append(_Load(name, TOOL_SPEED, np.append(moves / (limit * np.diff(times)), 0.0)))
    return loads


def _between(scene: Scene, scheduled: TaskSchedule, errors: TaskAccuracy, times: Array, q: RobotRows) -> _Load:
    """What the tolerance between rows asks for, where the error is largest."""
    shares, allowed = np.zeros(len(times)), scheduled.task.tolerance.between
    if errors.between is not None:
        both, rounding = (
            (errors.between.position, errors.between.orientation),
            rounding_of_programs(scene, scheduled.task, q),
        )
        for error, tolerance, off in zip(both, allowed, rounding, strict=True):
            row = int(np.argmin(np.abs(times - error.at_s)))
            left = tolerance - min(error.easing * off, MOST_ROUNDED * tolerance)
            shares[row] = max(shares[row], (error.easing * error.largest / left) ** 0.5)
    return _Load(scheduled.task.name, BETWEEN_ROWS, shares)


def rounding_of_programs(scene: Scene, task: Task, q: RobotRows) -> tuple[float, float]:
    """By how much programs with rounded joint positions may put a tool off in [m] and turn it in [rad]."""
    cell, on_part = scene.cell, task.relative_to is Frame.PART
    holder = cell.robots[cell.carrier] if on_part and cell.carrier is not None else None
    p = scene.chains[task.robot].tool_poses(q[task.robot])[:, :3, 3]
    off, turned = np.zeros(len(p)), np.zeros(len(p))
    for robot in (cell.robot(task.robot), holder):
        if robot is not None and robot.control is not None:
            screws, half = scene.chains[robot.name].flange_screws(q[robot.name]), _half_units(robot, robot.control)
            moves = screws[:, :3] + np.cross(screws[:, 3:], p[:, :, None], axis=1)
            off += np.linalg.norm(moves, axis=1) @ half
            turned += np.linalg.norm(screws[:, 3:], axis=1) @ half
    return float(off.max()), float(turned.max())


def _half_units(robot: Robot, control: RobotControlEntry) -> Array:
    """Half a unit of the last decimal of each joint in programs of its controller, in [rad] or [m], shape (n,)."""
    decimals = FEWEST_DECIMALS if control.decimals is None else (control.decimals,) * 2
    units = ((joint.display_unit.scale, decimals[0 if joint.is_revolute else 1]) for joint in robot.model.joints)
    return np.array([0.5 * 10.0**-digits / scale for scale, digits in units])


def _greatest(times: Array, scheduled: TaskSchedule, feed: float, loads: Sequence[_Load]) -> GreatestFeed:
    """The greatest feed of one task that runs at a feed in [m/s]."""
    inside = np.flatnonzero(are_within(times, [(scheduled.begin, scheduled.end)]))
    shares = np.max([load.shares[inside] for load in loads], axis=0)
    row = int(inside[shares.argmax()])
    worst = max(loads, key=lambda load: float(load.shares[row]))
    run_in = scheduled.runs[0]
    steady = [(begin - TIME_TOLERANCE, end + TIME_TOLERANCE) for begin, end, _ in scheduled.demanded]
    return GreatestFeed(
        task=scheduled.task.name,
        feed=feed,
        travelled=scheduled.travelled[inside] - run_in,
        feeds=np.where(shares > LEAST_SHARE, feed / np.maximum(shares, LEAST_SHARE), np.inf),
        binding=worst.name,
        kind=worst.kind,
        at=float(scheduled.travelled[row]) - run_in,
        at_s=float(times[row]),
        point=_point(scheduled, row),
        is_in_ramp=not bool(are_within(times[row : row + 1], steady)[0]),
    )


def _point(scheduled: TaskSchedule, row: int) -> str:
    """The point of the file that is nearest to the tool in a row; empty for a path without a file."""
    path = scheduled.task.path
    if not isinstance(path, SampledPath):
        return ""
    nearest = int(np.linalg.norm(path.points - scheduled.X_PT[row, :3, 3], axis=1).argmin())
    line = path.lines[nearest] if path.lines else nearest + 2  # below the header
    return f"point {nearest + 1}, line {line} of {path.source}"
