"""Poses of all links of a robot, by successive screw displacements in plain NumPy.

The checks, the collision bodies and the reports use this file; the planner uses another engine, so that a mistake in
one of them shows as an error in the report ([Ribeiro2010]_ appendix B).
"""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cellplan.geometry.transforms import Array, pose_from, rotation_about, skew
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.robot import FollowerJoint, Joint

CACHED_ROWS: Final = 16_384  # [-] configurations whose displacements are kept: 15 MB for six links


class ScrewChain:
    """The links of one placed robot; the displacements that were computed last are cached."""

    def __init__(self, robot: Robot) -> None:
        """Take the joint axes at the reference configuration, followers after driven joints."""
        model = robot.model
        self._axes, self._factors = model.axes, [_screw_factors(axis) for axis in model.axes]
        self._order = model.carried_order
        self._drives = [model.drive(link) for link in range(len(self._axes))]
        self._flange_link, self._links_to_flange = model.flange_link, model.links_to_flange
        self._X_WB = robot.X_WB
        self._X_BF = model.X_BF
        self._X_BT = model.X_BF @ robot.tool.X_FT
        self._n = len(model.joints)
        self._last: tuple[Array, Array] | None = None  # positions and read-only displacements

    def __getstate__(self) -> dict[str, Any]:
        """State without the cached displacements, which another process computes anew."""
        return self.__dict__ | {"_last": None}

    def link_displacements(self, q: Array) -> Array:
        """Displacement of every link from its place in B at the reference configuration to its place in the world.

        The displaced pose of anything fixed to link i is ``X_WS = D[:, i + 1] @ X_BS`` (the base is i = -1):
        ``D_i = D_parent A_i(q_i)`` with the screw displacement ``A_i`` ([Ribeiro2010]_ Eq. B.73).

        Positions of the driven joints are in [rad] or [m], shape (N, n); displacements have the shape (N, links + 1, 4,
        4) and cannot be written to.
        """
        if self._last is not None and np.array_equal(self._last[0], q):
            return self._last[1]
        D = np.empty((len(self._axes) + 1, len(q), 4, 4))
        D[0] = self._X_WB
        positions = self._positions(q)
        for link in self._order:
            axis = self._axes[link]
            D[link + 1] = _carried_on(axis, self._factors[link], positions[link], D[axis.parent + 1])[0]
        D.setflags(write=False)
        displacements = np.moveaxis(D, 0, 1)
        if len(q) <= CACHED_ROWS:
            self._last = q.copy(), displacements
        return displacements

    def flange_poses(self, q: Array) -> Array:
        """Flange in the world, shape (N, 4, 4)."""
        return self.link_displacements(q)[:, self._flange_link + 1] @ self._X_BF

    def tool_poses(self, q: Array) -> Array:
        """Tool tip in the world, shape (N, 4, 4)."""
        return self.link_displacements(q)[:, self._flange_link + 1] @ self._X_BT

    def axis_points(self, q: Array) -> Array:
        """Reference point of each driven joint's axis, moved with its link, in the world, shape (N, n, 3)."""
        D = self.link_displacements(q)[:, 1 : self._n + 1]
        points = np.array([axis.point_B for axis in self._axes[: self._n]])
        return (D[..., :3, :3] @ points[..., None])[..., 0] + D[..., :3, 3]

    def flange_screws(self, q: Array) -> Array:
        r"""Twist that unit speed of each driven joint gives the flange, at the world origin, shape (N, 6, n).

        ``$ = [s0 x s; s]`` for a revolute and ``[s; 0]`` for a prismatic joint (linear part first), expressed in W
        ([Ribeiro2010]_ Eqs. B.15, B.16); a follower on the way to the flange adds its share to its leader's column.

        It is zero for joints that do not carry the flange.
        """
        return self._screws(self.link_displacements(q))

    def tool_motion(self, q: Array) -> tuple[Array, Array]:
        """`tool_poses` and `flange_screws` at once, for searches that need both many times."""
        D, screws = np.tile(self._X_WB, (len(q), 1, 1)), np.zeros((len(q), 6, self._n))
        positions = self._positions(q)
        for link in self._links_to_flange:
            axis, drive = self._axes[link], self._drives[link]
            D, s, s0 = _carried_on(axis, self._factors[link], positions[link], D)
            if axis.is_revolute:
                for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                    screws[:, i, drive.joint] += drive.ratio * (s0[:, j] * s[:, k] - s0[:, k] * s[:, j])
                screws[:, 3:, drive.joint] += drive.ratio * s
            else:
                screws[:, :3, drive.joint] += drive.ratio * s
        return D @ self._X_BT, screws

    def _screws(self, D: Array) -> Array:
        """Screws of the joints that carry the flange, from link displacements, shape (N, 6, n)."""
        screws = np.zeros((len(D), 6, self._n))
        for link in reversed(self._links_to_flange):
            axis, drive = self._axes[link], self._drives[link]
            screws[:, :, drive.joint] += drive.ratio * moved_screw(axis, D[:, axis.parent + 1])
        return screws

    def _positions(self, q: Array) -> list[Array]:
        """Positions of all axes, followers included, shape (N,) each."""
        driven = list(q.T)
        return driven + [drive.ratio * driven[drive.joint] + drive.offset for drive in self._drives[self._n :]]


def screw_displacement(axis: Joint | FollowerJoint, position: Array) -> Array:
    """Displacement by a turn about, or a slide along, one axis in its reference place, shape (N, 4, 4)."""
    if not axis.is_revolute:
        return pose_from(np.broadcast_to(np.eye(3), (len(position), 3, 3)), position[:, None] * axis.axis_B)
    R = rotation_about(axis.axis_B, position)
    return pose_from(R, axis.point_B - R @ axis.point_B)


def _carried_on(axis: Joint | FollowerJoint, factors: Array, position: Array, D: Array) -> tuple[Array, Array, Array]:
    """Displacements behind an axis, its direction and its point in the world, from the displacements D before it.

    With the matrix X of a unit screw ``A(q) = 1 + sin(q) X + (1 - cos(q)) X^2``, or ``1 + q X`` for a slide. What D
    gives with X, X^2, the direction and the point is one product for all configurations.
    """
    carried = (D.reshape(-1, 4) @ factors).reshape(len(D), 4, 10)
    q = position[:, None, None]
    if axis.is_revolute:
        behind = D + np.sin(q) * carried[:, :, :4] + (1.0 - np.cos(q)) * carried[:, :, 4:8]
    else:
        behind = D + q * carried[:, :, :4]
    return behind, carried[:, :3, 8], carried[:, :3, 9]


def _screw_factors(axis: Joint | FollowerJoint) -> Array:
    """Matrix X of an axis' unit screw, its square, the axis' direction and its point side by side, shape (4, 10)."""
    factors = np.zeros((4, 10))
    if axis.is_revolute:
        factors[:3, :3] = skew(axis.axis_B)
        factors[:3, 3] = -factors[:3, :3] @ axis.point_B
        factors[:, 4:8] = factors[:, :4] @ factors[:, :4]
    else:
        factors[:3, 3] = axis.axis_B
    factors[:3, 8], factors[:, 9] = axis.axis_B, (*axis.point_B, 1.0)
    return factors


def moved_screw(axis: Joint | FollowerJoint, D: Array) -> Array:
    """Unit screw of an axis carried along by displacements of shape (N, 4, 4), linear part first, shape (N, 6)."""
    s = D[:, :3, :3] @ axis.axis_B
    if not axis.is_revolute:
        return np.concatenate([s, np.zeros_like(s)], axis=1)
    s0 = D[:, :3, :3] @ axis.point_B + D[:, :3, 3]
    return np.concatenate([np.cross(s0, s), s], axis=1)


Chains = Mapping[str, ScrewChain]  # by robot
