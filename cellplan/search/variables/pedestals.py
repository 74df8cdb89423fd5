"""Obstacles that a robot stands on become its pedestal, so that they move with its base."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Box, Cylinder
from cellplan.model.cell.cell import Cell, Obstacle, Robot
from cellplan.model.cell.layout import LayoutSettings, VariableKind, VaryRange
from cellplan.model.cell.mounting import Hanger, Pedestal, Wedge
from cellplan.model.units import MM
from cellplan.search.variables.written import written_quantity

CENTRED: Final = 1e-3  # [m] by which a base may stand beside the middle of its obstacle, above it or below its top
UPRIGHT: Final = 1e-6  # [-] of an axis that leans
ALIGNED: Final = 1e-6  # [rad] between the sides of a box and the axes of the base on it
SHORTEST: Final = 1e-3  # [m] of a column that is left below a base
STEEPEST: Final = math.radians(75.0)  # [rad] of a tilted base
OUTSIDE: Final = 1.01  # [-] a column with a slanting top is a prism round the circle
MOST_LEAN: Final = math.radians(1.0)  # [rad] of a base that stands upright


def with_pedestals(cell: Cell, settings: LayoutSettings) -> tuple[dict[str, object], tuple[str, ...]]:
    """Values that turn obstacles below single varied bases into pedestals of these robots.

    An upright cylinder or box counts on which exactly one base stands, and that centred. One that an exclusion names
    stays an obstacle.

    Returns:
        Values by address for ``Cell.with_values``, and sentences about what they do.
    """
    varied = {variable.name for variable in settings.ranges if variable.kind is VariableKind.BASE}
    tilted = {
        variable.name for variable in settings.ranges if variable.kind is VariableKind.BASE and variable.index in {3, 4}
    }
    named = {body for pair in cell.checks.exclude for body in pair.bodies}
    values, remarks = dict[str, object](), list[str]()
    for obstacle in cell.obstacles:
        robots = [robot for robot in cell.robots if _stands_on(robot, obstacle)]
        if len(robots) != 1 or robots[0].name not in varied or robots[0].pedestal is not None:
            continue
        robot = robots[0]
        column = _column(robot, obstacle)
        if column is None:
            continue
        if obstacle.name in named:
            remarks.append(
                f"environment.{obstacle.name} stays where it is, as an exclusion names it, although '{robot.name}' "
                "stands on it"
            )
            continue
        mount = {"tilted": column} if robot.name in tilted else None
        values[f"robots.{robot.name}.{'pedestal' if mount is None else 'mount'}"] = mount or column
        values[f"environment.{obstacle.name}"] = None
        remarks.append(
            f"environment.{obstacle.name} is the pedestal of '{robot.name}' here: it moves with the base and reaches "
            f"down to {column['floor_z_mm']:g} mm"
        )
    return values, tuple(remarks)


def leaving_columns(cell: Cell, ranges: Sequence[VaryRange], *, spare: float = 0.0) -> tuple[VaryRange, ...]:
    """Ranges of heights narrowed by ``spare`` in [m] so that a column below a base, or above one that hangs, stays."""
    extended, shortest = [], SHORTEST + spare
    for variable in ranges:
        mount = (
            cell.robot(variable.name).pedestal if variable.kind is VariableKind.BASE and variable.index == 2 else None
        )
        lower, upper = variable.lower, variable.upper
        if isinstance(mount, Hanger):
            upper = min(upper, mount.ceiling - shortest)
        elif isinstance(mount, Pedestal | Wedge):
            lower = max(lower, mount.floor + shortest)
        if isinstance(mount, Wedge):
            lower = max(lower, mount.floor + shortest + _slope(cell, variable.name, ranges) * _outer_radius(mount))
        if not lower < upper:
            where = cell.origin.at(f"layout.vary.{variable.address.removeprefix('robots.').removesuffix('.z_mm')}")
            raise InputError(f"{where}: expected heights that leave a column at the base of '{variable.name}'")
        extended.append(replace(variable, lower=lower, upper=upper))
    return tuple(extended)


def _slope(cell: Cell, robot: str, ranges: Sequence[VaryRange]) -> float:
    """Steepest slope of a base at any roll and pitch that it may have."""
    R = cell.robot(robot).X_WB[:3, :3]
    steepest = math.acos(min(1.0, max(-1.0, float(R[2, 2]))))
    tilts = [
        variable
        for variable in ranges
        if variable.kind is VariableKind.BASE and variable.name == robot and variable.index in {3, 4}
    ]
    widest = sum(max(abs(tilt.lower), abs(tilt.upper)) for tilt in tilts)
    return math.tan(min(max(widest, steepest), STEEPEST))


def _outer_radius(mount: Wedge) -> float:
    """Distance of the corners of a column from its middle in [m]."""
    return 0.5 * math.hypot(*mount.size) if mount.size is not None else OUTSIDE * float(mount.radius or 0.0)


def _stands_on(robot: Robot, obstacle: Obstacle) -> bool:
    """Whether the origin of a base is on top of an upright column or box."""
    ends = _ends(obstacle)
    if ends is None or abs(ends[1] - float(robot.X_WB[2, 3])) > CENTRED:
        return False
    across = obstacle.X_WS[:3, :3].T @ (robot.X_WB[:3, 3] - obstacle.X_WS[:3, 3])
    if isinstance(obstacle.shape, Box):
        size = np.array(obstacle.shape.size)
        upright = int(np.argmax(np.abs(obstacle.X_WS[2, :3])))
        return bool(np.all(np.delete(np.abs(across) - 0.5 * size, upright) <= 0.0))
    return isinstance(obstacle.shape, Cylinder) and float(np.hypot(across[0], across[1])) <= obstacle.shape.radius


def _ends(obstacle: Obstacle) -> tuple[float, float] | None:
    """Heights in [m] of the bottom and the top of an upright column or box; None for anything else."""
    shape, vertical = obstacle.shape, np.abs(obstacle.X_WS[2, :3])
    if isinstance(shape, Cylinder):
        half = 0.5 * shape.length if vertical[2] >= 1.0 - UPRIGHT else None
    elif isinstance(shape, Box):
        axis = int(np.argmax(vertical))
        half = 0.5 * shape.size[axis] if vertical[axis] >= 1.0 - UPRIGHT else None
    else:
        half = None
    middle = float(obstacle.X_WS[2, 3])
    return None if half is None else (middle - half, middle + half)


def _column(robot: Robot, obstacle: Obstacle) -> dict[str, Any] | None:
    """The pedestal as a cell file writes it; None where it would not be the same body."""
    ends, shape = _ends(obstacle), obstacle.shape
    offset = robot.X_WB[:2, 3] - obstacle.X_WS[:2, 3]
    leans = math.acos(min(1.0, max(-1.0, float(robot.X_WB[2, 2])))) > MOST_LEAN
    if ends is None or leans or float(np.hypot(*offset)) > CENTRED:
        return None
    floor = {"floor_z_mm": written_quantity(ends[0], is_angle=False)}
    if isinstance(shape, Cylinder):
        return {"cylinder": {"radius_mm": _mm(shape.radius)}} | floor
    sides = None if not isinstance(shape, Box) else _sides(robot.X_WB, obstacle.X_WS, shape)
    return None if sides is None else {"box": {"size_mm": sides}} | floor


def _sides(X_WB: Array, X_WS: Array, box: Box) -> list[float] | None:
    """Edge lengths in [mm] of an upright box along the x and y of a base; None where they are turned."""
    heading = math.atan2(float(X_WB[1, 0]), float(X_WB[0, 0]))
    x = np.array([math.cos(heading), math.sin(heading), 0.0])
    sides = []
    for axis in (x, np.array([-x[1], x[0], 0.0])):
        along = np.abs(X_WS[:3, :3].T @ axis)
        side = int(np.argmax(along))
        if along[side] < math.cos(ALIGNED):
            return None
        sides.append(_mm(box.size[side]))
    return sides


def _mm(length: float) -> float:
    """A length in [mm] as the file had it."""
    return float(f"{MM * length:.12g}")
