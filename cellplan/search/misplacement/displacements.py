"""Displacements of the bases of one layout as variables, so that the kernel and the bodies give their derivatives."""

from collections.abc import Container
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.frozen import derive
from cellplan.geometry.shapes import HalfSpace
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.settings.layout import MisplacementEntry
from cellplan.search.distances.moving_bodies import NeighbourCells
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.kernel.varied import VariedFields
from cellplan.search.variables.variables import Variables
from cellplan.search.variables.written import written_quantity

COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "yaw_deg")
TWIST_ROWS: Final = (0, 1, 2, 5)  # of the components in a twist
HEIGHT: Final = 2  # place of z among the components
ON_PLANE: Final = 1e-6  # [m] by which a base may be off a plane and stand on it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseDisplacements(VariedFields):
    """Variables d, m of them: how far each base is beside its place in a layout, 0 for the layout itself.

    A base is displaced along the axes of the world in [m] and turned about the vertical through its origin in [rad]; a
    column below it goes with it. The tools come to their paths anew. Bases that stand on a plane of the environment
    stay on it.
    """

    variables: Variables  # variables of the layout
    x: Array  # their values, shape (n,)
    robots: tuple[int, ...]  # the robot of each displacement, m of them
    components: tuple[int, ...]  # its place in ``COMPONENTS``, m of them
    amounts: Array  # by how much each base may be off, shape (m,)

    def __post_init__(self) -> None:
        """Name the displacements by the addresses that they change, and derive their bounds and steps."""
        robots = self.variables.base.robots
        places = zip(self.robots, self.components, strict=True)
        amounts = self.amounts
        derive(
            self,
            names=tuple(f"robots.{robots[r].name}.base.{COMPONENTS[c]}" for r, c in places),
            given=np.zeros_like(amounts),
            lower=-amounts,
            upper=amounts,
            scale=amounts,
            cost=1.0 / amounts,
        )

    @classmethod
    def of(cls, variables: Variables, x: Array, misplacement: MisplacementEntry) -> "BaseDisplacements":
        """Those of all bases of a layout, shape (n,)."""
        cell = variables.placed(x)
        places = [
            (index, component)
            for index, robot in enumerate(cell.robots)
            for component in range(len(COMPONENTS))
            if component != HEIGHT or not _stands_on_plane(cell, robot)
        ]
        lengths = np.array([misplacement.position_mm.si] * 3 + [misplacement.orientation_deg.si])
        return cls(
            variables=variables,
            x=x,
            robots=tuple(robot for robot, _ in places),
            components=tuple(component for _, component in places),
            amounts=lengths[[component for _, component in places]],
        )

    def at(self, x: Array) -> "BaseDisplacements":
        """The same displacements of another layout, shape (n,)."""
        return replace(self, x=x)

    def layouts(self, d: Array, start: Array, at_work: Container[str] | None = None) -> Layouts:
        """Candidates for the kernel at displacements of shape (K, m), with start postures of shape (K, nq)."""
        one = self.variables.layouts(self.x[None], start[:1], at_work)
        shift = self.variables.state(self.x).base_shift(self.variables.base)
        chosen = self.variables.layouts(np.tile(self.x, (len(d), 1)), start).start
        return Layouts(
            X_WB=shift @ self._displaced(inverse(shift) @ one.X_WB, d),
            X_FT=np.tile(one.X_FT, (len(d), 1, 1, 1)),
            start=chosen,
            weights=np.tile(one.weights, (len(d), 1)),
        )

    def directions(self, d: Array, at_work: Container[str] | None = None) -> Directions:  # noqa: ARG002 - of all tasks
        """What each displacement does to a candidate for the kernel."""
        base, nq = self.base_twists(d), self.variables.base.joint_count
        turn = self.variables.state(self.x).base_shift(self.variables.base)[:3, :3]
        none = np.zeros((nq, len(d)))
        seen = np.concatenate([turn @ base[:, :3], turn @ base[:, 3:]], axis=1)
        return Directions(base=seen, tool=np.zeros_like(base), start=none, weights=none)

    def base_twists(self, d: Array) -> Array:
        """What each displacement does to each base: velocity of its origin, angular velocity, (robots, 6, m)."""
        twists = np.zeros((len(self.variables.base.robots), 6, len(d)))
        for column, (robot, component) in enumerate(zip(self.robots, self.components, strict=True)):
            twists[robot, TWIST_ROWS[component], column] = 1.0
        return twists

    def neighbours(self, d: Array, step: float) -> tuple[NeighbourCells, ...]:  # noqa: ARG002 - of the protocol
        """Nothing: a displaced base changes no tool and no grasp."""
        return ()

    def placed(self, d: Array) -> Cell:
        """The cell with displaced bases, shape (m,), neither rounded nor validated: quick, for scenes."""
        cell = self.variables.placed(self.x)
        X_WB = self._displaced(np.array([[robot.X_WB for robot in cell.robots]]), d[None])[0]
        robots = tuple(replace(robot, X_WB=X) for robot, X in zip(cell.robots, X_WB, strict=True))
        return replace(cell, robots=robots)

    def cell(self, d: Array, values: dict[str, object]) -> Cell:
        """The cell of the file with displaced bases, shape (m,), and the values of a layout and its start."""
        values, bases = dict(values), self.variables.state(self.x).bases
        for name, robot, component, by in zip(self.names, self.robots, self.components, d.tolist(), strict=True):
            value = bases[robot, TWIST_ROWS[component]] + by
            values[name] = written_quantity(float(value), is_angle=component > HEIGHT)
        return self.variables.given_cell.with_values(values)

    def _displaced(self, X_WB: Array, d: Array) -> Array:
        """Bases of the layout, shape (1, robots, 4, 4), displaced, shape (K, robots, 4, 4)."""
        by = np.zeros((len(d), X_WB.shape[1], len(COMPONENTS)))
        by[:, list(self.robots), list(self.components)] = d
        X = np.tile(X_WB, (len(d), 1, 1, 1))
        turn = np.tile(np.eye(3), (len(d), X_WB.shape[1], 1, 1))
        cosine, sine = np.cos(by[..., 3]), np.sin(by[..., 3])
        turn[..., 0, 0], turn[..., 0, 1], turn[..., 1, 0], turn[..., 1, 1] = cosine, -sine, sine, cosine
        X[..., :3, :3] = turn @ X[..., :3, :3]
        X[..., :3, 3] += by[..., :3]
        return X


def _stands_on_plane(cell: Cell, robot: Robot) -> bool:
    """Whether the origin of a base without a column lies in a plane of the environment: it cannot be lower."""
    if robot.pedestal is not None:
        return False
    planes = [obstacle.X_WS for obstacle in cell.obstacles if isinstance(obstacle.shape, HalfSpace)]
    return any(abs(float(X[:3, 2] @ (robot.X_WB[:3, 3] - X[:3, 3]))) <= ON_PLANE for X in planes)
