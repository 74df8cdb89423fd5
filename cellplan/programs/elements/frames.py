"""Frames that a controller counts from: its base C, and its flange G; those of the model, B and F, unless stated."""

from collections.abc import Mapping, Sequence

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse, pose_from, rotation_about
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Station


def controller_base(robot: Robot) -> Array:
    """The base that its controller counts from, in the world: ``X_WC = X_WB X_BC``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.base
    return robot.X_WB if stated is None else robot.X_WB @ stated.matrix


def on_flange(robot: Robot, X_FA: Array) -> Array:
    """A pose given in the flange of the model, in that of the controller: ``X_GA = inv(X_FG) X_FA``, shape (4, 4)."""
    stated = None if robot.control is None else robot.control.tool_frame
    return X_FA if stated is None else inverse(stated.matrix) @ X_FA


def carried_poses(robot: Robot, q: Array, X_FA: Array) -> Array:
    """A pose in the flange, in the base of the model in [m], shape (N, 4, 4), for joints in [rad] or [m], shape (N, n).

    It is the product of exponentials of all axes down to the flange.
    """
    model, X_BA = robot.model, robot.model.X_BF @ X_FA
    p, R = np.broadcast_to(X_BA[:3, 3], (len(q), 3)), np.broadcast_to(X_BA[:3, :3], (len(q), 3, 3))
    for link in reversed(model.links_to_flange):
        axis, drive = model.axes[link], model.drive(link)
        position = drive.ratio * q[:, drive.joint] + drive.offset
        if axis.is_revolute:
            turn = rotation_about(axis.axis_B, position)
            p = axis.point_B + np.einsum("nij,nj->ni", turn, p - axis.point_B)
            R = turn @ R
        else:
            p = p + position[:, None] * axis.axis_B
    return pose_from(R, p)


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
    X_FP = inverse(on_flange(holder, np.eye(4))) @ station.X
    return holder.X_WB @ carried_poses(holder, q[holder.name], X_FP)


def require_frame_numbers(robot: Robot, stations: Sequence[Station], *, needed: tuple[int, int] | None = None) -> None:
    """Refuse fewer numbers of frames than poses of the part in which a robot works; there are no stations if not known.

    ``needed`` has the smallest and the largest number where programs need some; None where they can do without.
    """
    control, poses = robot.control, [", ".join(station.tasks) for station in stations if station.X is not None]
    numbers = () if control is None else control.frames
    if not numbers and control is not None and control.base_number and len(poses) <= 1:
        numbers = (control.base_number,)
    if len(numbers) < len(poses) if numbers else needed is not None:
        count = "1 number" if len(poses) == 1 else f"{len(poses)} numbers"
        counted = f"{count}, one for each pose of the part in which it works ({'; '.join(poses)})"
        what = counted if poses else "the numbers of the frames of the part"
        what += f", {needed[0]} to {needed[1]}" if needed else ""
        raise InputError(f"robots.{robot.name}.controller.frames: expected {what}, got {len(numbers) or 'none'}")


def require_rest(robot: str, station: Station) -> None:
    """Refuse lines in a frame that moves: that of a part which moves while the tool of a robot works on it."""
    if station.X is None or station.holder is not None:
        tasks = ", ".join(station.tasks)
        carried = "one that moves" if station.holder is None else f"'{station.holder}' of the same controller"
        raise InputError(
            f"robots.{robot}: expected a part that rests, held by a robot of another controller, for lines of the tool "
            f"(tasks {tasks}), got {carried}; write joints (--moves joints)"
        )
