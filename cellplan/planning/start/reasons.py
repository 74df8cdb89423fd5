"""Start reasons: why no start was found, in one line that says what to change: base, tool, obstacle or joint limit."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.model.cell.doubts import doubt_about
from cellplan.model.robot.robot import Joint
from cellplan.model.seeds import generator
from cellplan.planning.start.branches import SEEDS, SEEDS_PER_HOLDER, StartSearch
from cellplan.planning.start.given import off_words, start_place, start_words
from cellplan.planning.start.inverse_kinematics import (
    finite_limits,
    on_nearest_turns,
    random_configurations,
    tip_jacobian,
)
from cellplan.planning.start.trial_motion import StartTrials
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.planning.tracking.task_constraints import constraint_rows
from cellplan.scene.bodies import Kind, SceneBody
from cellplan.scene.kinematics.screw_chain import ScrewChain

ANYWHERE: Final = 12  # configurations drawn from the whole range of a robot's joints
ARRIVED: Final = 1e-4  # [m] a tip that comes this near reaches its place
SHOWN: Final = 3  # contacts that are named at most
ATTEMPTS: Final = 120  # iterations from each seed; the nearest pose is approached linearly, beyond reach
LONGEST_MOVE: Final = 0.4  # [rad, m] largest change of a joint in one iteration
SHARE: Final = 0.5  # of error times lever: damping that keeps the linear model honest beyond reach


@dataclass(frozen=True, slots=True, kw_only=True)
class StartContact:
    """Two bodies that touch."""

    robot: str  # the robot whose configurations were evaluated
    bodies: tuple[SceneBody, SceneBody]  # the body of that robot first
    count: int  # in how many of them they touch
    of: int  # how many there were
    is_everywhere: bool = False  # whether they also touch wherever else the robot may be


def contacts_of(
    trials: StartTrials, cell: Cell, robot: Robot, tried: Sequence[tuple[Array, Array | None]]
) -> list[StartContact]:
    """Contacts of one robot with itself and with what does not depend on the other robots' choices, most often first.

    Args:
        cell: The cell in the order of names.
    """
    among = _robot_pairs(trials, cell, robot)
    counts: Counter[tuple[str, str]] = Counter()
    for q, holder_configuration in tried:
        counts.update(trials.contacts(_placed(cell, robot, q, holder_configuration), among=among))
    bodies = {body.name: body for body in trials.bodies}
    contacts = [
        StartContact(robot=robot.name, bodies=_robot_first(robot, bodies, pair), count=count, of=len(tried))
        for pair, count in counts.items()
    ]
    return sorted(contacts, key=lambda contact: (-contact.count, [body.name for body in contact.bodies]))


def touches_anywhere(
    trials: StartTrials, cell: Cell, contact: StartContact, holder_configuration: Array | None
) -> bool:
    """Whether two bodies touch at configurations from the whole range of their robot's joints as well."""
    robot = cell.robot(contact.robot)
    names = {body.name for body in contact.bodies}
    among = _robot_pairs(trials, cell, robot) & np.array([set(pair) == names for pair in trials.pair_names], dtype=bool)
    samples = random_configurations(robot.model, ANYWHERE, generator(f"{robot.name} anywhere", cell.solver.seed))
    return all(trials.contacts(_placed(cell, robot, q, holder_configuration), among=among) for q in samples)


def contacts_between(trials: StartTrials, tried: Sequence[Array]) -> list[tuple[tuple[str, str], int]]:
    """Pairs that touch in configurations of the whole cell, shape (nq,) each, with how often, most often first."""
    counts: Counter[tuple[str, str]] = Counter()
    for q in tried:
        counts.update(trials.contacts(q, among=trials.open_pairs))
    ordered = [((min(pair), max(pair)), count) for pair, count in counts.items()]
    return sorted(ordered, key=lambda entry: (-entry[1], entry[0]))


def _robot_pairs(trials: StartTrials, cell: Cell, robot: Robot) -> Flags:
    """Pairs of a body that the robot moves and one of its own or one that stands where it stands, shape (pairs,)."""
    given = {robot.name for robot in cell.robots if robot.start is not None} | {robot.name, *cell.positioners[:1]}

    def is_of_robot(body: SceneBody) -> bool:
        return body.robot == robot.name and not body.is_at_rest

    def is_settled(body: SceneBody) -> bool:
        return body.is_at_rest or body.robot in given

    pairs = [(trials.bodies[pair.first], trials.bodies[pair.second]) for pair in trials.pairs]
    flags = [(is_of_robot(a) and is_settled(b)) or (is_of_robot(b) and is_settled(a)) for a, b in pairs]
    return np.array(flags, dtype=bool) & trials.open_pairs


def _placed(cell: Cell, robot: Robot, q: Array, holder_configuration: Array | None) -> Array:
    """The whole cell with one robot and the positioner where they are desired, shape (nq,)."""
    whole = np.concatenate(
        [robot.start if robot.start is not None else np.clip(0.0, *finite_limits(robot.model)) for robot in cell.robots]
    )
    if holder_configuration is not None:
        whole[cell.columns(cell.positioners[0])] = holder_configuration
    whole[cell.columns(robot.name)] = q
    return whole


def _robot_first(robot: Robot, bodies: dict[str, SceneBody], pair: tuple[str, str]) -> tuple[SceneBody, SceneBody]:
    """Two bodies by name, that of the robot first; of two of its own a link after what it carries."""
    a, b = sorted((bodies[name] for name in pair), key=lambda body: body.name)
    if a.robot == b.robot:
        return (b, a) if a.kind is Kind.LINK and b.kind is not Kind.LINK else (a, b)
    return (a, b) if a.robot == robot.name else (b, a)


def why_nothing(search: StartSearch, holder_count: int) -> str:
    """One line on what stands in the way of a start.

    A contact that no configuration of a robot avoids comes first, then the contact that occurs most often. Where some
    robot does not come to its task at all, the line says by how much it fails and for which robot.
    """
    if search.failures.touching:
        unavoidable = _unavoidable(search)
        return _unavoidable_words(search, *unavoidable) if unavoidable else _frequent_words(search)
    return _unreached_words(search, holder_count)


def _unavoidable(search: StartSearch) -> list[StartContact]:
    """Contacts in every configuration of some robot, one for each robot.

    Those that are there wherever the robot is come first, and of these what stands in the surroundings.
    """
    contacts: list[StartContact] = []
    for robot in search.cell.robots:
        tried = search.failures.arrived.get(robot.name, [])
        if robot.start is not None or not tried:
            continue
        contacts_seen = contacts_of(search.trials, search.cell, robot, tried)
        in_all = [contact for contact in contacts_seen if contact.count == contact.of]
        ranked = sorted(
            (replace(contact, is_everywhere=_is_everywhere(search, contact)) for contact in in_all), key=_urgency
        )
        contacts += ranked[:1]
    return sorted(contacts, key=_urgency)


def _urgency(contact: StartContact) -> tuple[bool, bool]:
    """What decides which contact is named first."""
    return not contact.is_everywhere, contact.bodies[1].robot is not None


def _unavoidable_words(search: StartSearch, contact: StartContact, *others: StartContact) -> str:
    """What to say of a contact that no configuration of a robot avoids, and of the same of other robots."""
    cell, (body, other) = search.cell, contact.bodies
    also = ", and wherever else its joints may be" if contact.is_everywhere else ""
    which, goal = "the only one" if contact.of == 1 else f"all {contact.of}", _goal_words(search, contact.robot)
    arrives = "were tried" if goal is None else f"reach {goal}"
    besides = [
        f"'{contact.bodies[0].name}' touches '{contact.bodies[1].name}' in all {contact.of} of its own"
        for contact in others
    ]
    more = f"; besides, {', '.join(besides[: SHOWN - 1])}" if besides else ""
    return (
        f"{start_place(cell, cell.robot(contact.robot))}: no start configuration of '{contact.robot}' is free of "
        f"contact: '{body.name}' touches '{other.name}' in {which} that {arrives}{also}: "
        f"{doubt_about(cell, cell.robot(contact.robot)) or _cure(contact)}{more}"
    )


def _is_everywhere(search: StartSearch, contact: StartContact) -> bool:
    """Whether a contact is there wherever its robot is."""
    holder_configuration = search.failures.arrived[contact.robot][0][1]
    return touches_anywhere(search.trials, search.cell, contact, holder_configuration)


def _cure(contact: StartContact) -> str:
    """What to change so that two bodies need not touch."""
    robot, (body, other) = contact.robot, contact.bodies
    if other.robot == robot:
        if Kind.PART in {body.kind, other.kind}:
            return "hold the part otherwise"
        return "change its tool" if Kind.TOOL in {body.kind, other.kind} else "move its base, so that it need not fold"
    if other.kind is Kind.PART:
        tool = f"change the tool of '{robot}' or the direction of its axis"
        return tool if body.kind is Kind.TOOL else f"lengthen the tool of '{robot}' or turn its axis"
    if other.robot is not None:
        return f"move the bases of '{robot}' and '{other.robot}' apart"
    places = f"move the base of '{robot}' or the obstacle '{other.name}'"
    return places if body.kind is Kind.LINK or contact.is_everywhere else f"{places}, or change the tool"


def _frequent_words(search: StartSearch) -> str:
    """What to say where every contact can be avoided, but not all of them together."""
    tried = search.failures.touching
    counted = contacts_between(search.trials, tried)[:SHOWN]
    doubt = next((text for robot in search.cell.robots if (text := doubt_about(search.cell, robot))), "")
    named = ", ".join(f"'{first}' touches '{second}' in {count}" for (first, second), count in counted)
    return (
        f"{search.cell.origin.at('robots')}: found no start configurations that reach the tasks without contact: of "
        f"{len(tried)} combinations tried, {named}: {doubt or 'move the bases apart, or change a tool'}"
    )


def _unreached_words(search: StartSearch, holder_count: int) -> str:
    """What to say of a robot that does not come to where it is desired."""
    cell, failures = search.cell, search.failures
    usual = (*cell.positioners, cell.robots[0].name)[0]
    name = max(sorted(failures.misses), key=lambda robot: failures.misses[robot], default=usual)
    robot = cell.robot(name)
    relation = next((relation for relation in cell.relations if relation.robot == name), None)
    if name in failures.off and relation is not None:
        return off_words(cell, relation, failures.off[name], at_best="at best ")
    tried = f"{SEEDS} attempts of the inverse kinematics"
    if search.is_holder_open and name not in cell.positioners[:1]:
        tried = f"{holder_count} configuration(s) of the positioner, {SEEDS_PER_HOLDER} attempts for each"
    desired = f"the tool of '{name}' to {_goal_words(search, name) or 'where the part meets the robots that stand'}"
    doubt = doubt_about(cell, robot)
    return (
        f"{start_place(cell, robot)}: no configuration within the joint limits brings {desired} ({tried}): "
        f"{f'{doubt}; ' if doubt else ''}{_shortfall(search, robot)}"
    )


def _goal_words(search: StartSearch, name: str) -> str | None:
    """Where a robot's tool is desired at the start; None for a robot without a task or a grasp."""
    relation = next((relation for relation in search.cell.relations if relation.robot == name), None)
    if relation is None:
        return None
    return "its grasp on the part" if isinstance(relation, Grasp) else start_words(relation)


def _shortfall(search: StartSearch, robot: Robot) -> str:
    """By how much a robot fails to come where it is desired, and the cure."""
    goals = search.failures.missed.get(robot.name, [])
    if not goals:
        return "move its base or change its tool"
    seeds = random_configurations(robot.model, SEEDS, generator(f"{robot.name} nearest", search.cell.solver.seed))
    left = [
        nearest_reach(robot, goal.relation, goal.X_PT, X_WP=goal.X_WP, seeds=seeds, tip_only=True) for goal in goals
    ]
    distance, best = min((shortfall[0], index) for index, shortfall in enumerate(left))
    outside = search.failures.beyond.get(robot.name, [])
    if outside:
        return _beyond_words(robot, np.array(outside), distance)
    if distance > ARRIVED:
        return (
            f"out of reach, the best attempt leaves its tool tip {1e3 * distance:.1f} mm away; move its base or the "
            "part, or change its tool"
        )
    goal = goals[best]
    tip, angle = nearest_reach(robot, goal.relation, goal.X_PT, X_WP=goal.X_WP, seeds=seeds, tip_only=False)
    return (
        f"its tool tip gets there, but not with the desired direction, the best attempt leaves "
        f"{1e3 * tip:.1f} mm and {np.degrees(angle):.1f} deg; turn the tool or its axis, free an axis, or move its base"
    )


def _beyond_words(robot: Robot, q: Array, distance: float) -> str:
    """The joint that is in the way of configurations, shape (K, n), which reach the goal outside the limits.

    The distance in [m] is what is left of the way within them.
    """
    model = robot.model
    turned = on_nearest_turns(model, q)
    beyond = np.maximum(np.maximum(model.lower - turned, turned - model.upper), 0.0)
    nearest = int(np.argmin(np.round(beyond.max(axis=1), 9)))
    worst = int(np.argmax(beyond[nearest]))
    joint = model.joints[worst]
    within = f", and within the limits its tip stays {1e3 * distance:.1f} mm away" if distance > ARRIVED else ""
    return (
        f"it gets there only beyond a limit, at best with joint '{joint.name}' at "
        f"{_shown(joint, turned[nearest, worst])}, {_shown(joint, beyond[nearest, worst])} outside "
        f"{_shown(joint, joint.lower)} .. {_shown(joint, joint.upper)}{within}; "
        "move its base, change its tool or free an axis"
    )


def _shown(joint: Joint, position: float) -> str:
    """A joint position with its unit, with one decimal."""
    return f"{np.degrees(position):.1f} deg" if joint.is_revolute else f"{1e3 * position:.1f} mm"


def nearest_reach(
    robot: Robot, relation: Relation, X_PT: Array, *, X_WP: Array, seeds: Array, tip_only: bool
) -> tuple[float, float]:
    r"""Smallest error that any of many attempts of the inverse kinematics leaves within the joint limits.

    Each attempt minimizes ``|e|`` by Levenberg-Marquardt's method, joints held at their limits on the way:

    .. math:: \Delta q = J^T (J J^T + \lambda^2 I)^{-1} e, \qquad \lambda^2 = \tfrac{1}{2} |e| \, l

    with the lever ``l`` from the base to the goal, which bounds the curvature of the tip's way beyond reach.

    Args:
        X_PT: Reference tool tip in P, shape (4, 4).
        X_WP: The part, shape (4, 4).
        seeds: Configurations to start from, shape (B, n).
        tip_only: Whether the direction of the tool is ignored.

    Returns:
        Distance of the tip in [m] and angle in [rad] that are left; the angle is nil when it is ignored.
    """
    chain, (lower, upper) = ScrewChain(robot), finite_limits(robot.model)
    rows = constraint_rows(relation, X_PT[None])[0]
    is_linear = np.abs(rows[:, :3]).max(axis=1, initial=0.0) > 0.0
    rows = rows[is_linear] if tip_only else rows
    if not len(rows):
        return 0.0, 0.0
    lever = max(1.0, float(np.linalg.norm((X_WP @ X_PT)[:3, 3] - robot.X_WB[:3, 3])))
    q, best = np.clip(seeds, lower, upper), np.full((len(seeds), len(rows)), np.inf)
    for _ in range(ATTEMPTS):
        error, J = _error_and_jacobian(chain, relation, q, X_PT, X_WP=X_WP, rows=rows)
        size = np.linalg.norm(error, axis=1)
        is_better = size < np.linalg.norm(best, axis=1)
        best[is_better] = error[is_better]
        move = _move(J, error, SHARE * lever * size, at=(q <= lower, q >= upper))
        q = np.clip(q + move, lower, upper)
    left = best[int(np.argmin(np.linalg.norm(best, axis=1)))] @ rows
    return float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))


def _error_and_jacobian(
    chain: ScrewChain, relation: Relation, q: Array, X_PT: Array, *, X_WP: Array, rows: Array
) -> tuple[Array, Array]:
    """Reference minus actual, shape (B, m), and the Jacobian of the actual, shape (B, m, n)."""
    X_WT, screws_W = chain.tool_motion(q)
    goals = np.broadcast_to(X_PT, (len(q), 4, 4))
    error = pose_errors(goals, inverse(X_WP) @ X_WT, [relation.is_spin_free] * len(q)) @ rows.T
    return error, rows @ tip_jacobian(screws_W, X_WT[:, :3, 3], X_WP[:3, :3].T)


def _move(J: Array, error: Array, squared_damping: Array, *, at: tuple[Flags, Flags]) -> Array:
    """Damped moves, shape (B, n), in which no joint at a limit goes farther and none goes far."""
    downhill = np.einsum("bmn,bm->bn", J, error)
    is_free = ~((at[0] & (downhill < 0.0)) | (at[1] & (downhill > 0.0)))
    J = J * is_free[:, None, :]
    J_T = np.swapaxes(J, 1, 2)
    damping = np.maximum(squared_damping, 1e-12)[:, None, None] * np.eye(J.shape[1])
    move = (J_T @ np.linalg.solve(J @ J_T + damping, error[:, :, None]))[:, :, 0]
    longest = np.abs(move).max(axis=1, keepdims=True)
    return move * np.minimum(1.0, LONGEST_MOVE / np.maximum(longest, LONGEST_MOVE))
