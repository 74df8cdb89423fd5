"""Start branches: the configurations of each robot from which a start of the whole cell can be put together."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, inverse, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import Frame, Task
from cellplan.planning.start.given import is_off, leaning_angle, part_pose, tool_distance
from cellplan.planning.start.inverse_kinematics import (
    constrained_rank,
    finite_limits,
    joint_margin_shares,
    random_configurations,
    reaching_configurations,
    smallest_singular_values,
    within_limits,
)
from cellplan.planning.start.near_ties import best_first
from cellplan.planning.start.seeds import seeded
from cellplan.planning.start.trial_motion import StartTrials
from cellplan.scene.kinematics.screw_chain import Chains

MOST_CANDIDATES: Final = 24  # configurations of a robot, or of the cell, that are considered again
MOST_GOALS: Final = 6  # goals of a robot that are considered again
SEEDS: Final = 48  # random starts of the inverse kinematics per robot and place; finds all 8 branches of a 6-axis arm
SEEDS_PER_HOLDER: Final = 16  # the same when many configurations of the positioner are to be tried
HOLDER_DRAWS: Final = 1500  # configurations of the positioner that are drawn when its start is to be found as well
HOLDER_POSTURES: Final = 120  # the most promising of these, which are tried
HOLDER_RANGE: Final = 0.7  # share of each joint range that they are drawn from, so that room is left to move
TRIED_ALONE: Final = 8  # branches of each operator that are tried out without the other operators
BRANCHES: Final = 4  # the best of these, which are combined
ALL_AXES: Final = 6  # [-] components of a grasp that leaves nothing free
LEAN: Final = 0.5  # [-] of the cone by which an axis leans at a start that is not reached with the desired one
SIDES: Final = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.pi / 4.0 * np.arange(8)])  # to which it leans then
COMFORTABLE: Final = 0.1  # smallest singular value above which more manipulability is worth no more

Branch = tuple[float, Array]  # what a configuration is worth, and the configuration, shape (n,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissedGoal:
    """Where a tool was desired: a task or grasp, the desired tip, and the frame that it is given in, in the world."""

    relation: Relation
    X_PT: Array
    X_WP: Array


@dataclass(slots=True, kw_only=True)
class Failures:
    """What the search has seen of each robot, by name."""

    # configurations within the limits that reach a goal, each with that of the positioner
    arrived: dict[str, list[tuple[Array, Array | None]]] = field(default_factory=dict)
    missed: dict[str, list[MissedGoal]] = field(default_factory=dict)  # goals that no configuration reaches
    misses: dict[str, int] = field(default_factory=dict)  # how many such goals there were
    beyond: dict[str, list[Array]] = field(default_factory=dict)  # reaching a goal with a joint out of its limits
    # smallest distance in [m] and [rad] of a given start from its task or grasp, as the part was held
    off: dict[str, tuple[float, float]] = field(default_factory=dict)
    touching: list[Array] = field(default_factory=list)  # configurations of the whole cell in which something touches

    def reached(self, robot: str, q: Array, holder_configuration: Array | None) -> None:
        """Keep configurations of a robot, shape (K, n), that reach its goal with the positioner at one of its own."""
        arrived = self.arrived.setdefault(robot, [])
        arrived += [(configuration, holder_configuration) for configuration in q[: MOST_CANDIDATES - len(arrived)]]

    def unreached(self, robot: str, goal: MissedGoal, *, beyond: Array) -> None:
        """Keep a goal that a robot does not reach, and configurations that do outside its limits, shape (K, n)."""
        self.misses[robot] = self.misses.get(robot, 0) + 1
        goals = self.missed.setdefault(robot, [])
        if len(goals) < MOST_GOALS:
            goals.append(goal)
        outside = self.beyond.setdefault(robot, [])
        outside += list(beyond[: MOST_CANDIDATES - len(outside)])

    def off_path(self, robot: str, distance: tuple[float, float]) -> None:
        """Keep the distance of a given start from its task if it is the smallest so far."""
        self.misses[robot] = self.misses.get(robot, 0) + 1
        self.off[robot] = min(distance, self.off.get(robot, (np.inf, np.inf)))

    def touched(self, q: Array) -> None:
        """Keep a configuration of the whole cell, shape (nq,), in which something touches."""
        if len(self.touching) < MOST_CANDIDATES:
            self.touching.append(q)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StartSearch:
    """What all parts of the search for a start use."""

    cell: Cell  # the cell in the order of names
    chains: Chains  # kinematic chain of each robot, by name
    paths: Mapping[str, ClockedPath]  # path of every task on the common clock, by task name
    trials: StartTrials  # the coarse clock on which motions are tried, and the bodies
    random: Mapping[str, np.random.Generator]  # random numbers of each robot, by name
    failures: Failures  # why configurations were dropped

    @property
    def is_holder_open(self) -> bool:
        """Whether the start of the robot that carries the part is to be found as well."""
        return any(self.cell.robot(name).start is None for name in self.cell.positioners[:1])

    def X_PT_start(self, relation: Relation) -> Array:
        """Where a tool is to be at the start: on its task, or on its grasp."""
        return relation.X_PT if isinstance(relation, Grasp) else self.paths[relation.name].toolpath.X_PT_start

    def random_configurations(self, robot: Robot, count: int) -> Array:
        """Configurations of a robot drawn from its own random numbers, shape (count, n)."""
        return random_configurations(robot.model, count, self.random[robot.name])


def holder_configurations(search: StartSearch) -> list[Array | None]:
    """Configurations of the positioner to try: the given one, those that suit a given operator, or drawn ones."""
    cell = search.cell
    if not cell.positioners:
        return [None]
    holder = cell.robot(cell.positioners[0])
    if holder.start is not None:
        return [holder.start]
    configurations = _configurations_of_holder(search, holder)
    search.failures.reached(holder.name, configurations, None)
    return list(configurations)


def _configurations_of_holder(search: StartSearch, holder: Robot) -> Array:
    """Configurations of a positioner whose start is to be found, best first, shape (K, n)."""
    cell = search.cell
    for relation in cell.relations:
        if relation.robot == holder.name:
            return _configurations_at(search, holder, relation, search.X_PT_start(relation))
    for relation in cell.relations:
        operator = cell.robot(relation.robot)
        if operator.start is not None and relation.relative_to is Frame.PART:
            return _configurations_meeting(search, relation, operator.start)
    for relation in cell.relations:
        if relation.relative_to is Frame.PART and _is_deficient(search, relation):
            configurations = _configurations_of_pairs(search, holder, relation)
            if len(configurations):
                return configurations
    return _promising_configurations(search, holder)


def branches_of(search: StartSearch, robot: Robot, holder_configuration: Array | None) -> list[Branch]:
    """Configurations of one robot with what they are worth, best first; one entry when there is no choice."""
    cell = search.cell
    if holder_configuration is not None and robot.name == cell.positioners[0]:
        return [(np.inf, holder_configuration)]
    relation = next((relation for relation in cell.relations if relation.robot == robot.name), None)
    if robot.start is not None:
        start = robot.start if relation is None else _placed(search, robot, relation, holder_configuration)
        return [] if start is None else [(np.inf, start)]
    if relation is None:
        neutral = np.clip(np.zeros(len(robot.model.joints)), *finite_limits(robot.model))
        neutral = neutral if robot.home is None else robot.home
        search.failures.reached(robot.name, neutral[None], holder_configuration)
        return [(np.inf, neutral)]
    scored = _scored_branches(search, robot, relation, holder_configuration)
    if isinstance(relation, Grasp):
        return [*_as_stated(search, robot, relation, holder_configuration), *scored[:BRANCHES]]
    if search.is_holder_open:
        return scored[:BRANCHES]
    return _tried_alone(search, relation, scored[:TRIED_ALONE], holder_configuration)[:BRANCHES]


def _placed(search: StartSearch, robot: Robot, relation: Relation, holder_configuration: Array | None) -> Array | None:
    """A given start, moved to its task as the positioner, which is searched, holds the part; None where too far off."""
    if not search.is_holder_open or relation.relative_to is not Frame.PART or robot.start is None:
        return robot.start
    if isinstance(relation, Task) and relation.settle > 0.0:
        return robot.start
    X_WP = part_pose(search.cell, holder_configuration)
    if X_WP is None:
        return robot.start
    chain, X_PT = search.chains[robot.name], search.X_PT_start(relation)
    distance = tool_distance(chain, relation, robot.start, X_PT, X_WR=X_WP)
    if not is_off(search.cell, relation, distance):
        return robot.start
    start = seeded(chain, relation, robot, X_PT, X_WR=X_WP)
    if start is None:
        search.failures.off_path(robot.name, distance)
    return start


def _tried_alone(
    search: StartSearch, task: Task, branches: list[Branch], holder_configuration: Array | None
) -> list[Branch]:
    """Branches of an operator by the shares that the motion from each leaves free, best first."""
    if not branches:
        return []
    shares = np.array([search.trials.judge_alone(task, q, holder_configuration) for _, q in branches])
    order = best_first(np.column_stack([shares, np.array([q for _, q in branches])]))
    return [(float(shares[index, 0]), branches[index][1]) for index in order]


def _as_stated(search: StartSearch, robot: Robot, grasp: Grasp, holder_configuration: Array | None) -> list[Branch]:
    """Configurations that bring a tool to its grasp just as it is stated, where that leaves components free.

    They are worth more than all others: with any other lean a tool may well dig into the part.
    """
    X_WP = part_pose(search.cell, holder_configuration)
    if len(grasp.axes) == ALL_AXES or X_WP is None:
        return []
    closed = replace(grasp, axes=tuple(range(ALL_AXES)))
    seeds = search.random_configurations(robot, SEEDS_PER_HOLDER if search.is_holder_open else SEEDS)
    chain = search.chains[robot.name]
    q = within_limits(robot.model, reaching_configurations(chain, closed, grasp.X_PT, X_WP=X_WP, seeds=seeds))
    margins = np.sort(joint_margin_shares(robot.model, q), axis=1)
    order = best_first(np.column_stack([margins, q]))
    return [(1.0 + float(margins[index, 0]), q[index]) for index in order[:BRANCHES]]


def _scored_branches(
    search: StartSearch, robot: Robot, relation: Relation, holder_configuration: Array | None
) -> list[Branch]:
    """Configurations that bring a tool to the start of its task or to its grasp, by joint margin times manipulability.

    A tool whose axis may lean does so where no configuration has the desired axis. Where two are worth the same, the
    joints with the next smaller margins decide, and then the configuration itself.
    """
    X_WP = part_pose(search.cell, holder_configuration) if relation.relative_to is Frame.PART else np.eye(4)
    if X_WP is None:
        return []
    X_PT = search.X_PT_start(relation)
    chain = search.chains[robot.name]
    seeds = search.random_configurations(robot, SEEDS_PER_HOLDER if search.is_holder_open else SEEDS)
    configurations = reaching_configurations(chain, relation, X_PT, X_WP=X_WP, seeds=seeds)
    q = within_limits(robot.model, configurations)
    lean = LEAN * leaning_angle(search.cell, relation)
    if lean and not len(q):
        leaned = X_PT @ pose_from(rotation_exp(lean * SIDES), np.zeros((len(SIDES), 3)))
        arrived = [reaching_configurations(chain, relation, X, X_WP=X_WP, seeds=seeds) for X in leaned]
        q = within_limits(robot.model, np.concatenate(arrived))
    if not len(q):
        search.failures.unreached(
            robot.name, MissedGoal(relation=relation, X_PT=X_PT, X_WP=X_WP), beyond=configurations
        )
        return []
    manipulability = np.minimum(1.0, smallest_singular_values(chain, relation, X_PT, q) / COMFORTABLE)
    scores = np.sort(joint_margin_shares(robot.model, q), axis=1) * manipulability[:, None]
    order = best_first(np.column_stack([scores, q]))
    search.failures.reached(robot.name, q[order], holder_configuration)
    return [(float(scores[index, 0]), q[index]) for index in order]


def _promising_configurations(search: StartSearch, holder: Robot) -> Array:
    """Configurations of the positioner that hold the part where the tools of operators like to be, best first."""
    cell = search.cell
    lower, upper = finite_limits(holder.model)
    middle = 0.5 * (lower + upper)
    q = middle + HOLDER_RANGE * (search.random_configurations(holder, HOLDER_DRAWS) - middle)
    X_WP = search.chains[holder.name].tool_poses(q) @ cell.part.X_CP
    awkwardness = np.zeros(len(q))
    for relation in cell.relations:
        operator = cell.robot(relation.robot)
        usual = search.chains[relation.robot].tool_poses(search.random_configurations(operator, HOLDER_DRAWS))
        goal = (X_WP if relation.relative_to is Frame.PART else np.eye(4)) @ search.X_PT_start(relation)
        base = operator.X_WB[:3, 3]
        awkwardness = np.maximum(awkwardness, _awkwardness(goal, usual, base))
    return q[best_first(np.column_stack([-awkwardness, q]))[:HOLDER_POSTURES]]


def _awkwardness(goal: Array, usual: Array, base: Array) -> Array:
    """How far tool goals, shape (N, 4, 4), are from where and how a robot's tool usually is, shape (N,).

    The measure is the distance from the base in standard deviations of the usual distance, and the cosine between the
    tool axis and the direction away from the base.
    """
    away, usual_away = goal[:, :3, 3] - base, usual[:, :3, 3] - base
    distance, usual_distance = np.linalg.norm(away, axis=1), np.linalg.norm(usual_away, axis=1)
    spread = max(float(usual_distance.std()), 1e-6)  # a robot that cannot move has none
    outward = np.sum(goal[:, :3, 2] * away, axis=1) / np.maximum(distance, 1e-9)
    return np.abs(distance - np.median(usual_distance)) / spread + (1.0 - outward)


def _configurations_meeting(search: StartSearch, relation: Relation, operator_start: Array) -> Array:
    """Configurations of the positioner that bring the start of a task, or a grasp, to a tool that stands."""
    cell, chains = search.cell, search.chains
    holder = cell.robot(cell.positioners[0])
    X_WT = chains[relation.robot].tool_poses(operator_start[None])[0]
    X_W_holder = X_WT @ inverse(search.X_PT_start(relation)) @ cell.part.held_by[0].X_PT
    return _configurations_at(search, holder, cell.part.held_by[0], X_W_holder)


def _is_deficient(search: StartSearch, relation: Relation) -> bool:
    """Whether a robot alone has too few axes for its task, so that hardly any place of the part suits it."""
    robot, X_PT = search.cell.robot(relation.robot), search.X_PT_start(relation)
    q = random_configurations(robot.model, SEEDS_PER_HOLDER, np.random.default_rng(search.cell.solver.seed))
    return constrained_rank(search.chains[robot.name], relation, X_PT, q) < len(relation.axes)


def _configurations_of_pairs(search: StartSearch, holder: Robot, relation: Relation) -> Array:
    """Configurations of the positioner that bring the part to where the tool of an operator happens to be."""
    operator = search.cell.robot(relation.robot)
    lower, upper = finite_limits(operator.model)
    middle = 0.5 * (lower + upper)
    samples = middle + HOLDER_RANGE * (search.random_configurations(operator, HOLDER_POSTURES) - middle)
    met = [_configurations_meeting(search, relation, q)[:1] for q in samples]
    return np.concatenate([*met, np.empty((0, len(holder.model.joints)))])


def _configurations_at(search: StartSearch, holder: Robot, relation: Relation, X_W_holder: Array) -> Array:
    """Configurations of the positioner that bring its tool to a place in the world, those with most margin first."""
    seeds = search.random_configurations(holder, SEEDS)
    configurations = reaching_configurations(
        search.chains[holder.name], relation, X_W_holder, X_WP=np.eye(4), seeds=seeds
    )
    inside = within_limits(holder.model, configurations)
    if not len(inside):
        goal = MissedGoal(relation=relation, X_PT=X_W_holder, X_WP=np.eye(4))
        search.failures.unreached(holder.name, goal, beyond=configurations)
        return inside
    order = best_first(np.column_stack([np.sort(joint_margin_shares(holder.model, inside), axis=1), inside]))
    return inside[order]
