"""Rows: the demands on a point, linear in a step of the variables; only those that a step of the region could bind."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.search.kernel.figures import Crests
from cellplan.search.programs.measures import ANGLE, LENGTH, SHARE, Kind, Measures, rooms
from cellplan.search.programs.objective import Demands, Objective, Room
from cellplan.search.programs.problem import PointDerivatives, Problem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Rows ``lack + gradient z <= aim t``, of a step z in usual steps of the variables and the objective t.

    Attributes:
        kind: What they are about.
        subjects: Columns of joints, or numbers of pairs, shape (M,).
        nodes: Nodes of the motion, shape (M,).
        lacks: By how much the demand and the room are missed now, in usual units, negative where kept, shape (M,).
        gradients: Derivatives of the lacks by z, shape (M, n).
        allowed: What of the lacks counts as kept at a point, shape (M,).
        units: Usual units of what is measured, see ``Measures.values``, shape (M,).
        aim: 1 where the row bounds the objective, 0 where it must be kept.
    """

    kind: Kind
    subjects: Indices
    nodes: Indices
    lacks: Array
    gradients: Array
    allowed: Array
    units: Array
    aim: float = 0.0

    def that_can_bind(self, box: Array) -> "Rows":
        """Those that a step within ``+-box`` can bring to their bounds."""
        reach = np.abs(self.gradients) @ box
        highest = self.lacks + reach
        return self.of(highest > (float((self.lacks - reach).max(initial=-np.inf)) if self.aim else 0.0))

    def bends(self, here: Measures, there: Measures, z: Array) -> Array:
        """By how much more than the rows say a step z was seen to change the lacks, shape (M,); 0 where not seen."""
        before, after = (each.values(self.kind, self.subjects, self.nodes) for each in (here, there))
        return np.nan_to_num((after - before) / self.units - self.gradients @ z)

    def of(self, kept: Flags) -> "Rows":
        """Some of them."""
        return Rows(
            kind=self.kind,
            subjects=self.subjects[kept],
            nodes=self.nodes[kept],
            lacks=self.lacks[kept],
            gradients=self.gradients[kept],
            allowed=self.allowed[kept],
            units=self.units[kept],
            aim=self.aim,
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
        found = problem.derivatives(point)
        return cls(
            problem=problem,
            measures=measures,
            derivatives=found,
            distances=problem.distance_derivatives(point, measures.distances, found),
        )

    def rows(self, demands: Demands, room: Room, box: Array) -> list[Rows]:
        """All rows that a step within a box can bind; the ones that bound the objective first."""
        parts = [*self._timing(demands, room), *self._margins(room, box), self._apart(room)]
        if demands.objective is Objective.CLEARANCE:
            parts.append(self._aimed_apart())
        return [rows.that_can_bind(box) for rows in parts if len(rows.lacks)]

    def _timing(self, demands: Demands, room: Room) -> Iterator[Rows]:
        """Speeds and accelerations: the objective itself, or bounds at a given duration."""
        measures, problem = self.measures, self.problem
        is_aim = demands.objective is Objective.CYCLE
        if not is_aim and demands.duration is None:
            return
        span = float(problem.times[-1] - problem.times[0])
        whole = measures.factor if is_aim or demands.duration is None else demands.duration / span / (1.0 + room.time)
        unit = 1.0 if is_aim else SHARE
        found = [(Kind.SPEED, measures.speeds, self.derivatives.qd, problem.limits.velocity)]
        if self.derivatives.qdd is not None:
            found.append((Kind.ACCELERATION, measures.accelerations, self.derivatives.qdd, problem.acceleration))
        for kind, crests, by, limits in found:
            value = np.sqrt(crests.value) if kind is Kind.ACCELERATION else crests.value
            nodes, columns = np.nonzero(value > 0.5 * whole)
            gradients = crests.derivatives(nodes, columns, by) / limits[columns, None]
            at = value[nodes, columns]
            if kind is Kind.ACCELERATION:
                gradients /= 2.0 * at[:, None]
            yield Rows(
                kind=kind,
                subjects=columns,
                nodes=nodes,
                lacks=(at / whole - 1.0) / unit,
                gradients=gradients * problem.scale / (whole * unit),
                allowed=np.full(len(at), 0.0 if is_aim else 0.5 * room.time / unit),
                units=np.full(len(at), whole * unit),
                aim=1.0 if is_aim else 0.0,
            )

    def _margins(self, room: Room, box: Array) -> Iterator[Rows]:
        """Distances of the joints from their limits."""
        problem, dq = self.problem, self.derivatives.q
        reach = np.abs(dq) @ (problem.scale * box)
        units = np.where(problem.limits.is_revolute, ANGLE, LENGTH)
        sides: Sequence[tuple[Kind, Crests, float]] = (
            (Kind.LOWER_LIMIT, self.measures.lower, -1.0),
            (Kind.UPPER_LIMIT, self.measures.upper, 1.0),
        )
        for kind, crests, sign in sides:
            nodes, columns = np.nonzero(crests.value + room.margin + 1.5 * reach > 0.0)
            gradients = sign * crests.derivatives(nodes, columns, dq) / units[columns, None]
            yield Rows(
                kind=kind,
                subjects=columns,
                nodes=nodes,
                lacks=(crests.value[nodes, columns] + room.margin) / units[columns],
                gradients=gradients * problem.scale,
                allowed=0.5 * room.margin / units[columns],
                units=units[columns],
            )

    def _apart(self, room: Room) -> Rows:
        """Distances of near pairs."""
        distances = self.measures.distances
        return Rows(
            kind=Kind.DISTANCE,
            subjects=distances.pairs,
            nodes=distances.nodes,
            lacks=(self.measures.lacks + rooms(distances, room)) / LENGTH,
            gradients=-self.distances * self.problem.scale / LENGTH,
            allowed=0.5 * rooms(distances, room) / LENGTH,
            units=np.full(len(distances.pairs), LENGTH),
        )

    def _aimed_apart(self) -> Rows:
        """Distances of near pairs but those of a robot's own bodies, as bounds of the objective."""
        rows = self._apart(Room(distance=0.0)).of(~self.measures.distances.is_own)
        return replace(rows, lacks=rows.lacks - self.measures.nearest / LENGTH, aim=1.0)
