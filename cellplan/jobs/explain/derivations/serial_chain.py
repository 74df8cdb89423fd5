"""Serial chain: the axes between a robot's base and its flange, in order, and how the driven joints move them."""

from typing import NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, pose_from, rotation_about
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import Drive, FollowerJoint, Joint, RobotModel


class ChainAxis(NamedTuple):
    """One axis on the way from base to flange, and how a driven joint moves it."""

    axis: Joint | FollowerJoint
    drive: Drive


def chain_to_flange(model: RobotModel) -> tuple[ChainAxis, ...]:
    """Axes that carry the flange, from the base on; joints and followers beside the way are left out."""
    return tuple(ChainAxis(model.axes[link], model.drive(link)) for link in model.links_to_flange)


def axis_positions(chain: tuple[ChainAxis, ...], q: Array) -> Array:
    """Positions of the axes of a chain for the robot's driven joints ``q``, shape (n,), in [rad] or [m]."""
    return np.array([drive.ratio * q[drive.joint] + drive.offset for _, drive in chain])


def axis_shares(chain: tuple[ChainAxis, ...], joints: int) -> Array:
    """Speed of each axis per speed of each driven joint, shape (axes, joints): a follower's share is its ratio."""
    shares = np.zeros((len(chain), joints))
    for row, (_, drive) in enumerate(chain):
        shares[row, drive.joint] = drive.ratio
    return shares


def displacement(s: Array, s0: Array, position: float, *, is_revolute: bool) -> Array:
    """Screw displacement by a turn about, or a slide along, one axis ([Ribeiro2010]_ App. B), shape (4, 4).

    Written here anew: the kinematics of the checks must not vouch for itself.
    """
    if not is_revolute:
        return pose_from(np.eye(3), position * s)
    R = rotation_about(s, position)
    return pose_from(R, s0 - R @ s0)


def part_holder(cell: Cell) -> tuple[Robot, Array] | None:
    """The robot that carries the part, and the part frame ``X_FP`` in its flange; None when the part is fixed.

    Where several robots hold the part, the first is the reference ([Ribeiro2010]_ 4.5).
    """
    if cell.carrier is None:
        return None
    robot = cell.robots[cell.carrier]
    return robot, robot.tool.X_FT @ cell.part.X_CP


def checked_configuration(cell: Cell, q: Array) -> Array:
    """The stacked joint vector, shape (nq,); one of another length, or that is not finite, is refused."""
    q = np.asarray(q, dtype=float)
    if q.shape != (cell.joint_count,):
        raise InputError(f"q: expected {cell.joint_count} joint positions, one per joint, got shape {q.shape}")
    if not np.all(np.isfinite(q)):
        raise InputError(f"q: expected finite joint positions, got {q[~np.isfinite(q)][0]}")
    return q
