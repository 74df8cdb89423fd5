"""Bases of all operators with the part at rest, those of operators that are tied to each other together."""

from collections import Counter
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.search.starts.at_rest import MOST_BASES, Pool, Setting, pool
from cellplan.search.starts.problem import StartProblem

LEADING: Final = 12  # [-] bases of an operator beside which those that follow it are sought
SHOWN: Final = 3  # [-] reasons that are named for one robot
FOLLOWING: Final = 4  # [-] of the ones that follow for each


def pools(problem: StartProblem, setting: Setting, rng: np.random.Generator) -> tuple[list[Pool], str]:
    """Pools of all operators, and the first one that has none in words.

    Args:
        problem: The cell.
        setting: Where the part rests.
        rng: Random numbers.
    """
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
    if len(finer.q):
        return finer
    return pool(replace(problem, at_rest=problem.at_rest_fine), robot, setting, rng)


def _with_follower(problem: StartProblem, led: Pool, robot: int, setting: Setting, rng: np.random.Generator) -> Pool:
    """A pool with one operator more, whose base follows from those of the pool."""
    x, q, cost, drops = list(led.x[:0]), list(led.q[:0]), list[float](), Counter[str]()
    follower = led
    for row in range(min(len(led.q), LEADING)):
        there, start = setting.x.copy(), setting.start.copy()
        there[led.columns], start[led.joints] = led.x[row, led.columns], led.q[row]
        X_WB = problem.placed_layouts(there[None], start[None]).X_WB[0]
        follower = pool(problem, robot, replace(setting, x=there, start=start, X_WB=X_WB), rng)
        drops += follower.drops
        first = slice(0, FOLLOWING)
        x += list(follower.x[first])
        q += [np.append(led.q[row], start) for start in follower.q[first]]
        cost += (led.cost[row] + follower.cost[first]).tolist()
        if len(x) >= MOST_BASES:
            break
    order = np.argsort(cost, kind="stable")[:MOST_BASES].astype(np.intp)
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
