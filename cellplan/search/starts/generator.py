"""Where a search for a layout begins: the given layout, the engineer's own ones, and what sampling finds.

Start number ``index`` depends on the cell, the seed and this number only, so any worker makes the same one.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import product
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.seeds import generator
from cellplan.planning.start.inverse_kinematics import SAME_POSTURE, joint_margin_shares, on_nearest_turns
from cellplan.search.kernel.run import run
from cellplan.search.starts.at_rest import Pool, Setting, pool, settings
from cellplan.search.starts.combined import Judged, combined, judged
from cellplan.search.starts.effort import EFFORT
from cellplan.search.starts.freedom import random_within
from cellplan.search.starts.problem import StartProblem
from cellplan.search.starts.reaching import BaseBounds, PlacedDraws, followed, reached

SHOWN: Final = 3  # [-] reasons that are named for one robot


class StartOrigin(StrEnum):
    """Where a start comes from."""

    GIVEN = "given"
    TRY = "try"
    BRANCH = "branch"
    SAMPLED = "sampled"
    RANDOM = "random"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Start:
    """A layout from which a search may go on: all tools follow their paths."""

    x: Array  # values of the variables in [m] or [rad], shape (n,)
    start: Array  # start posture with the tools on their paths in [rad] or [m], shape (nq,)
    origin: StartOrigin  # where it comes from
    text: str  # the same in words
    violation: float  # 0 where limits, speeds and the distances that were asked are kept; larger the farther off
    cycle: float  # shortest time in [s] of the same motion that keeps speeds and accelerations


@dataclass(frozen=True, slots=True, kw_only=True)
class Starts:
    """The starts of one number, the best first, each far from those before it where that could be had."""

    starts: tuple[Start, ...]
    reason: str  # why there is none, or why draws failed that were tried before

    def __iter__(self) -> Iterator[Start]:
        """The starts, the best first."""
        return iter(self.starts)

    @property
    def first(self) -> tuple[Array, Array]:
        """Variables, shape (n,), and start posture, shape (nq,), of the best one."""
        if not self.starts:
            raise NoSolutionError(self.reason)
        return self.starts[0].x, self.starts[0].start


class StartGenerator:
    """All starts of one search."""

    def __init__(self, problem: StartProblem, *, seed: int, tries: Sequence[tuple[str, Array, Array]] = ()) -> None:
        """Take what is searched.

        Args:
            tries: The engineer's own layouts: name, values of the variables, shape (n,), and start posture, (nq,).
        """
        self._problem, self._seed, self._tries = problem, seed, tuple(tries)

    def at(self, index: int) -> Starts:
        """The starts of one number: 0 the given layout, then those of the engineer, then sampled and random ones."""
        if index == 0:
            start = self._problem.given_start()[None]
            x = self._problem.with_starts(self._problem.variables.given[None], start)[0]
            return self._of_layout(StartOrigin.GIVEN, "the given layout", x, start[0])
        if index <= len(self._tries):
            name, x, start = self._tries[index - 1]
            return self._of_layout(StartOrigin.TRY, f"layout of {name}", x, start)
        number = index - len(self._tries) - 1
        rng = generator(f"starts/{index}", self._seed)
        if number % EFFORT.every_random == EFFORT.every_random - 1:
            return self._random(rng, number)
        return self._sampled(rng, number)

    def branches(self, robots: Collection[str], start: Array) -> tuple[Array, Array]:
        """Other branches of inverse kinematics of the given layout from which all tools follow their paths.

        Args:
            start: The start posture of the given layout, which is left out, shape (nq,).

        Returns:
            Variables, shape (C, n), and start postures, shape (C, nq), the best first.
        """
        problem = self._problem
        x = problem.with_starts(problem.variables.given[None], start[None])[0]
        many, starts, _ = branch_starts(problem, x, start, generator("branches", self._seed), robots)
        if not len(many):
            return many, starts
        followed = run(problem.job, problem.variables.layouts(many, starts))
        is_other = np.abs(followed.q[:, 0] - start).max(axis=1) > SAME_POSTURE
        is_new = followed.is_followed & is_other
        return many[is_new], followed.q[is_new, 0]

    def _of_layout(self, origin: StartOrigin, text: str, x: Array, start: Array) -> Starts:
        """One layout as it is, else with other branches of inverse kinematics of the operators."""
        problem = self._problem
        as_it_is = judged(problem, x[None], start[None])
        if len(as_it_is.x):
            return Starts(starts=self._starts(origin, text, as_it_is), reason="")
        x, starts, reason = branch_starts(problem, x, start, generator(f"branches/{text}", self._seed))
        others = judged(problem, x, starts) if len(x) else as_it_is
        why = f"{text}: {reason or words(others.drops)}"
        return Starts(starts=self._starts(StartOrigin.BRANCH, f"{text}, other branches", others), reason=why)

    def _sampled(self, rng: np.random.Generator, number: int) -> Starts:
        """Starts with the part at rest first, put together afterwards."""
        problem, reasons = self._problem, list[str]()
        places, drops = settings(problem, rng, EFFORT.settings_tried)
        if not places:
            return Starts(starts=(), reason=f"no configuration of the holder can be used: {words(drops)}")
        for setting in places:
            here = problem.with_part(setting.x)
            bases, reason = pools(here, setting, rng)
            if reason:
                reasons.append(reason)
                continue
            judgement = judged(here, *combined(here, setting, bases, rng))
            if len(judgement.x):
                text = f"sampled with the part at rest, draw {number}"
                return Starts(starts=self._starts(StartOrigin.SAMPLED, text, judgement), reason="".join(reasons[:1]))
            reasons.append(f"no combination follows all paths: {words(judgement.drops)}")
        return Starts(starts=(), reason="".join(reasons[:1]))

    def _random(self, rng: np.random.Generator, number: int) -> Starts:
        """Layouts drawn within the bounds, with all branches of inverse kinematics."""
        problem = self._problem
        everything = np.arange(len(problem.variables.names))
        samples = random_within(problem.variables, everything, EFFORT.random, rng)
        parts = [branch_starts(problem, x, problem.start, rng) for x in samples]
        x, start = (np.concatenate([part[place] for part in parts]) for place in (0, 1))
        if not len(x):
            return Starts(starts=(), reason=_most_frequent([part[2] for part in parts]))
        judgement = judged(problem, x, start)
        text = f"drawn within the bounds, draw {number}"
        return Starts(
            starts=self._starts(StartOrigin.RANDOM, text, judgement),
            reason="" if len(judgement.x) else words(judgement.drops),
        )

    def _starts(self, origin: StartOrigin, text: str, judgement: Judged) -> tuple[Start, ...]:
        """Candidates as starts, spread."""
        return tuple(
            Start(
                x=judgement.x[i],
                start=judgement.start[i],
                origin=origin,
                text=text,
                violation=float(judgement.violation[i]),
                cycle=float(judgement.cycle[i]),
            )
            for i in _spread(judgement.violation, judgement.picks).tolist()
        )


def _spread(violation: Array, picks: Indices) -> Indices:
    """An order that puts what shares no base with those before it first, of equal ones the better."""
    first, others = list[int](), list[int]()
    for candidate in range(len(violation)):
        shares = any(np.any(picks[candidate] == picks[other]) for other in first)
        (others if shares else first).append(candidate)
    feasible = [i for i in first if violation[i] == 0.0]
    return np.array([*feasible, *sorted({*first, *others} - set(feasible))], dtype=np.intp)


def _most_frequent(reasons: Sequence[str]) -> str:
    """The reason that comes most often, and how often."""
    (reason, count), *_ = sorted(Counter(reasons).items(), key=lambda entry: (-entry[1], entry[0]))
    return f"{reason} (in {count} of {len(reasons)} layouts)"


def pools(problem: StartProblem, setting: Setting, rng: np.random.Generator) -> tuple[list[Pool], str]:
    """Pools of all operators, and the first one that has none in words."""
    pools = list[Pool]()
    for first, *others in problem.freedom.groups(problem.operators):
        together = _finer(problem, first, setting, rng)
        robot = first
        for other in others if len(together.q) else ():
            robot, together = other, _with_follower(problem, together, other, setting, rng)
            if not len(together.q):
                break
        if not len(together.q):
            drops, name = together.drops, problem.cell.robots[robot].name
            return [], f"'{name}' follows its path from none of {drops.total()} bases: {words(drops)}"
        pools.append(together)
    return pools, ""


def _finer(problem: StartProblem, robot: int, setting: Setting, rng: np.random.Generator) -> Pool:
    """The pool of one operator, its path at more nodes where no base follows."""
    finer = pool(problem, robot, setting, rng)
    return finer if len(finer.q) else pool(replace(problem, at_rest=problem.at_rest_fine), robot, setting, rng)


def _with_follower(problem: StartProblem, led: Pool, robot: int, setting: Setting, rng: np.random.Generator) -> Pool:
    """A pool with one operator more, whose base follows from those of the pool."""
    x, q, cost, drops = list(led.x[:0]), list(led.q[:0]), list[float](), Counter[str]()
    follower = led
    for row in range(min(len(led.q), EFFORT.leading)):
        there, start = setting.x.copy(), setting.start.copy()
        there[led.columns], start[led.joints] = led.x[row, led.columns], led.q[row]
        X_WB = problem.placed_layouts(there[None], start[None]).X_WB[0]
        follower = pool(problem, robot, replace(setting, x=there, start=start, X_WB=X_WB), rng)
        drops += follower.drops
        first = slice(0, EFFORT.following)
        x += list(follower.x[first])
        q += [np.append(led.q[row], start) for start in follower.q[first]]
        cost += (led.cost[row] + follower.cost[first]).tolist()
        if len(x) >= EFFORT.pool:
            break
    order = np.argsort(cost, kind="stable")[: EFFORT.pool].astype(np.intp)
    return Pool(
        x=np.array(x).reshape(-1, led.x.shape[1])[order],
        columns=np.append(led.columns, follower.columns),
        q=np.array(q).reshape(len(x), -1)[order],
        joints=np.append(led.joints, follower.joints),
        cost=np.array(cost)[order],
        drops=drops,
    )


def words(drops: Counter[str]) -> str:
    """The most frequent reasons in words."""
    shown = sorted(
        ((count, reason) for reason, count in drops.items() if count), key=lambda entry: (-entry[0], entry[1])
    )
    return ", ".join(f"{reason} ({count})" for count, reason in shown[:SHOWN]) or "nothing was drawn"


def branches(problem: StartProblem, robot: int, x: Array, start: Array, rng: np.random.Generator) -> Array:
    """Configurations from which an operator follows its path with the part at rest, shape (M, n).

    They are ordered by what they leave of the joint limits on the whole path, the most first.

    Args:
        x: Values of the variables, shape (n,).
        start: Start posture of the cell; that of this robot is tried too, shape (nq,).
    """
    cell, arm = problem.cell, problem.arms[robot]
    layouts = problem.variables.layouts(x[None], start[None])
    model, columns = cell.robots[robot].model, cell.columns(cell.robots[robot].name)
    q = np.vstack([start[columns], rng.uniform(arm.lower, arm.upper, (EFFORT.postures - 1, len(arm.lower)))])
    goal = problem.goal(robot, problem.part_pose(layouts))
    if goal is None:
        return start[None, columns]
    fixed = BaseBounds(is_free=np.zeros(4, dtype=bool), lower=np.zeros(3), upper=np.zeros(3))
    X_WB, X_FT = (np.tile(part[0, robot], (len(q), 1, 1)) for part in (layouts.X_WB, layouts.X_FT))
    placed, has_arrived = reached(arm, goal, fixed, PlacedDraws(q=q, X_WB=X_WB, X_FT=X_FT))
    near = placed.q[has_arrived]
    q = np.where(np.all(on_nearest_turns(model, near) == near, axis=1)[:, None], near, on_nearest_turns(model, near))
    q = _distinct(q)
    path, has_followed = followed(arm, goal, PlacedDraws(q=q, X_WB=X_WB[: len(q)], X_FT=X_FT[: len(q)]))
    margin = joint_margin_shares(model, path[has_followed]).min(axis=(1, 2), initial=np.inf)
    order = np.argsort(-margin, kind="stable")
    return q[has_followed][order[margin[order] >= 0.0]][: EFFORT.branches]


def branch_starts(
    problem: StartProblem, x: Array, start: Array, rng: np.random.Generator, robots: Collection[str] | None = None
) -> tuple[Array, Array, str]:
    """Combinations of branches of the operators of one layout.

    Args:
        x: Values of the variables, shape (n,).
        start: Start posture, shape (nq,).
        robots: Names of the operators whose branch may change; None for all.

    Returns:
        Variables, shape (C, n), start postures, shape (C, nq), and the robot that follows its path from no branch, in
        words; empty where all do.
    """
    nothing = np.zeros((0, len(x))), np.zeros((0, len(start)))
    start = problem.variables.layouts(x[None], start[None]).start[0]
    choices = []
    operators = [
        operator for operator in problem.operators if robots is None or problem.cell.robots[operator].name in robots
    ]
    for robot in operators:
        configurations = branches(problem, robot, x, start, rng)
        if not len(configurations):
            name = problem.cell.robots[robot].name
            return *nothing, f"'{name}' follows its path from no configuration with the part at rest"
        choices.append(configurations)
    while np.prod([len(choice) for choice in choices]) > EFFORT.branch_combinations:
        longest = max(range(len(choices)), key=lambda place: len(choices[place]))
        choices[longest] = choices[longest][:-1]
    rows = []
    for picks in product(*choices):
        row = start.copy()
        for robot, q in zip(operators, picks, strict=True):
            row[problem.cell.columns(problem.cell.robots[robot].name)] = q
        rows.append(row)
    starts = np.array(rows)
    return problem.with_starts(np.tile(x, (len(starts), 1)), starts), starts, ""


def _distinct(q: Array) -> Array:
    """One configuration of each branch, in the order of their joints."""
    if not len(q):
        return q
    q = q[np.lexsort(np.round(q / SAME_POSTURE).T[::-1])]
    is_new = np.append(True, np.abs(np.diff(q, axis=0)).max(axis=1) > SAME_POSTURE)
    return q[is_new]
