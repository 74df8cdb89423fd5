"""Measures: how a point stands to all demands, without any derivative."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.search.kernel.figures import FIGURES, PeakValues, refuse_not_finite
from cellplan.search.programs.objective import CycleTiming, Demands, Effort, Objective, Reserve
from cellplan.search.programs.pace import Pace
from cellplan.search.programs.problem import ArmValues, Distances, Point, Problem

ANGLE: Final = 0.01  # [rad] of a lack that weighs as much as
LENGTH: Final = 0.003  # [m] and as
SHARE: Final = 0.01  # [-] of the duration
SINGULAR: Final = 0.1  # [-] of a singular value that is demanded
IN_RESERVE: Final = 0.02  # [-] of the price of a lack where only the room is missed that counts as kept
FARTHEST: Final = 1e3  # [-] beyond a singular value that is not demanded
ROUNDING: Final = 1e-6  # [-] usual units: 3 nm


class MeasureKind(StrEnum):
    """What a demand is about."""

    LOWER_LIMIT = "lower_limit"
    UPPER_LIMIT = "upper_limit"
    SPEED = "speed"
    ACCELERATION = "acceleration"
    DISTANCE = "distance"
    DURATION = "duration"
    CYCLE = "cycle"
    SINGULAR = "singular"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measures:
    """Figures of one point; see ``Problem.is_dense`` for extremes between nodes.

    Attributes:
        speeds: Speeds as shares of their limits, shape (N, nq); of a retimed motion those of its shortest cycle, as if
            it lasted as long as the nodes do.
        accelerations: Accelerations likewise, shape (N, nq): the motion must last as many times as long as the nodes do
            as the root of them says.
    """

    point: Point
    lower: (
        PeakValues  # distances of the joints from their lower limits, the demanded margin off, negative, shape (N, nq)
    )
    upper: PeakValues  # likewise from their upper limits
    speeds: PeakValues
    accelerations: PeakValues
    distances: Distances  # near pairs at the keys
    violations: (
        Array  # by how much pairs miss what is demanded of them, in [m], negative where they keep it, shape (M,)
    )
    within: float  # distance in [m] beyond what is demanded, from which on pairs are not near
    factor: float  # how many times as long as the nodes the motion must last for all speeds and accelerations
    cycle: float  # shortest cycle in [s], with all transfers
    span: float  # time in [s] from the first node to the last
    arms: ArmValues | None  # least singular values of the arms; None where none are demanded
    singular: PeakValues  # shares of what is demanded of them that they miss, negative where they keep it, shape (N, A)
    pace: Pace | None = None  # the motion as fast as the limits allow everywhere; None with the time laws of the cell

    @classmethod
    def of(cls, problem: Problem, point: Point, demands: Demands, effort: Effort) -> "Measures":
        """Measure a point."""
        times, limits, beyond, transfers = problem.times, problem.limits, demands.beyond, problem.transfers
        span = float(times[-1] - times[0])
        pace = Pace.of(problem, point) if demands.timing is CycleTiming.RETIMED else None
        speeds, accelerations, factor = law_loads(problem, point) if pace is None else _paced(problem, point, pace)
        jerky = 0.0 if pace is None else transfers.window * len(pace.stretches)
        most = demands.clearance + (0.0 if beyond is None else float(beyond.max(initial=0.0)))
        distances = problem.distances(point, key_nodes(problem, effort), effort.within + most)
        added = np.where(distances.within_robot, 0.0, demands.clearance)
        if beyond is not None:
            added = added + beyond[distances.pairs]
        arms = None if demands.singular is None else problem.arms(point)
        lower = _crests(problem, limits.lower + demands.margin - point.q)
        upper = _crests(problem, point.q - limits.upper + demands.margin)
        for name, crests in zip(FIGURES, (lower, upper, speeds, accelerations), strict=True):
            refuse_not_finite(name, crests.value, problem.joint_names)
        return cls(
            point=point,
            lower=lower,
            upper=upper,
            speeds=speeds,
            accelerations=accelerations,
            distances=distances,
            violations=distances.demands + added - distances.values,
            within=effort.within,
            factor=factor,
            cycle=_work(demands, factor, span) + jerky + transfers.seconds(point.x, point.q),
            span=span,
            arms=arms,
            singular=PeakValues.of(times, _missing(arms, demands, len(times))),
            pace=pace,
        )

    def missed(self, problem: Problem, demands: Demands, reserve: Reserve) -> "Missed":
        """What every joint and pair misses at its worst."""
        units = np.where(problem.limits.is_revolute, ANGLE, LENGTH)
        joints = (np.stack([self.lower.value.max(axis=0), self.upper.value.max(axis=0)]) + reserve.margin) / units
        violations, allowed = [joints.ravel()], [np.tile(0.5 * reserve.margin / units, 2)]
        worst = np.full(int(self.distances.pairs.max(initial=-1)) + 1, -np.inf)
        reserved = reserves(self.distances, reserve)
        np.maximum.at(worst, self.distances.pairs, (self.violations + reserved) / LENGTH)
        most = np.zeros_like(worst)
        most[self.distances.pairs] = 0.5 * reserved / LENGTH
        violations.append(worst)
        allowed.append(most)
        violations.append((self.singular.value.max(axis=0) + reserve.singular) / SINGULAR)
        allowed.append(np.full(len(violations[-1]), 0.5 * reserve.singular / SINGULAR))
        if demands.duration is not None:
            whole = demands.duration / self.span / (1.0 + reserve.time)
            loads = np.array([self.factor])
            if self.pace is None:
                loads = np.concatenate([self.speeds.value.max(axis=0), np.sqrt(self.accelerations.value.max(axis=0))])
            violations.append((loads / whole - 1.0) / SHARE)
            allowed.append(np.full(len(loads), 0.5 * reserve.time / SHARE))
        return Missed(violations=np.concatenate(violations), allowed=np.concatenate(allowed))

    def values(self, kind: MeasureKind, subjects: Indices, nodes: Indices) -> Array:
        """Measures of a kind: violations of margins and distances, shares of speeds; NaN where not measured."""
        of_nodes = {
            MeasureKind.LOWER_LIMIT: self.lower,
            MeasureKind.UPPER_LIMIT: self.upper,
            MeasureKind.SPEED: self.speeds,
            MeasureKind.SINGULAR: self.singular,
        }
        if (crests := of_nodes.get(kind)) is not None:
            return crests.value[nodes, subjects]
        match kind:
            case MeasureKind.ACCELERATION:
                return np.sqrt(self.accelerations.value[nodes, subjects])
            case MeasureKind.DURATION:
                return np.full(len(nodes), self.factor)
            case MeasureKind.CYCLE:
                return np.full(len(nodes), self.cycle)
            case _:
                distances = self.distances
                places = zip(distances.pairs.tolist(), distances.nodes.tolist(), strict=True)
                known = dict(zip(places, self.violations.tolist(), strict=True))
                queries = zip(subjects.tolist(), nodes.tolist(), strict=True)
                return np.array([known.get(key, np.nan) for key in queries])

    def objective(self, problem: Problem, demands: Demands) -> float:
        """What is to be small: the cycle in [s], the cost of the change, or the least room between bodies, negative."""
        match demands.objective:
            case Objective.CYCLE:
                return self.cycle
            case Objective.CHANGE:
                return float((np.abs(self.point.x - problem.given) * problem.cost).sum())
            case Objective.CLEARANCE:
                return self.nearest
            case Objective.CONFORMING:
                return 0.0

    @property
    def nearest(self) -> float:
        """The largest of ``violations`` but those within a robot in [m]: bodies are so much too near each other."""
        return float(self.violations[~self.distances.within_robot].max(initial=-self.within))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Missed:
    """What joints and pairs miss at their worst, in usual units."""

    violations: Array  # with the whole room, negative where kept, shape (F,)
    allowed: Array  # what of it counts as kept, shape (F,)

    @property
    def violation(self) -> float:
        """Sum of what does not count as kept; what is left of rounding does."""
        total = float(np.maximum(self.violations - self.allowed, 0.0).sum())
        return total if total > ROUNDING else 0.0

    def cost(self, price: float) -> float:
        """What it costs in the merit of a point, at the price of one unit: little where it counts as kept."""
        return price * (self.violation + IN_RESERVE * float(np.clip(self.violations, 0.0, self.allowed).sum()))


def _crests(problem: Problem, values: Array, *, in_magnitude: bool = False) -> PeakValues:
    """Functions of time with values at the nodes of shape (N, n), and their extremes between them where these count."""
    if problem.is_dense:
        return PeakValues.at_nodes(values, in_magnitude=in_magnitude)
    return PeakValues.of(problem.times, values, in_magnitude=in_magnitude)


def law_loads(problem: Problem, point: Point) -> tuple[PeakValues, PeakValues, float]:
    """Speeds and accelerations under the laws, and how many times as long as the nodes they must last."""
    speeds = _crests(problem, point.qd / problem.limits.velocity, in_magnitude=True)
    accelerations = _crests(problem, point.qdd / problem.acceleration, in_magnitude=True)
    return speeds, accelerations, max(float(speeds.value.max()), float(np.sqrt(accelerations.value.max())))


def _work(demands: Demands, factor: float, span: float) -> float:
    """Time of the motions in [s]: as fast as the limits allow, or as a program has them."""
    is_written = demands.objective is Objective.CYCLE and demands.duration is not None
    return span if is_written else factor * span


def _missing(arms: ArmValues | None, demands: Demands, nodes: int) -> Array:
    """Shares of the singular values that are demanded, which are missed, shape (N, A)."""
    if arms is None or demands.singular is None:
        return np.zeros((nodes, 0))
    is_demanded = demands.singular > 0.0
    return np.where(is_demanded, 1.0 - arms.values / np.where(is_demanded, demands.singular, 1.0), -FARTHEST)


def _paced(problem: Problem, point: Point, pace: Pace) -> tuple[PeakValues, PeakValues, float]:
    """The same of a retimed motion: at its nodes, as nothing is an extreme between them."""
    factor = pace.seconds / float(problem.times[-1] - problem.times[0])
    velocities, accelerations = (
        PeakValues.at_nodes(share * factor**order)
        for order, share in enumerate(pace.reached(point.qd, point.qdd), start=1)
    )
    return velocities, accelerations, factor


def reserves(distances: Distances, reserve: Reserve) -> Array:
    """What is asked of near pairs beyond their demands in [m], shape (M,)."""
    return np.where(distances.within_robot, reserve.within_robot, reserve.distance)


def key_nodes(problem: Problem, effort: Effort) -> Indices:
    """Nodes at which distances are asked: the ones nearest to even times of each motion, and to the times given."""
    chosen = [np.abs(problem.times[:, None] - np.array(effort.also_at)).argmin(axis=0)]
    for part in problem.transfers.parts:
        times = problem.times[part]
        even = np.linspace(times[0], times[-1], effort.keys)
        chosen.append(part.start + np.abs(times[:, None] - even).argmin(axis=0))
    return np.unique(np.concatenate(chosen)).astype(np.intp)
