"""Starts with the part at rest: where the first holder keeps it, and bases of one operator that follow its path."""

from collections import Counter
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.units import MM
from cellplan.search.distances.keep_out import in_areas
from cellplan.search.starts.effort import EFFORT
from cellplan.search.starts.freedom import FIXED, random_within
from cellplan.search.starts.problem import StartProblem
from cellplan.search.starts.reaching import FreeArm, Goal, PlacedDraws, followed, matched, reached

NEAR: Final = 0.5  # [rad] and half metres by which a configuration may miss a path's start and still speak for it
HOLDER_RANGE: Final = 0.7  # share of each joint range that configurations of the holder are drawn from: room to move
GIVEN_BASE: Final = 0.5  # share of the draws with the holder's base where it is given
LOOKED_AT: Final = 0.0, 0.34, 0.67  # shares of a path at which contacts are asked
CONTACTS_AT_ONCE: Final = 32
FAR_AWAY: Final = 0.1  # [m] from the start of a path, where it is worth saying
ROUND: Final = 100  # [mm] to which that is said
ROOMY: Final = 0.7  # [rad, m] a margin above which more of it is worth no more


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setting:
    """Where the part rests."""

    x: Array  # the variables; those of operators as given, shape (n,)
    start: Array  # start postures; those of operators as given, shape (nq,)
    X_WB: Array  # base of every robot, shape (robots, 4, 4)
    X_WP: Array  # the part, shape (4, 4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pool:
    """Bases of an operator, or of several tied ones, that follow with the part at rest, the best first; M of them."""

    x: Array  # the variables, shape (M, n)
    columns: Indices  # those that count
    q: Array  # start configurations in [rad] or [m], shape (M, j)
    joints: Indices  # columns of these joints among all, shape (j,)
    cost: Array  # what following costs in speed and margin, shape (M,)
    drops: Counter[str]  # how many draws failed by what


def settings(problem: StartProblem, rng: np.random.Generator, count: int) -> tuple[list[Setting], Counter[str]]:
    """At most ``count`` places for the part at rest, and by what draws failed.

    The places that operators reach best come first.
    """
    cell, drops = problem.cell, Counter[str]()
    if cell.carrier is None:
        return _part_settings(problem, rng, count), drops
    x = _random_settings(problem, rng)
    layouts = problem.variables.layouts(x, np.tile(problem.start, (len(x), 1)))
    columns, arm = cell.columns(cell.robots[cell.carrier].name), problem.arms[cell.carrier]
    placed = PlacedDraws(
        q=layouts.start[:, columns], X_WB=layouts.X_WB[:, cell.carrier], X_FT=layouts.X_FT[:, cell.carrier]
    )
    usable = np.ones(len(x), dtype=bool)
    goal = problem.goal(cell.carrier, np.eye(4))
    if goal is not None:
        placed, usable = reached(arm, goal, problem.bounds(cell.carrier), placed)
        drops["does not reach its own path"] += int(np.sum(~usable))
    margin = np.minimum(placed.q - arm.lower, arm.upper - placed.q) - problem.margin[columns]
    usable[1:] &= margin[1:].min(axis=1) >= 0.0
    drops["at a joint limit"] += int(np.sum(~usable)) - drops["does not reach its own path"]
    X_WB, start = layouts.X_WB.copy(), layouts.start.copy()
    X_WB[:, cell.carrier], start[:, columns] = placed.X_WB, placed.q
    X_WP = placed.X_WB @ arm.flanges(placed.q) @ placed.X_FT @ cell.part.X_CP
    usable = np.flatnonzero(usable)
    short = problem.contacts[cell.carrier].shortfalls(X_WB[usable], start[usable])
    drops.update(f"{pair[0]} too near {pair[1]}" for pair in short.pair if pair is not None)
    usable = usable[short.worst <= 0.0][: EFFORT.matched]
    if not len(usable):
        return [], drops
    x = problem.with_starts(
        _with_bases(problem, cell.carrier, x, X_WB[:, cell.carrier], layouts.X_WB[:, cell.carrier]), start
    )
    settings = [Setting(x=x[i], start=start[i], X_WB=X_WB[i], X_WP=X_WP[i]) for i in usable.tolist()]
    ability = _abilities(problem, settings, rng)
    return [settings[i] for i in np.argsort(-ability, kind="stable")[:count].tolist()], drops


def _part_settings(problem: StartProblem, rng: np.random.Generator, count: int) -> list[Setting]:
    """Places for a part that no robot holds: the given one, where it may lie elsewhere drawn ones."""
    variables, places = problem.variables, problem.freedom.part
    layouts = variables.layouts(variables.given[None], problem.start[None])
    x = random_within(variables, places, EFFORT.matched if len(places) else 1, rng)
    x[0] = variables.given
    settings = [
        Setting(x=row, start=problem.start, X_WB=layouts.X_WB[0], X_WP=variables.placed(row).part.X_CP) for row in x
    ]
    if len(settings) == 1:
        return settings
    return [settings[i] for i in np.argsort(-_abilities(problem, settings, rng), kind="stable")[:count].tolist()]


def _random_settings(problem: StartProblem, rng: np.random.Generator) -> Array:
    """Variables with those of the holder, and those that place several robots, drawn, the given ones first."""
    cell, variables = problem.cell, problem.variables
    holder = 0 if cell.carrier is None else cell.carrier
    x = random_within(
        variables, np.append(problem.freedom.by_robot[holder], problem.freedom.shared), EFFORT.settings, rng
    )
    places = problem.freedom.columns[cell.columns(cell.robots[holder].name)]
    joints = places[places != FIXED]
    middle = 0.5 * (np.maximum(variables.lower, -np.pi) + np.minimum(variables.upper, np.pi))[joints]
    x[:, joints] = middle + HOLDER_RANGE * (x[:, joints] - middle)
    base = np.append(problem.sampled_columns(holder), problem.freedom.shared)
    stays = rng.uniform(size=EFFORT.settings) < GIVEN_BASE
    x[np.ix_(stays, base)] = variables.given[base]
    x[0] = variables.given
    return x


def _abilities(problem: StartProblem, settings: list[Setting], rng: np.random.Generator) -> Array:
    """How much of what each operator can do suits the start of its path, for the worst operator, shape (S,)."""
    ability = np.full(len(settings), np.inf)
    for robot in problem.operators:
        if problem.freedom.leaders[robot] != robot:
            continue  # where it may stand depends on the one that it follows
        arm, bounds = problem.arms[robot], problem.bounds(robot)
        draws = _draws(problem, robot, settings[0], EFFORT.matches, rng)[1]
        X_BT, is_tied = arm.flanges(draws.q) @ draws.X_FT, bool(len(problem.freedom.shared))
        for place, setting in enumerate(settings):
            goal = problem.goal(robot, setting.X_WP)
            if goal is not None:
                X_WB = np.broadcast_to(setting.X_WB[robot], draws.X_WB.shape) if is_tied else draws.X_WB
                miss = matched(goal, bounds, X_BT, X_WB)[1]
                ability[place] = min(ability[place], float(np.sum(np.exp(-((miss / NEAR) ** 2)))))
    return ability


def _draws(
    problem: StartProblem, robot: int, setting: Setting, count: int, rng: np.random.Generator
) -> tuple[Array, PlacedDraws]:
    """Variables, shape (count, n), and configurations, bases and tools of an operator drawn within their bounds."""
    arm, model = problem.arms[robot], problem.cell.robots[robot]
    columns = problem.sampled_columns(robot)
    x = np.tile(setting.x, (EFFORT.templates, 1))
    x[:, columns] = random_within(problem.variables, columns, EFFORT.templates, rng)[:, columns]
    layouts = problem.placed_layouts(x, np.tile(setting.start, (EFFORT.templates, 1)))
    row = np.arange(count) % EFFORT.templates
    margin = problem.margin[problem.cell.columns(model.name)]
    lower, upper = np.minimum(arm.lower + margin, arm.upper), np.maximum(arm.upper - margin, arm.lower)
    q = rng.uniform(np.minimum(lower, upper), np.maximum(lower, upper), (count, len(lower)))
    return x[row], PlacedDraws(q=q, X_WB=layouts.X_WB[row, robot], X_FT=layouts.X_FT[row, robot])


def pool(problem: StartProblem, robot: int, setting: Setting, rng: np.random.Generator) -> Pool:
    """Bases of one operator from which its tool follows the whole path with the part at rest, free of contact."""
    goal, arm, bounds = problem.goal(robot, setting.X_WP), problem.arms[robot], problem.bounds(robot)
    if goal is None:
        raise ValueError(f"pool: robot {robot} has no path")
    x, draws = _draws(problem, robot, setting, EFFORT.bases * EFFORT.per_base, rng)
    X_WB, miss = matched(goal, bounds, arm.flanges(draws.q) @ draws.X_FT, draws.X_WB)
    best = np.argsort(miss, kind="stable")[: EFFORT.bases]
    drops = Counter[str]()
    x, initial = x[best], draws.X_WB[best]
    at, has_arrived = reached(arm, goal, bounds, replace(draws, X_WB=X_WB).of_places(best))
    drops[_unreached(goal, arm, at)] = int(np.sum(~has_arrived))
    x, initial, at = x[has_arrived], initial[has_arrived], at.of_places(has_arrived)
    x = _with_bases(problem, robot, x, at.X_WB, initial)
    inside = _within(problem, robot, x)
    drops["base out of bounds"] = int(np.sum(~inside))
    x, at = x[inside], at.of_places(inside)
    outside = ~in_areas(problem.cell, at.X_WB[:, :3, 3])
    drops["base in an area that is kept free"] = int(np.sum(~outside))
    x, at = x[outside], at.of_places(outside)
    q, has_followed = followed(arm, goal, at)
    drops["loses its path"] = int(np.sum(~has_followed))
    x, at, q = x[has_followed], at.of_places(has_followed), q[has_followed]
    margin = np.minimum(q - arm.lower, arm.upper - q) - problem.margin[problem.cell.columns(goal.relation.robot)]
    roomy = margin.min(axis=(1, 2), initial=np.inf) >= 0.0
    drops["joint limit"] = int(np.sum(~roomy))
    order = np.flatnonzero(roomy)
    cost = _costs(problem, robot, q[roomy], margin[roomy])
    ranked = np.argsort(cost, kind="stable")
    free = _free(problem, robot, setting, at.X_WB[order][ranked], q[order][ranked], drops)
    rows = order[ranked[free]]
    return Pool(
        x=x[rows],
        columns=problem.freedom.by_robot[robot],
        q=q[rows, 0],
        joints=np.arange(problem.cell.joint_count)[problem.cell.columns(goal.relation.robot)],
        cost=cost[ranked[free]],
        drops=drops,
    )


def _unreached(goal: Goal, arm: FreeArm, at: PlacedDraws) -> str:
    """That tools do not reach the start of the path; where all stay far away, how far."""
    tips = (at.X_WB @ arm.flanges(at.q) @ at.X_FT)[:, :3, 3]
    nearest = float(np.linalg.norm(tips - (goal.X_WR @ goal.X_RT[0])[:3, 3], axis=1).min())
    far = f", stays more than {ROUND * int(MM * nearest / ROUND)} mm away" if nearest > FAR_AWAY else ""
    return f"does not reach the start of its path{far}"


def _costs(problem: StartProblem, robot: int, q: Array, margins: Array) -> Array:
    """Logarithm of how long the joints need for the path, and what is missing of a wide margin, shape (B,)."""
    if not len(q):
        return np.zeros(0)
    columns, rates = problem.cell.columns(problem.cell.robots[robot].name), problem.at_rest.rates
    velocities = rates @ q
    shares = (
        np.abs(velocities / problem.arms[robot].velocity),
        np.sqrt(np.abs(rates @ velocities) / problem.acceleration[columns]),
    )
    longest = np.maximum(*(share.max(axis=(1, 2)) for share in shares))
    return np.log(np.maximum(longest, 1e-9)) + np.maximum(0.0, 1.0 - margins.min(axis=(1, 2)) / ROOMY)


def _free(problem: StartProblem, robot: int, setting: Setting, X_WB: Array, q: Array, drops: Counter[str]) -> Indices:
    """The first ``StartEffort.pool`` of some draws that keep their distance from all but other operators."""
    indices, columns = list[int](), problem.cell.columns(problem.cell.robots[robot].name)
    nodes = np.unique([round(share * (q.shape[1] - 1)) for share in LOOKED_AT])
    for first in range(0, len(q), CONTACTS_AT_ONCE):
        group = np.arange(first, min(first + CONTACTS_AT_ONCE, len(q)))
        bases = np.tile(setting.X_WB, (len(group) * len(nodes), 1, 1, 1))
        bases[:, robot] = np.repeat(X_WB[group], len(nodes), axis=0)
        start = np.tile(setting.start, (len(bases), 1))
        start[:, columns] = q[group][:, nodes].reshape(len(bases), -1)
        short = problem.contacts[robot].shortfalls(bases, start)
        worst = short.worst.reshape(len(group), len(nodes))
        for place, index in enumerate(group.tolist()):
            node = int(np.argmax(worst[place]))
            pair = short.pair[place * len(nodes) + node]
            if pair is None:
                indices.append(index)
            else:
                drops[f"{pair[0]} too near {pair[1]}"] += 1
        if len(indices) >= EFFORT.pool:
            break
    return np.array(indices[: EFFORT.pool], dtype=np.intp)


def _with_bases(problem: StartProblem, robot: int, x: Array, X_WB: Array, initial: Array) -> Array:
    """Variables of bases that were moved from where they were drawn, shape (B, n)."""
    changed, columns = x.copy(), problem.freedom.base[robot]
    for component in np.flatnonzero(columns[:3] != FIXED).tolist():
        changed[:, columns[component]] += X_WB[:, component, 3] - initial[:, component, 3]
    if columns[3] != FIXED:
        turn = X_WB[:, :3, :3] @ np.swapaxes(initial[:, :3, :3], 1, 2)
        angle = changed[:, columns[3]] + np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
        lower, upper = problem.variables.lower[columns[3]], problem.variables.upper[columns[3]]
        middle = 0.5 * (lower + upper) if np.isfinite(lower + upper) else 0.0
        changed[:, columns[3]] = middle + (angle - middle + np.pi) % (2.0 * np.pi) - np.pi
    return changed


def _within(problem: StartProblem, robot: int, x: Array) -> Flags:
    """Which variables of a robot's base are within their bounds, shape (B,)."""
    columns = problem.freedom.base[robot]
    columns = columns[columns != FIXED]
    lower, upper = problem.variables.lower[columns], problem.variables.upper[columns]
    return np.all((x[:, columns] >= lower) & (x[:, columns] <= upper), axis=1)
