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
        words = f"{verdict} {low:.6g} .. {high:.6g} deg, {np.degrees(value):.4f} deg at worst, at {at_s:.3f} s"
        checks.append(
            Check(
                name="joint_sum",
                subject=f"{robot.name}/{names}",
                passed=passed,
                value=float(np.degrees(value)),
                limit=float(np.degrees(limit)),
                unit="deg",
                at_s=at_s,
                message=f"sum {names} of {robot.name} {words}",
            )
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
        verdict += "inside its limits" if passed else f"beyond its limit {scale * limit:.6g} {unit}"
        checks.append(
            Check(
                name="controller_position",
                subject=f"{robot.name}/{joint.name}",
                passed=passed,
                value=scale * value,
                limit=scale * limit,
                unit=unit,
                at_s=at_s,
                message=f"joint {robot.name}/{joint.name} as the controller shows it {verdict}, {scale * value:.4f} "
                f"{unit}, worst at {at_s:.3f} s",
            )
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
    return Check(
        name="joint_position",
        subject=f"{use.robot}/{use.joint}",
        passed=passed,
        value=value,
        limit=limit,
        unit=unit,
        at_s=use.margin_at_s,
        message=f"joint {use.robot}/{use.joint} {verdict}, worst at {use.margin_at_s:.3f} s",
    )


def _check_velocity(use: JointUse, alike: Sequence[float]) -> Check:
    """One joint's largest speed; ``alike`` are the limits of the robot's other joints that move as it does."""
    unit, scale = use.display_unit
    passed = use.peak_velocity <= use.velocity_limit
    verdict = "has a peak velocity of" if passed else "exceeds its velocity limit:"
    doubt = "" if passed else doubt_about_velocity(use.velocity_limit, alike, is_revolute=use.is_revolute)
    doubt = doubt and f"; {doubt}"
    percent = 100 * use.peak_velocity / use.velocity_limit
    return Check(
        name="joint_velocity",
        subject=f"{use.robot}/{use.joint}",
        passed=passed,
        value=scale * use.peak_velocity,
        limit=scale * use.velocity_limit,
        unit=f"{unit}/s",
        at_s=use.peak_velocity_at_s,
        message=(
            f"joint {use.robot}/{use.joint} {verdict} {scale * use.peak_velocity:.4g} {unit}/s "
            f"at {use.peak_velocity_at_s:.3f} s ({percent:.4g} % of its limit {scale * use.velocity_limit:g} "
            f"{unit}/s){doubt}"
        ),
    )
