r"""Bodies of robots whose clocks are independent: where each of them is at any place of its own program, and its way.

Between two rows all joints of a robot move linearly; the unit of time is that step. A point x of a body then has
:math:`|\ddot x| \le M` (``lever_arms``), so its speed differs from the mean of the step by :math:`M/2` at most: no
point of the body is anywhere in the step faster than :math:`|\Delta c| + \rho\,|\Delta R|_2 + M/2` with a sphere
:math:`(c, \rho)` round it, nor faster than the sum of each joint's motion times its longest lever arm. The sum of
these speeds from the first row on is the way W; it is piecewise linear, so that between any two places a and b of the
program no point of the body is displaced by more than :math:`W(b) - W(a)`.

Its velocity changes by no more than M in a step, and at a row by no more than the change of each joint's motion times
its lever arm. The sum of these changes is the swerve S. A curve whose velocity changes by no more than s within a
length of time T strays from its chord by no more than :math:`T s / 4`: its deviation at t is
:math:`t (T - t) / T` times the difference of two means of the velocity.
"""

from collections.abc import Mapping

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.transforms import rotated
from cellplan.model.cell.cell import Cell
from cellplan.scene.collision.bodies import require_rigid
from cellplan.scene.scene import Scene


class FreeMotion:
    """The programs of all robots, each with rows of its own."""

    def __init__(self, scene: Scene, q: Array | Mapping[str, Array]) -> None:
        """Work out the ways of all bodies, from at least two rows of each robot.

        Positions are in [rad] or [m] of each robot, shape (N, n), not necessarily as many rows for each; or of all
        robots, stacked, shape (N, nq).
        """
        self.scene = scene
        self._q = _by_robot(scene.cell, q)
        self.last = {name: len(rows) - 1 for name, rows in self._q.items()}  # last row of each robot, by name
        bodies = range(len(scene.engine.bodies))
        carriers = [scene.carrier(index) for index in bodies]
        names = [robot.name for robot in scene.cell.robots]
        self._robot = np.array([-1 if body.robot is None else names.index(body.robot) for body in carriers])
        self._link = np.array([body.link for body in carriers], dtype=np.intp)
        self._X_BS = np.array([body.X_BS for body in carriers]).reshape(-1, 4, 4)
        self._travel, self._swerves = self._worked_out()

    def travel(self, bodies: Indices, rows: Array) -> Array:
        """Way in [m] of some bodies from the first row to some places of their programs, shape (M,)."""
        before = np.clip(rows.astype(np.intp), 0, self._travel.shape[1] - 2)
        begin = self._travel[bodies, before]
        return begin + (rows - before) * (self._travel[bodies, before + 1] - begin)

    def stray(self, bodies: Indices, first: Array, last: Array) -> Array:
        """How far in [m] a point of some bodies is at most from its chord between two places, shape (M,)."""
        begin, end = np.floor(first).astype(np.intp), np.ceil(last).astype(np.intp)
        return 0.25 * (last - first) * (self._swerves[bodies, end] - self._swerves[bodies, begin])

    def poses(self, bodies: Indices, rows: Array) -> tuple[Array, Array]:
        """Rotations, shape (M, 3, 3), and positions in the world in [m], shape (M, 3), of some bodies.

        Bodies of the engine that robots carry, and the place of each in the program of its robot, have the shape (M,).
        """
        R, p = np.empty((len(bodies), 3, 3)), np.empty((len(bodies), 3))
        for index, robot in enumerate(self.scene.cell.robots):
            carried = np.flatnonzero(self._robot[bodies] == index)
            if not len(carried):
                continue
            places, place = np.unique(rows[carried], return_inverse=True)
            D = self.scene.chains[robot.name].link_displacements(self.positions(robot.name, places))
            require_rigid(D[..., :3, :3], D[..., :3, 3])
            X, held = D[place, self._link[bodies[carried]] + 1], self._X_BS[bodies[carried]]
            R[carried] = X[:, :3, :3] @ held[:, :3, :3]
            p[carried] = (X[:, :3, :3] @ held[:, :3, 3:])[..., 0] + X[:, :3, 3]
        return R, p

    def positions(self, robot: str, rows: Array) -> Array:
        """Positions of a robot at places of its program, shape (M, n)."""
        q = self._q[robot]
        before = np.clip(rows.astype(np.intp), 0, len(q) - 2)
        share = (rows - before)[:, None]
        return (1.0 - share) * q[before] + share * q[before + 1]

    def _worked_out(self) -> tuple[Array, Array]:
        """Ways and swerves of all bodies at the rows of the longest program; nothing moves after its last row.

        A swerve between two rows is that of the steps between them and of the kinks at the rows within and at the last.
        """
        scene, longest = self.scene, 1 + max(self.last.values())
        padded = [np.concatenate([q, np.repeat(q[-1:], longest - len(q), axis=0)]) for q in self._q.values()]
        q = np.concatenate(padded, axis=1)
        arms, poses = LeverArms(scene, q), scene.body_poses(q)
        steps, kinks = arms.steps(q), arms.kinks(q)
        travel, swerves = (np.zeros((len(scene.engine.bodies), longest)) for _ in range(2))
        for index, body in enumerate(scene.engine.bodies):
            chain = arms.chain(None, index)
            bend = chain.bend(steps)
            moved = np.diff(rotated(poses.R[index], body.centre) + poses.p[index], axis=0)
            turned = np.diff(poses.R[index], axis=0).reshape(-1, 9)
            speed = np.linalg.norm(moved, axis=1) + 0.5 * bend
            speed += body.radius * np.sqrt(0.5) * np.linalg.norm(turned, axis=1)
            np.cumsum(np.minimum(speed, chain.reach(steps)), out=travel[index, 1:])
            bend[:-1] += chain.reach(kinks)
            np.cumsum(bend, out=swerves[index, 1:])
        return travel, swerves


def _by_robot(cell: Cell, q: Array | Mapping[str, Array]) -> dict[str, Array]:
    """Rows of each robot, in the order of the cell."""
    if isinstance(q, np.ndarray):
        q = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}
    for robot in cell.robots:
        if robot.name not in q or len(q[robot.name]) < 2:
            raise ValueError(f"certify: expected at least two rows of robot '{robot.name}'")
    return {robot.name: q[robot.name] for robot in cell.robots}
