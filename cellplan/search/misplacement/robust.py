"""Robust layouts: improved until they keep their demands with all bases off their places, with one cycle for all.

The programs ask for what displacements take to first order beyond the demands. What bends beyond that is measured: the
worst corners by the derivatives, each displacement alone at its ends, and seeded corners are planned anew, and what
they still miss is asked for in the next round.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.misplacement.corners import Corner, judged
from cellplan.search.misplacement.guarded import GuardedProblem
from cellplan.search.misplacement.worst import worst
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.objective import Allowance, Demands, Effort, Objective

SEEDED: Final = 128  # [-] corners
ROUNDS: Final = 6  # [-] in which what was missed is asked for
WITHIN: Final = 0.003  # [m] beyond the demand: of pairs that are this near in a corner the room is known
MORE_ANGLE: Final = float(np.radians(0.05))  # [rad] asked for beyond what a corner missed
MORE_LENGTH: Final = 0.0003  # [m] likewise
MORE_REACH: Final = 0.003  # [m] likewise of the singular values of arms: 0.01
MORE_TIME: Final = 0.002  # [-] likewise
GAIN: Final = 0.002  # [-] share of the cycle that another round must gain
START_OVER: Final = 0.1  # [-] usual steps: first region of each round


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robust:
    """A layout and its corners.

    Attributes:
        found: The layout, as the last programs left it.
        corners: All corners that were planned: the worst ones by derivatives, the ends, then the seeded ones.
        worst_ones: Number of those by derivatives.
        ends: Number of displacements at their ends, one at a time.
        cycle: Shortest cycle in [s] in which the layout and all its corners keep their limits.
        problem: The job, with the displacements as its variables.
    """

    found: Improved
    corners: tuple[Corner, ...]
    worst_ones: int
    ends: int
    cycle: float
    problem: GuardedProblem

    @property
    def is_kept(self) -> bool:
        """Whether all corners keep all demands in ``cycle``."""
        return all(corner.keeps(self.cycle) for corner in self.corners)

    @property
    def kept(self) -> int:
        """Number of corners that keep all demands in ``cycle``."""
        return sum(corner.keeps(self.cycle) for corner in self.corners)


@dataclass(slots=True, kw_only=True)
class _Bent:
    """What corners were seen to take beyond the first order."""

    margin: Array
    distance: Array
    time: float = 0.0

    def on(self, allowance: Allowance) -> Allowance:
        """What is taken in all."""
        return Allowance(
            margin=allowance.margin + self.margin,
            speed=allowance.speed * (1.0 + self.time) + self.time,
            acceleration=allowance.acceleration * (1.0 + self.time) + 2.0 * self.time,
            distance=allowance.distance + self.distance,
        )

    def add(self, robust: Robust, demands: Demands, effort: Effort) -> None:
        """Ask for what corners missed, and a little more."""
        followed = [corner for corner in robust.corners if np.isfinite(corner.cycle)]
        if len(followed) < len(robust.corners):  # out of reach: only further from singular configurations helps
            self.distance[len(robust.problem.bodies.pairs) :] += MORE_REACH
        if followed:
            missed = -np.min([corner.margins for corner in followed], axis=0)
            self.margin += np.where(missed > 0.0, np.minimum(missed, 10.0 * MORE_ANGLE) + MORE_ANGLE, 0.0)
            lacks = -np.min([corner.rooms for corner in followed], axis=0)
            self.distance += np.where(lacks > 0.0, np.minimum(lacks, 20.0 * MORE_LENGTH) + MORE_LENGTH, 0.0)
        if demands.duration is not None and robust.cycle > demands.duration:
            self.time += min(robust.cycle / demands.duration - 1.0, 0.05) + effort.room.time


def robust_layout(
    problem: GuardedProblem,
    displaced: Callable[[Array], GuardedProblem],
    begin: tuple[Array, Array],
    demands: Demands,
    effort: Effort,
    *,
    signs: Array,
) -> Robust | None:
    """Improve a layout until its corners keep all demands; the best of what was found, None without a motion.

    Args:
        problem: The layout problem.
        displaced: The same job for a layout, shape (n,), with displacements of its bases as variables.
        begin: Variables, shape (n,), and start posture, shape (nq,).
        demands: The objective and what must be kept in every corner.
        effort: How much work each round may do.
        signs: Seeded corners, each displacement -1 or 1, shape (C, m).
    """
    (x, start), best = begin, None
    bent = _Bent(margin=np.zeros(len(start)), distance=np.zeros(problem.pair_count))
    point = problem.evaluate(x, start)
    for _ in range(ROUNDS):
        if point is None:
            break
        of = displaced(point.x)
        allowance = bent.on(worst(of, replace(point, x=of.given), demands, effort).allowance)
        found = improve(problem, point.x, point.start, replace(demands, allowance=allowance), effort)
        if found is None:
            break
        robust = _with_corners(displaced(found.x), found, demands, effort, signs)
        is_better = best is None or _rank(robust, demands) < _rank(best, demands)
        is_done = best is not None and best.is_kept and not robust.cycle < (1.0 - GAIN) * best.cycle
        if is_better:
            best = robust
        if is_done or (demands.objective is not Objective.CYCLE and _is_enough(robust, demands)):
            break
        bent.add(robust, demands, effort)
        point = found.point
    return best


def seeded_signs(rng: np.random.Generator, count: int) -> Array:
    """Seeded corners of displacements, -1 or 1, shape (SEEDED, m)."""
    return rng.choice([-1.0, 1.0], (SEEDED, count))


def _with_corners(problem: GuardedProblem, found: Improved, demands: Demands, effort: Effort, signs: Array) -> Robust:
    """A layout with all its corners planned anew."""
    amounts = problem.upper
    listed = worst(problem, replace(found.point, x=problem.given), demands, effort).corners
    ends = np.concatenate([np.diag(amounts), -np.diag(amounts)])
    d = np.concatenate([problem.given[None], listed, ends, signs * amounts])
    near = replace(effort, within=WITHIN)
    nominal, *corners = judged(problem, d, found.start, demands, near)
    return Robust(
        found=found,
        corners=tuple(corners),
        worst_ones=len(listed),
        ends=len(ends),
        cycle=max(nominal.cycle, *(corner.cycle for corner in corners)),
        problem=problem,
    )


def _is_enough(robust: Robust, demands: Demands) -> bool:
    """Whether all corners keep all demands, at the duration that is demanded."""
    return robust.is_kept and (demands.duration is None or robust.cycle <= demands.duration)


def _rank(robust: Robust, demands: Demands) -> tuple[bool, int, float]:
    """What makes one better than another."""
    return not _is_enough(robust, demands), len(robust.corners) - robust.kept, robust.cycle
