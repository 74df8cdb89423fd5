"""Tolerances: how far each base may be off, in one direction at a time, before a demand is missed."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.misplacement.corners import judged
from cellplan.search.misplacement.guarded import Guarded
from cellplan.search.programs.objective import Demands, Effort

FARTHEST: Final = 16.0  # [-] times the amount that is asked for
HALVINGS: Final = 9  # [-] of the range: to 3 % of that amount


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseTolerance:
    """How far one base may be off in one direction, all else in place."""

    name: str  # address of what is displaced
    sign: float  # direction, -1 or 1
    unit: Array  # the displacement by 1 [m] or [rad] in this direction, shape (m,)
    start: Array  # start configuration at the extent in [rad] or [m], shape (nq,)
    extent: float  # largest displacement found in [m] or [rad] at which all demands are kept, not negative
    missed: float  # smallest one found at which a demand is missed; inf where none was missed as far as was asked
    first: str  # the demand that is missed there; empty without one


def tolerances(
    problem: Guarded, start: Array, demands: Demands, effort: Effort, cycle: float
) -> tuple[BaseTolerance, ...]:
    """How far each base may be off in every direction, by bisection of all of them together.

    Args:
        start: Start posture of the layout in [rad] or [m], shape (nq,).
        cycle: Cycle in [s] in which limits of speed and acceleration must be kept.
    """
    amounts, count = problem.upper, len(problem.upper)
    directions = np.concatenate([np.diag(amounts), -np.diag(amounts)])
    tolerated, missed, first = np.zeros(2 * count), np.full(2 * count, np.inf), [""] * (2 * count)
    at, starts = np.full(2 * count, FARTHEST), np.tile(start, (2 * count, 1))
    for _ in range(1 + HALVINGS):
        failing = np.flatnonzero(~(tolerated == FARTHEST))
        if not failing.size:
            break
        corners = judged(problem, at[failing, None] * directions[failing], start, demands, effort)
        for row, corner in zip(failing.tolist(), corners, strict=True):
            if corner.keeps(cycle):
                tolerated[row], starts[row] = at[row], corner.start
            else:
                missed[row], first[row] = at[row], corner.first
        at = 0.5 * (tolerated + np.minimum(missed, FARTHEST))
    size = np.tile(amounts, 2)
    return tuple(
        BaseTolerance(
            name=problem.names[row % count],
            sign=1.0 if row < count else -1.0,
            unit=directions[row] / size[row],
            start=starts[row],
            extent=float(tolerated[row] * size[row]),
            missed=float(missed[row] * size[row]),
            first=first[row],
        )
        for row in range(2 * count)
    )
