r"""Pace: the fastest motion along a joint path that is known at the nodes, and how its loads depend on both.

Along the path counts its length s, with the joints in shares of their top speeds; where the joints rest over the
nominal time, they still move at unit speed over the length. The unknowns are the squares :math:`c = \dot s^2` at the
nodes; in between, c is linear in s, so that :math:`\ddot s` is constant there. A joint has the speed
:math:`q' \sqrt{c}` and the acceleration :math:`q' \ddot s + q'' c`, which is limited at both ends of every interval:
limits in the middle would let c alternate from node to node.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.planning.timing.path_length import KINK, REST_SHARE
from cellplan.planning.timing.speed_profile import PathLoads, largest_squares
from cellplan.search.programs.problem import Point, Problem

END_NODES: Final = ((0, 1, 2), (-1, -2, -3))  # the ends of a stretch and the nodes beside them
LEAST_STEP: Final = 1e-9  # [-] share of the longest step
FEWEST_NODES: Final = 4  # [-] of a stretch: an end at rest takes its direction from the two nodes beside it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PacedStretch:
    """Nodes from one rest of the path to the next, M of them."""

    nodes: Indices  # the nodes, shape (M,)
    rates: Array  # derivatives of the length by the nominal time there, shape (M,); 1 instead of 0 at a rest
    bends: Array  # second derivatives, shape (M,)
    steps: Array  # lengths between the nodes, positive, shape (M - 1,)
    at_rest: tuple[bool, bool]  # whether all joints rest over the nominal time at the first and at the last node

    def directions(self, qd: Array) -> Array:
        """Derivatives of the joints by the length, of all (N, ...) the (M, ...); at a rest those beside it go on."""
        directions = _per_row(qd[self.nodes], 1.0 / self.rates)
        for is_resting, (end, near, far), steps in zip(
            self.at_rest, END_NODES, (self.steps, self.steps[::-1]), strict=True
        ):
            if is_resting:
                share = steps[0] / steps[1]
                directions[end] = (1.0 + share) * directions[near] - share * directions[far]
        return directions

    def curvatures(self, directions: Array, qdd: Array) -> Array:
        """Second derivatives by the length, shape (M, ...); 0 at a rest, where nothing comes of them."""
        curvatures = _per_row(qdd[self.nodes] - _per_row(directions, self.bends), 1.0 / self.rates**2)
        curvatures[[end for end, is_resting in zip((0, -1), self.at_rest, strict=True) if is_resting]] = 0.0
        return curvatures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PacePlaces:
    """Where loads are limited, E places: at ``directions[at] * by_direction + curvatures[at] * by_curvature``."""

    at: Indices  # places along all stretches, shape (E,)
    is_speed: Flags  # whether it is about speeds, not accelerations, shape (E,)
    by_direction: Array  # speed or acceleration of the path, shape (E,)
    by_curvature: Array  # square of its speed, 0 for speeds, shape (E,)
    around: Indices  # places of the squares that these depend on, shape (E, 2)
    changes: Array  # of both by relative changes of these squares, shape (E, 2, 2), ``by_direction`` first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pace:
    """The fastest motion along the path of a point; P places along all its stretches, m of them not at their ends."""

    stretches: tuple[PacedStretch, ...]  # its stretches from rest to rest
    velocity: Array  # limits of the speeds in [rad/s] or [m/s], shape (nq,)
    acceleration: Array  # limits of the accelerations in [rad/s^2] or [m/s^2], inf for none, shape (nq,)
    squares: Array  # squares c of the speed, 0 at the ends of stretches, shape (P,)
    seconds: float  # time that it takes
    shares: Array  # shares of this time: where a square rises by a share y it falls by y / 2 of them, shape (P,)

    @classmethod
    def of(cls, problem: Problem, point: Point) -> Self:
        """The fastest motion along a path."""
        velocity, limited = problem.limits.velocity, np.isfinite(problem.acceleration)
        stretches = _stretches(problem, point)
        squares, shares, seconds = [np.zeros(0)], [np.zeros(0)], 0.0
        for stretch in stretches:
            directions = stretch.directions(point.qd)
            initial = 1.0 / (np.abs(directions) / velocity).max(axis=1) ** 2
            if limited.any():
                along, bent = (
                    part[:, limited] / problem.acceleration[limited]
                    for part in (directions, stretch.curvatures(directions, point.qdd))
                )
                initial = largest_squares(stretch.steps, PathLoads.in_shares(along, bent), initial)
            initial[[0, -1]] = 0.0
            speeds = np.sqrt(initial)
            both = speeds[1:] + speeds[:-1]
            times, per_speed = 2.0 * stretch.steps / both, 2.0 * stretch.steps / both**2
            seconds += float(times.sum())
            squares.append(initial)
            shares.append(speeds * (np.append(per_speed, 0.0) + np.append(0.0, per_speed)))
        return cls(
            stretches=stretches,
            velocity=velocity,
            acceleration=problem.acceleration,
            squares=np.concatenate(squares),
            seconds=seconds,
            shares=np.concatenate(shares) / (seconds or 1.0),
        )

    @property
    def inner(self) -> Indices:
        """Places that are no ends of stretches, shape (m,)."""
        return np.flatnonzero(self.squares > 0.0)

    @property
    def nodes(self) -> Indices:
        """Nodes of all places, shape (P,)."""
        return np.concatenate([np.zeros(0, dtype=np.intp), *(stretch.nodes for stretch in self.stretches)])

    def places(self, squares: Array) -> PacePlaces:
        """Where loads are limited, at some squares c, shape (P,)."""
        ends = np.cumsum([0, *(len(stretch.nodes) for stretch in self.stretches)])
        left = np.concatenate([np.zeros(0, dtype=np.intp), *(np.arange(a, b - 1) for a, b in pairwise(ends))])
        steps = np.concatenate([np.zeros(0), *(stretch.steps for stretch in self.stretches)])
        inner, before, after = self.inner, squares[left], squares[left + 1]
        u, halves = (after - before) / (2.0 * steps), np.stack([-before, after], axis=1) / (2.0 * steps[:, None])
        none, speeds = np.zeros(len(left)), np.sqrt(squares[inner])
        by_speed = np.zeros((len(inner), 2, 2))
        by_speed[:, 0, 0] = 0.5 * speeds
        at_left = np.stack([halves, np.stack([before, none], axis=1)], axis=1)
        at_right = np.stack([halves, np.stack([none, after], axis=1)], axis=1)
        around = np.stack([left, left + 1], axis=1)
        return PacePlaces(
            at=np.concatenate([inner, left, left + 1]),
            is_speed=np.arange(len(inner) + 2 * len(left)) < len(inner),
            by_direction=np.concatenate([speeds, u, u]),
            by_curvature=np.concatenate([np.zeros(len(inner)), before, after]),
            around=np.concatenate([np.stack([inner, inner], axis=1), around, around]),
            changes=np.concatenate([by_speed, at_left, at_right]),
        )

    def shapes(self, qd: Array, qdd: Array | None) -> tuple[Array, Array]:
        """Derivatives of joints by the length of this path, first and second, at all places, shape (P, ...) each.

        Args:
            qd: Speeds over the nominal time, or their derivatives, shape (N, ...).
            qdd: Accelerations likewise; None where nothing limits them.
        """
        first = [stretch.directions(qd) for stretch in self.stretches]
        empty = np.zeros((0, *qd.shape[1:]))
        directions = np.concatenate([empty, *first])
        if qdd is None:
            return directions, np.zeros_like(directions)
        both = zip(self.stretches, first, strict=True)
        return directions, np.concatenate([empty, *(stretch.curvatures(part, qdd) for stretch, part in both)])

    def loads(self, qd: Array, qdd: Array, squares: Array) -> Array:
        """Loads of a path over the lengths of this one as shares of their limits, with signs, shape (E, nq)."""
        places, (directions, curvatures) = self.places(squares), self.shapes(qd, qdd)
        loads = _per_row(directions[places.at], places.by_direction) + _per_row(
            curvatures[places.at], places.by_curvature
        )
        limits: Array = np.where(places.is_speed[:, None], self.velocity, self.acceleration)
        return loads / limits

    def reached(self, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Largest speeds and accelerations at the nodes as shares of their limits, shape (N, nq) each."""
        loads, places = np.abs(self.loads(qd, qdd, self.squares)), self.places(self.squares)
        nodes, largest_loads = self.nodes[places.at], (np.zeros(qd.shape), np.zeros(qd.shape))
        for selected, largest in zip((places.is_speed, ~places.is_speed), largest_loads, strict=True):
            np.maximum.at(largest, nodes[selected], loads[selected])
        return largest_loads

    def derivatives(
        self, shapes: tuple[Array, Array], by: tuple[Array, Array], rows: Indices, joints: Indices
    ) -> Array:
        """Derivatives of some loads by the n variables and relative changes of the inner squares, shape (R, n + m).

        Args:
            shapes: Of this path, see ``shapes``, shape (P, nq) each.
            by: Their derivatives by the variables, shape (P, nq, n) each.
            rows: Numbers of the places of the loads, shape (R,).
            joints: Columns of their joints, shape (R,).
        """
        places, inner, count = self.places(self.squares), self.inner, by[0].shape[-1]
        at = places.at[rows]
        derivatives = np.zeros((len(rows), count + len(self.squares)))
        derivatives[:, :count] = _per_row(by[0][at, joints], places.by_direction[rows])
        derivatives[:, :count] += _per_row(by[1][at, joints], places.by_curvature[rows])
        by_shape = np.stack([part[at, joints] for part in shapes], axis=1)
        per_square = np.einsum("rk,rks->rs", by_shape, places.changes[rows])
        for side in range(2):
            np.add.at(derivatives, (np.arange(len(rows)), count + places.around[rows, side]), per_square[:, side])
        limits = np.where(places.is_speed[rows], self.velocity[joints], self.acceleration[joints])
        by_variables: Array = np.concatenate([derivatives[:, :count], derivatives[:, count + inner]], axis=1)
        return by_variables / limits[:, None]


def _stretches(problem: Problem, point: Point) -> tuple[PacedStretch, ...]:
    """The stretches of a path between rests of all joints, corners that are passed at speed, and motions."""
    times, velocity = problem.times, problem.limits.velocity
    velocities, accelerations = point.qd / velocity, point.qdd / velocity
    rates = np.linalg.norm(velocities, axis=1)
    rests = rates <= REST_SHARE * rates.max(initial=0.0)
    safe = np.where(rests, 1.0, rates)
    bends = np.where(rests, 0.0, (velocities * accelerations).sum(axis=1) / safe)
    twice = np.append(np.diff(times) == 0.0, False)
    turned = np.linalg.norm(np.diff(velocities / safe[:, None], axis=0, append=0.0), axis=1) > KINK
    is_corner = twice & np.append(~rests[1:] & ~rests[:-1], False) & turned
    is_corner[[part.start - 1 for part in problem.transfers.parts[1:]]] = True
    ends = np.unique([0, *np.flatnonzero(rests), *(np.flatnonzero(is_corner) + 1), len(times) - 1])
    stretches = []
    for first, last in pairwise(ends.tolist()):
        nodes = np.arange(first, last + 1 - is_corner[last - 1])
        nodes = nodes[~np.append(twice[nodes[:-1]], False)]
        if len(nodes) >= FEWEST_NODES:
            width, rate, bend = np.diff(times[nodes]), rates[nodes], bends[nodes]
            steps = width * (rate[1:] + rate[:-1]) / 2.0 + width**2 * (bend[:-1] - bend[1:]) / 12.0
            stretches.append(
                PacedStretch(
                    nodes=nodes,
                    rates=safe[nodes],
                    bends=bend,
                    steps=np.maximum(steps, LEAST_STEP * steps.max()),
                    at_rest=(bool(rests[first]), bool(rests[nodes[-1]])),
                )
            )
    return tuple(stretches)


def _per_row(values: Array, factors: Array) -> Array:
    """Values (M, ...) times a factor of each row (M,)."""
    return values * factors.reshape(-1, *(1,) * (values.ndim - 1))
