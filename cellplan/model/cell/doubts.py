"""What looks like a mistake of a unit or a sign in a cell: asked first where something fails, before larger cures."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.units import MM

TURN: Final = 2.0 * np.pi  # limits in degrees of no larger a number may be radians
NARROW: Final = 20.0  # [-] how much narrower than others a range is that may be in radians: 57.3, less for short ranges
USUAL: Final = np.radians(90.0)  # [rad] range of the others of a robot
THOUSAND: Final = 300.0  # [-] how much slower than others a sliding joint is whose limit may be in metres
SMALL: Final = 0.01  # [m] a tool or a place that may be in metres is no larger, its number taken for millimetres
LARGE: Final = 0.3  # [m] the others are at least as far


def doubt_about(cell: Cell, robot: Robot) -> str:
    """A question about a robot's tool, limits or base, with its key; empty where nothing looks wrong."""
    return _about_tool(robot) or doubt_about_limits(robot) or _about_base(cell, robot)


def doubt_about_velocity(limit: float, others: Sequence[float], *, is_revolute: bool) -> str:
    """A question about the velocity limit of a joint that is far below those of the robot's other joints like it."""
    unit, factor = ("radians", NARROW) if is_revolute else ("metres", THOUSAND)
    if not others or factor * limit > float(np.median(others)):
        return ""
    return f"is the limit in {unit} per second? Those of the other joints are far larger"


def _about_tool(robot: Robot) -> str:
    """A tip behind the flange, or nearer to it than any tool is long."""
    X_FT = robot.tool.X_FT
    along, away = float(X_FT[:3, 3] @ X_FT[:3, 2]), float(np.linalg.norm(X_FT[:3, 3]))
    if along < -SMALL:
        return (
            f"is the tool reversed? The tip of the tool of '{robot.name}' is {-MM * along:.4g} mm behind its flange "
            f"along the tool's own axis: check the sign of robots.{robot.name}.tool.xyz_mm, or turn the axis by rpy_deg"
        )
    if 0.0 < away < 1e-3:
        return f"is robots.{robot.name}.tool.xyz_mm in metres? Its tip is {MM * away:.3g} mm from the flange"
    return ""


def doubt_about_limits(robot: Robot) -> str:
    """Ranges of joints that would be usual ones if their numbers were radians."""
    model = robot.model
    turning = [joint for joint in model.joints if joint.is_revolute and np.isfinite([joint.lower, joint.upper]).all()]
    narrow = [it for it in turning if np.degrees(max(abs(it.lower), abs(it.upper))) <= TURN and it.upper > it.lower]
    others = [it.upper - it.lower for it in turning if it not in narrow]
    usual = float(np.median(others)) if others else USUAL
    doubtful = [it for it in narrow if NARROW * (it.upper - it.lower) < usual or not others]
    if not doubtful:
        return ""
    first = doubtful[0]
    return (
        f"are the limits of '{first.name}' in radians? They are {np.degrees(first.lower):.4g} .. "
        f"{np.degrees(first.upper):.4g} deg, and keys that end in _deg count degrees"
    )


def _about_base(cell: Cell, robot: Robot) -> str:
    """A base a few millimetres from the origin where others are far from it."""
    away = {it.name: float(np.linalg.norm(it.X_WB[:3, 3])) for it in cell.robots}
    if 0.0 < away[robot.name] < SMALL and max(away.values()) > LARGE:
        return (
            f"is robots.{robot.name}.base.xyz_mm in metres? The base is {MM * away[robot.name]:.3g} mm from the origin"
        )
    return ""
