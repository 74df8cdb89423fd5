"""Joint drift: how far the joints are after each cycle from where they were at its start."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check
from cellplan.model.robot.repeatability import JointDrift, Repeatability
from cellplan.model.task.task import TIME_TOLERANCE

REVOLUTE_DRIFT_TOL: Final = float(np.deg2rad(0.001))  # [rad] below the repeatability of any arm's joints
PRISMATIC_DRIFT_TOL: Final = 1e-6  # [m] likewise


def repeatability(cell: Cell, schedule: Schedule, q: RobotRows) -> Repeatability | None:
    """How far every joint is at the end of each cycle from where it was at its start.

    A cycle lies between two times at which all tools are at the pose of their start together. Tasks that begin and
    end their cycles together are taken cycle by cycle; otherwise the whole run is one cycle. Cycles that begin while a
    tool still settles are left out. Between two samples a joint moves linearly.

    Args:
        q: Positions read back in [rad] or [m], shape (N, n), by robot.

    Returns:
        The drift of every joint; None when a tool does not come back, or no cycle is left.
    """
    cycle_times = _cycle_times(schedule)
    if len(cycle_times) < 2:
        return None
    drifts = []
    for robot in cell.robots:
        for joint, positions in zip(robot.model.joints, q[robot.name].T, strict=True):
            drift = np.diff(np.interp(cycle_times, schedule.times, positions))
            k = int(np.argmax(np.abs(drift)))
            drifts.append(
                JointDrift(
                    robot=robot.name,
                    joint=joint.name,
                    is_revolute=joint.is_revolute,
                    drift=drift,
                    worst=float(abs(drift[k])),
                    at_cycle=k + 1,
                )
            )
    closes = all(drift.worst <= _limit(drift) for drift in drifts)
    return Repeatability(cycle_times=cycle_times, drifts=tuple(drifts), closes=closes)


def check_joint_drift(repeatability: Repeatability | None, *, is_demanded: bool) -> tuple[Check, ...]:
    """Whether every joint comes back in every cycle; nothing is checked when the cell does not demand it.

    Args:
        repeatability: Drift of the run; a run without a cycle cannot meet the demand.
    """
    if not is_demanded:
        return ()
    if repeatability is None:
        message = "joint drift: there is no cycle to judge, as not all tools come back to the pose of their start"
        return (Check("joint_drift", "cell", False, message, value=0.0, limit=1.0, unit="cycles", at_s=None),)
    return tuple(_check(repeatability, drift) for drift in repeatability.drifts)


def _cycle_times(schedule: Schedule) -> Array:
    """Times at which all tools are at their start together, shape (cycles + 1,); fewer than two: no cycle."""
    if not schedule.tasks or not all(scheduled.cycle_ends for scheduled in schedule.tasks):
        return np.zeros(0)
    bounds = [np.array([scheduled.begin, *scheduled.cycle_ends]) for scheduled in schedule.tasks]
    is_common = all(len(b) == len(bounds[0]) and np.abs(b - bounds[0]).max() <= TIME_TOLERANCE for b in bounds)
    cycle_times = bounds[0] if is_common else np.array([min(b[0] for b in bounds), max(b[-1] for b in bounds)])
    settled = max(scheduled.task.judged_from for scheduled in schedule.tasks)
    return cycle_times[cycle_times >= settled - TIME_TOLERANCE]


def _limit(drift: JointDrift) -> float:
    """Largest drift of a joint that comes back, in [rad] or [m]."""
    return REVOLUTE_DRIFT_TOL if drift.is_revolute else PRISMATIC_DRIFT_TOL


def _check(drifts: Repeatability, drift: JointDrift) -> Check:
    """One joint against its limit."""
    unit, scale = drift.display_unit
    value, limit = scale * drift.worst, scale * _limit(drift)
    joint, at_s = f"{drift.robot} {drift.joint}", float(drifts.cycle_times[drift.at_cycle])
    message = (
        f"{joint} is {value:.3g} {unit} away from its position one cycle earlier, at {at_s:.3f} s, the end of cycle "
        f"{drift.at_cycle}; allowed {limit:g} {unit}"
    )
    passed = drift.worst <= _limit(drift)
    return Check("joint_drift", joint, passed, message, value=value, limit=limit, unit=unit, at_s=at_s)
