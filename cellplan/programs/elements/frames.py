"""Frames that a controller counts from: its base C, and its flange G; those of the model, B and F, unless stated."""

from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Robot


def controller_base(robot: Robot) -> Array:
    """The base that its controller counts from, in the world: ``X_WC = X_WB X_BC``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.base
    return robot.X_WB if stated is None else robot.X_WB @ stated.matrix


def on_flange(robot: Robot, X_FA: Array) -> Array:
    """A pose given in the flange of the model, in that of the controller: ``X_GA = inv(X_FG) X_FA``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.tool_frame
    return X_FA if stated is None else inverse(stated.matrix) @ X_FA
