"""In legs: all robots straight in joint space, in up to three legs; only robots that are in each other's way wait.

A leg is a straight move of some robots together, from rest to rest. A robot moves in one of the legs and stands in the
others, or it backs off towards its home before the part turns and goes on afterwards; a positioner may also go joint by
joint. Of all such moves the fastest one that is free is taken.

In a leg all joints share one law. Whether two bodies come too near in it therefore depends only on where the robots
that carry them stand at its ends, not on how long it takes: a leg that is refused is refused in every move in which
those robots go the same way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Self

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.robot.robot import BASE
from cellplan.planning.timing.retime import JointLimitsInTime, Retimer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.straight_time import straight_line, straight_steps
from cellplan.scene.pairs import ScenePair
from cellplan.scene.scene import Scene

LEGS: Final = 3
BACK: Final = (0.3, 0.6, 1.0)  # [-] shares of the way home that a robot backs off
MOST_REFUSED: Final = 60  # legs that are refused before none is looked for any more
NEARER: Final = 1e-5  # [m] than it may be that a pair is in rows that are not certified: rounding of quick distances
MOST_COMBINATIONS: Final = 2_000_000  # of the routes of all robots that are compared
CORNERED: Final = 2  # joints of a positioner that goes joint by joint
START, GOAL = 0, 1  # places of a robot among those at which it may stand between two legs

Ends = tuple[bytes, bytes]  # configurations of one robot at both ends of a leg


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotRoutes:
    """Routes of one robot from its start to its goal."""

    stops: Array  # configurations at which it may stand between legs in [rad] or [m], shape (P, n)
    routes: Indices  # its place among them at both ends of every leg, shape (K, LEGS + 1)
    steps: Indices  # whole steps that each leg takes it, zero where it stands, shape (K, LEGS)

    @classmethod
    def over(
        cls, stops: Sequence[Array], routes: Sequence[Sequence[int]], limits: JointLimitsInTime, step: float
    ) -> Self:
        """Routes over some stops.

        Args:
            stops: Configurations in [rad] or [m], shape (n,) each.
            routes: Places among them at both ends of every leg.
            limits: Limits of the joints, shape (n,) each.
            step: Time between two rows in [s].
        """
        at, places = np.array(stops), np.array(routes, dtype=np.intp)
        between = straight_steps(at[:, None], at[None], limits, step)
        return cls(stops=at, routes=places, steps=between[places[:, :-1], places[:, 1:]])

    def going(self, leg: int, ends: Ends) -> Flags:
        """Which routes have given ends of a leg, shape (K,)."""
        at = [stop.tobytes() for stop in self.stops]
        return np.array([(at[route[leg]], at[route[leg + 1]]) == ends for route in self.routes.tolist()])


def legs_of(query: TransferQuery, retimer: Retimer, tried: Tried) -> list[Array]:
    """Stacked configurations at the ends of the legs of the fastest free move, shape (nq,) each; none where none is.

    Args:
        query: Who moves from where to where.
        retimer: The limits of all joints and the step of the rows.
        tried: Receives the legs that were refused.
    """
    moved = sorted({row for name in query.movers for row in rows_moved_by(query.scene, name)})
    scene, refused = scene_of_rows(query.scene, moved), list[Mapping[str, Ends]]()
    blocked: set[str] = set()
    free: set[bytes] = set()
    while tried.legs < MOST_REFUSED:
        routes = {name: _routes_of(query, name, retimer, is_blocked=name in blocked) for name in query.movers}
        if np.prod([float(len(it.routes)) for it in routes.values()]) > MOST_COMBINATIONS:
            return []
        ends = _fastest(query, routes, refused)
        if ends is None:
            return []
        for a, b in pairwise(ends):
            line = straight_line(a, b)
            if (key := line[[0, -1]].tobytes()) in free:
                continue
            if (carriers := refusing_robots(scene, line, query.movers)) is not None:
                tried.legs += 1
                columns = {name: query.scene.cell.columns(name) for name in carriers}
                refused.append({name: (a[at].tobytes(), b[at].tobytes()) for name, at in columns.items()})
                blocked |= carriers
                break
            free.add(key)
        else:
            return ends
    return []


def least_steps(query: TransferQuery, retimer: Retimer, refused: Mapping[str, Ends]) -> int:
    """Steps that a move in legs takes at least where some robots cannot go straight at once.

    Args:
        query: Who moves from where to where.
        retimer: The limits of all joints and the step of the rows.
        refused: Ends of the move of those robots.
    """
    routes = {name: _routes_of(query, name, retimer, is_blocked=name in refused) for name in query.movers}
    ends = _fastest(query, routes, [refused])
    at = np.array([query.start, query.goal] if ends is None else ends)
    return int(straight_steps(at[:-1], at[1:], retimer.bounds, retimer.step).sum())


def refusing_robots(scene: Scene, line: Array, movers: tuple[str, ...]) -> set[str] | None:
    """Robots that carry the bodies of a pair that comes too near along a line; None where none does.

    Args:
        line: Stacked joint positions in [rad] or [m], shape (N, nq).
        movers: The robots that move, of which some are named.
    """
    at_fault = _too_near(scene, line)
    if not at_fault:
        bound = certify(scene, line, with_minimum=False)
        if bound.is_met:
            return None
        at_fault = [pair.pair for pair in bound.pairs if pair.touches or pair.unproved or pair.distance < pair.demand]
    carriers = [
        {body.robot for body in (scene.bodies[pair.first], scene.bodies[pair.second]) if body.link != BASE}
        for pair in at_fault
    ]
    named = [names for one in carriers if (names := {name for name in one if name in movers})]
    return min(named, key=lambda names: (len(names), sorted(names)), default=set(movers))


def _too_near(scene: Scene, line: Array) -> list[ScenePair]:
    """Pairs that are too near in the rows of a line already, which takes less than a certificate to see."""
    demands = np.array([pair.least_distance for pair in scene.pairs])
    near = scene.near(line, float(demands.max(initial=0.0)))
    rows = np.unique(near.rows[near.distances < demands[near.rows] - NEARER])
    return [scene.pairs[row] for row in rows.tolist()]


def _routes_of(query: TransferQuery, name: str, retimer: Retimer, *, is_blocked: bool) -> RobotRoutes:
    """Routes of a robot: in one of the legs, and where something was in its way over other places too."""
    cell, columns = query.scene.cell, query.scene.cell.columns(name)
    stops = list(query.ends_of(name))
    routes = [[START] * (LEGS + 1 - moved) + [GOAL] * moved for moved in range(LEGS, 0, -1)]
    home = None if query.home is None else query.home[columns]
    if is_blocked and name in cell.positioners:
        for corner in _corners(stops[START], stops[GOAL], home):
            via = len(stops)
            stops.append(corner)
            routes += [[START, via, GOAL, GOAL], [START, via, via, GOAL], [START, START, via, GOAL]]
    elif is_blocked and home is not None:
        for share in BACK:
            a, b = len(stops), len(stops) + 1  # off the start, and off the goal
            stops += [end + share * (home - end) for end in stops[:2]]
            routes += [[START, a, b, GOAL], [START, a, a, GOAL], [START, a, GOAL, GOAL], [START, START, b, GOAL]]
    return RobotRoutes.over(stops, routes, retimer.bounds.of(columns), retimer.step)


def _corners(start: Array, goal: Array, home: Array | None) -> list[Array]:
    """Places over which a holder goes where it cannot go straight: joint by joint in either order, and its home."""
    places = [] if home is None else [home]
    if len(start) == CORNERED:
        places += [np.array([goal[0], start[1]]), np.array([start[0], goal[1]])]
    return [place for place in places if np.any(place != start) and np.any(place != goal)]


def _fastest(
    query: TransferQuery, routes: Mapping[str, RobotRoutes], refused: list[Mapping[str, Ends]]
) -> list[Array] | None:
    """Stacked configurations at the ends of the legs of the fastest move that is not refused; None where all are."""
    total = np.zeros([len(it.routes) for it in routes.values()])
    for leg in range(LEGS):
        longest = np.zeros(total.shape, dtype=np.intp)
        for axis, robot in enumerate(routes.values()):
            longest = np.maximum(longest, np.expand_dims(robot.steps[:, leg], _other_axes(axis, len(routes))))
        total += longest
    for ends in refused:
        for leg in range(LEGS):
            going = [routes[name].going(leg, ends[name]) if name in ends else np.array(True) for name in routes]
            is_refused = np.array(True)
            for axis, flags in enumerate(going):
                is_refused = is_refused & (
                    np.expand_dims(flags, _other_axes(axis, len(routes))) if flags.ndim else flags
                )
            total[np.broadcast_to(is_refused, total.shape)] = np.inf
    best = np.unravel_index(int(np.argmin(total)), total.shape)
    if not np.isfinite(total[best]):
        return None
    stops = np.tile(query.start, (LEGS + 1, 1))
    for (name, robot), choice in zip(routes.items(), best, strict=True):
        stops[:, query.scene.cell.columns(name)] = robot.stops[robot.routes[choice]]
    return [stops[0], *(q for before, q in pairwise(stops) if not np.array_equal(before, q))]


def _other_axes(axis: int, count: int) -> tuple[int, ...]:
    """All axes but one, to expand a vector along it."""
    return tuple(other for other in range(count) if other != axis)
