"""Serial chain: the axes between a robot's base and its flange, in order, and how the driven joints move them."""

from dataclasses import dataclass

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, pose_from, rotation_about
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import JointKind, RobotModel


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChainAxis:
    """One axis on the way from base to flange; a driven joint has ratio 1 and offset 0."""

    name: str  # name of the joint or follower
    kind: JointKind  # revolute or prismatic
    axis_B: Array  # unit direction at the reference configuration, shape (3,)
    point_B: Array  # A point on the axis in [m], shape (3,)
    leader: int  # index of the driven joint that moves it, in ``RobotModel.joints``
    ratio: float = 1.0  # its motion per motion of that joint
    offset: float = 0.0  # its position in [rad] or [m] when that joint reads zero

    @property
    def is_revolute(self) -> bool:
        """Whether the axis turns rather than slides."""
        return self.kind == JointKind.REVOLUTE


def chain_to_flange(model: RobotModel) -> tuple[ChainAxis, ...]:
    """Axes that carry the flange, from the base on; joints and followers beside the way are left out."""
    chain = []
    for link in model.links_to_flange:
        axis, drive = model.axes[link], model.drive(link)
        chain.append(
            ChainAxis(
                name=axis.name,
                kind=axis.kind,
                axis_B=axis.axis_B,
                point_B=axis.point_B,
                leader=drive.joint,
                ratio=drive.ratio,
                offset=drive.offset,
            )
        )
    return tuple(chain)


def axis_positions(chain: tuple[ChainAxis, ...], q: Array) -> Array:
    """Positions of the axes of a chain for the robot's driven joints ``q``, shape (n,), in [rad] or [m]."""
    return np.array([axis.ratio * q[axis.leader] + axis.offset for axis in chain])


def axis_shares(chain: tuple[ChainAxis, ...], joints: int) -> Array:
    """Speed of each axis per speed of each driven joint, shape (axes, joints): a follower's share is its ratio."""
    shares = np.zeros((len(chain), joints))
    for row, axis in enumerate(chain):
        shares[row, axis.leader] = axis.ratio
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
