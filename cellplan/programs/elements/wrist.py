"""Configuration of an arm: on which side of axis 1, and of the line through axes 2 and 3, its wrist is."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, rotation_about
from cellplan.model.cell.cell import Robot
from cellplan.programs.elements.joints import Axes, from_numbers

MEETING_TOL: Final = 1e-6  # [m] axes of a wrist that pass nearer than this to its centre meet there
PARALLEL_TOL: Final = 1e-6  # [rad] angle by which axes may miss being parallel or square
FORWARD_TOL: Final = 1e-3  # [m] an arm whose wrist is nearer than this to the plane of axis 1 is not stretched forward


def sides_at_zero(robot: Robot, *, both: bool) -> Array:
    """The sides, shape (2,), at the zero of the controller, where an arm is stretched forward.

    ``InputError`` where the wrist is at no side of axis 1, or, for ``both``, on the line through axes 2 and 3.
    """
    sides: Array = wrist_sides(robot, from_numbers(robot, np.zeros((1, len(robot.model.joints)))))[0]
    if np.any(np.abs(sides[: 1 + both]) < FORWARD_TOL):
        raise InputError(
            f"robots.{robot.name}: expected an arm that is stretched forward at the zero of its controller, as its "
            f"targets on the part state a configuration"
        )
    return sides


def wrist_sides(robot: Robot, q: Array) -> Array:
    """Signed distances in [m] of the wrist from axis 1 and, times its length, from the lower arm, shape (N, 2).

    ``InputError`` unless the last six joints, in [rad], shape (N, n), are those of an arm whose axes 2 and 3 are
    parallel and cross axis 1, with a wrist of three axes that meet.
    """
    arm = list(Axes.of(robot).arm)
    joints = [robot.model.joints[place] for place in arm]
    first, second, third = joints[:3]
    wrist_B = _wrist_centre(robot, arm)
    forward = np.cross(second.axis_B, first.axis_B)
    is_level = abs(second.axis_B @ first.axis_B) < PARALLEL_TOL
    if not is_level or np.linalg.norm(np.cross(second.axis_B, third.axis_B)) > PARALLEL_TOL:
        raise InputError(
            f"robots.{robot.name}: expected an arm whose axes 2 and 3 are parallel and cross axis 1, as its targets on "
            f"the part state a configuration"
        )
    upper = rotation_about(second.axis_B, q[:, arm[1]])
    elbow = upper @ (third.point_B - second.point_B)
    bent = rotation_about(third.axis_B, q[:, arm[2]]) @ (wrist_B - third.point_B)
    wrist = elbow + (upper @ bent[..., None])[..., 0]  # from axis 2
    return np.stack(
        [(wrist + second.point_B - first.point_B) @ forward, np.cross(elbow, wrist) @ second.axis_B], axis=1
    )


def _wrist_centre(robot: Robot, arm: list[int]) -> Array:
    """The point at the reference configuration where the last three axes meet, in [m], shape (3,)."""
    joints = [robot.model.joints[place] for place in arm[3:]]
    across = [np.eye(3) - np.outer(joint.axis_B, joint.axis_B) for joint in joints]
    right = np.sum([part @ joint.point_B for part, joint in zip(across, joints, strict=True)], axis=0)
    centre = np.linalg.lstsq(np.sum(across, axis=0), right, rcond=None)[0]
    gaps = [np.linalg.norm(part @ (centre - joint.point_B)) for part, joint in zip(across, joints, strict=True)]
    if max(gaps) > MEETING_TOL:
        raise InputError(
            f"robots.{robot.name}: expected an arm whose axes 4, 5 and 6 meet in a point, as its targets on the part "
            f"state a configuration"
        )
    return centre
