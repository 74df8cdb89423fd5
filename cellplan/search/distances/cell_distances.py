r"""Distances between the bodies of a layout at some configurations of its motion, and their exact derivatives.

The distance of two convex bodies along their common normal :math:`n` is :math:`-h_A(n) - h_B(-n)` with the support
functions of both. At the nearest points it does not change with the normal, so its derivative by any variable is that
of the support functions at a fixed normal: for a body that moves as a whole, the velocity of the nearest point along
the normal; for one whose shape changes, the change of its reach in that direction.
"""

from collections.abc import Iterator, Sequence, Set
from copy import copy
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import pose, rotation_about
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.mounting import Bracket
from cellplan.scene.collision.bodies import CollisionBody, prepare
from cellplan.scene.collision.engine import Engine
from cellplan.scene.kinematics.link_forest import WORLD
from cellplan.scene.near import BodyTable, NearPairs, NearTable
from cellplan.scene.scene import Scene
from cellplan.search.distances.keep_out import keep_out_bodies
from cellplan.search.distances.layout_pairs import (
    LayoutPair,
    among,
    demands_of,
    layout_pairs,
    with_areas,
)
from cellplan.search.distances.moving_bodies import LayoutVariables, MovingBodies, PlacedBody, far_away, reaches

STEP: Final = (
    1e-6  # [m] and [rad] to either side, by which the reach of a body that changes its shape is differentiated
)
TURNS: Final = 3  # place of the first of the rotations among the components of a twist
RAISED: Final = 0.1  # [m] by which a base on the floor is raised so that its column exists


class CellDistances:
    """The pairs of a cell that its layouts keep apart.

    Attributes:
        pairs: The pairs: those that the checks watch, those of which they judge the depth, then areas of the floor with
            the bases and columns that keep out of them.
        variables: What places the bodies.
    """

    def __init__(self, scene: Scene, variables: LayoutVariables) -> None:
        """Use ``of``."""
        self._scene, self.variables, self._cell = scene, variables, scene.cell
        self._moving = MovingBodies(scene)
        self.pairs, watched = layout_pairs(scene)
        areas, origins = keep_out_bodies(scene.cell)
        carriers = [scene.carrier(index) for index in range(len(scene.engine.bodies))] + [*areas, *origins]
        added = [prepare(area.name, area.shape) for area in (*areas, *origins)]  # type: ignore[arg-type] # no half-space
        first = len(scene.engine.bodies)
        at_base = {origin.robot: first + len(areas) + place for place, origin in enumerate(origins)}
        ends = [
            (first + area, body)
            for area in range(len(areas))
            for robot, origin in at_base.items()
            for body in (origin, *([self._moving.columns[robot]] if robot in self._moving.columns else []))
        ]
        self.pairs, watched = with_areas(self.pairs, watched, ends, [carrier.name for carrier in carriers])
        self._engine = Engine([*scene.engine.bodies, *added]) if added else scene.engine
        changed = {index for index, _ in self._moving.of_tools(variables.placed(variables.given))}
        self._table = replace(
            scene.near_table,
            bodies=BodyTable.of(scene.near_table.forest, carriers, self._engine.bodies),
            pairs=among(watched, _concerned(self.pairs, changed)),
            is_hull=np.append(scene.near_table.is_hull, [True] * len(added)).astype(bool),
        )
        self.demands = demands_of(self.pairs)  # what is demanded of each pair in [m], shape (P,)
        # whether both of its bodies belong to one robot, shape (P,)
        self.within_robot = np.array([pair.within_robot for pair in self.pairs], dtype=bool)
        self.most_demanded = float(self.demands.max(initial=0.0))  # the largest demand in [m]
        index = {robot.name: place for place, robot in enumerate(self._cell.robots)}
        self._robots = np.array(
            [-1 if carrier.robot is None else index[carrier.robot] for carrier in carriers], dtype=np.intp
        )

    @classmethod
    def of(cls, scene: Scene, variables: LayoutVariables) -> "CellDistances":
        """The pairs of a scene, which is that of the cell of the variables.

        Pairs do not depend on where bases are, but for columns: a robot that stands on the floor without one is raised,
        so that a layout may have it.
        """
        bare = {
            robot.name: _raised(robot.X_WB)
            for robot in scene.cell.robots
            if robot.pedestal is not None
            and not isinstance(robot.pedestal, Bracket)
            and robot.pedestal.solid(robot.X_WB) is None
        }
        return cls(scene.moved(bare) if bare else scene, variables)

    def of_variables(self, variables: LayoutVariables) -> "CellDistances":
        """The same pairs for other variables that change the same bodies."""
        distances = copy(self)
        distances.variables = variables
        return distances

    def near(self, x: Array, q: Array, within: float) -> NearPairs:
        """All pairs of one layout that are nearer than a distance.

        Args:
            x: The variables, shape (n,).
            q: Stacked joint positions at the keys in [rad] or [m], shape (K, nq).
            within: The distance in [m].
        """
        cell = self.variables.placed(x)
        table, engine = self._placed(cell)
        return table.find(engine, table.forest.displacements(q, _bases(cell)), within)

    def derivatives(self, near: NearPairs, x: Array, dq: Array) -> Array:
        """Derivatives of near distances by the variables, shape (M, n).

        Args:
            x: The variables, shape (n,).
            dq: Derivatives of the joints at the keys by the variables, shape (K, nq, n).
        """
        derivatives, base = np.empty((len(near.rows), dq.shape[2])), self.variables.base_twists(x)
        for key in range(len(dq)):
            rows = near.samples == key
            derivatives[rows] = near.by_joints[rows] @ dq[key]
        self._add_by_bases(derivatives, near, base)
        self._add_by_shapes(derivatives, near, x, base)
        return derivatives

    def _placed(self, cell: Cell) -> tuple[NearTable, Engine]:
        """The bodies as a layout has them."""
        placed = {**dict(self._moving.of_bases(_bases(cell))), **dict(self._moving.of_tools(cell))}
        bodies = self._engine.bodies
        other = dict[int, CollisionBody]()
        for index, body in placed.items():
            if body.shape is not None and body.shape is not bodies[index].shape and body.shape != bodies[index].shape:
                other[index] = prepare(bodies[index].name, body.shape)
        poses = {index: body.X_LS if body.shape is not None else far_away(index) for index, body in placed.items()}
        return self._table.moved(poses, other), self._engine.with_bodies(other) if other else self._engine

    def _add_by_bases(self, derivatives: Array, near: NearPairs, base: Array) -> None:
        """Add derivatives while joints stand still, of what moves as a whole with the bases, shape (M, n)."""
        X_WB = near.D[[self._scene.near_table.forest.place(robot.name) for robot in self._cell.robots], 0]
        twists = np.zeros((len(base) + 1, 6, base.shape[2]))  # at the world's origin; the last one for the world
        turns = np.swapaxes(base[:, 3:], 1, 2)
        twists[:-1, :3] = base[:, :3] + np.swapaxes(np.cross(X_WB[:, None, :3, 3], turns), 1, 2)
        twists[:-1, 3:] = base[:, 3:]
        robots = np.append(self._robots, -1)  # -1 for a half-space as well
        robots[list(self._moving.columns.values())] = -1  # they do not lean with their bases
        ends = robots[near.bodies]
        forces = near.wrenches
        for side, sign in ((0, -1.0), (1, 1.0)):
            for robot in range(len(base)):
                rows = (ends[:, side] == robot) & (ends[:, 1 - side] != robot)
                derivatives[rows] += sign * forces[rows] @ twists[robot]

    def _add_by_shapes(self, derivatives: Array, near: NearPairs, x: Array, base: Array) -> None:
        """Add derivatives while links stand still, of what moves on its link or changes its shape, shape (M, n)."""
        directions = dict[int, tuple[Indices, Array]]()
        for index, by, forward, back in self._changes(near, x, base):
            if index not in directions:
                directions[index] = self._directions(near, index)
            rows, n = directions[index]
            if len(rows):
                change = (reaches(back, n) - reaches(forward, n)) / (2.0 * STEP)
                columns = np.flatnonzero(by)
                derivatives[rows[:, None], columns] += change[:, None] * by[columns]

    def _column(self, name: str, X_WB: Array) -> PlacedBody:
        """The column of a robot at its base, as seen from the world."""
        column = self._moving.of_base(name, X_WB)
        return PlacedBody(column.shape, X_WB @ column.X_LS)

    def _directions(self, near: NearPairs, index: int) -> tuple[Indices, Array]:
        """The pairs of a body, and where the others are, seen from its link: unit directions of shape (M, 3).

        A column is seen from the world, all other bodies from what carries them. No body is in a pair with itself.
        """
        link = WORLD if index in self._moving.columns.values() else int(self._table.bodies.links[index])
        rows, sides = np.nonzero(near.bodies == index)
        n = near.normals[rows] * np.where(sides == 0, 1.0, -1.0)[:, None]
        return rows, (n[:, None] @ near.D[link, near.samples[rows], :3, :3])[:, 0]

    def _changes(self, near: NearPairs, x: Array, base: Array) -> Iterator[tuple[int, Array, PlacedBody, PlacedBody]]:
        """Bodies a step forward and back of one number, and by how much that grows with each variable, (n,)."""
        forest = self._scene.near_table.forest
        for name, index in self._moving.columns.items():
            if index not in near.bodies:
                continue
            X_WB, by = near.D[forest.place(name), 0], base[self._cell.index(name)]
            for component in np.flatnonzero(by.any(axis=1)).tolist():
                forward, back = (self._column(name, _displaced(X_WB, component, step)) for step in (STEP, -STEP))
                yield index, by[component], forward, back
        for neighbour in self.variables.neighbours(x, STEP):
            moved = (self._moving.that_differ(cell, neighbour.robot) for cell in neighbour.sides)
            for (index, forward), (_, back) in zip(*moved, strict=True):
                if forward.shape != back.shape or not np.array_equal(forward.X_LS, back.X_LS):
                    yield index, neighbour.by, forward, back


def _displaced(X: Array, component: int, step: float) -> Array:
    """A frame moved along an axis of the world, or turned about one through its origin."""
    displaced = X.copy()
    if component < TURNS:
        displaced[component, 3] += step
    else:
        displaced[:3, :3] = rotation_about(np.eye(3)[component - TURNS], step) @ X[:3, :3]
    return displaced


def _concerned(pairs: Sequence[LayoutPair], changed: Set[int]) -> Flags:
    """Which pairs a layout can change: not those of one robot without a joint between them, unless it changes one."""
    is_free = [not (pair.within_robot and pair.is_fixed) or not changed.isdisjoint(pair.ends) for pair in pairs]
    return np.array(is_free, dtype=bool)


def _bases(cell: Cell) -> Array:
    """Bases of a cell in the world, shape (robots, 4, 4)."""
    return np.array([robot.X_WB for robot in cell.robots])


def _raised(X_WB: Array) -> Array:
    """A base a little higher."""
    return pose((0.0, 0.0, RAISED)) @ X_WB
