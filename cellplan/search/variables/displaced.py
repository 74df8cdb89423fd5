"""Bodies that move with the numbers of a layout while all joints stand still: rods, pedestals and the part."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross
from cellplan.model.cell import Cell
from cellplan.model.layout import VariableKind, VaryRange
from cellplan.model.mounting import Bracket, Mount, Pedestal, Wedge
from cellplan.model.rod import Rod
from cellplan.search.variables.directions import base_twists, grasp_twists, part_twists
from cellplan.search.variables.state import State
from cellplan.search.variables.twists import about_origin, rod_twists

Field = Callable[[Array], Array]  # points (M, 3) -> velocities per unit of one number, (M, 3)


class BodyFrame(StrEnum):
    """Frame in which points of a body and their velocities are given."""

    FLANGE = "flange"
    WORLD = "world"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisplacedBody:
    """A body that the variables move or reshape while all joints stand still.

    Attributes:
        name: Its name in the scene: ``kuka/tool_2``, ``kuka/pedestal``, ``part``.
        robot: Name of the robot that carries it; None for a part at rest.
        frame: Where its points are given: the robot's flange, whose own motion with the base comes on top, or the
            world.
        fields: Velocity by each number that moves it, by the number's place.
        factors: How the numbers follow from the variables, shape (m, n).
    """

    name: str
    robot: str | None
    frame: BodyFrame
    fields: dict[int, Field]
    factors: Array

    def velocity(self, points: Array) -> Array:
        """Velocities of surface points per unit of each variable, in [m].

        A rod is stretched between its round ends and a pedestal between floor and base, which is exact for distances:
        where a point moves along its surface only, that does not matter.

        Args:
            points: In its frame, shape (M, 3).

        Returns:
            Shape (M, 3, n).
        """
        found = np.zeros((*points.shape, self.factors.shape[1]))
        for row, moved in self.fields.items():
            found += moved(points)[..., None] * self.factors[row]
        return found


def displaced_bodies(
    state: State, cell: Cell, ranges: Sequence[VaryRange], factors: Array
) -> tuple[DisplacedBody, ...]:
    """All bodies that the variables displace at one layout; see ``Variables.displaced``."""
    bodies = [_rod(state, cell, robot, ranges) for robot in range(len(cell.robots))]
    bodies += [_column(state, cell, robot, ranges) for robot in range(len(cell.robots))]
    bodies.append(_part(state, cell, ranges))
    return tuple(
        DisplacedBody(name=name, robot=robot, frame=frame, fields=fields, factors=factors)
        for name, robot, frame, fields in bodies
        if fields
    )


Placed = tuple[str, str | None, BodyFrame, dict[int, Field]]


def _rod(state: State, cell: Cell, robot: int, ranges: Sequence[VaryRange]) -> Placed:
    """The rod of a robot's tool; its holder stays."""
    rod, name, fields = state.rods[robot], cell.robots[robot].name, dict[int, Field]()
    for row, each in enumerate(ranges):
        if rod is not None and each.kind is VariableKind.TOOL and each.name == name:
            twist = rod_twists(rod)[each.index]
            fields[row] = partial(_stretched, rod) if each.index == 0 else partial(_rigid, twist)
    body = "" if rod is None else rod.bodies()[-1].name
    return f"{name}/{body}", name, BodyFrame.FLANGE, fields


def _stretched(rod: Rod, points: Array) -> Array:
    """Velocity of the points of a rod by its length: none at its inner end, that of the tip at its outer one."""
    direction, (begin, end) = rod.X_FT[:3, 2], rod.span
    share = np.clip((points @ direction - begin) / (end - begin), 0.0, 1.0)
    return share[:, None] * direction


def _rigid(twist: Array, points: Array) -> Array:
    """Velocity of the points of a rigid body by a twist about the origin."""
    return twist[:3] + cross(np.broadcast_to(twist[3:], points.shape), points)


def _part(state: State, cell: Cell, ranges: Sequence[VaryRange]) -> Placed:
    """The part, by its grasp, by the rod of its first holder, or by its pose at rest."""
    carrier, fields = cell.carrier, dict[int, Field]()
    if carrier is None:
        for row, each in enumerate(ranges):
            if each.kind is VariableKind.PART:
                fields[row] = partial(_rigid, part_twists(state)[each.index])
        return "part", None, BodyFrame.WORLD, fields
    name, rod = cell.robots[carrier].name, state.rods[carrier]
    for row, each in enumerate(ranges):
        if each.name == name and each.kind is VariableKind.GRASP:
            fields[row] = partial(_rigid, grasp_twists(state, cell, carrier)[each.index])
        elif each.name == name and each.kind is VariableKind.TOOL and rod is not None:
            fields[row] = partial(_rigid, rod_twists(rod)[each.index])
    return "part", name, BodyFrame.FLANGE, fields


def _column(state: State, cell: Cell, robot: int, ranges: Sequence[VaryRange]) -> Placed:
    """What a robot stands on or hangs from."""
    mount, name, fields = cell.robots[robot].pedestal, cell.robots[robot].name, dict[int, Field]()
    twists = base_twists(state, cell, ranges)[robot]
    for row, each in enumerate(ranges):
        if mount is not None and each.kind is VariableKind.BASE and each.name == name:
            fields[row] = partial(_below, mount, state.bases[robot], each.index, twists[:, row])
    return f"{name}/{'mount' if mount is None else mount.name}", name, BodyFrame.WORLD, fields


def _below(mount: Mount, base: Array, index: int, twist: Array, points: Array) -> Array:
    """Velocity of the points of a column by a component of its base: it stays upright, one end at the base."""
    moving = about_origin(twist, base[:3])
    if isinstance(mount, Bracket) or index in {0, 1, 5}:
        return _rigid(moving, points)
    found = np.zeros_like(points)
    if isinstance(mount, Wedge):
        found[:, 2] = _wedge(mount, base, index, points)
    elif index == 2:
        far = mount.floor if isinstance(mount, Pedestal) else mount.ceiling
        found[:, 2] = np.clip((points[:, 2] - far) / (base[2] - far), 0.0, 1.0)
    return found


def _wedge(mount: Wedge, base: Array, index: int, points: Array) -> Array:
    """Velocity upwards of the points of a column with a slanting top by height, roll or pitch of its base."""
    (sine, cosine), (x, y) = (np.sin(base[5]), np.cos(base[5])), (points[:, :2] - base[:2]).T
    across, roll, pitch = np.stack([cosine * x + sine * y, cosine * y - sine * x]), base[3], base[4]
    height = base[2] - mount.floor - np.tan(pitch) * across[0] + np.tan(roll) / np.cos(pitch) * across[1]
    if index == 2:
        change = np.ones(len(points))
    elif index == 3:
        change = across[1] / (np.cos(roll) ** 2 * np.cos(pitch))
    else:
        change = across[1] * np.tan(roll) * np.sin(pitch) / np.cos(pitch) ** 2 - across[0] / np.cos(pitch) ** 2
    return np.clip((points[:, 2] - mount.floor) / height, 0.0, 1.0) * change
