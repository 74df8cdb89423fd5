"""Which modes are free of collisions by themselves, and which two cannot be at work at the same time.

Both are examined in few configurations with a reserve, as an assignment needs many; what it chooses is certified
when it is solved.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.answers import Answers, worked_out
from cellplan.scene.bodies import Kind
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.goals import Stations
from cellplan.search.assign.problem.table import TaskMode

LOOKED_AT: Final = 5  # configurations of a mode that are examined, those before and after its path among them
MET: Final = 4  # configurations of each of two modes that are combined
RESERVE: Final = 0.007  # [m] beyond the demand, of bodies of different robots, the part and the surroundings
WITHIN_ROBOT: Final = 0.0005  # [m] likewise of bodies of one robot, whose design often sets the distance
AT_SEAM: Final = 0.0005  # [m] likewise of a tool and the part: their distance is that of the path, for any arm
FAR: Final = 0.75  # [m] points on the axes of two arms that are farther apart do not meet


@dataclass(eq=False)
class ScenesByRobot:
    """The scene of a cell in parts, by which robots move what is in them."""

    scene: Scene  # of the cell, with all tools at work

    @cached_property
    def _moved(self) -> dict[str, set[int]]:
        """Pairs that each robot moves."""
        return {robot.name: set(rows_moved_by(self.scene, robot.name)) for robot in self.scene.cell.robots}

    @cached_property
    def _operators(self) -> list[str]:
        """Robots that do not carry the part."""
        return [robot.name for robot in self.scene.cell.robots if robot.name not in self.scene.cell.positioners]

    @cached_property
    def standing(self) -> Scene:
        """The scene without the pairs that operators move."""
        moved = set().union(*(self._moved[name] for name in self._operators))
        return scene_of_rows(self.scene, [row for row in range(len(self.scene.pairs)) if row not in moved])

    @cached_property
    def alone(self) -> dict[str, tuple[Scene, Array]]:
        """By operator, the scene of its pairs but those with other operators at work, and their demands in [m]."""
        return {name: self._demanded(sorted(self._moved[name])) for name in self._operators}

    @cached_property
    def tools(self) -> dict[str, tuple[Scene, Array]]:
        """By operator, likewise of its tool and the part."""
        return {
            name: self._demanded([row for row in sorted(self._moved[name]) if self._is_of_seam(row)])
            for name in self._operators
        }

    def _demanded(self, rows: Sequence[int]) -> tuple[Scene, Array]:
        """The scene of some pairs, and their demands in [m]."""
        return scene_of_rows(self.scene, rows), np.array([self._demand(row) for row in rows])

    @cached_property
    def between(self) -> dict[tuple[str, ...], Scene]:
        """The pairs between two operators."""
        return {
            (a, b): scene_of_rows(self.scene, sorted(self._moved[a] & self._moved[b]))
            for a, b in combinations(sorted(self._operators), 2)
        }

    def _demand(self, row: int) -> float:
        """Distance in [m] that a pair is to keep with its reserve."""
        pair = self.scene.pairs[row]
        bodies = self.scene.bodies[pair.first], self.scene.bodies[pair.second]
        reserve = WITHIN_ROBOT if bodies[0].robot == bodies[1].robot else RESERVE
        reserve = AT_SEAM if self._is_of_seam(row) else reserve
        return (pair.demand if pair.rule is Rule.CLEARANCE else 0.0) + reserve

    def _is_of_seam(self, row: int) -> bool:
        """Whether a pair is a tool and the part."""
        pair = self.scene.pairs[row]
        return {self.scene.bodies[it].kind for it in (pair.first, pair.second)} == {Kind.TOOL, Kind.PART}


@dataclass(eq=False)
class AssignmentClearance:
    """Clearance of modes in one cell.

    Attributes:
        scene: The scene of the cell, with all tools at work.
        home: Stacked homes of all robots in [rad] or [m], shape (nq,).
        conflict: Distance in [m] that two robots at work are to keep.
        answers: What answers for many modes at once, or records it.
        examined: Numbers of modes, and of pairs of modes, that were examined.
    """

    scene: Scene
    home: Array
    stations: Stations
    conflict: float
    answers: Answers = worked_out
    examined: tuple[int, int] = (0, 0)
    _fitting: dict[tuple[object, ...], bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Parts of the scene are made when they are needed, once."""
        self._scenes = ScenesByRobot(self.scene)

    def stacked(self, modes: Mapping[str, Array], station: int) -> Array:
        """Stacked configurations with some robots in configurations of shape (S, n) each and the others at home."""
        cell, count = self.scene.cell, max(map(len, modes.values()), default=1)
        q = np.tile(self.home, (count, 1))
        if self.stations.holder is not None:
            q[:, cell.columns(self.stations.holder)] = self.stations.q[station]
        for name, positions in modes.items():
            q[:, cell.columns(name)] = positions
        return q

    def is_open(self, station: int) -> bool:
        """Whether the part and its holder touch nothing at a station while all operators are at home."""
        return self._scenes.standing.touching(self.stacked({}, station)[0]) is None

    def tool_fits(self, mode: TaskMode) -> bool:
        """Whether its tool keeps its distance from the part: the same for all arms, branches and poses of the part."""
        key = mode.task, mode.robot, mode.spin, mode.directions, mode.path_values
        if key not in self._fitting:
            self._fitting[key] = self._keeps_apart(self._scenes.tools[mode.robot], mode, np.arange(len(mode.q)))
        return self._fitting[key]

    def is_free(self, mode: TaskMode) -> bool:
        """Whether a mode keeps its distance from all that stands, from the part and within its robot."""
        self.examined = self.examined[0] + 1, self.examined[1]
        return self._keeps_apart(self._scenes.alone[mode.robot], mode, spread_rows(len(mode.q), LOOKED_AT))

    def _keeps_apart(self, demanded: tuple[Scene, Array], mode: TaskMode, rows: Indices) -> bool:
        """Whether pairs keep the distances that they demand in [m] at some configurations of a mode."""
        scene, demands = demanded
        near = scene.near(self.stacked({mode.robot: mode.q[rows]}, mode.station), float(demands.max(initial=0.0)))
        return bool(np.all(near.distances >= demands[near.rows]))

    def meet(self, first: TaskMode, second: TaskMode) -> bool:
        """Whether two modes of different robots come too near each other at some combination of their samples."""
        a, b = self._points(first), self._points(second)
        apart = float(np.linalg.norm(a[:, None] - b[None], axis=2).min())
        if apart > FAR:
            return False
        self.examined = self.examined[0], self.examined[1] + 1
        names = tuple(sorted((first.robot, second.robot)))
        scene = self._scenes.between[names]
        picked = {mode.robot: mode.q[spread_rows(len(mode.q), MET)] for mode in (first, second)}
        q = {
            first.robot: np.repeat(picked[first.robot], MET, axis=0),
            second.robot: np.tile(picked[second.robot], (MET, 1)),
        }
        return len(scene.near(self.stacked(q, first.station), self.conflict).rows) > 0

    def _points(self, mode: TaskMode) -> Array:
        """Points on the axes of an arm and its tool tip while it follows a mode, in the world in [m], shape (P, 3)."""
        chain = self.scene.chains[mode.robot]
        q = mode.q[spread_rows(len(mode.q), MET)]
        points = np.concatenate([chain.axis_points(q), chain.tool_poses(q)[:, None, :3, 3]], axis=1)
        return np.concatenate([points, 0.5 * (points[:, 1:] + points[:, :-1])], axis=1).reshape(-1, 3)


def spread_rows(count: int, looked_at: int) -> Indices:
    """Rows spread evenly over some, both ends among them."""
    return np.linspace(0, count - 1, looked_at).round().astype(np.intp)
