"""Start postures that are to be found: several inverse-kinematics branches per robot, rehearsed, the best one kept."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import NoSolutionError, StartNotFoundError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell import Cell, Robot
from cellplan.model.progress import Progress, silent
from cellplan.model.task import Task
from cellplan.model.toolpath import Toolpath
from cellplan.planning.combinations import Picks, best_combinations
from cellplan.planning.follow import follow
from cellplan.planning.given_starts import part_pose, start_place
from cellplan.planning.inverse_kinematics import (
    finite_limits,
    margin_shares,
    random_postures,
    reaching_postures,
    smallest_singular_values,
    within_limits,
)
from cellplan.planning.modes import plan_runs
from cellplan.planning.schedule import schedule_tasks
from cellplan.scene.scene import Scene

SEEDS: Final = 48  # random starts of the inverse kinematics per robot and place; finds all 8 branches of a 6-axis arm
SEEDS_PER_HOLDER: Final = 16  # the same when many postures of the positioner are to be tried
HOLDER_DRAWS: Final = 1500  # postures of the positioner that are drawn when its start is to be found as well
HOLDER_POSTURES: Final = 60  # the most promising of these, which are tried
HOLDER_RANGE: Final = 0.7  # share of each joint range that they are drawn from, so that room is left to move
CANDIDATES: Final = 10  # whole-cell postures that are rehearsed
BRANCHES: Final = 4  # best branches of each operator that are combined
COMBINATIONS_PER_HOLDER: Final = 3  # candidates taken from one posture of the positioner, so that several are compared
COMFORTABLE: Final = 0.1  # smallest singular value above which more manipulability is worth no more
REHEARSAL_SAMPLES: Final = 160  # instants of the coarse motion that a candidate is judged by
REHEARSAL_GAIN: Final = 0.5  # feedback gain times step of the coarse motion
TOUCH_INSTANTS: Final = 12  # instants of the coarse motion that are looked at for collisions
TOUCHING: Final = 2.0  # taken off the quality of a candidate that collides on the way


@dataclass(slots=True)
class _Obstructions:
    """Why postures were dropped, for the message when none is left."""

    unreached: dict[str, int] = field(default_factory=dict)
    touching: dict[tuple[str, str], int] = field(default_factory=dict)


def find_start(scene: Scene, toolpaths: Mapping[str, Toolpath], *, progress: Progress = silent) -> Array:
    """Stacked start posture of the whole cell; given postures are kept, the others chosen.

    Candidates put every tool on the start of its task, within limits and without collision. They are ranked by joint
    margin and manipulability; the best are rehearsed on a coarse clock and the one whose motion keeps the largest share
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
    candidates = _candidates(scene, toolpaths, progress)
    rehearsed = []
    for index, candidate in enumerate(candidates):
        progress("rehearsing start postures", index / len(candidates))
        rehearsed.append(_rehearse(scene, toolpaths, candidate))
    best = int(np.argmax([quality for quality, _ in rehearsed]))
    return rehearsed[best][1]


def _candidates(scene: Scene, toolpaths: Mapping[str, Toolpath], progress: Progress) -> list[Array]:
    """Whole-cell postures that reach every task without touching, best first within each posture of the positioner."""
    cell = scene.cell
    rng = np.random.default_rng(cell.solver.seed)
    obstructions = _Obstructions()
    found: list[Array] = []
    holder_postures = _holder_postures(scene, toolpaths, rng)
    for index, holder_posture in enumerate(holder_postures):
        progress("searching start postures", index / len(holder_postures))
        room = CANDIDATES if len(holder_postures) == 1 else COMBINATIONS_PER_HOLDER
        found += _combinations(scene, toolpaths, holder_posture, rng=rng, room=room, obstructions=obstructions)
        if len(found) >= CANDIDATES:
            break
    if not found:
        raise StartNotFoundError(_why_nothing(cell, obstructions, len(holder_postures)))
    return found[:CANDIDATES]


def _holder_postures(scene: Scene, toolpaths: Mapping[str, Toolpath], rng: np.random.Generator) -> list[Array | None]:
    """Postures of the positioner to try: the given one, those that suit a given operator, or drawn ones."""
    cell = scene.cell
    if not cell.positioners:
        return [None]
    holder = cell.robot(cell.positioners[0])
    if holder.start is not None:
        return [holder.start]
    for task in cell.tasks:
        operator = cell.robot(task.robot)
        if operator.start is not None:
            return list(_postures_meeting(scene, task, toolpaths[task.name], operator.start, rng))
    return list(_promising_postures(scene, toolpaths, holder, rng))


def _promising_postures(
    scene: Scene, toolpaths: Mapping[str, Toolpath], holder: Robot, rng: np.random.Generator
) -> Array:
    """Postures of the positioner that hold the part where the operators' tools like to be, best first."""
    lower, upper = finite_limits(holder.model)
    middle = 0.5 * (lower + upper)
    q = middle + HOLDER_RANGE * (random_postures(holder.model, HOLDER_DRAWS, rng) - middle)
    X_WP = scene.chains[holder.name].tool_poses(q) @ inverse(scene.cell.part.held_by[0].X_PT)
    awkwardness = np.zeros(len(q))
    for task in scene.cell.tasks:
        operator = scene.cell.robot(task.robot)
        usual = scene.chains[task.robot].tool_poses(random_postures(operator.model, HOLDER_DRAWS, rng))
        goal = X_WP @ toolpaths[task.name].X_PT_start
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


def _postures_meeting(
    scene: Scene, task: Task, toolpath: Toolpath, operator_start: Array, rng: np.random.Generator
) -> Array:
    """Postures of the positioner that bring the start of a task to the tool of an operator that already stands."""
    cell = scene.cell
    holder = cell.robot(cell.positioners[0])
    X_WT = scene.chains[task.robot].tool_poses(operator_start[None])[0]
    X_W_holder = X_WT @ inverse(toolpath.X_PT_start) @ cell.part.held_by[0].X_PT
    whole = replace(task, axes=(0, 1, 2, 3, 4, 5), is_spin_free=False)
    seeds = random_postures(holder.model, SEEDS, rng)
    q = reaching_postures(scene.chains[holder.name], whole, X_W_holder, X_WP=np.eye(4), seeds=seeds)
    inside = within_limits(holder.model, q)
    best_first: Array = inside[np.argsort(-margin_shares(holder.model, inside), kind="stable")]
    return best_first


def _combinations(
    scene: Scene,
    toolpaths: Mapping[str, Toolpath],
    holder_posture: Array | None,
    *,
    rng: np.random.Generator,
    room: int,
    obstructions: _Obstructions,
) -> list[Array]:
    """Whole-cell postures for one posture of the positioner, best first, that touch nothing."""
    cell = scene.cell
    X_WP = part_pose(cell, holder_posture)
    if X_WP is None:
        return []
    choices: list[list[tuple[float, Array]]] = []
    for robot in cell.robots:
        branches = _branches(scene, toolpaths, robot, holder_posture, X_WP=X_WP, rng=rng)
        if not branches:
            obstructions.unreached[robot.name] = obstructions.unreached.get(robot.name, 0) + 1
            return []
        choices.append(branches)
    found: list[Array] = []
    blocked: set[tuple[tuple[int, int], ...]] = set()
    open_pairs = _open_pairs(scene)

    def collides(picks: Picks) -> bool:
        return any(all(robot < len(picks) and picks[robot] == pick for robot, pick in known) for known in blocked)

    for picks in best_combinations([[score for score, _ in branches] for branches in choices], collides):
        q = np.concatenate([branches[pick][1] for branches, pick in zip(choices, picks, strict=True)])
        pair = scene.touching(q, among=open_pairs)
        if pair is None:
            found.append(q)
        else:
            obstructions.touching[pair] = obstructions.touching.get(pair, 0) + 1
            blocked.add(_culprits(cell, pair, picks))
        if len(found) == room or () in blocked:
            break
    return found


def _open_pairs(scene: Scene) -> NDArray[np.bool_]:
    """Pairs of bodies that a choice of the search moves; what given postures make collide is for the report to say."""
    given = {None, *(robot.name for robot in scene.cell.robots if robot.start is not None)}
    bodies = scene.bodies
    is_open = [not {bodies[pair.first].robot, bodies[pair.second].robot} <= given for pair in scene.pairs]
    return np.array(is_open, dtype=bool)


def _culprits(cell: Cell, pair: tuple[str, str], picks: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
    """Robots of a pair that touches with the branches they are on: no other robot can keep these from touching."""
    owners = {name.split("/")[0] for name in pair}
    return tuple(
        (index, picks[index])
        for index, robot in enumerate(cell.robots)
        if robot.name in owners or (robot.name in cell.positioners and "part" in owners)
    )


def _branches(
    scene: Scene,
    toolpaths: Mapping[str, Toolpath],
    robot: Robot,
    holder_posture: Array | None,
    *,
    X_WP: Array,
    rng: np.random.Generator,
) -> list[tuple[float, Array]]:
    """Postures of one robot with their scores, best first; one entry when there is no choice."""
    cell = scene.cell
    if holder_posture is not None and robot.name in cell.positioners:
        return [(np.inf, holder_posture)]
    if robot.start is not None:
        return [(np.inf, robot.start)]
    task = next((task for task in cell.tasks if task.robot == robot.name), None)
    if task is None:
        return [(np.inf, np.clip(np.zeros(len(robot.model.joints)), *finite_limits(robot.model)))]
    X_PT = toolpaths[task.name].X_PT_start
    chain = scene.chains[robot.name]
    is_holder_given = not cell.positioners or cell.robot(cell.positioners[0]).start is not None
    seeds = random_postures(robot.model, SEEDS if is_holder_given else SEEDS_PER_HOLDER, rng)
    q = within_limits(robot.model, reaching_postures(chain, task, X_PT, X_WP=X_WP, seeds=seeds))
    if not len(q):
        return []
    manipulability = np.minimum(1.0, smallest_singular_values(chain, task, X_PT, q) / COMFORTABLE)
    scores = margin_shares(robot.model, q) * manipulability
    order = np.argsort(-scores, kind="stable")[:BRANCHES]
    return [(float(scores[index]), q[index]) for index in order]


def _rehearse(scene: Scene, toolpaths: Mapping[str, Toolpath], start: Array) -> tuple[float, Array]:
    """Quality of a start posture on a coarse clock, and the posture with joints turned so that they have most room.

    The quality is the smallest share of joint range and joint speed left free, less when something collides.
    """
    cell = scene.cell
    schedule = schedule_tasks(cell, [toolpaths[task.name] for task in cell.tasks])
    step = max(cell.motion.step, schedule.times[-1] / REHEARSAL_SAMPLES)
    coarse = replace(
        cell,
        motion=replace(cell.motion, step=float(step)),
        solver=replace(cell.solver, gain=REHEARSAL_GAIN / float(step)),
    )
    motions = []
    for run in plan_runs(coarse):
        schedule = schedule_tasks(coarse, [toolpaths[name] for name in run.tasks])
        try:
            motions.append(follow(coarse, schedule, start=start, moving=run.moving).q)
        except NoSolutionError:
            return -np.inf, start
    turns = _whole_turns(cell, np.concatenate(motions))
    open_pairs = _open_pairs(scene)
    quality = min(_share_left_free(coarse, q + turns, schedule.step) for q in motions)
    for q in motions:
        instants = np.linspace(0, len(q) - 1, TOUCH_INSTANTS).astype(int)
        if any(scene.touching(q[k], among=open_pairs) is not None for k in instants):
            quality = min(quality, 1.0) - TOUCHING
    return quality, start + turns


def _whole_turns(cell: Cell, q: Array) -> Array:
    """Whole turns in [rad] that bring the motion of each joint nearest to mid-range; none where the start is given.

    A posture does not show on which turn its joints are, and a wrist may need a whole turn of room on one side.
    """
    turns = np.zeros(q.shape[1])
    for robot in cell.robots:
        if robot.start is None:
            lower, upper = robot.model.lower, robot.model.upper
            motion = q[:, cell.columns(robot.name)]
            turning = np.isfinite(upper - lower) & np.array([joint.is_revolute for joint in robot.model.joints])
            middle = 0.5 * np.where(turning, lower + upper, 0.0)
            own = -2 * np.pi * np.round((0.5 * (motion.min(axis=0) + motion.max(axis=0)) - middle) / (2 * np.pi))
            start = motion[0] + own
            turns[cell.columns(robot.name)] = np.where(turning & (start >= lower) & (start <= upper), own, 0.0)
    return turns


def _share_left_free(cell: Cell, q: Array, step: float) -> float:
    """Smallest share of a joint's half range or speed limit that a motion leaves free; negative when it breaks one."""
    shares = [1.0]
    for robot in cell.robots:
        positions = q[:, cell.columns(robot.name)]
        shares.append(float(margin_shares(robot.model, positions).min()))
        speeds = np.abs(np.diff(positions, axis=0)) / step
        shares.append(1.0 - float((speeds / robot.model.velocity).max(initial=0.0)))
    return min(shares)


def _why_nothing(cell: Cell, obstructions: _Obstructions, holder_count: int) -> str:
    """One line that names what stood in the way most often."""
    tried = f"{SEEDS} starts of each arm"
    if any(cell.robot(name).start is None for name in cell.positioners):
        tried = f"{holder_count} posture(s) of the positioner, {SEEDS_PER_HOLDER} starts of each arm"
    if obstructions.touching:
        first, second = max(obstructions.touching, key=lambda pair: obstructions.touching[pair])
        return (
            f"{cell.origin.at('robots')}: every start posture that reaches the tasks collides, most often "
            f"'{first}' with '{second}' ({tried} tried): move the bases apart or change a tool"
        )
    name = max(obstructions.unreached, key=lambda robot: obstructions.unreached[robot], default=cell.robots[0].name)
    task = next((task.name for task in cell.tasks if task.robot == name), "")
    return (
        f"{start_place(cell, cell.robot(name))}: no posture within the joint limits brings the tool to the "
        f"start of task '{task}' ({tried} tried): move the base, change the tool or free an axis"
    )
