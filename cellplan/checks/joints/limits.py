"""Positions and velocities of the joints of a written motion, against their limits."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.cell.doubts import doubt_about_velocity
from cellplan.model.report.report import Check, JointUse

SHOWN_TOL: Final = 1e-9  # [rad] or [m] sums of rounded positions


def check_joints(uses: tuple[JointUse, ...], times: Array, q: Array) -> list[Check]:
    """Two checks of each joint of one robot: position and speed."""
    checks = []
    for index, use in enumerate(uses):
        alike = [it.velocity_limit for it in uses if it is not use and it.is_revolute == use.is_revolute]
        checks += [_check_position(use, times, q[:, index]), _check_velocity(use, alike)]
    return checks


def check_sums(robot: Robot, times: Array, q: Array) -> list[Check]:
    """Sums of joint angles against their ranges; between two rows they are linear as the angles.

    Args:
        times: Times in [s], shape (N,).
        q: Positions in [rad] or [m], shape (N, n).
    """
    checks = []
    for it in robot.joint_sums:
        total, names = it.of(q), " + ".join(it.joints)
        worst = int(np.argmin(np.minimum(total - it.lower, it.upper - total)))
        value, at_s, passed = float(total[worst]), float(times[worst]), bool(np.all(it.holds(q)))
        limit = it.lower if value - it.lower < it.upper - value else it.upper
        verdict = "stays within" if passed else "leaves"
        low, high = np.degrees([it.lower, it.upper])
        worst_deg, limit_deg = float(np.degrees(value)), float(np.degrees(limit))
        words = f"{verdict} {low:.6g} .. {high:.6g} deg, {worst_deg:.4f} deg at worst, at {at_s:.3f} s"
        subject, message = f"{robot.name}/{names}", f"sum {names} of {robot.name} {words}"
        checks.append(
            Check("joint_sum", subject, passed, message, value=worst_deg, limit=limit_deg, unit="deg", at_s=at_s)
        )
    return checks


def check_shown(robot: Robot, times: Array, q: Array) -> list[Check]:
    """Positions that a controller shows, against the controller's limits, which may be on coupled axes.

    Args:
        times: Times in [s], shape (N,).
        q: Positions of the model, shape (N, n); every shown one is linear between two rows as these are.
    """
    counting = robot.model.controller
    if counting is None or counting.limits is None:
        return []
    positions, checks = counting.from_model(q), list[Check]()
    for index, (joint, (lower, upper)) in enumerate(zip(robot.model.joints, counting.limits.tolist(), strict=True)):
        if np.isinf(lower) and np.isinf(upper):
            continue
        unit, scale = joint.display_unit
        shown = positions[:, index]
        margins = np.minimum(shown - lower, upper - shown)
        worst = int(np.argmin(margins))
        value, at_s = float(shown[worst]), float(times[worst])
        limit = lower if value - lower < upper - value else upper
        passed = bool(margins[worst] >= -SHOWN_TOL)
        verdict = f"{'stays' if passed else 'is'} {scale * abs(float(margins[worst])):.4g} {unit} "
        value, limit, name = scale * value, scale * limit, f"{robot.name}/{joint.name}"
        verdict += "inside its limits" if passed else f"beyond its limit {limit:.6g} {unit}"
        message = f"joint {name} as the controller shows it {verdict}, {value:.4f} {unit}, worst at {at_s:.3f} s"
        checks.append(
            Check("controller_position", name, passed, message, value=value, limit=limit, unit=unit, at_s=at_s)
        )
    return checks


def _check_position(use: JointUse, times: Array, q: Array) -> Check:
    """One joint's worst position; the message names the first instant of a violation too."""
    unit, scale = use.display_unit
    worst = int(np.searchsorted(times, use.margin_at_s))
    value = scale * float(q[worst])
    limit = scale * (use.lower if q[worst] - use.lower < use.upper - q[worst] else use.upper)
    passed = use.margin >= 0.0
    if np.isinf(use.margin):
        verdict = "has no position limits"
    elif passed:
        verdict = f"stays {scale * use.margin:.4g} {unit} inside its limits"
    else:
        first = float(times[np.argmax((q < use.lower) | (q > use.upper))])
        side = "below its lower" if limit == scale * use.lower else "beyond its upper"
        verdict = (
            f"is {-scale * use.margin:.4g} {unit} {side} limit {limit:g} {unit} "
            f"(reaches {value:.4f} {unit}; outside from {first:.3f} s)"
        )
    joint, at_s = f"{use.robot}/{use.joint}", use.margin_at_s
    message = f"joint {joint} {verdict}, worst at {at_s:.3f} s"
    return Check("joint_position", joint, passed, message, value=value, limit=limit, unit=unit, at_s=at_s)


def _check_velocity(use: JointUse, alike: Sequence[float]) -> Check:
    """One joint's largest speed; ``alike`` are the limits of the robot's other joints that move as it does."""
    joint, (unit, scale), at_s = f"{use.robot}/{use.joint}", use.display_unit, use.peak_velocity_at_s
    passed, peak, limit = use.peak_velocity <= use.velocity_limit, scale * use.peak_velocity, scale * use.velocity_limit
    verdict = "has a peak velocity of" if passed else "exceeds its velocity limit:"
    doubt = "" if passed else doubt_about_velocity(use.velocity_limit, alike, is_revolute=use.is_revolute)
    doubt = doubt and f"; {doubt}"
    percent, unit = 100 * use.peak_velocity / use.velocity_limit, f"{unit}/s"
    share = f"{percent:.4g} % of its limit {limit:g} {unit}"
    message = f"joint {joint} {verdict} {peak:.4g} {unit} at {at_s:.3f} s ({share}){doubt}"
    return Check("joint_velocity", joint, passed, message, value=peak, limit=limit, unit=unit, at_s=at_s)
