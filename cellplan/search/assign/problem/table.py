"""The table of modes: how each robot can do each task at each pose of the part.

A mode is one branch of the arm followed along approach, path and retraction, at one spin of the tool. Filters come in
the order of their cost: torch and weld position, reach, joint limits, the continuation along the path.
Collisions come last and elsewhere, as they cost most.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse, rotation_about, rotation_vector
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.seeds import generator
from cellplan.planning.start.inverse_kinematics import damped_move, on_nearest_turns, random_configurations
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.kinematics.spherical_wrist import SphericalWristArm
from cellplan.search.assign.problem.goals import Stations, TaskGoal

MARGIN: Final = float(np.radians(4.0))  # [rad] that modes stay away from joint limits
LONGEST_MOVE: Final = 0.9  # [rad] of a joint between two poses of a mode: more is another branch, or a singular place
FOLLOWING: Final = 4  # Newton moves from one pose of a mode to the next
SEARCHING: Final = 30  # likewise from a seed
SEEDS: Final = 24  # configurations that branches are searched from where there is no closed form
ARRIVED: Final = 1e-6  # [m, rad] errors of a mode's poses
NEAR_START: Final = 0.02  # [rad, m] a mode that begins so near to a given start is the one that is meant
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
    path_values: tuple[tuple[str, object], ...] = ()  # those of its goal
    directions: tuple[bool, ...] = (False, True)  # whether it may be done as written, and from its end to its begin


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
    tool_fits: Callable[[TaskMode], bool] = lambda _: True  # whether the tool of a mode keeps away from the part

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
            allowed = self.stations.allowed(goal)
            possible = {False: not goal.is_mirrored, True: goal.is_reversible or goal.is_mirrored}
            allowed = {is_reversed: flags & possible[is_reversed] for is_reversed, flags in allowed.items()}
            places = np.flatnonzero(allowed[False] | allowed[True])
            spins = self.spins if goal.is_spin_free else np.zeros(1)
            table.note("torch and weld position", [goal.name] * (len(places) * len(spins)))
            for places_now in np.array_split(places, max(1, -(-len(places) * len(spins) // AT_ONCE))):
                self._follow(table, follower, goal, places_now, allowed)
        for key, modes in table.modes.items():
            if key[1] == robot.name:
                table.modes[key] = _distinct(sorted(modes, key=lambda mode: -mode.margin))[:MOST_MODES]

    def _follow(
        self,
        table: ModeTable,
        follower: "BranchFollower",
        goal: TaskGoal,
        places: Indices,
        allowed: Mapping[bool, Flags],
    ) -> None:
        """Add what can be followed of one task at some stations; in which directions it may be done there is given."""
        spins = self.spins if goal.is_spin_free else np.zeros(1)
        turns = np.tile(np.eye(4), (len(spins), 1, 1))
        turns[:, :3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), spins)
        X = self.stations.of_samples(places)[:, None] @ goal.X_PT @ turns[None, :, None]
        result = follower.follow(X.reshape(-1, *X.shape[2:]))
        for name, rows in (("reach", result.reaches), ("joint limits", result.begins)):
            table.note(name, [goal.name] * int(rows.sum()))
        is_given = np.ones(len(result.q), dtype=bool)
        if goal.start_q is not None:
            is_given = np.abs(result.q[:, 0] - goal.start_q).max(axis=1) < NEAR_START
        table.note("path", [goal.name] * int(is_given.sum()))
        bears = np.all([is_given, *(it.holds(result.q).all(axis=1) for it in follower.robot.joint_sums)], axis=0)
        table.note("sums of joints", [goal.name] * int(bears.sum()))
        for index in np.flatnonzero(bears).tolist():
            row = int(result.rows[index])
            place, spin = int(places[row // len(spins)]), float(spins[row % len(spins)])
            mode = TaskMode(
                task=goal.name,
                robot=follower.robot.name,
                station=place,
                spin=spin,
                q=result.q[index],
                margin=float(result.margins[index]),
                path_values=goal.path_values,
                directions=tuple(it for it in (False, True) if allowed[it][place]),
            )
            if self.tool_fits(mode):
                table.note("tool by the part", [goal.name])
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
    """Branches of one arm along tool poses: in closed form where its wrist allows it, else from many starts."""

    robot: Robot
    chain: ScrewChain
    arm: SphericalWristArm | None
    seeds: Array  # configurations that a search for branches starts from, shape (B, n)

    @classmethod
    def of(cls, robot: Robot) -> "BranchFollower":
        """The branches of a robot."""
        model = robot.model
        seeds = random_configurations(model, SEEDS, generator(f"modes of {robot.name}", 0))
        return cls(robot=robot, chain=ScrewChain(robot), arm=SphericalWristArm.of(model), seeds=seeds)

    def follow(self, X_WT: Array) -> FollowedBranches:
        """All branches that can be followed along tool poses, shape (N, S, 4, 4)."""
        model, count = self.robot.model, len(X_WT)
        rows, q = self._searched(X_WT[:, 0]) if self.arm is None else self._in_closed_form(self.arm, X_WT[:, 0])
        reaches = np.bincount(rows, minlength=count) > 0
        q = on_nearest_turns(model, q)
        inside = np.all((q >= model.lower + MARGIN) & (q <= model.upper - MARGIN), axis=1)
        rows, q = rows[inside], q[inside]
        path = np.empty((len(rows), X_WT.shape[1], len(model.joints)))
        followed = np.ones(len(rows), dtype=bool)
        for sample in range(X_WT.shape[1]):
            before, goals = q, X_WT[rows, sample]
            q, error = self._newton(q, goals, FOLLOWING)
            followed &= (error < ARRIVED) & (np.abs(q - before).max(axis=1, initial=0.0) < LONGEST_MOVE)
            path[:, sample] = q
        margins = np.minimum(path - model.lower, model.upper - path).min(axis=(1, 2), initial=np.inf)
        good = followed & (margins >= MARGIN)
        return FollowedBranches(
            reaches=reaches,
            begins=np.bincount(rows, minlength=count) > 0,
            rows=rows[good],
            q=path[good],
            margins=margins[good],
        )

    def _in_closed_form(self, arm: SphericalWristArm, X_WT: Array) -> tuple[Indices, Array]:
        """All branches at tool poses, shape (N, 4, 4), none with the arm over its back; rows and joints, (M, 6)."""
        robot = self.robot
        D = inverse(robot.X_WB) @ X_WT @ inverse(robot.model.X_BF @ robot.tool.X_FT)
        q = arm.configurations(D)
        axis, origin, centre = arm.axes[0], arm.points[0], arm.points[3]
        ahead = (centre - origin) - ((centre - origin) @ axis) * axis
        goal = D[:, :3, :3] @ centre + D[:, :3, 3] - origin
        R = rotation_about(axis, np.nan_to_num(q[..., 0]).ravel()).reshape(*q.shape[:2], 3, 3)
        rows, branches = np.nonzero(~np.isnan(q[..., 0]) & (((R @ ahead) * goal[:, None]).sum(axis=-1) >= 0.0))
        return rows, q[rows, branches]

    def _searched(self, X_WT: Array) -> tuple[Indices, Array]:
        """Branches at tool poses, shape (N, 4, 4), to which the seeds lead; their rows, and joints of shape (M, n)."""
        rows = np.repeat(np.arange(len(X_WT)), len(self.seeds))
        q, error = self._newton(np.tile(self.seeds, (len(X_WT), 1)), X_WT[rows], SEARCHING)
        rows, q = rows[error < ARRIVED], on_nearest_turns(self.robot.model, q[error < ARRIVED])
        alike = np.column_stack([rows, np.round(q / ALIKE)])
        _, first = np.unique(alike, axis=0, return_index=True)
        return rows[first], q[first]

    def _newton(self, q: Array, X_WT: Array, iterations: int) -> tuple[Array, Array]:
        """Damped Newton moves to tool poses, shape (N, 4, 4); joints, and the largest errors in [m] or [rad], (N,)."""
        for iteration in range(iterations + 1):
            X, screws = self.chain.tool_motion(q)
            p = X[:, :3, 3]
            turn = rotation_vector(X_WT[:, :3, :3] @ np.swapaxes(X[:, :3, :3], 1, 2))
            shift = X_WT[:, :3, 3] - p
            if iteration < iterations:
                twist = np.concatenate([shift + np.cross(p, turn), turn], axis=1)
                q = q + damped_move(screws, twist)
        return q, np.abs(np.concatenate([shift, turn], axis=1)).max(axis=1, initial=0.0)


def _distinct(modes: Sequence[TaskMode]) -> list[TaskMode]:
    """Modes that do not begin alike."""
    distinct: list[TaskMode] = []
    for mode in modes:
        if all(np.abs(mode.q[0] - other.q[0]).max() > ALIKE for other in distinct):
            distinct.append(mode)
    return distinct
