"""Frames that a controller counts from: its base C, and its flange G; those of the model, B and F, unless stated."""

from collections.abc import Mapping

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Station
from cellplan.scene.kinematics.screw_chain import ScrewChain


def controller_base(robot: Robot) -> Array:
    """The base that its controller counts from, in the world: ``X_WC = X_WB X_BC``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.base
    return robot.X_WB if stated is None else robot.X_WB @ stated.matrix


def on_flange(robot: Robot, X_FA: Array) -> Array:
    """A pose given in the flange of the model, in that of the controller: ``X_GA = inv(X_FG) X_FA``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.tool_frame
    return X_FA if stated is None else inverse(stated.matrix) @ X_FA


def part_pose(frame: ExportFrame, robot: str, task: str, q: Mapping[str, Array]) -> Array:
    """The frame of a task in the world as its controller has it, shape (N, 4, 4), or (4, 4) where it is fixed.

    ``q`` has the joints of the robot that holds the part in [rad] or [m], shape (N, n).
    """
    station = frame.station(robot, task)
    if station.X is None:
        raise InputError(f"task '{task}': expected a part that rests, or moves with a robot of the controller")
    if station.holder is None:
        return controller_base(frame.robot(robot)) @ station.X
    holder = frame.robot(station.holder)
    return ScrewChain(holder).flange_poses(q[holder.name]) @ inverse(on_flange(holder, np.eye(4))) @ station.X


def require_rest(robot: str, station: Station) -> None:
    """Refuse lines in a frame that moves: that of a part which moves while the tool of a robot works on it."""
    if station.X is None or station.holder is not None:
        tasks = ", ".join(station.tasks)
        carried = "one that moves" if station.holder is None else f"'{station.holder}' of the same controller"
        raise InputError(
            f"robots.{robot}: expected a part that rests, held by a robot of another controller, for lines of the tool "
            f"(tasks {tasks}), got {carried}; write joints (--moves joints)"
        )
