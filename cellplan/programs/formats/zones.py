"""Zones: how near to a row a target leaves the straight motion, in lengths of tool path or in turns of axes.

A share of a segment is known from the joints. Languages that state a zone by its size need the way of the tool instead:
the distance of its tip from the row when the share is left to go.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import RobotRows
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.frames import carried_poses
from cellplan.programs.elements.paced import Move, ReadMove

HALVINGS: Final = 24  # of the search for a share, to 3e-8
LEAST_SHARE: Final = 1e-6  # [-] of a row that is no stop, however near to it it is rounded
STANDS: Final = 1e-9  # [rad] or [m] axes that move less in a segment do not count


def tool_zones(robot: Robot, q: Array, shares: Array) -> Array:
    """Distance of the tool from each row in [m] when a share of the segment before or after it is left, shape (N,).

    It is the smaller one of both; zero at both ends.

    Rows ``q`` are in [rad] or [m], shape (N, n), shares 0 to 0.5, shape (N,).
    """
    zones = np.zeros(len(q))
    if len(q) > 2:
        inner, share, tips = q[1:-1], shares[1:-1], tool_tips(robot, q[1:-1])
        zones[1:-1] = np.min([_away(robot, tips, inner, other, share) for other in (q[:-2], q[2:])], axis=0)
    return zones


def tool_tips(robot: Robot, q: Array) -> Array:
    """Tool tip in the base frame in [m], shape (N, 3), of positions of the model in [rad] or [m], shape (N, n)."""
    return carried_poses(robot, q, robot.tool.X_FT)[:, :3, 3]


def on_scale(sizes: Array, scale: Sequence[int]) -> NDArray[np.int_]:
    """The largest of a scale that is no larger than each size, 0 where none is, shape (N,)."""
    whole = np.array([0, *scale])
    return whole[np.searchsorted(whole, sizes, side="right") - 1]


def tool_shares(robot: Robot, q: Array, zones: Array) -> Array:
    """Largest share of the segments of a row within which the tool is nearer to it than a zone, 0 to 0.5, shape (N,).

    Rows ``q`` are in [rad] or [m], shape (N, n); zones in [m], 0 for a stop, shape (N,).
    """
    shares = np.zeros(len(q))
    rows = np.flatnonzero(zones > 0.0)
    rows = rows[(rows > 0) & (rows < len(q) - 1)]
    tips = tool_tips(robot, q[rows])
    for other in (rows - 1, rows + 1):
        low, high = np.zeros(len(rows)), np.full(len(rows), LARGEST_SHARE)
        inside = _away(robot, tips, q[rows], q[other], high) <= zones[rows]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            near = _away(robot, tips, q[rows], q[other], middle) <= zones[rows]
            low, high = np.where(near, middle, low), np.where(near, high, middle)
        shares[rows] = np.maximum(shares[rows], np.where(inside, LARGEST_SHARE, high))
    return shares


def with_shares(robot: Robot, moves: Sequence[ReadMove], zones: Sequence[float]) -> list[ReadMove]:
    """Moves that were read, those of joints with the shares of zones that are stated by the distance of the tool.

    Zones are in [m], shape (N,), 0 for a stop and for lines and arcs, whose own zones stay. ``InputError`` has file and
    line where a motion of joints beside a seam is no stop.
    """
    shares = tool_shares(robot, np.array([move.q for move in moves]), np.array(zones)).tolist()
    for place, (move, zone) in enumerate(zip(moves, zones, strict=True)):
        if zone > 0.0 and any(other.poses for other in moves[max(place - 1, 0) : place + 2]):
            move.refuse("a stop beside a seam", "a rounded row")
    return [
        move if move.poses else replace(move, share=max(share, LEAST_SHARE) if zone > 0.0 else 0.0)
        for move, share, zone in zip(moves, shares, zones, strict=True)
    ]


def axis_zones(robot: Robot, q: Array, share: Array | float) -> Array:
    """Share of the way of the axis that moves most in the shorter segment of a row, in [deg] or [mm], shape (N,).

    Rows ``q`` are in [rad] or [m], shape (N, n); shares 0 to 0.5, of all rows or of each, shape (N,).
    """
    travels = _axis_travels(robot, q)
    return share * np.min(np.max(np.where(np.isfinite(travels), travels, 0.0), axis=2), axis=0)


def axis_shares(robot: Robot, q: Array, turns: Array, slides: Array) -> Array:
    """Largest share of its segments in which an axis is nearer to a row than a zone, 0 to 0.5, shape (N,).

    Rows ``q`` are in [rad] or [m], shape (N, n); zones in [deg] of turning and in [mm] of sliding axes, shape (N,).
    """
    zones = np.stack([turns if joint.is_revolute else slides for joint in robot.model.joints], axis=1)
    with np.errstate(over="ignore"):
        shares = np.max(zones / _axis_travels(robot, q), axis=(0, 2))
    shares[[0, -1]] = 0.0
    return np.minimum(shares, LARGEST_SHARE)


def part_shares(p: Array, zones: Array) -> Array:
    """As ``tool_shares`` for straight lines between points, NaN where a point is not known, shape (N, 3)."""
    lengths = np.full((2, len(p)), np.nan)
    lengths[0, 1:] = lengths[1, :-1] = np.linalg.norm(np.diff(p, axis=0), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(zones > 0.0, zones / np.min(lengths, axis=0), 0.0)
    return np.where(np.isnan(shares), LARGEST_SHARE, np.minimum(shares, LARGEST_SHARE))


def shares_off_seams(moves: Sequence[Move], rows: RobotRows) -> Array:
    """Shares within which moves of joints round each row, shape (N,); the tool says how near only between such rows."""
    shares, is_joint = np.zeros(len(rows)), ~rows.on_seam
    for move in moves:
        is_between = bool(np.all(is_joint[max(move.row - 1, 0) : move.row + 2]))
        shares[move.row] = move.share if is_between else 0.0
    return shares


def _away(robot: Robot, tips: Array, q: Array, other: Array, share: Array) -> Array:
    """Distance of the tool from its tips in some rows, a share on the way to others, in [m], shape (N,)."""
    return np.linalg.norm(tool_tips(robot, q + share[:, None] * (other - q)) - tips, axis=1)


def _axis_travels(robot: Robot, q: Array) -> Array:
    """Way of each axis to and from each row in [deg] or [mm], infinite where it stands, shape (2, N, n)."""
    units = np.array([joint.display_unit.scale for joint in robot.model.joints])
    moved = np.abs(np.diff(q, axis=0))
    travels = np.full((2, *q.shape), np.inf)
    travels[0, 1:] = travels[1, :-1] = np.where(moved > STANDS, moved * units, np.inf)
    return travels
