"""What a floor plan shows, as plain data: lengths in [mm], places in the world."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.robot.base_reaction import BaseReaction
from cellplan.model.units import MM
from cellplan.report.floor_plan.pendants import PlanPendant

LONGEST_CHAIN = 14  # places of a chain of dimensions; of more only the whole length is given
SAME_PLACE = 0.5  # [mm] lines of a chain of dimensions that are nearer are one


class Layer(StrEnum):
    """What a line of the plan belongs to."""

    SURROUNDINGS = "surroundings"
    REACH = "reach"
    SWEPT = "swept"
    ROBOTS = "robots"
    PART = "part"
    PATHS = "paths"
    DIMENSIONS = "dimensions"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanOutline:
    """Outline of a body: its name, its layer, the robot that it belongs to, and corners, shape (N, 2)."""

    name: str  # name of the body
    layer: Layer
    robot: str | None  # name of its robot; None for the surroundings and a fixed part
    is_base: bool  # whether it is part of a robot and never moves
    corners: Array  # its corners, shape (N, 2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanPath:
    """Path of a task at the start: its name, its robot and points, shape (N, 2)."""

    task: str
    robot: str
    points: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanWall:
    """A level line that all is on one side of: a point of it, shape (2,), and the direction to the free side."""

    name: str
    point: Array
    normal: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanRobot:
    """A robot of the plan."""

    name: str
    model: str
    colour: str
    base: Array  # coordinates of the base, shape (3,)
    yaw_deg: float  # direction of the x axis of the base, from that of the world
    centre: Array  # where its first axis stands, shape (2,)
    reach: float | None  # largest distance of the flange from there; None where it is no circle: on a rail, a wall
    reach_outline: Array  # farthest places of the flange then, shape (K, 2); none where it is a circle
    swept: tuple[Array, ...]  # contours of what links and tools cover during the motion; none without a motion
    reaction: BaseReaction | None = None  # what its base must hold; None where masses of links are not stated


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dimension:
    """A dimension along x (0) or y (1)."""

    axis: int
    first: float  # where it begins along the axis, at the smaller coordinate
    second: float  # where it ends
    row: int  # number of its row, counted from the plan outwards

    @property
    def length(self) -> float:
        """Its length in [mm]."""
        return self.second - self.first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FloorPlan:
    """A floor plan."""

    cell: str  # name of the cell
    state: str  # what the robots are shown at, and the motion of what is swept
    robots: tuple[PlanRobot, ...]
    outlines: tuple[PlanOutline, ...]  # outlines of all bodies
    paths: tuple[PlanPath, ...]  # paths of all tasks
    walls: tuple[PlanWall, ...]  # vertical half-spaces among the surroundings
    whole: tuple[Array, ...]  # contours of what the whole cell covers during the motion
    square: float | None  # edge of the squares that swept areas are made of; None without a motion
    pendants: tuple[
        PlanPendant, ...
    ] = ()  # frames to type into the pendants, by robot; none unless they are to be shown

    @property
    def dimensions(self) -> tuple[Dimension, ...]:
        """Distances between the bases along x and along y, and to the ends of the surroundings where there are any."""
        return tuple(dimension for axis in (0, 1) for dimension in self._dimensions(axis))

    def _dimensions(self, axis: int) -> Iterator[Dimension]:
        """One chain from base to base, and one round it from end to end."""
        places = distinct([float(robot.base[axis]) for robot in self.robots])
        around = [outline.corners[:, axis] for outline in self.outlines if outline.layer is Layer.SURROUNDINGS]
        ends = [float(min(map(np.min, around))), float(max(map(np.max, around)))] if around else []
        chain = distinct([*places, *ends])
        if len(chain) <= LONGEST_CHAIN:
            for first, second in pairwise(chain):
                yield Dimension(axis=axis, first=first, second=second, row=0)
        if len(chain) > 2:
            yield Dimension(axis=axis, first=chain[0], second=chain[-1], row=1)

    @property
    def fixed_frames(self) -> dict[tuple[float, float], dict[str, Array]]:
        """Fixed frames of the part by place in [mm] and name: poses in the world in [m], shape (4, 4) each."""
        places: dict[tuple[float, float], dict[str, Array]] = {}
        for frame in (frame for pendant in self.pendants for frame in pendant.frames):
            if frame.X_W is not None:
                x, y = (np.round(MM * frame.X_W[:2, 3]) + 0.0).tolist()
                places.setdefault((x, y), {})[frame.name] = frame.X_W
        return places

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest coordinates of everything but walls, shape (2,) each."""
        points = [outline.corners for outline in self.outlines] + [path.points for path in self.paths]
        points += [line for robot in self.robots for line in robot.swept] + [
            robot.base[None, :2] for robot in self.robots
        ]
        circles = [(robot.centre, robot.reach) for robot in self.robots if robot.reach is not None]
        points += [robot.reach_outline for robot in self.robots]
        points += [np.stack([centre - radius, centre + radius]) for centre, radius in circles]
        every = np.concatenate(points)
        return every.min(axis=0), every.max(axis=0)


def distinct(places: list[float]) -> list[float]:
    """Places in ascending order, those that are one once."""
    distinct_values: list[float] = []
    for place in sorted(places):
        if not distinct_values or place - distinct_values[-1] > SAME_PLACE:
            distinct_values.append(place)
    return distinct_values


def length_text(length: float) -> str:
    """A length in [mm] as text."""
    return f"{length:.1f}".removesuffix(".0")
