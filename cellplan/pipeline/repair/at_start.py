"""What is broken in the start posture already: there only the robots concerned, or the holder, can change anything."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.model.units import MM
from cellplan.pipeline.layout.prepared import PreparedSearch
from cellplan.pipeline.repair.attempts import PART, Attempt, RemedyKind
from cellplan.scene.scene import Scene
from cellplan.search.programs.problem import Point

CLEARLY: Final = 1e-4  # [rad] or [m] by which a demand is missed for sure
KEEPS_START: Final = frozenset({RemedyKind.WEIGHTS, RemedyKind.METHOD, RemedyKind.DURATION})
FIRST: Final = np.array([0], dtype=np.intp)


@dataclass(frozen=True, slots=True, kw_only=True)
class StartFault:
    """A demand that the start posture misses.

    The start posture of an operator follows from its own base, tool and branch and from where the part is: a change of
    other operators leaves it as it is.
    """

    robots: frozenset[str]  # robots of which a change may help
    text: str  # what is missed

    def excludes(self, attempt: Attempt) -> bool:
        """Whether an attempt cannot help."""
        return attempt.kind in KEEPS_START or self.robots.isdisjoint(attempt.robots)


def start_faults(ready: PreparedSearch, point: Point) -> tuple[StartFault, ...]:
    """What the start of a motion misses of the demands."""
    problem, cell, margin = ready.coarse, ready.variables.base, ready.demands().margin
    holder = set(cell.positioners) or {PART}
    left = np.minimum(point.q[0] - problem.limits.lower, problem.limits.upper - point.q[0])
    faults = []
    for column in np.flatnonzero(left - margin < -CLEARLY).tolist():
        robot, joint = problem.joint_names(column)
        text = f"joint {robot}/{joint} has too little room in the start posture, which this does not change"
        faults.append(StartFault(robots=frozenset({robot, *holder}), text=text))
    near = problem.distances(point, FIRST, 0.0)
    missing = near.demands - near.values
    for row in np.argsort(-missing, kind="stable").tolist():
        if missing[row] > CLEARLY:
            names = problem.pair_names(int(near.pairs[row]))
            robots = frozenset().union(*(_carriers(ready.scene, name) for name in names))
            text = (
                f"{names[0]} and {names[1]} are {MM * float(missing[row]):.3g} mm too near in the start posture, which "
                "this does not change"
            )
            faults.append(StartFault(robots=robots | holder, text=text))
    return tuple(faults)


def _carriers(scene: Scene, name: str) -> set[str]:
    """The robot that a body belongs to."""
    return {body.robot for body in scene.bodies if body.name == name and body.robot is not None}
