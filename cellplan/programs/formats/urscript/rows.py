"""What a URScript row states besides its joints: speed and acceleration of a move, and how far it may be rounded."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.acceleration import full_speed_in
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.programs.elements.corners import may_round
from cellplan.programs.formats.zones import tool_zones

APPROACH_SPEED: Final = 0.25  # [rad/s] of the leading joint towards the first row, from wherever the robot stands
APPROACH_ACCELERATION: Final = 0.5  # [rad/s^2] likewise
SLOWEST: Final = 0.01  # [rad/s] a move is stated no slower
TICK: Final = 1e-3  # [rad/s], [rad/s^2] speeds and accelerations are rounded down to it
BLEND_TICK: Final = 1e-4  # [m] radii are rounded down to it
SMALLEST_BLEND: Final = 5e-4  # [m] a smaller radius saves no time
BLEND_SHARE: Final = 0.99  # [-] neighbouring blends may not touch


def move_speeds(robot: Robot, rows: RobotRows) -> Array:
    """Speed of the leading joint in the move to each row in [rad/s], shape (N,): that of the plan, within all limits.

    The leading joint of a move is the one that travels farthest. Where rows have no times, or none travels, the speed
    is that of the approach.
    """
    speeds = np.full(len(rows), APPROACH_SPEED)
    if len(rows) < 2:
        return speeds
    travel = np.abs(np.diff(rows.q, axis=0))
    farthest = travel.max(axis=1)
    moves = np.flatnonzero(farthest > 0.0)
    planned = np.full(len(rows) - 1, APPROACH_SPEED) if rows.times is None else farthest / np.diff(rows.times)
    share = travel[moves] / farthest[moves, None]
    limits = np.array([joint.velocity for joint in robot.model.joints])
    allowed = (limits / np.maximum(share, 1e-12)).min(axis=1)
    limited = np.minimum(np.maximum(planned[moves], SLOWEST), allowed)
    speeds[1 + moves] = np.maximum(np.floor(limited / TICK + 1e-6), 1.0) * TICK
    return speeds


def move_acceleration(robot: Robot) -> float:
    """Acceleration of the leading joint in [rad/s^2] that no joint exceeds; that of the approach if none is known."""
    accelerations = []
    for place, joint in enumerate(robot.model.joints):
        seconds = full_speed_in(robot.acceleration, place)
        assumed = None if seconds is None else joint.top_speed / seconds
        accelerations.append(assumed if joint.acceleration is None else joint.acceleration)
    stated = [limit for limit in accelerations if limit is not None]
    smallest = min(stated, default=APPROACH_ACCELERATION)
    return float(max(np.floor(smallest / TICK + 1e-6), 1.0) * TICK)


def blend_radii(robot: Robot, rows: RobotRows, blend: Array | float) -> Array:
    """Distance in [m] from each row within which its move may be rounded, shape (N,); zero for a stop.

    It is that of the tool tip after its share ``blend`` of the shorter neighbouring segment. Which
    rows are stops: ``corners.may_round``.

    The share ``blend`` is 0 to 0.5, of all rows or of each, shape (N,).
    """
    if not np.any(np.asarray(blend) > 0.0):
        return np.zeros(len(rows))
    radii = tool_zones(robot, rows.q, np.broadcast_to(blend, len(rows)))
    radii = np.floor(BLEND_SHARE * radii / BLEND_TICK) * BLEND_TICK
    free = may_round(ProgramRows(name=None, robots={robot.name: rows}))[robot.name]
    return np.where(free & (radii >= SMALLEST_BLEND), radii, 0.0)
