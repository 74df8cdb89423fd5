"""Cooperation Jacobian by the Denavit-Hartenberg convention: frames on links, geometric Jacobians, rotations."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array, frame_from_axes, inverse, pose_from, skew
from cellplan.jobs.explain.derivations.serial_chain import (
    ChainAxis,
    axis_positions,
    axis_shares,
    chain_to_flange,
    checked_configuration,
    part_holder,
)
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import RobotModel
from cellplan.model.task.task import Frame

NEARLY_PARALLEL = 1e-3  # [rad] below this the common normal lies so far out that its foot costs digits
ROUNDING = 1e-12  # [m] a distance below this says nothing about a direction


@dataclass(frozen=True, slots=True, kw_only=True)
class DHRow:
    """One row of a Denavit-Hartenberg table, taken where the joint reads zero."""

    is_revolute: bool  # whether the joint's position adds to ``theta`` rather than to ``d``
    theta: float  # angle about z of the frame before, in [rad]
    d: float  # offset along z of the frame before, in [m]
    a: float  # length of the common normal, along the new x, in [m]
    alpha: float  # twist about the new x, in [rad]
    beta: float = 0.0  # further twist about the new y in [rad]: zero but for axes that are nearly, not quite, parallel

    def pose(self, position: float) -> Array:
        r"""Frame i in frame i-1, ``Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha) Rot_y(beta)``, shape (4, 4).

        Without the last factor this is the convention of [Ribeiro2010]_ App. A; the last one is Hayati's, without
        which axes that are nearly parallel have no well-conditioned row.
        """
        theta = self.theta + (position if self.is_revolute else 0.0)
        d = self.d + (0.0 if self.is_revolute else position)
        (st, sa, sb), (ct, ca, cb) = np.sin([theta, self.alpha, self.beta]), np.cos([theta, self.alpha, self.beta])
        about_z = np.array([[ct, -st, 0.0], [st, ct, 0.0], [0.0, 0.0, 1.0]])
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
        about_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
        return pose_from(about_z @ about_x @ about_y, np.array([self.a * ct, self.a * st, d]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DHChain:
    """Denavit-Hartenberg description of a robot from its base to its flange."""

    X_BD: Array  # frame 0, z along the first axis, in the robot's base
    rows: tuple[DHRow, ...]  # one row per axis on the way to the flange, followers included
    X_DF: Array  # flange in the last frame: a turn about and a slide along their common z
    axes: tuple[ChainAxis, ...]  # the axes the rows were made from
    joints: int  # number of driven joints of the robot

    def frames(self, q: Array) -> Array:
        """Frames 0..n in B for driven joints ``q``, shape (n,); result has shape (axes + 1, 4, 4)."""
        frames = [self.X_BD]
        for row, position in zip(self.rows, axis_positions(self.axes, q), strict=True):
            frames.append(frames[-1] @ row.pose(position))
        return np.stack(frames)

    def flange_pose(self, q: Array) -> Array:
        """Flange in B, shape (4, 4)."""
        return self.frames(q)[-1] @ self.X_DF


def dh_chain(model: RobotModel) -> DHChain:
    """Place Denavit-Hartenberg frames along the joint axes of a data sheet ([Ribeiro2010]_ App. A).

    Frame i has its z along axis i+1 (the flange's z after the last one) and its x along the common normal from the
    axis before. Where axes intersect, x is across both; where they are parallel, the normal through the origin before
    is taken; where they coincide, x stays. The position of a sliding axis has no effect; the point of the table serves.
    """
    axes = chain_to_flange(model)
    lines = [(axis.axis_B, axis.point_B) for axis, _ in axes] + [(model.X_BF[:3, 2], model.X_BF[:3, 3])]
    X_BD = _first_frame(*lines[0])
    rows: list[DHRow] = []
    X = X_BD
    for (axis, _), (s_B, s0_B) in zip(axes, lines[1:], strict=True):
        s, s0 = X[:3, :3].T @ s_B, X[:3, :3].T @ (s0_B - X[:3, 3])
        is_parallel = np.hypot(s[0], s[1]) < NEARLY_PARALLEL
        rows.append((_row_along if is_parallel else _row_across)(s, s0, is_revolute=axis.is_revolute))
        X = X @ rows[-1].pose(0.0)
    return DHChain(X_BD=X_BD, rows=tuple(rows), X_DF=inverse(X) @ model.X_BF, axes=axes, joints=len(model.joints))


def geometric_jacobian(chain: DHChain, q: Array) -> tuple[Array, Array]:
    """Geometric Jacobian of the flange, linear and angular part, shape (3, n) each, expressed in B.

    ``J_v = z x (o_F - o)`` and ``J_w = z`` for a revolute, ``J_v = z`` and ``J_w = 0`` for a prismatic axis
    ([Ribeiro2010]_ App. A); a follower adds its share to the column of the joint that drives it.
    """
    frames = chain.frames(q)
    o_F = (frames[-1] @ chain.X_DF)[:3, 3]
    z, o = frames[:-1, :3, 2], frames[:-1, :3, 3]
    turns = np.array([[float(axis.is_revolute)] for axis, _ in chain.axes]).reshape(-1, 1)
    J_v = turns * np.cross(z, o_F - o) + (1.0 - turns) * z
    shares = axis_shares(chain.axes, chain.joints)
    return J_v.T @ shares, (turns * z).T @ shares


@dataclass(frozen=True, slots=True, eq=False)
class _Arm:
    """One robot at one posture: rotation of its base, its flange in W, and its geometric Jacobian in B."""

    R_WB: Array
    X_WF: Array
    J_v: Array
    J_w: Array


def dh_cooperation_jacobian(cell: Cell, q: Array) -> Array:
    """Cooperation Jacobian from geometric Jacobians and rotations ([Ribeiro2010]_ Eqs. 3.28-3.34, 4.16).

    Args:
        q: Stacked joint vector in [rad] or [m], shape (nq,).

    Returns:
        Twists of the tools relative to the part, linear part first, expressed in P, shape (tasks + further holders, 6,
        nq): the grasps of further holders follow the tasks (4.5). Of a task in the world, relative to and in W.
    """
    q = checked_configuration(cell, q)
    holder = part_holder(cell)
    arms = {robot.name: _arm(robot, q[cell.columns(robot.name)]) for robot in cell.robots}
    X_WP = cell.part.X_CP if holder is None else arms[holder[0].name].X_WF @ holder[1]
    J = np.zeros((len(cell.relations), 6, cell.joint_count))
    for block, task in zip(J, cell.relations, strict=True):
        arm, X_FT = arms[task.robot], cell.robot(task.robot).tool.X_FT
        is_on_part = task.relative_to is Frame.PART
        X_WR = X_WP if is_on_part else np.eye(4)
        block[:, cell.columns(task.robot)] += _operator_block(arm, X_WR, r_FT=X_FT[:3, 3])
        if holder is not None and is_on_part:
            r_PT = (inverse(X_WP) @ arm.X_WF @ X_FT)[:3, 3]
            held = _positioner_block(arms[holder[0].name], X_WP, r_PT=r_PT, r_FP=holder[1][:3, 3])
            block[:, cell.columns(holder[0].name)] += held
    return J


def _arm(robot: Robot, q: Array) -> _Arm:
    """One robot at its own configuration."""
    chain = dh_chain(robot.model)
    return _Arm(robot.X_WB[:3, :3], robot.X_WB @ chain.flange_pose(q), *geometric_jacobian(chain, q))


def _positioner_block(arm: _Arm, X_WP: Array, *, r_PT: Array, r_FP: Array) -> Array:
    """Blocks (11) and (21): ``[-R J_v + S(r_PT) R J_w + R_PF S(r_FP) R_FB J_w; -R J_w]`` (Eqs. 3.31, 3.33)."""
    R_PB, R_PF = X_WP[:3, :3].T @ arm.R_WB, X_WP[:3, :3].T @ arm.X_WF[:3, :3]
    R_FB = arm.X_WF[:3, :3].T @ arm.R_WB
    linear = -R_PB @ arm.J_v + skew(r_PT) @ R_PB @ arm.J_w + R_PF @ skew(r_FP) @ R_FB @ arm.J_w
    return np.concatenate([linear, -R_PB @ arm.J_w])


def _operator_block(arm: _Arm, X_WP: Array, *, r_FT: Array) -> Array:
    """Blocks (12) and (22): ``[R J_v - R_PF S(r_FT) R_FB J_w; R J_w]`` (Eqs. 3.32, 3.34)."""
    R_PB, R_PF = X_WP[:3, :3].T @ arm.R_WB, X_WP[:3, :3].T @ arm.X_WF[:3, :3]
    R_FB = arm.X_WF[:3, :3].T @ arm.R_WB
    return np.concatenate([R_PB @ arm.J_v - R_PF @ skew(r_FT) @ R_FB @ arm.J_w, R_PB @ arm.J_w])


def _first_frame(s: Array, s0: Array) -> Array:
    """Frame 0: on the first axis, its x as near as may be to the x of B, or to its y where the axis lies along x."""
    hint = np.eye(3)[1 if abs(s[0]) > 0.9 else 0]
    return pose_from(frame_from_axes(s, hint), s0)


def _row_across(s: Array, s0: Array, *, is_revolute: bool) -> DHRow:
    """Row from the frame before to a skew or intersecting axis, both given in that frame."""
    sine = float(np.hypot(s[0], s[1]))
    normal = np.array([-s[1], s[0]]) / sine
    twist, a = sine, float(normal @ s0[:2])
    if a < -ROUNDING:
        normal, twist, a = -normal, -sine, -a
    along = -float(s0[:2] @ s[:2]) / sine**2
    return DHRow(
        is_revolute=is_revolute,
        theta=float(np.arctan2(normal[1], normal[0])),
        d=float(s0[2] + along * s[2]),
        a=a,
        alpha=float(np.arctan2(twist, s[2])),
    )


def _row_along(s: Array, s0: Array, *, is_revolute: bool) -> DHRow:
    """Row to an axis that is parallel, opposite, or nearly so: its origin stays level with the one before (d = 0)."""
    level = s0 - s0[2] / s[2] * s
    a = float(np.hypot(level[0], level[1]))
    theta = float(np.arctan2(level[1], level[0])) if a > ROUNDING else 0.0
    x, y = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
    return DHRow(
        is_revolute=is_revolute,
        theta=theta,
        d=0.0,
        a=float(x @ level[:2]),
        alpha=float(np.arctan2(0.0 - y @ s[:2], s[2])),
        beta=float(np.arctan2(x @ s[:2], np.hypot(y @ s[:2], s[2]))),
    )
