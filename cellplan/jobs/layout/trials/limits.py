"""What holds a layout back or what it breaks, and what each variable does about it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, TypedDict

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.timed_program import BINDS
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import number
from cellplan.search.kernel.figures import PeakValues
from cellplan.search.programs.explain import explain
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.problem import Point, PointDerivatives, Problem
from cellplan.search.programs.rows import Linear

NEAR_ANGLE: Final = np.radians(0.5)  # [rad] above the demand at which a margin binds
TOUCHING: Final = 1e-9  # [m] bodies of which less is demanded may touch
NEAR_SHARE: Final = 0.05  # [-] likewise of a singular value
NEAR_LENGTH: Final = 0.004  # [m] likewise of a distance or a sliding joint


class LimitRecord(TypedDict):
    """A limit that a layout breaks or that holds it back."""

    kind: Annotated[
        str, "`position`, `velocity`, `acceleration`, `distance`, `singular`, `bound`, `start`, `path` or `check`"
    ]
    subject: Annotated[str, "robot and joint, pair of bodies, or variable"]
    text: Annotated[str, "one line of text"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Standing:
    """A point measured against its demands."""

    problem: Problem
    measures: Measures
    demands: Demands

    @property
    def margin(self) -> float | None:
        """Smallest distance of a turning joint from its limits in [deg]; None without such limits."""
        turning = self.problem.limits.is_revolute
        least = float((self.demands.margin - self._beyond)[turning].min(initial=np.inf))
        return DEG * least if least < np.inf else None

    @property
    def clearance(self) -> float | None:
        """Smallest distance of bodies at the keys in [mm]; None where none are near."""
        return self._smallest(with_inner=True)

    @property
    def apart(self) -> float | None:
        """The same of bodies that do not belong to one robot."""
        return self._smallest(with_inner=False)

    def _smallest(self, *, with_inner: bool) -> float | None:
        """Smallest distance of pairs that are to be apart, not only in touch; None where none are near."""
        distances = self.measures.distances
        is_demanded = distances.demands >= min(TOUCHING, float(distances.demands.max(initial=0.0)))
        values = distances.values[is_demanded & (with_inner | ~distances.within_robot)]
        return MM * float(values.min()) if len(values) else None

    @property
    def _beyond(self) -> Array:
        """How far the joints are beyond what is demanded, shape (nq,)."""
        return np.maximum(self.measures.lower.value.max(axis=0), self.measures.upper.value.max(axis=0))

    def violations(self) -> list[LimitRecord]:
        """What it breaks, the worst first."""
        limits = [*self._margins(0.0, 0.0), *self._distances(0.0), *_singular(self, 0.0)]
        if self.demands.duration is not None:
            limits += self._loads(self._whole)
        return [record for _, record in sorted(limits, key=lambda entry: -entry[0])]

    def binding(self) -> list[LimitRecord]:
        """What holds it back: loads on the clock, margins, distances, bounds of variables."""
        loads = self._loads(self._whole, least=BINDS) if self._whole > 0.0 else iter(())
        limits = [
            *loads,
            *self._margins(NEAR_ANGLE, NEAR_LENGTH),
            *self._distances(NEAR_LENGTH),
            *_singular(self, NEAR_SHARE),
        ]
        return [record for _, record in limits] + list(self._bounds())

    @property
    def _whole(self) -> float:
        """How many times as long as the nodes the motion lasts: as demanded, or as short as possible."""
        if self.demands.duration is None:
            return self.measures.factor
        return self.demands.duration / float(self.problem.times[-1] - self.problem.times[0])

    def _loads(self, factor: float, *, least: float = 1.0) -> Iterator[tuple[float, LimitRecord]]:
        """Joints at a share of more than ``least`` of their limits in a time of ``factor`` times that of the nodes."""
        measures, times = self.measures, self.problem.times
        for kind, crests, order in (("velocity", measures.speeds, 1.0), ("acceleration", measures.accelerations, 2.0)):
            value = crests.value.max(axis=0) ** (1.0 / order)
            for column in np.flatnonzero((value / factor) ** order > least).tolist():
                share = value[column] / self._whole
                at = times[int(crests.value[:, column].argmax())] / times[-1]
                name = " ".join(self.problem.joint_names(column))
                text = (
                    f"{name} at {100.0 * share**order:.4g} % of its {kind} limit, at {100.0 * at:.0f} % of the motion"
                )
                yield 100.0 * (float(share) - 1.0), {"kind": kind, "subject": name, "text": text}

    def _margins(self, angle: float, length: float) -> Iterator[tuple[float, LimitRecord]]:
        """Joints nearer to their limits than demanded and a little more."""
        beyond = self._beyond
        for column, is_turning in enumerate(self.problem.limits.is_revolute.tolist()):
            if not beyond[column] > -(angle if is_turning else length):
                continue
            scale, unit = (DEG, "deg") if is_turning else (MM, "mm")
            left = scale * float(self.demands.margin[column] - beyond[column])
            demand = scale * float(self.demands.margin[column])
            name = " ".join(self.problem.joint_names(column))
            what = f"{-left:.4g} {unit} beyond its limit" if left < 0.0 else f"{left:.4g} {unit} from its limit"
            more = f", {demand:.4g} {unit} demanded" if demand > 0.0 else ""
            yield scale * float(beyond[column]), {"kind": "position", "subject": name, "text": f"{name} {what}{more}"}

    def _distances(self, tolerance: float) -> Iterator[tuple[float, LimitRecord]]:
        """Pairs nearer to each other than demanded and a little more, each once."""
        distances, violations = self.measures.distances, self.measures.violations
        seen = set[int]()
        for row in np.argsort(-violations, kind="stable").tolist():
            pair = int(distances.pairs[row])
            if not violations[row] > -tolerance:
                return
            is_shallow = distances.demands[row] < 0.0 and violations[row] < 0.5 * distances.demands[row]
            if pair in seen or is_shallow:  # what may be in each other, as a grip, is not near its demand there
                continue
            seen.add(pair)
            distance, demand = MM * float(distances.values[row]), MM * float(distances.demands[row])
            names = " and ".join(self.problem.pair_names(pair))
            how = f"{distance:.3g} mm apart" if distance >= 0.0 else f"{-distance:.3g} mm into each other"
            text = f"{names} {how}, {demand:.3g} mm demanded"
            yield MM * float(violations[row]), {"kind": "distance", "subject": names, "text": text}

    def _bounds(self) -> Iterator[LimitRecord]:
        problem, x = self.problem, self.measures.point.x
        near = 1e-6 * problem.scale
        for place, name in enumerate(problem.names):
            for side, gap in (("lower", x[place] - problem.lower[place]), ("upper", problem.upper[place] - x[place])):
                if gap <= near[place]:
                    yield {"kind": "bound", "subject": name, "text": f"{name} at its {side} bound"}


def _singular(standing: Standing, tolerance: float) -> Iterator[tuple[float, LimitRecord]]:
    """Arms nearer to singular configurations than demanded and a little more."""
    arms, demanded = standing.measures.arms, standing.demands.singular
    if arms is None or demanded is None:
        return
    violations = standing.measures.singular.value.max(axis=0)
    for place in np.flatnonzero(violations > -tolerance).tolist():
        name, value = arms.names[place], (1.0 - float(violations[place])) * float(demanded[place])
        text = f"{name} at a smallest singular value of {value:.3g}, {demanded[place]:.3g} demanded"
        yield 100.0 * float(violations[place]), {"kind": "singular", "subject": name, "text": text}


def reason(violation: LimitRecord) -> str:
    """Why a trial ended without a conforming layout, the same for all that end for it."""
    kinds = {
        "position": "joint too near its limit",
        "distance": "bodies too near each other",
        "singular": "arm too near a singular configuration",
    }
    what = kinds.get(violation["kind"], f"{violation['kind']} above its limit")
    return f"{what}: {violation['subject']}"


def standing_of(problem: Problem, point: Point, demands: Demands, effort: Any) -> Standing:
    """A point measured."""
    return Standing(problem=problem, measures=Measures.of(problem, point, demands, effort), demands=demands)


def effects(standing: Standing, steps: Array, linear: Linear | None = None) -> dict[str, list[float | None]]:
    """Effects of a step of each variable, shape (n,): on cycle in [s], smallest margin in [deg], clearance in [mm].

    Args:
        linear: The derivatives at that point, where they are known.
    """
    problem = standing.problem
    linear = linear or Linear.of(problem, standing.measures)
    by = linear.derivatives
    span = float(problem.times[-1] - problem.times[0])
    return {
        "cycle_s": _listed((span * _of_factor(standing, by) + _of_transfers(standing, by)) * steps),
        "margin_deg": _listed(_of_margin(standing, by) * DEG * steps),
        "clearance_mm": _listed(_of_distance(standing, linear) * MM * steps),
    }


def _of_factor(standing: Standing, by: PointDerivatives) -> Array:
    """Derivatives of the load of the joint that decides the clock; of all that decide it where it is retimed."""
    problem, measures = standing.problem, standing.measures
    if standing.demands.objective is Objective.CYCLE and not standing.demands.is_shorter_work:
        return np.zeros(by.q.shape[-1])
    if measures.pace is not None:
        demands = replace(standing.demands, objective=Objective.CYCLE, duration=None)
        optimum = explain(problem, measures.point, demands, Effort())
        span = float(problem.times[-1] - problem.times[0])
        return np.full(by.q.shape[-1], np.nan) if optimum is None else optimum.by_variable / span
    rates = np.sqrt(measures.accelerations.value)
    if by.qdd is not None and rates.max() > measures.speeds.value.max():
        highest = _highest(measures.accelerations, by.qdd, problem.acceleration, measures.accelerations.value)
        return highest / (2.0 * float(rates.max()))
    return _highest(measures.speeds, by.qd, problem.limits.velocity, measures.speeds.value)


def _of_transfers(standing: Standing, by: PointDerivatives) -> Array:
    """Derivatives of the time of the transfers of a program; those of a retimed one are in its load."""
    point, transfers = standing.measures.point, standing.problem.transfers
    if standing.measures.pace is not None:
        return np.zeros(by.q.shape[-1])
    return transfers.derivatives(point.x, point.q, by.q)


def _of_margin(standing: Standing, by: PointDerivatives) -> Array:
    """Derivatives of the smallest margin of a turning joint."""
    turning = standing.problem.limits.is_revolute
    lower, upper = standing.measures.lower, standing.measures.upper
    if not turning.any():
        return np.full(by.q.shape[-1], np.nan)
    seen = [np.where(turning, side.value, -np.inf) for side in (lower, upper)]
    is_lower = seen[0].max() > seen[1].max()
    ones = np.ones(len(turning))
    return _highest(lower, by.q, ones, seen[0]) if is_lower else -_highest(upper, by.q, ones, seen[1])


def _of_distance(standing: Standing, linear: Linear) -> Array:
    """Derivatives of the smallest distance of bodies that do not belong to one robot."""
    distances = standing.measures.distances
    if not len(distances.values) or distances.within_robot.all():
        return np.full(linear.derivatives.q.shape[-1], np.nan)
    values = np.where(distances.within_robot, np.inf, distances.values - distances.demands)
    return linear.distances[int(values.argmin())]


def _highest(crests: PeakValues, by: Array, limits: Array, values: Array) -> Array:
    """Derivatives of the highest value, shape (n,)."""
    node, column = np.unravel_index(int(values.argmax()), values.shape)
    nodes, columns = np.array([node], dtype=np.intp), np.array([column], dtype=np.intp)
    return np.asarray(crests.derivatives(nodes, columns, by)[0] / limits[column])


def _listed(values: Array) -> list[float | None]:
    """Plain numbers; None for those that are not finite."""
    return [number(round(float(value), 9)) if np.isfinite(value) else None for value in values.tolist()]
