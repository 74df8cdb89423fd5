"""Measures: how a point stands to all demands, without any derivative."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.search.kernel.figures import Crests
from cellplan.search.programs.objective import Demands, Effort, Room
from cellplan.search.programs.problem import Distances, Point, Problem

ANGLE: Final = 0.01  # [rad] of a lack that weighs as much as
LENGTH: Final = 0.003  # [m] and as
SHARE: Final = 0.01  # [-] of the duration
OWN_ROOM: Final = 0.1  # [-] share of the room that is asked of a robot's own bodies


class Kind(StrEnum):
    """What a demand is about."""

    LOWER_LIMIT = "lower_limit"
    UPPER_LIMIT = "upper_limit"
    SPEED = "speed"
    ACCELERATION = "acceleration"
    DISTANCE = "distance"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measures:
    """Figures of one point; each is that of the parabola where it is an extreme between nodes.

    Attributes:
        point: The point.
        lower: Distances of the joints from their lower limits, the demanded margin off, negative, shape (N, nq).
        upper: Likewise from their upper limits.
        speeds: Speeds as shares of their limits, shape (N, nq).
        accelerations: Roots of the accelerations as shares of their limits, shape (N, nq): the motion must last so many
            times as long as the nodes do.
        distances: Near pairs at the keys.
        lacks: By how much pairs miss what is demanded of them, in [m], negative where they keep it, shape (M,).
        factor: How many times as long as the nodes the motion must last for all speeds and accelerations.
        cycle: Shortest cycle in [s].
    """

    point: Point
    lower: Crests
    upper: Crests
    speeds: Crests
    accelerations: Crests
    distances: Distances
    lacks: Array
    factor: float
    cycle: float

    @classmethod
    def of(cls, problem: Problem, point: Point, demands: Demands, effort: Effort) -> "Measures":
        """Measure a point."""
        times, limits = problem.times, problem.limits
        speeds = Crests.of(times, point.qd / limits.velocity, in_magnitude=True)
        accelerations = Crests.of(times, point.qdd / problem.acceleration, in_magnitude=True)
        factor = max(float(speeds.value.max()), float(np.sqrt(accelerations.value.max())))
        within = effort.within + demands.clearance
        distances = problem.distances(point, key_nodes(problem, effort), within)
        added = np.where(distances.is_own, 0.0, demands.clearance)
        return cls(
            point=point,
            lower=Crests.of(times, limits.lower + demands.margin - point.q),
            upper=Crests.of(times, point.q - limits.upper + demands.margin),
            speeds=speeds,
            accelerations=accelerations,
            distances=distances,
            lacks=distances.demands + added - distances.values,
            factor=factor,
            cycle=factor * float(times[-1] - times[0]),
        )

    def violation(self, problem: Problem, demands: Demands, room: Room) -> float:
        """Sum over all joints and pairs of what they miss at their worst, half of the room off, in usual units."""
        turning = problem.limits.is_revolute
        units = np.where(turning, ANGLE, LENGTH)
        missed = np.maximum(self.lower.value.max(axis=0), self.upper.value.max(axis=0)) + 0.5 * room.margin
        total = float((np.maximum(missed, 0.0) / units).sum())
        worst = np.full(int(self.distances.pairs.max(initial=-1)) + 1, -np.inf)
        np.maximum.at(worst, self.distances.pairs, self.lacks + 0.5 * rooms(self.distances, room))
        total += float(np.maximum(worst, 0.0).sum()) / LENGTH
        if demands.duration is not None:
            total += max(0.0, self.cycle * (1.0 + 0.5 * room.time) / demands.duration - 1.0) / SHARE
        return total


def rooms(distances: Distances, room: Room) -> Array:
    """What is asked of near pairs beyond their demands in [m], shape (M,)."""
    return np.where(distances.is_own, OWN_ROOM, 1.0) * room.distance


def key_nodes(problem: Problem, effort: Effort) -> Indices:
    """Nodes at which distances are asked: the ones nearest to even times, and the extra ones."""
    times = problem.times
    even = np.linspace(times[0], times[-1], effort.keys)
    nearest = np.abs(times[:, None] - even).argmin(axis=0)
    return np.unique(np.concatenate([nearest, np.array(effort.extra_keys, dtype=np.intp)])).astype(np.intp)
