"""Rows: the demands on a point, linear in a step of the variables; only those that a step of the region could bind."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.search.kernel.figures import PeakValues
from cellplan.search.programs.measures import ANGLE, LENGTH, SHARE, SINGULAR, MeasureKind, Measures, reserves
from cellplan.search.programs.objective import Demands, Objective, Reserve
from cellplan.search.programs.pace import Pace
from cellplan.search.programs.problem import PointDerivatives, Problem

NEAR_SINGULAR: Final = 1.0  # [-] times what is demanded: singular values that are larger by that are no rows
LEAST_LOAD: Final = 0.5  # [-] shares of limits of a retimed motion from which on they become rows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConstraintRows:
    """Rows ``violation + gradient z <= aim t``, of a step z in usual steps of the variables and the objective t."""

    kind: MeasureKind  # what they are about
    subjects: Indices  # columns of joints, or numbers of pairs, shape (M,)
    nodes: Indices  # nodes of the motion, shape (M,)
    violations: (
        Array  # by how much the demand and the room are missed now, in usual units, negative where kept, shape (M,)
    )
    gradients: Array  # derivatives of the violations by z, shape (M, n)
    allowed: Array  # violations that count as met at a point, shape (M,)
    units: Array  # usual units of what is measured, see ``Measures.values``, shape (M,)
    aim: float = 0.0  # 1 where the row bounds the objective, 0 where it must be kept

    def that_can_bind(self, box: Array) -> Self:
        """Those that a step within ``+-box`` can bring to their bounds."""
        reach = np.abs(self.gradients) @ box
        highest, least = self.violations + reach, self.violations - reach
        return self.of(highest >= least.max(initial=-np.inf) if self.aim else highest > 0.0)

    def bends(self, here: Measures, there: Measures, z: Array) -> Array:
        """Change of the violations by a step z beyond what the rows predict, shape (M,); 0 where it was not seen."""
        before, after = (linear.values(self.kind, self.subjects, self.nodes) for linear in (here, there))
        return np.nan_to_num((after - before) / self.units - self.gradients @ z)

    def of(self, is_selected: Flags) -> Self:
        """Some of them."""
        return replace(
            self,
            subjects=self.subjects[is_selected],
            nodes=self.nodes[is_selected],
            violations=self.violations[is_selected],
            gradients=self.gradients[is_selected],
            allowed=self.allowed[is_selected],
            units=self.units[is_selected],
        )

    def widened(self, count: int) -> Self:
        """The same for steps that have more unknowns, which they do not depend on."""
        return replace(self, gradients=np.pad(self.gradients, ((0, 0), (0, count))))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PacedRows(ConstraintRows):
    """Rows about speeds or accelerations of a retimed motion; the squares of the path's speed are unknowns as well."""

    pace: Pace  # the motion
    places: Indices  # numbers of the loads, see ``Pace.loads``, shape (M,)
    signs: Array  # signs of the loads, shape (M,)

    def bends(self, here: Measures, there: Measures, z: Array) -> Array:
        """See ``ConstraintRows``: with the squares that the step was to have."""
        pace, inner, count = self.pace, self.pace.inner, len(here.point.x)
        squares = pace.squares.copy()
        squares[inner] *= 1.0 + z[count:]
        loads = pace.loads(there.point.qd, there.point.qdd, squares)[self.places, self.subjects]
        return (self.signs * loads - 1.0) / self.units - (self.violations + self.gradients @ z)

    def of(self, is_selected: Flags) -> Self:
        """See ``ConstraintRows``."""
        return replace(
            ConstraintRows.of(self, is_selected), places=self.places[is_selected], signs=self.signs[is_selected]
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Linear:
    """A point with its derivatives."""

    problem: Problem
    measures: Measures
    derivatives: PointDerivatives
    distances: Array

    @classmethod
    def of(cls, problem: Problem, measures: Measures) -> "Linear":
        """Take all derivatives at a point."""
        point = measures.point
        derivatives = problem.derivatives(point)
        return cls(
            problem=problem,
            measures=measures,
            derivatives=derivatives,
            distances=problem.distance_derivatives(point, measures.distances, derivatives),
        )

    def rows(self, demands: Demands, reserve: Reserve, box: Array) -> list[ConstraintRows]:
        """All rows that a step within a box can bind; the ones that bound the objective first.

        Args:
            box: Largest steps of the variables, then of the squares of a retimed motion, relative, (n + m,).
        """
        count = len(self.problem.scale)
        parts = [*self._margins(reserve, box[:count]), self._apart(reserve), *self._regular(demands, reserve)]
        if demands.objective is Objective.CLEARANCE:
            parts.append(self._aimed_apart())
        pace, duration = self.measures.pace, self._duration(demands, reserve)
        if pace is None:
            first = [] if duration is None else [*self._timing(duration, demands, reserve)]
            if demands.objective is Objective.CYCLE and not demands.is_shorter_work:
                first.append(self._cycle())
        else:
            parts = [rows.widened(len(box) - count) for rows in parts]
            first = [] if duration is None else [self._lasting(pace, duration, demands, reserve), *self._paced(pace)]
        return [rows.that_can_bind(box) for rows in (*first, *parts) if len(rows.violations)]

    def _duration(self, demands: Demands, reserve: Reserve) -> float | None:
        """How many times as long as the nodes the motion may last; None where it may last as long as it takes."""
        if demands.is_shorter_work:
            return self.measures.factor
        return None if demands.duration is None else demands.duration / self.measures.span / (1.0 + reserve.time)

    def _cycle(self, work: Array | None = None) -> ConstraintRows:
        """The cycle as a share of its own as the objective: time of the transfers, and of the motions by squares.

        Args:
            work: Share of the time of the motions that the squares save, each by its own share, shape (m,).
        """
        cycle, saved = self.measures.cycle, np.zeros(0) if work is None else work
        point = self.measures.point
        by_layout = self.problem.transfers.derivatives(point.x, point.q, self.derivatives.q) * self.problem.scale
        return ConstraintRows(
            kind=MeasureKind.CYCLE,
            subjects=np.zeros(1, dtype=np.intp),
            nodes=np.zeros(1, dtype=np.intp),
            violations=np.zeros(1),
            gradients=np.concatenate([by_layout / cycle, -saved])[None],
            allowed=np.zeros(1),
            units=np.full(1, cycle),
            aim=1.0,
        )

    def _lasting(self, pace: Pace, whole: float, demands: Demands, reserve: Reserve) -> ConstraintRows:
        """The duration of a retimed motion: the objective itself, or bounded by a given one."""
        if demands.objective is Objective.CYCLE:
            return self._cycle(0.5 * pace.seconds / self.measures.cycle * pace.shares[pace.inner])
        share, count = self.measures.factor / whole, len(self.problem.scale)
        saved = 0.5 * share * pace.shares[pace.inner] / SHARE
        return ConstraintRows(
            kind=MeasureKind.DURATION,
            subjects=np.zeros(1, dtype=np.intp),
            nodes=np.zeros(1, dtype=np.intp),
            violations=np.array([(share - 1.0) / SHARE]),
            gradients=np.concatenate([np.zeros(count), -saved])[None],
            allowed=np.full(1, 0.5 * reserve.time / SHARE),
            units=np.full(1, whole * SHARE),
        )

    def _paced(self, pace: Pace) -> Iterator[ConstraintRows]:
        """Speeds and accelerations of a retimed motion."""
        by, point, problem = self.derivatives, self.measures.point, self.problem
        shapes, changes = pace.shapes(point.qd, point.qdd), pace.shapes(by.qd, by.qdd)
        places, loads = pace.places(pace.squares), pace.loads(point.qd, point.qdd, pace.squares)
        for kind, unit in ((MeasureKind.SPEED, 1.0), (MeasureKind.ACCELERATION, 2.0)):
            is_kind = places.is_speed == (kind is MeasureKind.SPEED)
            rows, joints = (
                part.astype(np.intp) for part in np.nonzero(is_kind[:, None] & (np.abs(loads) > LEAST_LOAD))
            )
            signs = np.sign(loads[rows, joints])
            gradients = pace.derivatives(shapes, changes, rows, joints)
            gradients[:, : len(problem.scale)] *= problem.scale
            yield PacedRows(
                kind=kind,
                subjects=joints,
                nodes=pace.nodes[places.at[rows]],
                violations=np.minimum(np.abs(loads[rows, joints]) - 1.0, 0.0) / unit,
                gradients=gradients * signs[:, None] / unit,
                allowed=np.zeros(len(rows)),
                units=np.full(len(rows), unit),
                pace=pace,
                places=rows,
                signs=signs,
            )

    def _timing(self, whole: float, demands: Demands, reserve: Reserve) -> Iterator[ConstraintRows]:
        """Speeds and accelerations under the laws: the objective itself, or bounds at a given duration."""
        measures, problem = self.measures, self.problem
        is_aim = demands.is_shorter_work
        unit = 1.0 if is_aim else SHARE
        quantities = [(MeasureKind.SPEED, measures.speeds, self.derivatives.qd, problem.limits.velocity)]
        if self.derivatives.qdd is not None:
            quantities.append(
                (MeasureKind.ACCELERATION, measures.accelerations, self.derivatives.qdd, problem.acceleration)
            )
        for kind, crests, by, limits in quantities:
            value = np.sqrt(crests.value) if kind is MeasureKind.ACCELERATION else crests.value
            nodes, columns = np.nonzero(value > 0.5 * whole)
            gradients = crests.derivatives(nodes, columns, by) / limits[columns, None]
            at = value[nodes, columns]
            if kind is MeasureKind.ACCELERATION:
                gradients /= 2.0 * at[:, None]
            yield ConstraintRows(
                kind=kind,
                subjects=columns,
                nodes=nodes,
                violations=(at / whole - 1.0) / unit,
                gradients=gradients * problem.scale / (whole * unit),
                allowed=np.full(len(at), 0.0 if is_aim else 0.5 * reserve.time / unit),
                units=np.full(len(at), whole * unit),
                aim=1.0 if is_aim else 0.0,
            )

    def _margins(self, reserve: Reserve, box: Array) -> Iterator[ConstraintRows]:
        """Distances of the joints from their limits."""
        problem, dq = self.problem, self.derivatives.q
        reach = np.abs(dq) @ (problem.scale * box)
        units = np.where(problem.limits.is_revolute, ANGLE, LENGTH)
        sides: Sequence[tuple[MeasureKind, PeakValues, float]] = (
            (MeasureKind.LOWER_LIMIT, self.measures.lower, -1.0),
            (MeasureKind.UPPER_LIMIT, self.measures.upper, 1.0),
        )
        for kind, crests, sign in sides:
            nodes, columns = np.nonzero(crests.value + reserve.margin + 1.5 * reach > 0.0)
            gradients = sign * crests.derivatives(nodes, columns, dq) / units[columns, None]
            yield ConstraintRows(
                kind=kind,
                subjects=columns,
                nodes=nodes,
                violations=(crests.value[nodes, columns] + reserve.margin) / units[columns],
                gradients=gradients * problem.scale,
                allowed=0.5 * reserve.margin / units[columns],
                units=units[columns],
            )

    def _apart(self, reserve: Reserve) -> ConstraintRows:
        """Distances of near pairs."""
        distances = self.measures.distances
        return ConstraintRows(
            kind=MeasureKind.DISTANCE,
            subjects=distances.pairs,
            nodes=distances.nodes,
            violations=(self.measures.violations + reserves(distances, reserve)) / LENGTH,
            gradients=-self.distances * self.problem.scale / LENGTH,
            allowed=0.5 * reserves(distances, reserve) / LENGTH,
            units=np.full(len(distances.pairs), LENGTH),
        )

    def _regular(self, demands: Demands, reserve: Reserve) -> Iterator[ConstraintRows]:
        """Least singular values of the arms."""
        arms, crests = self.measures.arms, self.measures.singular
        nodes, subjects = (part.astype(np.intp) for part in np.nonzero(crests.value > -NEAR_SINGULAR))
        if arms is None or demands.singular is None or not len(nodes):
            return
        shares = crests.shares[nodes, subjects]
        rows, sides = np.nonzero(shares)
        by = arms.derivatives(nodes[rows] + sides - 1, subjects[rows], self.derivatives.q)
        gradients = np.zeros((len(nodes), by.shape[1]))
        np.add.at(gradients, rows, shares[rows, sides, None] * by)
        yield ConstraintRows(
            kind=MeasureKind.SINGULAR,
            subjects=subjects,
            nodes=nodes,
            violations=(crests.value[nodes, subjects] + reserve.singular) / SINGULAR,
            gradients=-gradients * self.problem.scale / (demands.singular[subjects, None] * SINGULAR),
            allowed=np.full(len(nodes), 0.5 * reserve.singular / SINGULAR),
            units=np.full(len(nodes), SINGULAR),
        )

    def _aimed_apart(self) -> ConstraintRows:
        """Distances of near pairs but those of a robot's own bodies, as bounds of the objective."""
        rows = self._apart(Reserve(distance=0.0)).of(~self.measures.distances.within_robot)
        return replace(rows, violations=rows.violations - self.measures.nearest / LENGTH, aim=1.0)
