"""Robust layouts: improved until they keep their demands with all bases off their places, with one cycle for all.

The programs know the motions of a few displacements, their scenarios, beside that of the layout in place: speeds,
accelerations and margins of each are rows with exact derivatives, so that a step may make the layout less sensitive.
Of distances they ask for what displacements take to first order. The first scenarios are the corners that are the worst
for a limit by the derivatives. After each round these, each displacement alone at its ends and seeded corners are
planned anew; those that miss most are further scenarios of the next round.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.frozen import derive
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.run import run, run_near
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.misplacement.corners import Corner, judged
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import Guarded, GuardedProblem, GuardedProgram, away_from_fold
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.problem import Point, PointDerivatives
from cellplan.search.variables.phase_variables import in_place_of

MOST: Final = 8  # [-] corners of each kind of demand
SEEDED: Final = 128  # [-] corners
ROUNDS: Final = 5  # [-] of programs and corners
ADDED: Final = 8  # [-] scenarios that a round adds at most
WITHIN: Final = 0.003  # [m] beyond the demand: of pairs that are this near in a corner the room is known
MORE_LENGTH: Final = 0.0003  # [m] asked for beyond what a corner missed
MOST_LENGTH: Final = 0.006  # [m] asked for at once
MORE_REACH: Final = 0.003  # [m] more of singular values of arms, where a corner has no motion; counts as 0.01 of these
LONGER: Final = 1e-3  # [-] share by which a corner may last longer than the scenarios and not become a scenario
NEAR: Final = 0.02  # [-] share of the cycle within which a scenario is kept on more nodes
NEAR_ANGLE: Final = float(np.radians(1.0))  # [rad] or [m] of a margin, likewise
ANGLE: Final = 0.1  # [rad] or [m] of a missed margin that counts like doubling the cycle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Worst:
    """What displacements may take from the demands of one layout."""

    margins: Array  # what they take from the margins at the nodes to first order, in [rad] or [m], shape (N, nq)
    speeds: Array  # likewise from the speeds as shares of their limits, shape (N, nq)
    accelerations: Array  # likewise from the accelerations, shape (N, nq)
    distances: Array  # likewise from each pair of bodies in [m], shape (pairs,)
    corners: Array  # the displacements that do it for what comes nearest to its limit, shape (K, m)


def worst(problem: Guarded, point: Point, demands: Demands, effort: Effort) -> Worst:
    """To first order a figure with derivatives g changes by at most sum |g_k| a_k, in the corner of the signs of g."""
    amounts, by = problem.upper, problem.derivatives(point)
    measures = Measures.of(problem, point, demands, effort)
    apart = problem.distance_derivatives(point, measures.distances, by)
    q, qd = (np.abs(part) @ amounts for part in (by.q, by.qd))
    qdd = np.zeros_like(qd) if by.qdd is None else np.abs(by.qdd) @ amounts
    rows = measures.distances
    taken = away_from_fold(problem, np.abs(apart) @ amounts, rows.values, rows.pairs)
    worst_case = Worst(
        margins=q,
        speeds=qd / problem.limits.velocity,
        accelerations=qdd / problem.acceleration,
        distances=_of_pairs(problem, measures, taken),
        corners=np.zeros((0, len(amounts))),
    )
    signs = [*_of_joints(problem, measures, by, worst_case), *_of_distances(measures, apart, taken)]
    corners = np.unique(np.array(signs).reshape(-1, len(amounts)), axis=0)
    return replace(worst_case, corners=corners * amounts)


def _of_pairs(problem: Guarded, measures: Measures, taken: Array) -> Array:
    """What is taken from each pair where that leaves least; from pairs that are not near the median of the others."""
    distances, rows = np.full(len(problem.is_arm), np.median(taken) if len(taken) else 0.0), measures.distances
    for row in np.argsort(measures.violations + taken, kind="stable").tolist():
        distances[rows.pairs[row]] = taken[row]
    return distances


def _of_joints(problem: Guarded, measures: Measures, by: PointDerivatives, worst_case: Worst) -> Iterator[Array]:
    """Signs of the displacements that take most from margins, speeds and accelerations."""
    point = measures.point
    units = np.where(problem.limits.is_revolute, np.radians(1.0), 0.01)
    sides = [(measures.lower.value, -1.0), (measures.upper.value, 1.0)]
    for value, sign in sides:
        yield from _leading((value + worst_case.margins) / units, by.q * sign)
    loads = [((measures.speeds.value + worst_case.speeds), by.qd * np.sign(point.qd)[..., None])]
    if by.qdd is not None:
        loads.append((measures.accelerations.value + worst_case.accelerations, by.qdd * np.sign(point.qdd)[..., None]))
    for value, gradients in loads:
        yield from _leading(value, gradients)


def _leading(value: Array, gradients: Array) -> Iterator[Array]:
    """Signs of gradients, shape (N, nq, m), of the joints with the highest values, each at its highest."""
    highest, columns = value.argmax(axis=0), np.argsort(-value.max(axis=0), kind="stable")
    for column in columns[:MOST].tolist():
        yield _signs(gradients[highest[column], column])


def _of_distances(measures: Measures, apart: Array, taken: Array) -> Iterator[Array]:
    """Signs of the displacements that bring bodies nearest, each pair once."""
    seen = set[int]()
    for row in np.argsort(-(measures.violations + taken), kind="stable").tolist():
        pair = int(measures.distances.pairs[row])
        if pair not in seen and len(seen) < MOST:
            seen.add(pair)
            yield _signs(-apart[row])


def _signs(gradient: Array) -> Array:
    """-1 or 1 for each component, 1 for those without effect."""
    return np.where(gradient < 0.0, -1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robust:
    """A layout and its corners."""

    improved: Improved  # the layout, as the last programs left it, with its motion in place
    corners: tuple[Corner, ...]  # all that were planned: the worst by derivatives, the ends, the seeded ones
    worst_ones: int  # number of those by derivatives
    ends: int  # number of displacements at their ends, one at a time
    nominal: float  # shortest cycle in [s] of the layout in place
    cycle: float  # shortest cycle in [s] in which the layout and all its corners keep their limits
    problem: Guarded  # the job, with the displacements as its variables
    displacements: BaseDisplacements  # base displacements of this layout

    @property
    def is_met(self) -> bool:
        """Whether all corners keep all demands in ``cycle``."""
        return all(corner.keeps(self.cycle) for corner in self.corners)

    @property
    def passing(self) -> int:
        """Number of corners that keep all demands in ``cycle``."""
        return sum(corner.keeps(self.cycle) for corner in self.corners)


@dataclass(slots=True, kw_only=True)
class RobustSearch:
    """Rounds of programs with scenarios."""

    problem: Guarded  # the layout problem
    displacements: BaseDisplacements  # displacements of the bases of any of its layouts
    demands: Demands  # the objective and what must be kept in every corner
    effort: Effort  # how much work each round may do
    _scenarios: list[Array] = field(default_factory=list)
    _beyond: Array = field(init=False)

    def __post_init__(self) -> None:
        """Begin without scenarios, and with nothing that corners were seen to miss."""
        self._beyond = np.zeros(len(self.problem.is_arm))
        self.demands = replace(self.demands, singular=None)  # the problem guards its arms itself

    def displaced(self, x: Array) -> Guarded:
        """The job of a layout, shape (n,), with the displacements of its bases as variables."""
        return self.problem.of_variables(self.displacements.at(x))

    def once(self, x: Array, start: Array) -> Improved | None:
        """One round from a layout, shape (n,), and its start posture, shape (nq,); None without a motion."""
        point = self.problem.evaluate(x, start)
        if point is None:
            return None
        of = self.displaced(x)
        worst_case = worst(of, replace(point, x=of.given), self.demands, self.effort)
        if not self._scenarios:
            self._begin(of, worst_case, point.start)
        demands = replace(self.demands, beyond=worst_case.distances + self._beyond)
        scenarios = scenarios_of(self.problem, self.displacements, np.array(self._scenarios))
        improved = improve(scenarios, x, point.start, demands, self.effort)
        if improved is None and len(self._scenarios) > 1:  # one is out of reach by now
            del self._scenarios[1:]
            self._beyond[self.problem.is_arm] += MORE_REACH
            return self.once(x, start)
        return improved

    def finer(self, problem: Guarded, robust: Robust, effort: Effort) -> "RobustSearch":
        """The same search on more nodes, with the scenarios of a layout that are near their limits."""
        near = [
            corner.d
            for corner in robust.corners
            if corner.cycle >= (1.0 - NEAR) * robust.cycle or corner.margins.min() < NEAR_ANGLE
        ]
        known = {scenario.tobytes() for scenario in self._scenarios}
        other = RobustSearch(problem=problem, displacements=self.displacements, demands=self.demands, effort=effort)
        other._beyond = self._beyond.copy()
        other._scenarios = [robust.problem.given, *(d for d in near if d.tobytes() in known)]
        return other

    def cornered(self, improved: Improved, signs: Array) -> Robust | None:
        """A layout with all its corners planned anew: the worst by derivatives, the ends, seeded ones of signs (C, m).

        None without a motion.
        """
        of = self.displaced(improved.x)
        point = self.problem.evaluate(improved.x, improved.start)
        if point is None:
            return None
        listed = worst(of, replace(point, x=of.given), self.demands, self.effort).corners
        ends = np.concatenate([np.diag(of.upper), -np.diag(of.upper)])
        d = np.concatenate([of.given[None], listed, ends, signs * of.upper])
        nominal, *corners = judged(of, d, improved.start, self.demands, replace(self.effort, within=WITHIN))
        return Robust(
            improved=replace(improved, point=point),
            corners=tuple(corners),
            worst_ones=len(listed),
            ends=len(ends),
            nominal=nominal.cycle,
            cycle=max(nominal.cycle, *(corner.cycle for corner in corners)),
            problem=of,
            displacements=self.displacements.at(improved.x),
        )

    def learn(self, robust: Robust) -> bool:
        """Ask for what corners missed; False where they missed nothing."""
        corners = robust.corners
        followed = [corner for corner in corners if np.isfinite(corner.cycle)]
        if len(followed) < len(corners):  # only further from singular configurations helps
            self._beyond[self.problem.is_arm] += MORE_REACH
        violations = -np.min([corner.spare_distances for corner in followed], axis=0) if followed else np.zeros(0)
        if (violations > 0.0).any():
            self._beyond += np.where(violations > 0.0, np.minimum(violations, MOST_LENGTH) + MORE_LENGTH, 0.0)
        most = robust.improved.cycle
        if self.demands.objective is not Objective.CYCLE and self.demands.duration is not None:
            most = self.demands.duration
        added = self._add(sorted(followed, key=lambda scenario: -_missed(scenario, most)), most)
        return added or len(followed) < len(corners) or bool((violations > 0.0).any())

    def _begin(self, of: Guarded, worst_case: Worst, start: Array) -> None:
        """Take the layout in place and the worst corners as scenarios, as far as tools can follow there."""
        planned = judged(of, worst_case.corners, start, self.demands, replace(self.effort, keys=1, within=0.0))
        self._scenarios = [of.given, *(scenario.d for scenario in planned if np.isfinite(scenario.cycle))]

    def _add(self, corners: Sequence[Corner], most: float) -> bool:
        """Make corners scenarios that miss a margin or last longer than the others, the worst ones first."""
        known, before = {scenario.tobytes() for scenario in self._scenarios}, len(self._scenarios)
        for corner in corners:
            if _missed(corner, most) > 0.0 and corner.d.tobytes() not in known:
                self._scenarios.append(corner.d)
            if len(self._scenarios) >= before + ADDED:
                break
        return len(self._scenarios) > before


def robust_layout(
    search: RobustSearch, begin: tuple[Array, Array], *, signs: Array, rounds: int = ROUNDS
) -> Robust | None:
    """Improve a layout until its corners keep all demands; the best of what was found, None without a motion.

    Args:
        begin: Variables, shape (n,), and start posture, shape (nq,).
        signs: Seeded corners, each displacement -1 or 1, shape (C, m).
    """
    (x, start), best = begin, None
    for _ in range(rounds):
        improved = search.once(x, start)
        robust = None if improved is None else search.cornered(improved, signs)
        if improved is None or robust is None:
            break
        if best is None or _rank(robust, search.demands) < _rank(best, search.demands):
            best = robust
        if not search.learn(robust):
            break
        x, start = improved.x, improved.start
    return best


def seeded_signs(rng: np.random.Generator, count: int) -> Array:
    """Seeded corners of displacements, -1 or 1, shape (SEEDED, m)."""
    return rng.choice([-1.0, 1.0], (SEEDED, count))


def _missed(corner: Corner, most: float) -> float:
    """How much a corner misses beside distances: more than 0 where it misses a margin or lasts too long."""
    return max(corner.cycle / most - 1.0 - LONGER, -float(corner.margins.min()) / ANGLE)


def _rank(robust: Robust, demands: Demands) -> tuple[bool, int, float]:
    """Sort key, best first."""
    is_late = demands.objective is not Objective.CYCLE and robust.cycle > (demands.duration or np.inf)
    return is_late or not robust.is_met, len(robust.corners) - robust.passing, robust.cycle


def scenarios_of(problem: Guarded, displacements: BaseDisplacements, d: Array) -> "GuardedProgram | ScenarioProblem":
    """The motions of a problem with displacements of shape (S, m), one after the other; of a program in each phase."""
    if isinstance(problem, GuardedProblem):
        return ScenarioProblem.of(problem, displacements, d)
    phases = tuple(ScenarioProblem.of(phase, displacements, d) for phase in problem.phases)
    return replace(problem, phases=phases, transfers=problem.transfers.repeated(len(d)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScenarioProblem(GuardedProblem):
    """A layout problem whose nodes are those of several motions, one after the other: one for each displacement.

    The variables are those of the layout. Every motion is planned anew. Distances are those of the layout in place.
    Directions of a displaced base are those of the base in place: the same for one that is moved and turned about the
    vertical.
    """

    displacements: BaseDisplacements  # whose bases are displaced
    d: Array  # by how much, shape (S, m); no displacement first

    def __post_init__(self) -> None:
        """Repeat the nodes."""
        GuardedProblem.__post_init__(self)
        derive(self, times=np.tile(self.job.times, len(self.d)))

    @classmethod
    def of(cls, problem: LayoutProblem, displacements: BaseDisplacements, d: Array) -> Self:
        """Scenarios of a layout problem, with displacements of shape (S, m)."""
        return cls(
            job=problem.job,
            variables=problem.variables,
            bodies=problem.bodies,
            acceleration=problem.acceleration,
            displacements=displacements,
            d=d,
        )

    def _layouts(self, x: Array, start: Array) -> Layouts:
        """The displaced layouts, with start postures of shape (S, nq)."""
        return in_place_of(self.variables, self.displacements.at(x)).layouts(self.d, start)

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``; the start posture is that of the layout in place."""
        count = len(self.d)
        if near is None:
            motion = run(self.job, self._layouts(x, np.tile(start, (count, 1))))
        else:
            q = near.q.reshape(count, -1, near.q.shape[1])
            rates = None if near.rates is None else near.rates[: len(self.job.times)]
            motion = run_near(self.job, self._layouts(x, q[:, 0]), q, rates)
        if not motion.is_followed.all():
            return None
        all_q, all_qd = (np.ascontiguousarray(part).reshape(-1, len(start)) for part in (motion.q, motion.qd))
        qdd = (self.job.rates @ motion.qd).reshape(all_qd.shape)
        return Point(x=x, start=all_q[0], q=all_q, qd=all_qd, qdd=qdd)

    def arms(self, point: Point) -> SingularValues:
        """See ``Problem``: the arms of the layout in place."""
        return GuardedProblem.arms(self, replace(point, q=point.q[: len(self.job.times)]))

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``; rates are those of the layout in place."""
        count, nq = len(self.d), point.q.shape[1]
        q, qd = (part.reshape(count, -1, nq) for part in (point.q, point.qd))
        layouts = self._layouts(point.x, q[:, 0])
        directions = self.variables.directions(point.x)
        derivatives = [
            differentiate(self.job, layouts.of_places(slice(place, place + 1)), q[place], qd[place], directions)
            for place in range(count)
        ]
        by_q = np.concatenate([derivative.q for derivative in derivatives])
        by_qd = np.concatenate([derivative.qd for derivative in derivatives])
        qdd = None
        if self.is_accelerating:
            qdd = (self.job.rates @ by_qd.reshape(count, q.shape[1], -1)).reshape(by_qd.shape)
        rates = derivatives[0].rates
        return PointDerivatives(
            q=by_q, qd=by_qd, qdd=qdd, rates=None if rates is None else np.tile(rates, (count, 1, 1))
        )
