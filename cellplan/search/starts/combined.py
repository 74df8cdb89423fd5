"""Operators put together: the coupled motion of many combinations, and what is left of them by limits and distances."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.search.kernel.figures import MotionFigures, Peaks
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.run import Motions, run
from cellplan.search.starts.at_rest import Pool, Setting
from cellplan.search.starts.effort import EFFORT
from cellplan.search.starts.problem import StartProblem

EAGER: Final = 2.0  # the larger, the rather combinations are made of the best
ANGLE: Final = 0.1  # [rad, m] beyond a margin that counts as much as
SPEED: Final = 0.1  # of a speed above its limit, or
LENGTH: Final = 0.01  # [m] of a distance too short


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """Candidates and what is left of them, the best first; F of them."""

    x: Array  # the variables, shape (F, n)
    start: Array  # start postures with the tools on their paths, shape (F, nq)
    violation: Array  # 0 for those that keep all limits and distances that were asked, shape (F,)
    cycle: Array  # shortest time in [s] of the same motion that keeps speeds and accelerations, shape (F,)
    picks: Indices  # what was picked of each pool, shape (F, pools)
    drops: Counter[str]  # how many candidates failed by what


def combined(
    problem: StartProblem, setting: Setting, pools: Sequence[Pool], rng: np.random.Generator
) -> tuple[Array, Array, Indices]:
    """Variables, shape (C, n), and start postures, (C, nq), of combinations, and their picks, (C, pools)."""
    sizes = [len(pool.q) for pool in pools]
    picks = np.stack([_picked(pool.cost, rng) for pool in pools], axis=1)
    if np.prod(sizes) <= EFFORT.combinations:
        picks = np.stack([part.ravel() for part in np.meshgrid(*(np.arange(size) for size in sizes))], axis=1)
    picks = np.unique(picks, axis=0)
    x, start = np.tile(setting.x, (len(picks), 1)), np.tile(setting.start, (len(picks), 1))
    for column, pool in enumerate(pools):
        x[:, pool.columns] = pool.x[picks[:, column]][:, pool.columns]
        start[:, pool.joints] = pool.q[picks[:, column]]
    return problem.with_starts(x, start), start, picks


def _picked(cost: Array, rng: np.random.Generator) -> Indices:
    """Picks of one pool, better ones more often, shape (combinations,)."""
    weights = np.exp(-EAGER * (cost - cost.min()))
    return rng.choice(len(cost), EFFORT.combinations, p=weights / weights.sum())


def judged(problem: StartProblem, x: Array, start: Array, picks: Indices | None = None) -> Judged:
    """Candidates that do the whole job, the best first: least violation, then shortest cycle.

    Limits are judged of all of them, distances of the best ones.

    Args:
        x: Variables, shape (C, n).
        start: Start postures, shape (C, nq).
        picks: What was picked of each pool, shape (C, pools).
    """
    layouts = problem.variables.layouts(x, start)
    motions = run(problem.job, layouts)
    picks = np.zeros((len(x), 0), dtype=np.intp) if picks is None else picks
    violation, cycle, drops = _by_joints(problem, motions)
    alive = np.flatnonzero(np.isfinite(violation))
    order = alive[np.lexsort((alive, cycle[alive], violation[alive]))]
    violation = violation.copy()
    chosen = order[: EFFORT.judged]
    placed = problem.placed_layouts(x, start) if problem.is_part_placed else layouts
    short = _shortfalls(problem, placed.of_places(chosen), motions.q[chosen], drops)
    violation[chosen] += short / LENGTH
    violation[order[EFFORT.judged :]] = np.inf
    chosen = chosen[np.lexsort((chosen, cycle[chosen], violation[chosen]))]
    handed_out = 0
    for candidate in chosen.tolist():
        if handed_out == EFFORT.handed_out or violation[candidate] > 0.0:
            break
        violation[candidate] += _exact_shortfall(problem, x[candidate], motions.q[candidate], drops) / LENGTH
        handed_out += violation[candidate] == 0.0
    chosen = chosen[np.lexsort((chosen, cycle[chosen], violation[chosen]))]
    return Judged(
        x=x[chosen],
        start=motions.q[chosen, 0],
        violation=violation[chosen],
        cycle=cycle[chosen],
        picks=picks[chosen],
        drops=drops,
    )


def _by_joints(problem: StartProblem, motions: Motions) -> tuple[Array, Array, Counter[str]]:
    """Violations, infinite where a path is lost, and cycles in [s], shape (C,) both, and how many fail by what."""
    job, drops = problem.job, Counter[str]()
    with np.errstate(all="ignore"):  # what lost its path is no number
        figures = MotionFigures.of(job, motions)
        shortfall = np.maximum(0.0, problem.margin - figures.margins).max(axis=1)
        rates = Peaks.of(job.times, job.rates @ (motions.qd / problem.acceleration), in_magnitude=True).value
        times = np.maximum(figures.speeds.value, np.sqrt(rates)).max(axis=1)
    excess = np.maximum(0.0, times - 1.0)
    violation = np.where(motions.is_followed, shortfall / ANGLE + excess / SPEED, np.inf)
    violation = np.where(np.isnan(violation), np.inf, violation)
    drops["loses a path"] = int(np.sum(np.isinf(violation)))
    drops["joint limit"] = int(np.sum(np.isfinite(violation) & (shortfall > 0.0)))
    drops["too fast"] = int(np.sum(np.isfinite(violation) & (excess > 0.0)))
    return violation, float(job.times[-1]) * times, drops


def _shortfalls(problem: StartProblem, layouts: Layouts, q: Array, drops: Counter[str]) -> Array:
    """By how much in [m] candidates fall short of distances at a few nodes, 0 where they do not, shape (C,)."""
    keys = _keys(q.shape[1], EFFORT.keys)
    short = problem.all_contacts.shortfalls(
        np.repeat(layouts.X_WB, len(keys), axis=0), q[:, keys].reshape(-1, q.shape[2])
    )
    worst = short.worst.reshape(len(q), len(keys))
    for candidate, key in enumerate(np.argmax(worst, axis=1).tolist()):
        pair = short.pair[candidate * len(keys) + key]
        if pair is not None:
            drops[f"{pair[0]} too near {pair[1]}"] += 1
    return np.maximum(0.0, worst.max(axis=1, initial=0.0))


def _exact_shortfall(problem: StartProblem, x: Array, q: Array, drops: Counter[str]) -> float:
    """The same of one candidate at more nodes, its columns and tools as they are."""
    keys = q[_keys(len(q), EFFORT.more_keys)]
    near = problem.distances.near(x, keys, problem.distances.most_demanded)
    short = problem.distances.demands[near.rows] - near.distances
    if not short.max(initial=0.0) > 0.0:
        return 0.0
    names = problem.distances.pairs[near.rows[int(np.argmax(short))]].names
    drops[f"{names[0]} too near {names[1]}"] += 1
    return float(short.max())


def _keys(nodes: int, count: int) -> Indices:
    """Some nodes, the first and the last among them."""
    return np.unique(np.linspace(0, nodes - 1, count).round().astype(np.intp))
