"""Robots brought to the starts of their paths by their joints and, as far as it is free, by the place of their base.

Newton's method for many draws at once, so any arm will do: sliding joints, linkages, more or fewer than six joints. A
draw is a configuration; the base that it would need is known from it but for two tilts and a height, so nearly every
draw ends at a base from which the tool reaches its start.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse, pose_from, rotation_about
from cellplan.model.cell.cell import Relation, Robot
from cellplan.planning.start.inverse_kinematics import damped_move, finite_limits, tip_jacobian
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.planning.tracking.task_constraints import constraint_rows
from cellplan.scene.kinematics.screw_chain import ScrewChain

UP: Final = np.array([0.0, 0.0, 1.0])
CLOSED: Final = 1e-7  # [m] and [rad] up to which a tool counts as at its goal: the motion settles the rest
ITERATIONS: Final = 25  # most draws that arrive at all do so in 6 to 12
TRIAL: Final = 10  # iterations after which draws that are still far away are given up
FAR: Final = 0.05  # [m, rad] far away
LONGEST_MOVE: Final = 0.5  # [rad, m] largest change in one iteration
STEPS: Final = 5  # of Newton's method from node to node at most; one or two but at corners
NEARLY: Final = 1e-3  # [m, rad] an error that one step more leaves nothing of
LOST: Final = 0.6  # [rad, m] a joint that moves more than this from one node to the next has jumped


class FreeArm:
    """The kinematics of one robot, its base and tool left open."""

    def __init__(self, robot: Robot) -> None:
        """Take the chain from the base to the flange."""
        bare = replace(robot, X_WB=np.eye(4), tool=replace(robot.tool, X_FT=np.eye(4)))
        self._chain = ScrewChain(bare)
        self.lower, self.upper = finite_limits(robot.model)
        self.velocity = robot.model.velocity

    def flanges(self, q: Array) -> Array:
        """Flange in the base frame, shape (B, 4, 4)."""
        return self._chain.tool_poses(q)

    def motion(self, q: Array) -> tuple[Array, Array]:
        """Flange in the base frame, shape (B, 4, 4), and screws of the joints at its origin, shape (B, 6, n)."""
        return self._chain.tool_motion(q)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Goal:
    """Where a tool is to be."""

    relation: Relation  # its task or grasp
    X_RT: Array  # its desired poses at the nodes in the frame R of the relation, shape (N, 4, 4)
    X_WR: Array  # that frame in the world, at rest, shape (4, 4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedDraws:
    """Draws of one robot: B of them."""

    q: Array  # configurations in [rad] or [m], shape (B, n)
    X_WB: Array  # bases, shape (B, 4, 4)
    X_FT: Array  # tool tips in the flange frames, shape (B, 4, 4)

    def of_places(self, places: Indices | Flags) -> "PlacedDraws":
        """Some of the draws."""
        return PlacedDraws(q=self.q[places], X_WB=self.X_WB[places], X_FT=self.X_FT[places])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseBounds:
    """How far the base of a robot may be moved."""

    is_free: Flags  # whether x, y, z and yaw are free, shape (4,)
    lower: Array  # lower bounds of x, y, z in [m], shape (3,); those of what is fixed are not used
    upper: Array  # upper bounds likewise

    def clipped(self, p: Array) -> Array:
        """Places of bases in [m], shape (B, 3), brought within the bounds; what is fixed is left as it is."""
        return np.where(self.is_free[:3], np.clip(p, self.lower, self.upper), p)


def matched(goal: Goal, bounds: BaseBounds, X_BT: Array, X_WB: Array) -> tuple[Array, Array]:
    """Bases moved so that tools come as near to the start of the path as they do with the joints as they are.

    Args:
        X_BT: Tools in their base frames, shape (B, 4, 4).
        X_WB: Bases, shape (B, 4, 4).

    Returns:
        The bases, shape (B, 4, 4), and how far the tools are from the goal in [rad] and half metres, shape (B,).
    """
    X_WG, X_WT = goal.X_WR @ goal.X_RT[0], X_WB @ X_BT
    away, R_WG = X_WT[:, :3, 3] - X_WB[:, :3, 3], X_WG[:3, :3]
    yaw = np.zeros(len(away))
    if bounds.is_free[3]:
        if goal.relation.is_spin_free:
            yaw = np.arctan2(R_WG[1, 2], R_WG[0, 2]) - np.arctan2(X_WT[:, 1, 2], X_WT[:, 0, 2])
        else:
            turn = R_WG @ np.swapaxes(X_WT[:, :3, :3], 1, 2)
            yaw = np.arctan2(turn[:, 1, 0] - turn[:, 0, 1], turn[:, 0, 0] + turn[:, 1, 1])
    turned = rotation_about(UP, yaw)
    R_WT = turned @ X_WT[:, :3, :3]
    away = (turned @ away[:, :, None])[:, :, 0]
    p = bounds.clipped(np.where(bounds.is_free[:3], X_WG[:3, 3] - away, X_WB[:, :3, 3]))
    placed = pose_from(turned @ X_WB[:, :3, :3], p)
    if goal.relation.is_spin_free:
        cosine = R_WT[:, :, 2] @ R_WG[:, 2]
    else:
        cosine = 0.5 * (np.einsum("bij,ij->b", R_WT, R_WG) - 1.0)
    miss = np.linalg.norm(p + away - X_WG[:3, 3], axis=1)
    return placed, np.arccos(np.clip(cosine, -1.0, 1.0)) + 2.0 * miss


def reached(arm: FreeArm, goal: Goal, bounds: BaseBounds, draws: PlacedDraws) -> tuple[PlacedDraws, Flags]:
    """Joints and bases changed together until the tools are at the start of the path.

    Returns:
        The draws with their configurations and bases, and which of them arrived, shape (B,). Configurations are within
        limits, bases within their bounds.
    """
    q, X_WB, has_arrived = draws.q.copy(), draws.X_WB.copy(), np.zeros(len(draws.q), dtype=bool)
    at = np.arange(len(q))
    for iteration in range(ITERATIONS):
        error, J = _linearised(arm, goal, 0, PlacedDraws(q=q[at], X_WB=X_WB[at], X_FT=draws.X_FT[at]), bounds.is_free)
        largest = np.abs(error).max(axis=1, initial=0.0)
        has_arrived[at[largest < CLOSED]] = True
        going_on = (largest >= CLOSED) & ((largest < FAR) | (iteration < TRIAL))
        at = at[going_on]
        if not len(at):
            break
        move = damped_move(J[going_on], error[going_on], LONGEST_MOVE)
        joints = q.shape[1]
        q[at] = np.clip(q[at] + move[:, :joints], arm.lower, arm.upper)
        _move_bases(X_WB, at, move[:, joints:], bounds)
    return PlacedDraws(q=q, X_WB=X_WB, X_FT=draws.X_FT), has_arrived


def _move_bases(X_WB: Array, at: Array, move: Array, bounds: BaseBounds) -> None:
    """Move some bases by changes of the free ones of x, y, z and yaw, in place."""
    change = np.zeros((len(at), 4))
    change[:, bounds.is_free] = move
    X_WB[at, :3, 3] = bounds.clipped(X_WB[at, :3, 3] + change[:, :3])
    if bounds.is_free[3]:
        X_WB[at, :3, :3] = rotation_about(UP, change[:, 3]) @ X_WB[at, :3, :3]


def followed(arm: FreeArm, goal: Goal, draws: PlacedDraws) -> tuple[Array, Flags]:
    """Tools led along the whole path, from node to node, with the bases and what the path is on at rest.

    Returns:
        Configurations at the nodes, shape (B, N, n), not valid where a path was lost, and which draws followed it all,
        shape (B,). They may be out of limits.
    """
    count, nodes = len(draws.q), len(goal.X_RT)
    q = np.full((count, nodes, draws.q.shape[1]), np.nan)
    q[:, 0], at = draws.q, np.arange(count)
    for node in range(1, nodes):
        here = q[at, node - 1].copy()
        if node > 1:
            here += q[at, node - 1] - q[at, node - 2]
        here, is_near = _corrected(arm, goal, node, replace(draws.of_places(at), q=here))
        is_followed = is_near & (np.abs(here - q[at, node - 1]).max(axis=1) < LOST)
        at = at[is_followed]
        q[at, node] = here[is_followed]
    has_followed = np.zeros(count, dtype=bool)
    has_followed[at] = True
    return q, has_followed


def _corrected(arm: FreeArm, goal: Goal, node: int, draws: PlacedDraws) -> tuple[Array, Flags]:
    """Configurations with the tools brought to a node of their path, and which came there, shapes (B, n) and (B,)."""
    q, at, is_near = draws.q.copy(), np.arange(len(draws.q)), np.zeros(len(draws.q), dtype=bool)
    fixed = np.zeros(4, dtype=bool)
    for _ in range(STEPS):
        error, J = _linearised(arm, goal, node, replace(draws, q=q).of_places(at), fixed)
        q[at] += damped_move(J, error, LONGEST_MOVE)
        arrived = np.abs(error).max(axis=1, initial=0.0) < NEARLY  # before this step, which squares it
        is_near[at[arrived]] = True
        at = at[~arrived]
        if not len(at):
            break
    return q, is_near


def _linearised(arm: FreeArm, goal: Goal, node: int, draws: PlacedDraws, is_free: Flags) -> tuple[Array, Array]:
    """Errors of the tools at a node, shape (B, m), and what joints and free base components do, shape (B, m, n + f)."""
    X_BF, screws_B = arm.motion(draws.q)
    X_BT = X_BF @ draws.X_FT
    X_BR = inverse(draws.X_WB) @ goal.X_WR
    X_RT = inverse(X_BR) @ X_BT
    rows = constraint_rows(goal.relation, goal.X_RT[node : node + 1])[0]
    desired = np.broadcast_to(goal.X_RT[node], X_RT.shape)
    error = pose_errors(desired, X_RT, [goal.relation.is_spin_free] * len(X_RT)) @ rows.T
    J = tip_jacobian(screws_B, X_BT[:, :3, 3], np.swapaxes(X_BR[:, :3, :3], 1, 2))
    if is_free.any():
        J = np.concatenate([J, _by_base(goal, draws.X_WB, X_BT)[:, :, is_free]], axis=2)
    return error, rows @ J


def _by_base(goal: Goal, X_WB: Array, X_BT: Array) -> Array:
    """Twists of the tools in the axes of R for x, y, z and yaw of their bases, shape (B, 6, 4)."""
    twists = np.zeros((len(X_WB), 6, 4))
    away = (X_WB[:, :3, :3] @ X_BT[:, :3, 3, None])[:, :, 0]
    twists[:, :3, :3] = np.eye(3)
    twists[:, :3, 3], twists[:, 3:, 3] = np.cross(UP, away), UP
    to_R = goal.X_WR[:3, :3].T
    return np.concatenate([to_R @ twists[:, :3], to_R @ twists[:, 3:]], axis=1)
