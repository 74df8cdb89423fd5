r"""Positions of INFORM: a pose of the tool and the configuration of the arm, ``///RCONF``, and the joints of both.

The first six numbers of ``///RCONF`` are (Yaskawa, NX100 and DX100 data transmission, job data format): 0 for *flip*,
0 for *upper arm*, 0 for *front*, and 0 where axes R, T and S are *below 180 degrees*. An arm is in flip where axis R is
within a quarter turn of its zero, whatever its whole turns (NX100 operator's manual, manipulator types):

.. math:: -90 < \theta_R \le 90, \quad 270 < \theta_R \le 360, \quad -360 < \theta_R \le -270 .

The two solutions of a wrist differ by half a turn of R, so that flip tells them apart. An axis is below 180 degrees
where :math:`-180 < \theta \le 180`; its whole turns follow from that and from the pose.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Robot
from cellplan.programs.elements.wrist import sides_at_zero, wrist_sides
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.kinematics.spherical_wrist import SphericalWristArm

STATED: Final = 6  # numbers of a configuration that have a meaning
WIDTH: Final = 24  # of all its numbers; older controllers have fewer
TURNED: Final = (3, 5, 0)  # axes R, T and S, whose half turns it states
REAR: Final = 2  # place of the number for front or rear
EDGE: Final = 1e-4  # [deg] from the edge of a configuration within which either of its sides is right
ONE_CIRCLE: Final = 3e-6  # [m] of points with three decimals of a millimetre, from the circle through three of them
LIMIT_TOL: Final = 1e-6  # [rad] by which rounding takes an axis beyond its limit


def configuration(robot: Robot, q: Array) -> NDArray[np.int_]:
    """Configuration of an arm with joints in [rad], shape (N, 6), as six numbers, shape (N, 6).

    Which side is in front follows from the zero of the controller, at which the arm is stretched forward.

    ``InputError`` unless it is an arm with a wrist of three axes that meet.
    """
    sides = wrist_sides(robot, q) * np.sign(sides_at_zero(robot, both=True)) < 0.0
    angles = _counted(robot, q)[:, TURNED]
    quarter = np.mod(angles[:, 0] + 90.0, 360.0)
    is_flip = (quarter > 0.0) & (quarter <= 180.0)
    return np.column_stack([~is_flip, sides[:, 1], sides[:, 0], (angles <= -180.0) | (angles > 180.0)]).astype(int)


def are_on_one_circle(p: Array) -> bool:
    """Whether points in [m], shape (N, 3), are on the circle through the first three, as far as their decimals say."""
    offset = p - p[0]
    normal = np.cross(offset[1], offset[2])
    area = float(np.linalg.norm(normal))
    if area <= ONE_CIRCLE * float(np.linalg.norm(offset[2])):
        return False
    centre = np.linalg.solve([offset[1], offset[2], normal], [*(0.5 * np.sum(offset[1:3] ** 2, axis=1)), 0.0])
    height = offset @ normal / area
    radial = np.linalg.norm(offset - centre - height[:, None] * normal / area, axis=1) - np.linalg.norm(centre)
    return bool(np.hypot(height, radial).max() <= ONE_CIRCLE)


def tool_pose(robot: Robot, q: Array) -> Array:
    """The tool of a robot in the world in [m], shape (4, 4), for joints in [rad], shape (6,); of many, for (N, 6)."""
    poses: Array = ScrewChain(robot).tool_poses(np.atleast_2d(q))
    return poses[0] if q.ndim == 1 else poses


def joints_of(robot: Robot, X_WT: Array, stated: NDArray[np.int_]) -> Array | None:
    """Joints in [rad], shape (6,), that bring a tool to a pose, shape (4, 4), in a configuration, shape (6,).

    None where the arm does not reach it so within its limits.
    """
    arm = SphericalWristArm.of(robot.model)
    if arm is None:
        return None
    D = inverse(robot.X_WB) @ X_WT @ inverse(robot.model.X_BF @ robot.tool.X_FT)
    solutions = arm.configurations(D[None])[0]
    q = _on_stated_turns(robot, solutions[np.all(np.isfinite(solutions), axis=1)], stated)
    model = robot.model
    q = q[np.all((q >= model.lower - LIMIT_TOL) & (q <= model.upper + LIMIT_TOL), axis=1)]
    if not len(q):
        return None
    near = [configuration(robot, q + turn) == stated for turn in np.deg2rad([-EDGE, 0.0, EDGE])]
    fits = np.all(np.any(near, axis=0), axis=1)
    exact = np.sum(near[1], axis=1) * fits
    best: Array = q[int(np.argmax(exact))]
    return best if np.any(fits) else None


def _on_stated_turns(robot: Robot, q: Array, stated: NDArray[np.int_]) -> Array:
    """Joints with axes S, R and T on the turns that are stated, and the others within their limits, shape (K, 6)."""
    q, model = q.copy(), robot.model
    senses = np.ones(len(model.joints)) if model.controller is None else model.controller.sign
    beyond = dict(zip(TURNED, stated[3:].tolist(), strict=True))
    for axis in range(len(model.joints)):  # an axis counts on earlier ones only
        if axis not in beyond:
            below, above = q[:, axis] < model.lower[axis] - LIMIT_TOL, q[:, axis] > model.upper[axis] + LIMIT_TOL
            q[:, axis] += 2.0 * np.pi * (below.astype(float) - above)
            continue
        angle = _counted(robot, q)[:, axis]
        meant = angle - 360.0 * np.ceil((angle - 180.0) / 360.0)
        meant += np.where(meant <= 0.0, 360.0, -360.0) * beyond[axis]
        q[:, axis] += senses[axis] * np.deg2rad(meant - angle)
    return q


def _counted(robot: Robot, q: Array) -> Array:
    """Joints as the controller counts them in [deg], shape (N, 6)."""
    zero = robot.model.controller
    return np.rad2deg(q if zero is None else zero.from_model(q))
