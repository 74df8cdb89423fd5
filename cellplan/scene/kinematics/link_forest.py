"""Places of the links of all robots of a cell at once: the screw displacements of all axes in a few products."""

from collections.abc import Sequence

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.robot import BASE, RobotModel

WORLD = 0  # place of what does not move


class LinkForest:
    """The links of some robots, stacked: the world first, then of each robot its base and its links.

    Attributes:
        carries: 1 where an axis carries a link, shape (links, axes); links as stacked, all axes of all robots.
        shares: How far an axis moves with each of the stacked joints, shape (axes, nq).
    """

    def __init__(self, robots: Sequence[Robot]) -> None:
        """Take the axes at the reference configuration, of each robot followers after driven joints."""
        self._first: dict[str, int] = {}
        parents, order = list[int](), list[int]()
        model_links: list[tuple[int, int, RobotModel, int]] = []
        columns, count = 0, 1
        for robot in robots:
            self._first[robot.name] = count
            parents += [count + 1 + axis.parent for axis in robot.model.axes]
            first = len(model_links)
            model_links += [(count + 1 + link, columns, robot.model, link) for link in range(len(robot.model.axes))]
            order += [first + link for link in robot.model.carried_order]
            columns += len(robot.model.joints)
            count += 1 + len(robot.model.axes)
        axes = [model.axes[link] for _, _, model, link in model_links]
        self._places = np.array([place for place, *_ in model_links], dtype=np.intp)
        self._parents, self._bases = np.array(parents, dtype=np.intp), list(self._first.values())
        self._directions = np.array([axis.axis_B for axis in axes]).reshape(-1, 3)
        self._points = np.array([axis.point_B for axis in axes]).reshape(-1, 3)
        self._turning = np.array([axis.is_revolute for axis in axes], dtype=bool)
        self._offsets = np.array([model.drive(link).offset for _, _, model, link in model_links])
        self._skew = np.cross(self._directions[:, None], -np.eye(3)).reshape(-1, 3, 3)
        self._skew2 = self._skew @ self._skew
        self.shares, self.carries = np.zeros((len(axes), columns)), np.zeros((count, len(axes)))
        for axis, (_, first, model, link) in enumerate(model_links):
            self.shares[axis, first + model.drive(link).joint] = model.drive(link).ratio
        for axis in order:
            place = self._places[axis]
            self.carries[place] = self.carries[parents[axis]]
            self.carries[place, axis] = 1.0
        depths = self.carries[self._places].sum(axis=1)
        self._levels: list[Indices] = [np.flatnonzero(depths == depth) for depth in np.unique(depths)]

    def place(self, robot: str | None, link: int = BASE) -> int:
        """Place of a link in the stack: of a robot's base by default, of the world when there is no robot."""
        return WORLD if robot is None else self._first[robot] + 1 + link

    def displacements(self, q: Array, X_WB: Array) -> Array:
        """Displacements of all links from their places at the reference configuration, shape (links, K, 4, 4).

        See ``ScrewChain``.

        Args:
            q: Stacked joint positions in [rad] or [m], shape (K, nq).
            X_WB: Bases of the robots in the world, shape (robots, 4, 4), or of each configuration (robots, K, 4, 4).

        Raises:
            ValueError: A joint position or a base is not finite.
        """
        if not (np.all(np.isfinite(q)) and np.all(np.isfinite(X_WB))):
            raise ValueError("links: a joint position or a base is not finite")
        positions = self.shares @ q.T + self._offsets[:, None]
        turns = np.where(self._turning[:, None], positions, 0.0)[..., None, None]
        A = np.zeros((*positions.shape, 4, 4))
        A[..., :3, :3] = np.eye(3) + np.sin(turns) * self._skew[:, None]
        A[..., :3, :3] += (1.0 - np.cos(turns)) * self._skew2[:, None]
        turned = self._points[:, None] - (A[..., :3, :3] @ self._points[:, None, :, None])[..., 0]
        slid = positions[..., None] * self._directions[:, None]
        A[..., :3, 3] = np.where(self._turning[:, None, None], turned, slid)
        A[..., 3, 3] = 1.0
        D = np.empty((len(self.carries), len(q), 4, 4))
        D[WORLD] = np.eye(4)
        D[self._bases] = X_WB if X_WB.ndim == 4 else X_WB[:, None]
        for level in self._levels:
            D[self._places[level]] = D[self._parents[level]] @ A[level]
        return D

    def screws(self, D: Array) -> Array:
        """Twist that unit speed of each axis gives what it carries, at the world origin, linear part first.

        From displacements of the links, shape (links, K, 4, 4); the twists have the shape (axes, K, 6).
        """
        R, p = D[self._parents, :, :3, :3], D[self._parents, :, :3, 3]
        s = (R @ self._directions[:, None, :, None])[..., 0]
        s0 = (R @ self._points[:, None, :, None])[..., 0] + p
        turning = self._turning[:, None, None]
        return np.concatenate([np.where(turning, np.cross(s0, s), s), np.where(turning, s, 0.0)], axis=-1)
