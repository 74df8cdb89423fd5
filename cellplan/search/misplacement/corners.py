"""Corners: layouts whose bases are all off their places, planned anew; and how far each base may be off by itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.misplacement.guarded import Guarded
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort, Objective

FARTHEST: Final = 16.0  # [-] times the amount that is asked for
HALVINGS: Final = 9  # [-] of the range: to 3 % of that amount


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corner:
    """A layout with displaced bases."""

    d: Array  # the displacements, shape (m,)
    start: Array  # its start posture in [rad] or [m], shape (nq,); not valid where it is not followed
    cycle: float  # its shortest cycle in [s]; inf where a tool loses its path
    margins: Array  # by how much each joint keeps more than the margin that is demanded, in [rad] or [m], shape (nq,)
    spare_distances: (
        Array  # by how much each pair of bodies that is near keeps more than its distance, in [m]; inf for others
    )
    first: str  # the limit that is the next to be missed, or that is missed most: one line of text

    @property
    def spare_distance(self) -> float:
        """The least of ``rooms``."""
        return float(self.spare_distances.min(initial=np.inf))

    def keeps(self, cycle: float) -> bool:
        """Whether all demands are kept in a cycle of so many seconds."""
        return self.cycle <= cycle and bool(np.all(self.margins >= 0.0)) and self.spare_distance >= 0.0


def judged(problem: Guarded, d: Array, start: Array, demands: Demands, effort: Effort) -> list[Corner]:
    """Motions of a layout with displaced bases, planned anew, all together.

    Args:
        d: The displacements, shape (K, m).
        start: Start posture of the layout, near theirs, shape (nq,).
    """
    corners = []
    for place, point in enumerate(problem.points(d, start)):
        if point is None:
            corners.append(_lost(problem, d[place], start))
        else:
            corners.append(_measured(problem, Measures.of(problem, point, demands, effort), demands))
    return corners


def _lost(problem: Guarded, d: Array, start: Array) -> Corner:
    """A layout in which a tool cannot follow."""
    margins, spare = np.full(len(problem.limits.velocity), -np.inf), np.full(len(problem.is_arm), -np.inf)
    return Corner(d=d, start=start, cycle=np.inf, margins=margins, spare_distances=spare, first="a tool loses its path")


def _measured(problem: Guarded, measures: Measures, demands: Demands) -> Corner:
    """A layout whose motion is known; its cycle is that of the motions alone where that is not the objective."""
    spare, is_whole = np.full(len(problem.is_arm), np.inf), demands.objective is Objective.CYCLE
    np.minimum.at(spare, measures.distances.pairs, -measures.violations)
    beyond = np.maximum(measures.lower.value.max(axis=0), measures.upper.value.max(axis=0))
    point = measures.point
    return Corner(
        d=point.x,
        start=point.start,
        cycle=measures.cycle if is_whole else measures.factor * measures.span,
        margins=-beyond,
        spare_distances=spare,
        first=_first(problem, measures, beyond, spare),
    )


def _first(problem: Guarded, measures: Measures, beyond: Array, spare: Array) -> str:
    """What is missed most, of margins and distances; else the joint that decides the cycle."""
    scores: Sequence[float] = (float(beyond.max()) / np.radians(1.0), -float(spare.min(initial=np.inf)) / 0.01)
    if max(scores) <= 0.0:
        speeds, rates = measures.speeds.value.max(axis=0), np.sqrt(measures.accelerations.value.max(axis=0))
        loads, kind = (speeds, "velocity") if speeds.max() >= rates.max() else (rates, "acceleration")
        return f"{kind} of {' '.join(problem.joint_names(int(loads.argmax())))}"
    if scores[0] >= scores[1]:
        return f"margin of {' '.join(problem.joint_names(int(beyond.argmax())))}"
    return f"distance of {' and '.join(problem.pair_names(int(spare.argmin())))}"


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
