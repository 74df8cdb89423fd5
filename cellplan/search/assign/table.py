"""The table of modes: how each robot can do each task at each pose of the part.

A mode is one branch of the arm followed along approach, path and retraction, at one spin of the tool. Filters come in
the order of their cost: the demanded direction of the tool, reach, joint limits, the continuation along the path.
Collisions come last and elsewhere, as they cost most.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse, rotation_about
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.kinematics.spherical_wrist import BRANCHES, SphericalWristArm
from cellplan.search.assign.goals import Stations, TaskGoal

MARGIN: Final = float(np.radians(4.0))  # [rad] that modes stay away from joint limits
LONGEST_MOVE: Final = 0.9  # [rad] of a joint between two poses of a mode: more is another branch, or a singular place
NEWTON_STEPS: Final = 2  # that take rounding in robot files out of the closed form
ARRIVED: Final = 1e-6  # [m, rad] errors of a mode's poses
ALIKE: Final = 0.15  # [rad] modes that begin nearer to each other count as one
MOST_MODES: Final = 6  # of one robot for one task at one station
AT_ONCE: Final = 20_000  # goals: 60 MB

Key = tuple[str, str, int]  # task, robot, station


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskMode:
    """One way in which a robot does a task at a station."""

    task: str
    robot: str
    station: int
    spin: float  # turn of the tool about its axis beside that of the task in [rad]
    q: Array  # configurations before, along and after the path in [rad] or [m], shape (S + 2, n)
    margin: float  # smallest distance from a joint limit in [rad] or [m]


@dataclass(slots=True, kw_only=True, eq=False)
class ModeTable:
    """All modes."""

    modes: dict[Key, list[TaskMode]] = field(default_factory=dict)  # those with the largest margins first
    counts: dict[str, Counter[str]] = field(default_factory=dict)  # goals that were left after each filter, by task

    def note(self, filter_name: str, tasks: Sequence[str]) -> None:
        """Count what a filter left."""
        for task in tasks:
            self.counts.setdefault(task, Counter())[filter_name] += 1

    def robots_of(self, task: str) -> list[str]:
        """Robots that have a mode for a task, each once."""
        return list(dict.fromkeys(robot for name, robot, _ in self.modes if name == task))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeSearch:
    """What modes are looked for among."""

    cell: Cell
    goals: Sequence[TaskGoal]
    stations: Stations
    spins: Array  # turns of the tool about its axis beside those of the tasks in [rad], shape (S,)
    most_lean: float = np.pi  # largest angle in [rad] between the tool's axis and gravity

    def table(self) -> ModeTable:
        """The table of all robots."""
        table = ModeTable()
        for robot in self.cell.robots:
            goals = [goal for goal in self.goals if robot.name in goal.robots]
            if goals and robot.name != self.stations.holder:
                self._fill(table, robot, goals)
        return table

    def _fill(self, table: ModeTable, robot: Robot, goals: Sequence[TaskGoal]) -> None:
        """Add the modes of one robot."""
        follower = BranchFollower.of(robot)
        for goal in goals:
            places = np.flatnonzero(self._leaning(goal))
            table.note("demanded direction of the tool", [goal.name] * (len(places) * len(self.spins)))
            for places_now in np.array_split(places, max(1, -(-len(places) * len(self.spins) // AT_ONCE))):
                self._follow(table, follower, goal, places_now)
        for key, modes in table.modes.items():
            if key[1] == robot.name:
                table.modes[key] = _distinct(sorted(modes, key=lambda mode: -mode.margin))[:MOST_MODES]

    def _leaning(self, goal: TaskGoal) -> Flags:
        """Stations at which the tool keeps the demanded direction all along a task, shape (K,)."""
        down = -(self.stations.X_WP[:, :3, :3] @ goal.X_PT[:, :3, 2].T)[:, 2]
        return np.min(down, axis=1) >= np.cos(self.most_lean) - 1e-9

    def _follow(self, table: ModeTable, follower: "BranchFollower", goal: TaskGoal, places: Indices) -> None:
        """Add what can be followed of one task at some stations."""
        turns = np.tile(np.eye(4), (len(self.spins), 1, 1))
        turns[:, :3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), self.spins)
        X = self.stations.X_WP[places, None, None] @ goal.X_PT[None, None] @ turns[None, :, None]
        result = follower.follow(X.reshape(-1, *X.shape[2:]))
        for name, rows in (("reach", result.reaches), ("joint limits", result.begins)):
            table.note(name, [goal.name] * int(rows.sum()))
        table.note("path", [goal.name] * len(result.q))
        for row, q, margin in zip(result.rows.tolist(), result.q, result.margins.tolist(), strict=True):
            place, spin = int(places[row // len(self.spins)]), float(self.spins[row % len(self.spins)])
            mode = TaskMode(
                task=goal.name, robot=follower.robot.name, station=place, spin=spin, q=q, margin=float(margin)
            )
            table.modes.setdefault((goal.name, follower.robot.name, place), []).append(mode)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FollowedBranches:
    """Branches that were followed along poses; M of them."""

    reaches: Flags  # whether any branch reaches the first pose of a row, shape (N,)
    begins: Flags  # whether one does within the joint limits, shape (N,)
    rows: Indices  # rows of the poses that each belongs to, shape (M,)
    q: Array  # configurations in [rad] or [m], shape (M, S, n)
    margins: Array  # smallest distances from joint limits, shape (M,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BranchFollower:
    """Branches of one arm along tool poses."""

    robot: Robot
    chain: ScrewChain
    arm: SphericalWristArm

    @classmethod
    def of(cls, robot: Robot) -> "BranchFollower":
        """The branches of a robot.

        Raises:
            ValueError: The robot has no spherical wrist.
        """
        arm = SphericalWristArm.of(robot.model)
        if arm is None:
            raise ValueError(f"'{robot.name}' has no spherical wrist")
        return cls(robot=robot, chain=ScrewChain(robot), arm=arm)

    def follow(self, X_WT: Array) -> FollowedBranches:
        """All branches that can be followed along tool poses, shape (N, S, 4, 4)."""
        robot, model = self.robot, self.robot.model
        to_link = inverse(model.X_BF @ robot.tool.X_FT)
        D = inverse(robot.X_WB) @ X_WT @ to_link
        first = self.arm.configurations(D[:, 0])
        reaches = ~np.isnan(first[..., 0])
        first = within_range(model, first)
        within = reaches & self._is_inside(first) & self._faces(first, D[:, 0])
        rows, branches = np.nonzero(within)
        inner = self.arm.configurations(D[rows, 1:].reshape(-1, 4, 4)) if len(rows) else np.zeros((0, BRANCHES, 6))
        path = np.empty((len(rows), X_WT.shape[1], len(model.joints)))
        path[:, 0] = first[rows, branches]
        for sample, q in enumerate(np.moveaxis(inner.reshape(len(rows), X_WT.shape[1] - 1, BRANCHES, -1), 1, 0), 1):
            path[:, sample] = _nearest(path[:, sample - 1], q)
        moves = np.abs(np.diff(path, axis=1)).max(axis=(1, 2), initial=0.0)
        margins = np.minimum(path - model.lower, model.upper - path).min(axis=(1, 2))
        good = (moves < LONGEST_MOVE) & (margins >= MARGIN)
        path, rows, margins = path[good], rows[good], margins[good]
        arrived = self._refined(path, X_WT[rows])
        return FollowedBranches(
            reaches=np.any(reaches, axis=1),
            begins=np.any(within, axis=1),
            rows=rows[arrived],
            q=path[arrived],
            margins=margins[arrived],
        )

    def _is_inside(self, q: Array) -> Flags:
        """Whether configurations keep away from the joint limits."""
        model = self.robot.model
        return np.all((q >= model.lower + MARGIN) & (q <= model.upper - MARGIN), axis=-1)

    def _faces(self, q: Array, D: Array) -> Flags:
        """Whether the first joint turns the arm towards its goal rather than over its back, shape (N, 8)."""
        axis, origin, centre = self.arm.axes[0], self.arm.points[0], self.arm.points[3]
        ahead = (centre - origin) - ((centre - origin) @ axis) * axis
        goal = D[:, :3, :3] @ centre + D[:, :3, 3] - origin
        R = rotation_about(axis, np.nan_to_num(q[..., 0]).ravel()).reshape(*q.shape[:-1], 3, 3)
        return ((R @ ahead) * goal[:, None]).sum(axis=-1) >= 0.0

    def _refined(self, path: Array, X_WT: Array) -> Flags:
        """Take the rounding of robot files out of paths, in place; which of them arrive at all their poses, (M,)."""
        q, goals = path.reshape(-1, path.shape[-1]), X_WT.reshape(-1, 4, 4)
        for step in range(NEWTON_STEPS + 1):
            X, screws = self.chain.tool_motion(q)
            error = _pose_error(X, goals)
            if step < NEWTON_STEPS:
                q += _newton(screws, error)
        return (np.abs(error).max(axis=1) < ARRIVED).reshape(path.shape[:2]).all(axis=1)


def within_range(model: RobotModel, q: Array) -> Array:
    """Configurations turned by whole turns as near to the middle of the joints' ranges as they go."""
    bounded = np.isfinite(model.lower) & np.isfinite(model.upper)
    middle = np.where(bounded, 0.5 * (model.lower + model.upper), 0.0)
    return q - 2.0 * np.pi * np.round((q - middle) / (2.0 * np.pi))


def _nearest(before: Array, q: Array) -> Array:
    """The branches nearest to configurations, shape (M, n), among those of shape (M, 8, n); turns are unwound."""
    q = q - 2.0 * np.pi * np.round((q - before[:, None]) / (2.0 * np.pi))
    moves = np.where(np.isnan(q), np.inf, np.abs(q - before[:, None])).max(axis=-1)
    return q[np.arange(len(q)), np.argmin(moves, axis=1)]


def _pose_error(X: Array, goals: Array) -> Array:
    """Twists at the world's origin that lead from poses to goals, near each other, shape (N, 6)."""
    R, p = X[:, :3, :3], X[:, :3, 3]
    S = goals[:, :3, :3] @ np.swapaxes(R, 1, 2)
    turn = 0.5 * np.stack([S[:, 2, 1] - S[:, 1, 2], S[:, 0, 2] - S[:, 2, 0], S[:, 1, 0] - S[:, 0, 1]], axis=1)
    return np.concatenate([goals[:, :3, 3] - p + np.cross(p, turn), turn], axis=1)


def _newton(screws: Array, error: Array) -> Array:
    """Newton moves of the joints, shape (N, n)."""
    J_T = np.swapaxes(screws, 1, 2)
    normal = screws @ J_T + 1e-12 * np.eye(6)
    return (J_T @ np.linalg.solve(normal, error[:, :, None]))[..., 0]


def _distinct(modes: Sequence[TaskMode]) -> list[TaskMode]:
    """Modes that do not begin alike."""
    distinct: list[TaskMode] = []
    for mode in modes:
        if all(np.abs(mode.q[0] - other.q[0]).max() > ALIKE for other in distinct):
            distinct.append(mode)
    return distinct
