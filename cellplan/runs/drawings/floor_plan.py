"""The floor plan of a cell: what stands where, what moves how far, and how far each robot reaches."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.outlines import outlines, swept_outlines
from cellplan.geometry.raster import contours, covered, stretches
from cellplan.geometry.shapes import HalfSpace, Solid
from cellplan.geometry.transforms import transform_points
from cellplan.model.cell.cell import Cell, Robot, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.robot.base_reaction import BaseReaction
from cellplan.model.robot.robot import RobotModel
from cellplan.model.task.task import Frame
from cellplan.model.units import DEG, MM
from cellplan.report.floor_plan.plan import FloorPlan, Layer, PlanOutline, PlanPath, PlanRobot, PlanWall
from cellplan.report.plots.palette import robot_colours
from cellplan.scene.bodies import Kind, SceneBody, body_poses, scene_bodies
from cellplan.scene.kinematics.reach import arm_reach, has_round_reach, reach_outline
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain

SQUARE: Final = 20.0  # [mm]
TRAVEL: Final = 0.12  # [m] between the rows that a swept area is made of, at a metre from the axes that turn
MOST_ROWS: Final = 240  # [-] of them
REACH_ROUNDS: Final = 5  # [-] enough for a drawing
PATH_POINTS: Final = 121  # [-]
NO_REACTIONS: Final[Mapping[str, BaseReaction]] = MappingProxyType({})
LEVEL: Final = 1e-6  # [-] component of a normal that is zero

LAYERS: Final = {Kind.PART: Layer.PART, Kind.OBSTACLE: Layer.SURROUNDINGS}  # others belong to the robots

TaskPoints = Mapping[str, Array]


def floor_plan(
    cell: Cell,
    start: Mapping[str, Array],
    motions: Sequence[Mapping[str, Array]],
    paths: TaskPoints,
    *,
    state: str,
    reactions: Mapping[str, BaseReaction] = NO_REACTIONS,
) -> FloorPlan:
    """The floor plan of a cell.

    Args:
        start: Joint positions at which all is shown, by robot in [rad] or [m], shape (n,) each.
        motions: Joint positions of which the swept area is shown, shape (N, n) each; none for a cell that stands.
        paths: Points of the path of each task in [m], shape (N, 3), on the part or in the world as the task says.
        state: What is shown, in words.
        reactions: What the bases must hold meanwhile, by robot, as far as it is known.
    """
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    bodies = [body for body in scene_bodies(cell) if not isinstance(body.shape, HalfSpace)]
    at = {name: q[None] for name, q in start.items()}
    poses = body_poses(bodies, chains, at)
    squares = _swept(cell, bodies, chains, motions) if motions else {}
    return FloorPlan(
        cell=cell.name,
        state=state,
        robots=tuple(
            replace(_robot(robot, colour, squares), reaction=reactions.get(robot.name))
            for robot, colour in zip(cell.robots, robot_colours(cell).values(), strict=True)
        ),
        outlines=tuple(
            _outline(body, MM * outlines(_solid(body), poses.R[index], poses.p[index])[0])
            for index, body in enumerate(bodies)
        ),
        paths=tuple(_paths(cell, paths, chains, at)),
        walls=tuple(_walls(cell)),
        whole=_contours(np.concatenate([*squares.values()])) if squares else (),
        square=SQUARE if motions else None,
    )


def swept_state(duration: float) -> str:
    """What the floor plan of a run shows, which takes a time in [s]."""
    return f"Robots at the start, and what they sweep in {duration:.3f} s"


def schedule_paths(schedule: Schedule) -> dict[str, Array]:
    """Points along the path of every task of a run in [m], shape (N, 3) each."""
    paths = {}
    for task in schedule.tasks:
        rows = np.unique(np.linspace(0, len(task.X_PT) - 1, PATH_POINTS).round().astype(np.intp))
        paths[task.task.name] = task.X_PT[rows, :3, 3]
    return paths


def _solid(body: SceneBody) -> Solid:
    """Shape of a body that is no half-space."""
    if isinstance(body.shape, HalfSpace):
        raise TypeError("a half-space has no outline")
    return body.shape


def _robot(robot: Robot, colour: str, squares: Mapping[str, Indices]) -> PlanRobot:
    first = robot.model.axes[0] if robot.model.axes else None
    centre = robot.X_WB[:3, 3] if first is None else transform_points(robot.X_WB, first.point_B[None])[0]
    is_round = has_round_reach(robot)
    return PlanRobot(
        name=robot.name,
        model=robot.model.name,
        colour=colour,
        base=np.round(MM * robot.X_WB[:3, 3], 3) + 0.0,
        yaw_deg=round(float(DEG * np.arctan2(robot.X_WB[1, 0], robot.X_WB[0, 0])), 3) + 0.0,
        centre=MM * centre[:2],
        reach=MM * _reach(robot.model) if is_round else None,
        reach_outline=np.zeros((0, 2)) if is_round else MM * reach_outline(robot, rounds=REACH_ROUNDS),
        swept=_contours(squares[robot.name]) if robot.name in squares else (),
    )


@lru_cache(maxsize=64)
def _reach(model: RobotModel) -> float:
    """Reach of a robot's flange in [m]; the phases of a program have the same robots."""
    return arm_reach(model, rounds=REACH_ROUNDS)


def _outline(body: SceneBody, corners: Array) -> PlanOutline:
    """Outline of a body in [mm]."""
    return PlanOutline(
        name=body.name,
        layer=LAYERS.get(body.kind, Layer.ROBOTS),
        robot=body.robot,
        is_base=body.robot is not None and body.is_at_rest,
        corners=corners,
    )


def _paths(cell: Cell, paths: TaskPoints, chains: Chains, at: Mapping[str, Array]) -> Iterable[PlanPath]:
    X_WP = cell.part.X_CP
    if cell.part.held_by:
        holder = cell.part.held_by[0].robot
        X_WP = chains[holder].tool_poses(at[holder])[0] @ X_WP
    for task in cell.tasks:
        if task.name in paths:
            X_WR = X_WP if task.relative_to is Frame.PART else np.eye(4)
            points = MM * transform_points(X_WR, paths[task.name])[:, :2]
            yield PlanPath(task=task.name, robot=task.robot, points=points)


def _walls(cell: Cell) -> Iterable[PlanWall]:
    """Upright half-spaces of the surroundings."""
    for thing in cell.obstacles:
        normal = thing.X_WS[:3, 2]
        if isinstance(thing.shape, HalfSpace) and abs(normal[2]) < LEVEL:
            yield PlanWall(name=thing.name, point=MM * thing.X_WS[:2, 3], normal=normal[:2])


def _swept(
    cell: Cell, bodies: Sequence[SceneBody], chains: Chains, motions: Sequence[Mapping[str, Array]]
) -> dict[str, Indices]:
    """Squares that moving links, tools and the part cover, by the robot that moves them."""
    columns: dict[str, list[Indices]] = {robot.name: [] for robot in cell.robots}
    moving = [body for body in bodies if not body.is_at_rest]
    for q in motions:
        rows = _rows(q)
        poses = body_poses(moving, chains, {name: values[rows] for name, values in q.items()})
        for index, body in enumerate(moving):
            lines = swept_outlines(_solid(body), poses.R[index], poses.p[index])
            columns[str(body.robot)].append(covered(MM / SQUARE * lines))
    return {name: stretches(np.concatenate(indices)) for name, indices in columns.items() if indices}


def _rows(q: RobotRows) -> Indices:
    """Rows of a motion between which no joint moves far; the first and the last among them."""
    steps = np.max([np.abs(np.diff(values, axis=0)).sum(axis=1) for values in q.values()], axis=0)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    count = min(MOST_ROWS, len(travelled), 2 + int(travelled[-1] / TRAVEL))
    marks = np.linspace(0.0, travelled[-1], count)
    return np.unique(
        np.append(np.searchsorted(travelled, marks - LEVEL), len(travelled) - 1).clip(0, len(travelled) - 1)
    )


def _contours(squares: Indices) -> tuple[Array, ...]:
    """Contours of squares in [mm]."""
    return tuple(SQUARE * line for line in contours(stretches(squares)))
