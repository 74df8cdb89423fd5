"""Which variables of a search place which robot: what a start may choose for one robot without touching another."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell.cell import Cell
from cellplan.search.distances.moving_bodies import LayoutVariables
from cellplan.search.kernel.varied import KernelVariables

PROBE: Final = 0.1  # of a variable's range or usual step: far above rounding
COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "yaw_deg")  # of a base that a start chooses so that its tool comes there
FIXED: Final = -1  # in place of a column


class StartVariables(LayoutVariables, KernelVariables, Protocol):
    """Variables as starts need them; see ``search.variables``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Freedom:
    """The variables of a search, sorted by the robot that they place."""

    by_robot: tuple[Indices, ...]  # columns of its base, tool and start alone, and those that move later operators too
    base: Indices  # columns of x, y, z, yaw of each base among its robot's; ``FIXED`` without one, (robots, 4)
    columns: Indices  # column of the start position of each joint; ``FIXED`` where there is none, shape (nq,)
    shared: Indices  # columns that place the first holder and others: equal or mirrored ones; none of weights
    part: Indices  # columns of the variables that place a part at rest
    leaders: tuple[int, ...]  # by robot, whose variables move it too: equal or mirrored ones; itself without any

    @classmethod
    def of(cls, cell: Cell, variables: StartVariables, start: Array) -> "Freedom":
        """Sort the variables by what changes when each of them does.

        Args:
            start: A start posture, shape (nq,).
        """
        count = len(variables.names)
        x = np.tile(variables.given, (count + 1, 1))
        step = PROBE * np.minimum(variables.scale, np.maximum(variables.upper - variables.lower, 0.0))
        down = variables.given + step > variables.upper
        x[1:] += np.diag(np.where(down, -step, step))
        seen = variables.layouts(x, np.tile(start, (count + 1, 1)))
        starts = seen.start[1:] != seen.start[0]
        moved = np.zeros((count, len(cell.robots)), dtype=bool)
        for index, robot in enumerate(cell.robots):
            placed = (seen.X_WB[:, index], seen.X_FT[:, index])
            by_pose = [np.any(part[1:] != part[0], axis=(1, 2)) for part in placed]
            moved[:, index] = np.any([*by_pose, np.any(starts[:, cell.columns(robot.name)], axis=1)], axis=0)
        is_part = np.array([name.startswith("part.at") for name in variables.names], dtype=bool)
        leader = _leaders(cell, variables.names, np.where(is_part[:, None], False, moved))
        led_columns = tuple(np.flatnonzero(leader == index) for index in range(len(cell.robots)))
        columns = np.full(cell.joint_count, FIXED)
        for column in np.flatnonzero(leader != FIXED).tolist():
            changed = np.flatnonzero(starts[column])
            if len(changed) == 1:
                columns[changed[0]] = column
        base = [_base_columns(robot.name, variables.names, led_columns[i]) for i, robot in enumerate(cell.robots)]
        led = [set(leader[moved[:, index] & ~is_part]) - {FIXED, index} for index in range(len(cell.robots))]
        return cls(
            by_robot=led_columns,
            base=np.array(base, dtype=np.intp),
            columns=columns,
            shared=np.flatnonzero((leader == FIXED) & ~is_part & (moved.sum(axis=1) > 1)),
            part=np.flatnonzero(is_part),
            leaders=tuple(int(min(followed, default=index)) for index, followed in enumerate(led)),
        )

    def groups(self, operators: Sequence[int]) -> list[tuple[int, ...]]:
        """Operators by what ties them to each other, those that lead first."""
        groups = dict[int, list[int]]()
        for robot in operators:
            first = robot
            for _ in self.leaders:
                first = self.leaders[first]
            groups.setdefault(first, []).append(robot)
        return [
            tuple(sorted(group, key=lambda robot: (self.leaders[robot] != robot, robot))) for group in groups.values()
        ]


def _leaders(cell: Cell, names: Sequence[str], moved: Flags) -> Indices:
    """The robot that each variable is drawn for, ``FIXED`` where it is none or the first holder is among several."""
    leader = np.full(len(names), FIXED)
    for column, name in enumerate(names):
        robots = np.flatnonzero(moved[column])
        if len(robots) == 1:
            leader[column] = robots[0]
        elif len(robots) > 1 and cell.carrier not in robots:
            named = [index for index in robots.tolist() if name.startswith(f"robots.{cell.robots[index].name}.")]
            leader[column] = named[0] if named else FIXED
    return leader


def _base_columns(robot: str, names: Sequence[str], columns: Indices) -> list[int]:
    """Columns of the components of a robot's base."""
    places = {names[column]: column for column in columns.tolist()}
    return [places.get(f"robots.{robot}.base.{component}", FIXED) for component in COMPONENTS]


def random_within(variables: StartVariables, columns: Indices, count: int, rng: np.random.Generator) -> Array:
    """The given values, shape (count, n), with columns drawn evenly within their bounds, or ten steps if infinite."""
    x = np.tile(variables.given, (count, 1))
    spread = np.where(variables.scale > 0.0, 10.0 * variables.scale, 1.0)
    lower = np.where(np.isfinite(variables.lower), variables.lower, variables.given - spread)[columns]
    upper = np.where(np.isfinite(variables.upper), variables.upper, variables.given + spread)[columns]
    x[:, columns] = rng.uniform(lower, upper, (count, len(columns)))
    return x
