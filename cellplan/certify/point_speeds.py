r"""Point speeds: bounds of how fast the flange of a robot, its tool tip and the part that it holds move in the world.

Joints move evenly from row to row. Over a step, u from 0 to 1, a point then goes along x(u) with
:math:`|x''| \le B` (``lever_arms``), and as the mean of x' is the chord,

.. math:: |x'(u)| \le |x(1) - x(0)| + B / 2 .

Of a body that is moved as a whole the corners of its convex hull are fastest: the speed is convex over its points.
"""

from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.certify.lever_arms import Chain, LeverArms
from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Mesh
from cellplan.model.cell.cell import Robot
from cellplan.scene.bodies import Kind
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

PARTS: Final = 64  # of a straight move, in which its points are followed
CHUNK: Final = 2_000_000  # [-] coordinates of points at once: 16 MB


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointSpeeds:
    """Points fixed to the flange of one robot, and the speed that none of them may exceed."""

    robot: str  # its name
    limit: float  # largest speed in the world in [m/s]
    columns: slice  # its joints in the configurations that are given
    screws: ScrewChain
    link: int  # the link that the points are fixed to
    points_B: Array  # flange, tool tip and corners of the part, at the reference configuration in B, shape (K, 3)
    beyond: float  # by how much in [m] the part reaches beyond its corners: the radius of a ball
    chain: Chain  # the joints from the ground to a ball round the flange that holds all points
    axes: Array  # by how much each of them moves per joint of the robot, shape (m, n)

    @classmethod
    def of(cls, scene: Scene, robot: Robot, *, limit: float) -> Self:
        """The points of a robot, those of the part among them while it carries that; the limit in [m/s]."""
        model, columns = robot.model, scene.cell.columns(robot.name)
        points, beyond = [model.X_BF[None, :3, 3], (model.X_BF @ robot.tool.X_FT)[None, :3, 3]], 0.0
        for index, body in enumerate(scene.bodies):
            if body.kind is Kind.PART and body.robot == robot.name:
                solid = scene.engine.bodies[index]
                corners = solid.hull.vertices if isinstance(solid.hull, Mesh) else solid.core.vertices
                points.append(corners @ body.X_BS[:3, :3].T + body.X_BS[:3, 3])
                beyond = solid.inflation + solid.looseness
        points_B = np.concatenate(points)
        radius = float(np.linalg.norm(points_B - points_B[0], axis=1).max()) + beyond
        ends = np.stack([scene.cell.joint_limits.lower, scene.cell.joint_limits.upper])
        arms = LeverArms(scene, np.where(np.isfinite(ends), ends, 0.0))  # only joints that slide count, all of them end
        chain, axes = arms.flange(robot.name, radius=radius)
        return cls(
            robot=robot.name,
            limit=limit,
            columns=columns,
            screws=scene.chains[robot.name],
            link=model.flange_link,
            points_B=points_B,
            beyond=beyond,
            chain=chain,
            axes=axes[:, columns],
        )

    def among(self, columns: slice) -> Self:
        """The same for configurations that hold some joints only, all of the robot's among them."""
        first = self.columns.start - columns.start
        return replace(self, columns=slice(first, self.columns.stop - columns.start))

    def travel(self, q: Array) -> Array:
        """Bound of the speed in each step, times the step, in [m], shape (N - 1,).

        Args:
            q: Joint positions in [rad] or [m], shape (N, joints).
        """
        of_robot = q[:, self.columns]
        return self._chords(of_robot[None])[0] + 0.5 * self.chain.bend(self._moved(np.diff(of_robot, axis=0)))

    def straight_rate(self, start: Array, goal: Array, step: float) -> Array:
        r"""Largest rate of the share of straight moves in [1/s], infinite where no point moves, shape (...).

        With the largest speed a by the share and its second derivative at most K, ``travel`` keeps the limit v in all
        rows of a move at the rate V where :math:`a V + K V^2 \Delta t / 2 \le v`.

        Args:
            start: Joint positions in [rad] or [m], shape (..., joints).
            goal: Likewise.
            step: Time between two rows in [s].
        """
        first, last = np.broadcast_arrays(start[..., self.columns], goal[..., self.columns])
        shape, count = first.shape[:-1], first.shape[-1]
        first, last = first.reshape(-1, count), last.reshape(-1, count)
        bend, fastest = self.chain.bend(self._moved(last - first)), np.zeros(len(first))
        shares, size = np.linspace(0.0, 1.0, PARTS + 1)[:, None], max(1, CHUNK // (PARTS * 3 * len(self.points_B)))
        for begin in range(0, len(first), size):
            a, b = first[begin : begin + size, None], last[begin : begin + size, None]
            fastest[begin : begin + size] = PARTS * self._chords(a + shares * (b - a)).max(axis=1)
        fastest += 0.5 * bend / PARTS
        with np.errstate(divide="ignore"):
            rate = 2.0 * self.limit / (fastest + np.sqrt(fastest**2 + 2.0 * bend * step * self.limit))
        return rate.reshape(shape)

    def _chords(self, q: Array) -> Array:
        """Longest chords of the points over the steps of some moves of the robot, shape (M, N, n) to (M, N - 1)."""
        X = self.screws.link_displacements(q.reshape(-1, q.shape[-1]))[:, self.link + 1]
        points = (X[:, :3, :3] @ self.points_B.T + X[:, :3, 3:]).reshape(*q.shape[:2], 3, -1)
        chords = np.linalg.norm(np.diff(points, axis=1), axis=2).max(axis=2)
        if self.beyond == 0.0:
            return chords
        turned = np.diff(X[:, :3, :3].reshape(*q.shape[:2], 9), axis=1)
        longest = np.linalg.norm(turned, axis=2) / np.sqrt(2.0)  # chord of a unit vector that turns: 2 sin(angle / 2)
        return chords + self.beyond * longest

    def _moved(self, moves: Array) -> Array:
        """By how much each axis moves, without its sign, shape (..., n) to (..., m)."""
        return np.abs(moves @ self.axes.T)


def point_speeds(scene: Scene, limit: float | None) -> tuple[PointSpeeds, ...]:
    """The points of all robots with one limit in [m/s]; none without a limit."""
    return () if limit is None else tuple(PointSpeeds.of(scene, robot, limit=limit) for robot in scene.cell.robots)
