"""Bodies that a layout moves on their links or gives another shape: columns, tools and the part."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Capsule, Cylinder, Solid, support
from cellplan.geometry.transforms import inverse, pose
from cellplan.model.cell.cell import Cell
from cellplan.scene.bodies import Kind, part_body
from cellplan.scene.scene import Scene

FAR: Final = 1e5  # [m] height at which a body is put that a layout does not have
ON_AXIS: Final = 1e-6  # [m] by which a tool tip may lie beside the axis of a round body


class LayoutVariables(Protocol):
    """Variables of a layout, as far as distances depend on them; n of them."""

    @property
    def given(self) -> Array:
        """Values of the cell as it is, shape (n,)."""
        ...

    def placed(self, x: Array) -> Cell:
        """The cell at values of the variables: bases, tools with their solids, grasps, the part at rest."""
        ...

    def base_twists(self, x: Array) -> Array:
        """Velocity of the origin of each base in W and its angular velocity by each variable, shape (robots, 6, n)."""
        ...

    def neighbours(self, x: Array, step: float) -> "Iterable[NeighbourCells]":
        """Cells in which a tool or the part is a step to either side; all that variables do to these."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NeighbourCells:
    """Two cells in which one number of a tool or of the part is a step in [m] or [rad] greater, and less."""

    robot: str | None  # the robot of which the solids of the tool differ; None where it is the place of the part
    by: Array  # by how much the number grows with each variable, shape (n,)
    sides: tuple[Cell, Cell]  # the cell with the greater number, then with the smaller one; their rest does not count


@dataclass(frozen=True, slots=True)
class PlacedBody:
    """A body as a layout has it: its solid, None where it has none, and its pose on its link; see ``SceneBody``."""

    shape: Solid | None
    X_LS: Array


class MovingBodies:
    """The bodies that a layout moves on their links or gives another shape, by their places in the engine."""

    def __init__(self, scene: Scene) -> None:
        """Find out which bodies these are."""
        self._cell, self._bodies = scene.cell, scene.bodies
        self._solids = len(scene.engine.bodies) - len(scene.cut_from)
        self.columns = {str(body.robot): index for index, body in enumerate(scene.bodies) if body.kind is Kind.PEDESTAL}
        self._tools: dict[str, list[int]] = {}
        for index, body in enumerate(scene.bodies):
            if body.kind is Kind.TOOL:
                self._tools.setdefault(str(body.robot), []).append(index)
        self._cuts = {body: self._solids + place for place, body in enumerate(scene.cut_from)}
        self._part = next(index for index, body in enumerate(scene.bodies) if body.kind is Kind.PART)

    def of_bases(self, X_WB: Array) -> Iterator[tuple[int, PlacedBody]]:
        """Columns below or above bases in the world, shape (robots, 4, 4)."""
        for name, index in self.columns.items():
            yield index, self.of_base(name, X_WB[self._cell.index(name)])

    def of_base(self, name: str, X_WB: Array) -> PlacedBody:
        """The column of a robot that has one, at its base in the world, shape (4, 4)."""
        robot = self._cell.robot(name)
        solid = None if robot.pedestal is None else robot.pedestal.solid(X_WB)
        return PlacedBody(None, far_away(self.columns[name])) if solid is None else PlacedBody(*solid)

    def of_tools(self, cell: Cell) -> Iterator[tuple[int, PlacedBody]]:
        """The part, and of tools that are not those of the scene their bodies and what of them is outside the zone."""
        for robot in cell.robots:
            yield from self.of_tool(cell, robot.name)
        if cell.part is not self._cell.part or cell.carrier is not None:
            yield from self.of_part(cell)

    def of_tool(self, cell: Cell, name: str) -> Iterator[tuple[int, PlacedBody]]:
        """Likewise of the tool of one robot; none where it is that of the scene."""
        robot = cell.robot(name)
        if robot.tool is self._cell.robot(name).tool:
            return
        for index, body in zip(self._tools.get(name, []), robot.tool.bodies, strict=True):
            placed = PlacedBody(body.shape, robot.model.X_BF @ body.X_BS)
            yield index, placed
            if index in self._cuts:
                tip = (inverse(body.X_BS) @ robot.tool.X_FT)[:3, 3]
                yield self._cuts[index], _before(placed, tip, cell.checks.contact_zone_mm.si, self._cuts[index])

    def that_differ(self, cell: Cell, robot: str | None) -> Iterator[tuple[int, PlacedBody]]:
        """Those of the tool of a robot, or the part where there is none; see ``NeighbourCells``."""
        return self.of_part(cell) if robot is None else self.of_tool(cell, robot)

    def of_part(self, cell: Cell) -> Iterator[tuple[int, PlacedBody]]:
        """The part."""
        yield self._part, PlacedBody(cell.part.shape, part_body(cell, cell.part, *cell.part.held_by[:1]).X_BS)


def far_away(index: int) -> Array:
    """A pose at which a body is near nothing, not even another one of these."""
    return pose((0.0, 0.0, FAR * (index + 1)))


def reaches(placed: PlacedBody, n: Array) -> Array:
    """How far a body reaches from the origin of its link along unit directions there, shape (M, 3), in [m], (M,)."""
    if placed.shape is None:
        return np.zeros(len(n))
    return support(placed.shape, n @ placed.X_LS[:3, :3]) + n @ placed.X_LS[:3, 3]


def _before(placed: PlacedBody, tip: Array, zone: float, index: int) -> PlacedBody:
    """A cylinder round what of a round body lies outside a zone round a tip on its axis; any other body as it is."""
    shape = placed.shape
    if not isinstance(shape, Capsule | Cylinder) or float(np.hypot(tip[0], tip[1])) > ON_AXIS or tip[2] < 0.0:
        return placed
    half, r, ahead = 0.5 * shape.length, shape.radius, float(tip[2]) - 0.5 * shape.length
    low, high = -half, float(tip[2]) - float(np.sqrt(max(zone**2 - r**2, 0.0)))
    if isinstance(shape, Capsule):
        low -= r
        if high > half:  # the zone ends on the round end
            high = half + (ahead**2 + r**2 - zone**2) / (2.0 * ahead)
            half += r
    if high >= half:
        return placed
    if high <= low:
        return PlacedBody(None, far_away(index))
    return PlacedBody(Cylinder(shape.radius, high - low), placed.X_LS @ pose((0.0, 0.0, 0.5 * (low + high))))
