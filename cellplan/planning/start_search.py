"""Start postures that are to be found: several inverse-kinematics branches per robot, tried out, the best one kept."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.errors import StartNotFoundError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell import Cell, Grasp, Relation, Robot
from cellplan.model.progress import Progress, silent
from cellplan.model.task import Frame
from cellplan.model.toolpath import Toolpath
from cellplan.planning.combinations import Picks, best_combinations
from cellplan.planning.given_starts import part_pose, start_place
from cellplan.planning.inverse_kinematics import (
    finite_limits,
    margin_shares,
    random_postures,
    reaching_postures,
    smallest_singular_values,
    within_limits,
)
from cellplan.planning.start_trials import StartTrials
from cellplan.scene.scene import Scene

SEEDS: Final = 48  # random starts of the inverse kinematics per robot and place; finds all 8 branches of a 6-axis arm
SEEDS_PER_HOLDER: Final = 16  # the same when many postures of the positioner are to be tried
HOLDER_DRAWS: Final = 1500  # postures of the positioner that are drawn when its start is to be found as well
HOLDER_POSTURES: Final = 60  # the most promising of these, which are tried
HOLDER_RANGE: Final = 0.7  # share of each joint range that they are drawn from, so that room is left to move
CANDIDATES: Final = 10  # whole-cell postures that are tried out
TRIED_ALONE: Final = 8  # branches of each operator that are tried out without the other operators
BRANCHES: Final = 4  # the best of these, which are combined
COMBINATIONS_PER_HOLDER: Final = 3  # candidates taken from one posture of the positioner, so that several are compared
COMFORTABLE: Final = 0.1  # smallest singular value above which more manipulability is worth no more


@dataclass(slots=True, kw_only=True)
class _Search:
    """What all parts of the search use, and why postures were dropped, for the message when none is left."""

    scene: Scene
    toolpaths: Mapping[str, Toolpath]
    trials: StartTrials
    rng: np.random.Generator
    unreached: dict[str, int] = field(default_factory=dict)
    touching: dict[tuple[str, str], int] = field(default_factory=dict)

    @property
    def is_holder_open(self) -> bool:
        """Whether the start posture of the robot that carries the part is to be found as well."""
        return any(self.scene.cell.robot(name).start is None for name in self.scene.cell.positioners[:1])

    def X_PT_start(self, relation: Relation) -> Array:
        """Where a tool is to be at the start: on its task, or on its grasp."""
        return relation.X_PT if isinstance(relation, Grasp) else self.toolpaths[relation.name].X_PT_start


def find_start(scene: Scene, toolpaths: Mapping[str, Toolpath], *, progress: Progress = silent) -> Array:
    """Stacked start posture of the whole cell; given postures are kept, the others chosen.

    Candidates put every tool on the start of its task, within limits and without collision. They are ranked by joint
    margin and manipulability; the best are tried out on a coarse clock and the one whose motion keeps the largest share
    of its joint ranges and speeds free is taken. The search is seeded by ``solver.seed``.

    Args:
        scene: The cell made computable.
        toolpaths: Toolpath of every task, by task name.
        progress: Who wants to know how far it is.

    Raises:
        StartNotFoundError: No posture reaches all tasks within limits and without collision.
    """
    cell = scene.cell
    if all(robot.start is not None for robot in cell.robots):
        return np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    search = _Search(
        scene=scene,
        toolpaths=toolpaths,
        trials=StartTrials(scene, toolpaths),
        rng=np.random.default_rng(cell.solver.seed),
    )
    candidates = _candidates(search, progress)
    judged = []
    for index, candidate in enumerate(candidates):
        progress("trying start postures", index / len(candidates))
        judged.append(search.trials.judge(candidate))
    best = int(np.argmax([quality for quality, _ in judged]))
    return judged[best][1]


def _candidates(search: _Search, progress: Progress) -> list[Array]:
    """Whole-cell postures that reach every task without touching, best first within each posture of the positioner."""
    found: list[Array] = []
    holder_postures = _holder_postures(search)
    for index, holder_posture in enumerate(holder_postures):
        progress("searching start postures", index / len(holder_postures))
        room = CANDIDATES if len(holder_postures) == 1 else COMBINATIONS_PER_HOLDER
        found += _combinations(search, holder_posture, room)
        if len(found) >= CANDIDATES:
            break
    if not found:
        raise StartNotFoundError(_why_nothing(search, len(holder_postures)))
    return found[:CANDIDATES]


def _holder_postures(search: _Search) -> list[Array | None]:
    """Postures of the positioner to try: the given one, those that suit a given operator, or drawn ones."""
    cell = search.scene.cell
    if not cell.positioners:
        return [None]
    holder = cell.robot(cell.positioners[0])
    if holder.start is not None:
        return [holder.start]
    for relation in cell.relations:
        if relation.robot == holder.name:
            return list(_postures_at(search, holder, relation, search.X_PT_start(relation)))
    for relation in cell.relations:
        operator = cell.robot(relation.robot)
        if operator.start is not None and relation.relative_to is Frame.PART:
            return list(_postures_meeting(search, relation, operator.start))
    return list(_promising_postures(search, holder))


def _promising_postures(search: _Search, holder: Robot) -> Array:
    """Postures of the positioner that hold the part where the operators' tools like to be, best first."""
    scene, rng = search.scene, search.rng
    lower, upper = finite_limits(holder.model)
    middle = 0.5 * (lower + upper)
    q = middle + HOLDER_RANGE * (random_postures(holder.model, HOLDER_DRAWS, rng) - middle)
    X_WP = scene.chains[holder.name].tool_poses(q) @ inverse(scene.cell.part.held_by[0].X_PT)
    awkwardness = np.zeros(len(q))
    for relation in scene.cell.relations:
        operator = scene.cell.robot(relation.robot)
        usual = scene.chains[relation.robot].tool_poses(random_postures(operator.model, HOLDER_DRAWS, rng))
        goal = (X_WP if relation.relative_to is Frame.PART else np.eye(4)) @ search.X_PT_start(relation)
        base = operator.X_WB[:3, 3]
        awkwardness = np.maximum(awkwardness, _awkwardness(goal, usual, base))
    order: Array = q[np.argsort(awkwardness, kind="stable")[:HOLDER_POSTURES]]
    return order


def _awkwardness(goal: Array, usual: Array, base: Array) -> Array:
    """How far tool goals, shape (N, 4, 4), are from where and how a robot's tool usually is, shape (N,).

    The measure is the distance from the base in standard deviations of the usual distance, and the cosine between the
    tool axis and the direction away from the base.
    """
    away, usual_away = goal[:, :3, 3] - base, usual[:, :3, 3] - base
    distance, usual_distance = np.linalg.norm(away, axis=1), np.linalg.norm(usual_away, axis=1)
    spread = max(float(usual_distance.std()), 1e-6)  # a robot that cannot move has none
    outward = np.sum(goal[:, :3, 2] * away, axis=1) / np.maximum(distance, 1e-9)
    measure: Array = np.abs(distance - np.median(usual_distance)) / spread + (1.0 - outward)
    return measure


def _postures_meeting(search: _Search, relation: Relation, operator_start: Array) -> Array:
    """Postures of the positioner that bring the start of a task, or a grasp, to the tool of a robot that stands."""
    cell, chains = search.scene.cell, search.scene.chains
    holder = cell.robot(cell.positioners[0])
    X_WT = chains[relation.robot].tool_poses(operator_start[None])[0]
    X_W_holder = X_WT @ inverse(search.X_PT_start(relation)) @ cell.part.held_by[0].X_PT
    return _postures_at(search, holder, cell.part.held_by[0], X_W_holder)


def _postures_at(search: _Search, holder: Robot, relation: Relation, X_W_holder: Array) -> Array:
    """Postures of the positioner that bring its tool to a place in the world, those with most joint margin first."""
    seeds = random_postures(holder.model, SEEDS, search.rng)
    chain = search.scene.chains[holder.name]
    q = reaching_postures(chain, relation, X_W_holder, X_WP=np.eye(4), seeds=seeds)
    inside = within_limits(holder.model, q)
    best_first: Array = inside[np.argsort(-margin_shares(holder.model, inside), kind="stable")]
    return best_first


def _combinations(search: _Search, holder_posture: Array | None, room: int) -> list[Array]:
    """Whole-cell postures for one posture of the positioner, best first, that touch nothing."""
    cell = search.scene.cell
    choices: list[list[tuple[float, Array]]] = []
    for robot in cell.robots:
        branches = _branches(search, robot, holder_posture)
        if not branches:
            search.unreached[robot.name] = search.unreached.get(robot.name, 0) + 1
            return []
        choices.append(branches)
    found: list[Array] = []
    blocked: set[tuple[tuple[int, int], ...]] = set()

    def collides(picks: Picks) -> bool:
        return any(all(robot < len(picks) and picks[robot] == pick for robot, pick in known) for known in blocked)

    for picks in best_combinations([[score for score, _ in branches] for branches in choices], collides):
        q = np.concatenate([branches[pick][1] for branches, pick in zip(choices, picks, strict=True)])
        pair = search.scene.touching(q, among=search.trials.open_pairs)
        if pair is None:
            found.append(q)
        else:
            search.touching[pair] = search.touching.get(pair, 0) + 1
            blocked.add(_culprits(cell, pair, picks))
        if len(found) == room or () in blocked:
            break
    return found


def _culprits(cell: Cell, pair: tuple[str, str], picks: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
    """Robots of a pair that touches with the branches they are on: no other robot can keep these from touching."""
    owners = {name.split("/")[0] for name in pair}
    return tuple(
        (index, picks[index])
        for index, robot in enumerate(cell.robots)
        if robot.name in owners or (robot.name in cell.positioners[:1] and "part" in owners)
    )


def _branches(search: _Search, robot: Robot, holder_posture: Array | None) -> list[tuple[float, Array]]:
    """Postures of one robot with their scores, best first; one entry when there is no choice."""
    cell = search.scene.cell
    if holder_posture is not None and robot.name == cell.positioners[0]:
        return [(np.inf, holder_posture)]
    if robot.start is not None:
        return [(np.inf, robot.start)]
    task = next((relation for relation in cell.relations if relation.robot == robot.name), None)
    if task is None:
        anywhere = np.clip(np.zeros(len(robot.model.joints)), *finite_limits(robot.model))
        return [(np.inf, anywhere if robot.home is None else robot.home)]
    scored = _scored_branches(search, robot, task, holder_posture)
    if search.is_holder_open or isinstance(task, Grasp):
        return scored[:BRANCHES]
    judged = [(search.trials.judge_alone(task, q, holder_posture), q) for _, q in scored[:TRIED_ALONE]]
    judged.sort(key=lambda branch: -branch[0])
    return judged[:BRANCHES]


def _scored_branches(
    search: _Search, robot: Robot, task: Relation, holder_posture: Array | None
) -> list[tuple[float, Array]]:
    """Postures that bring a tool to the start of its task or to its grasp, by joint margin times manipulability."""
    X_WP = part_pose(search.scene.cell, holder_posture) if task.relative_to is Frame.PART else np.eye(4)
    if X_WP is None:
        return []
    X_PT = search.X_PT_start(task)
    chain = search.scene.chains[robot.name]
    seeds = random_postures(robot.model, SEEDS_PER_HOLDER if search.is_holder_open else SEEDS, search.rng)
    q = within_limits(robot.model, reaching_postures(chain, task, X_PT, X_WP=X_WP, seeds=seeds))
    if not len(q):
        return []
    manipulability = np.minimum(1.0, smallest_singular_values(chain, task, X_PT, q) / COMFORTABLE)
    scores = margin_shares(robot.model, q) * manipulability
    return [(float(scores[index]), q[index]) for index in np.argsort(-scores, kind="stable")]


def _why_nothing(search: _Search, holder_count: int) -> str:
    """One line that names what stood in the way most often."""
    cell = search.scene.cell
    tried = f"{SEEDS} starts of each arm"
    if search.is_holder_open:
        tried = f"{holder_count} posture(s) of the positioner, {SEEDS_PER_HOLDER} starts of each arm"
    if search.touching:
        first, second = max(search.touching, key=lambda pair: search.touching[pair])
        return (
            f"{cell.origin.at('robots')}: found no start postures that reach the tasks without a collision, most "
            f"often of '{first}' with '{second}' ({tried} tried): move the bases apart or change a tool"
        )
    name = max(
        search.unreached, key=lambda robot: search.unreached[robot], default=(*cell.positioners, cell.robots[0].name)[0]
    )
    task = next((relation for relation in cell.relations if relation.robot == name), None)
    goal = (
        "the part to where the other robots stand" if task is None else f"the tool to the start of task '{task.name}'"
    )
    if isinstance(task, Grasp):
        goal = "the tool to its grasp on the part"
    return (
        f"{start_place(cell, cell.robot(name))}: no posture within the joint limits brings {goal} "
        f"({tried} tried): move the base, change the tool or free an axis"
    )
