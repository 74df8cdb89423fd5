r"""How far the points of a body can be from the joint axes that move it, whatever the configuration.

Seen from one body, another is moved by the joints on the way between the two links: down from the one to the link they
share, or to the ground, and up to the other. Take a point :math:`P_j` on each of these axes. Two axes that follow each
other sit on one link, so the distance of their points never changes, but for what a sliding joint adds between them.
The triangle inequality gives, for every point x of the body at the far end and every turning joint j,

.. math:: |x - P_j| \le L_j = \sum_{i \ge j} \bigl( |P_{i+1} - P_i| + \hat q_i \bigr) + \rho

with the largest position :math:`\hat q_i` of each sliding joint in the program, zero for those that turn, the centre c
of a sphere round the body as the last point, and its radius :math:`\rho`; or, where that is less, a line round which
the body lies in place of the sphere. A sliding joint moves a point as far as it slides: :math:`L_j = 1`.

What counts of a turning joint is the distance from its axis, not from :math:`P_j`. It is known for the joint next to
the body, whose points keep their distance from that axis: that is its lever arm.
"""

from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import BASE, FollowerJoint, Joint
from cellplan.scene.bodies import SceneBody
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """The joints between two bodies, the nearest to the first one first."""

    axes: np.ndarray  # their places among all axes of the scene, shape (m,)
    # lever arm of each to the points of the second body, in [m] for joints that turn, 1 for those that slide, shape
    # (m,)
    levers: Array
    turns: Array  # 1 for joints that turn, 0 for those that slide, shape (m,)

    def bend(self, steps: Array) -> Array:
        r"""Largest second derivative of a point of the second body seen from the first in each step, shape (n - 1,).

        With even joints :math:`\ddot x = \sum_i \sum_j \partial^2 x / \partial q_i \partial q_j \, \dot q_i \dot q_j`.
        For a joint i that is nearer to the first body than j, or j itself, that derivative is
        :math:`s_i \times (s_j \times (x - P_j))` when both turn, no longer than :math:`L_j`; :math:`s_i \times s_j`
        when only i turns; and zero when i slides.

        In each step every axis of the scene moves by so much in [rad] or [m], shape (n - 1, axes).
        """
        moved = steps[:, self.axes]
        turned = moved * self.turns
        return (moved * self.levers * (2.0 * np.cumsum(turned, axis=1) - turned)).sum(axis=1)

    def turn_bend(self, steps: Array) -> Array:
        """Largest second derivative of a unit vector that turns with the second body, likewise, shape (n - 1,)."""
        return (steps[:, self.axes] @ self.turns) ** 2

    def reach(self, steps: Array) -> Array:
        """How far a point of the second body travels at most in each step, seen from the first, in [m]."""
        return steps[:, self.axes] @ self.levers


class LeverArms:
    """All axes of a cell at their reference configuration, and how far each slides in a program."""

    def __init__(self, scene: Scene, q: Array) -> None:
        """Place the axes in the world at the rows of a program, between which joints move evenly.

        The joint positions are stacked, in [rad] or [m], shape (N, nq).
        """
        cell = scene.cell
        self._scene = scene
        self._known: dict[tuple[int | None, int], Chain] = {}
        self._placed = [axis for robot in cell.robots for axis in _placed(robot, cell.columns(robot.name).start)]
        self._first = dict(zip((robot.name for robot in cell.robots), _starts(cell), strict=True))
        self._columns = np.array([axis.column for axis in self._placed], dtype=np.intp)
        self._ratios = np.array([axis.ratio for axis in self._placed])
        self._turns = np.array([float(axis.is_revolute) for axis in self._placed])
        self._slides = self._slides_in(q)

    def over(self, q: Array) -> "LeverArms":
        """Those of another program in the same cell: these themselves where no joint slides by another length."""
        return self if np.array_equal(self._slides_in(q), self._slides) else LeverArms(self._scene, q)

    def _slides_in(self, q: Array) -> Array:
        """By how much each axis slides at most from its reference configuration in [m], 0 for one that turns."""
        positions = q[:, self._columns] * self._ratios + np.array([axis.offset for axis in self._placed])
        return np.abs(positions).max(axis=0, initial=0.0) * (1.0 - self._turns)

    def steps(self, q: Array) -> Array:
        """By how much each axis moves from row to row, without its sign, in [rad] or [m], shape (n - 1, axes)."""
        return np.abs(np.diff(q[:, self._columns], axis=0) * self._ratios)

    def kinks(self, q: Array) -> Array:
        """By how much the motion of each axis changes from step to step, without its sign, shape (n - 2, axes)."""
        return np.abs(np.diff(q[:, self._columns], n=2, axis=0) * self._ratios)

    def chain(self, first: int | None, second: int) -> Chain:
        """The joints between two of the engine's bodies; ``first`` is None for the ground."""
        chain = self._known.get((first, second))
        if chain is None:
            down = [] if first is None else self._path_down(*_link(self._scene.carrier(first)))
            chain = self._known[first, second] = self._chain(down, second)
        return chain

    def tool(self, robot: str, *, seen_by: str | None) -> Chain:
        """The joints between the flange of a robot, or the ground for None, and the tool tip of another one."""
        cell = self._scene.cell
        placed = cell.robot(robot)
        tip = (placed.X_WB @ placed.model.X_BF @ placed.tool.X_FT)[:3, 3]
        down = [] if seen_by is None else self._path_down(seen_by, cell.robot(seen_by).model.flange_link)
        return self._between(down, self._path_down(robot, placed.model.flange_link), _Held(tip, 0.0, tip[None], 0.0))

    def from_tip(self, robot: str, index: int) -> float:
        """No point of an engine's body on the flange link of a robot is farther from its tool tip, in [m]."""
        placed, seen = self._scene.cell.robot(robot), self._scene.engine.bodies[index]
        tip = (placed.model.X_BF @ placed.tool.X_FT)[:3, 3]
        ends = _moved(self._scene.carrier(index).X_BS, seen.ends)
        return float(np.linalg.norm(ends - tip, axis=-1).max()) + seen.girth

    def flange(self, robot: str, *, radius: float) -> tuple[Chain, Array]:
        """The joints between the ground and a ball round the flange of a robot, of a radius in [m].

        By how much each axis of the chain moves per stacked joint stands in the second value, shape (m, nq); the chain
        numbers them in that order.
        """
        placed = self._scene.cell.robot(robot)
        centre = (placed.X_WB @ placed.model.X_BF)[:3, 3]
        up = self._path_down(robot, placed.model.flange_link)
        chain = self._between([], up, _Held(centre, radius, centre[None], radius))
        moves = np.zeros((len(chain.axes), self._scene.cell.joint_count))
        moves[np.arange(len(chain.axes)), self._columns[chain.axes]] = self._ratios[chain.axes]
        return replace(chain, axes=np.arange(len(chain.axes))), moves

    def _chain(self, down: list[int], index: int) -> Chain:
        """The joints on the way down from one link and up to another body."""
        body, seen = self._scene.carrier(index), self._scene.engine.bodies[index]
        X_WS = body.X_BS if body.robot is None else self._scene.cell.robot(body.robot).X_WB @ body.X_BS
        held = _Held(_moved(X_WS, seen.centre), seen.radius, _moved(X_WS, seen.ends), seen.girth)
        return self._between(down, self._path_down(*_link(body)), held)

    def _between(self, down: list[int], up: list[int], held: "_Held") -> Chain:
        """The joints on the way down from one link and up to another one, which something moves with."""
        shared = set(down) & set(up)
        axes = [axis for axis in down if axis not in shared] + [axis for axis in reversed(up) if axis not in shared]
        levers = np.ones(len(axes))
        point, length = held.centre, held.radius
        for place in range(len(axes) - 1, -1, -1):
            axis = self._placed[axes[place]]
            foot = axis.foot(point)
            length += float(np.linalg.norm(point - foot))
            if place == len(axes) - 1:
                length = min(length, float(np.linalg.norm(held.ends - foot, axis=1).max()) + held.girth)
                reach = float(np.linalg.norm(held.ends - axis.foot(held.ends), axis=1).max()) + held.girth
            length += float(self._slides[axes[place]])
            if axis.is_revolute:
                levers[place] = min(length, reach) if place == len(axes) - 1 else length
            point = foot
        return Chain(np.array(axes, dtype=np.intp), levers, self._turns[axes])

    def _path_down(self, robot: str | None, link: int) -> list[int]:
        """Axes from a link to the ground."""
        path: list[int] = []
        link = BASE if robot is None else link
        while link != BASE:
            path.append(self._first[str(robot)] + link)
            link = self._placed[path[-1]].parent
        return path


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """What moves with a link, in the world when all joints are at zero: a sphere, and a line with a radius round it."""

    centre: Array
    radius: float
    ends: Array
    girth: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _PlacedAxis:
    """One axis at the reference configuration in the world, and the stacked joint that moves it."""

    column: int  # the stacked joint
    ratio: float  # its motion per motion of that joint
    offset: float  # its position when that joint reads zero
    is_revolute: bool  # whether it turns
    parent: int  # index in its robot of the axis that carries it
    point_W: Array  # A point on it in [m]
    axis_W: Array  # its unit direction

    def foot(self, points: Array) -> Array:
        """The points of the axis that are nearest to some points, shape (..., 3)."""
        return self.point_W + ((points - self.point_W) @ self.axis_W)[..., None] * self.axis_W


def _placed(robot: Robot, start: int) -> list[_PlacedAxis]:
    """The axes of a robot, followers after joints; ``start`` is the column of its first joint."""
    R, p = robot.X_WB[:3, :3], robot.X_WB[:3, 3]
    placed = []
    axes: tuple[Joint | FollowerJoint, ...] = (*robot.model.joints, *robot.model.followers)
    for place, axis in enumerate(axes):
        column, ratio, offset = place, 1.0, 0.0
        if isinstance(axis, FollowerJoint):
            column, ratio, offset = axis.leader, axis.ratio, axis.offset
        placed.append(
            _PlacedAxis(
                column=start + column,
                ratio=ratio,
                offset=offset,
                is_revolute=axis.is_revolute,
                parent=axis.parent,
                point_W=R @ axis.point_B + p,
                axis_W=R @ axis.axis_B,
            )
        )
    return placed


def _starts(cell: Cell) -> list[int]:
    """Place of each robot's first axis among all."""
    counts = [len(robot.model.joints) + len(robot.model.followers) for robot in cell.robots]
    return [0, *np.cumsum(counts)[:-1].tolist()]


def _link(body: SceneBody) -> tuple[str | None, int]:
    """Robot and link that carry a body."""
    return body.robot, body.link


def _moved(X: Array, points: Array) -> Array:
    """Displaced points, shape (..., 3)."""
    return points @ X[:3, :3].T + X[:3, 3]
