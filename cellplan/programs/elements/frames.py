"""Frames that a controller counts from: its base C, and its flange G; those of the model, B and F, unless stated."""

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import Station


def controller_base(robot: Robot) -> Array:
    """The base that its controller counts from, in the world: ``X_WC = X_WB X_BC``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.base
    return robot.X_WB if stated is None else robot.X_WB @ stated.matrix


def on_flange(robot: Robot, X_FA: Array) -> Array:
    """A pose given in the flange of the model, in that of the controller: ``X_GA = inv(X_FG) X_FA``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.tool_frame
    return X_FA if stated is None else inverse(stated.matrix) @ X_FA


def require_rest(robot: str, station: Station) -> None:
    """Refuse lines in a frame that moves: that of a part which moves while the tool of a robot works on it."""
    if station.X is None or station.holder is not None:
        tasks = ", ".join(station.tasks)
        carried = "one that moves" if station.holder is None else f"'{station.holder}' of the same controller"
        raise InputError(
            f"robots.{robot}: expected a part that rests, held by a robot of another controller, for lines of the tool "
            f"(tasks {tasks}), got {carried}; write joints (--moves joints)"
        )
