"""In legs: all robots straight in joint space, in up to three legs; only robots that are in each other's way wait.

A leg is a straight move of some robots together, from rest to rest. A robot moves in one of the legs and stands in the
others, or it backs off towards its home before the part turns and goes on afterwards; a positioner may also go joint by
joint. Of all such moves the fastest one that is free is taken.

In a leg all joints share one law. Whether two bodies come too near in it therefore depends only on where the robots
that carry them stand at its ends, not on how long it takes: a leg that is refused is refused in every move in which
those robots go the same way.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.planning.timing.retime import JointLimitsInTime, Retimer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.straight_moves import StraightMoves
from cellplan.planning.transfer.straight_time import straight_steps

LEGS: Final = 3
BACK: Final = (0.3, 0.6, 1.0)  # [-] shares of the way home that a robot backs off
MOST_REFUSED: Final = 60  # legs that are refused before none is looked for any more
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


class RouteChoices:
    """Choices of a route for every robot that moves, with the steps that they take together."""

    def __init__(
        self, query: TransferQuery, retimer: Retimer, blocked: Collection[str], refused: Iterable[Mapping[str, Ends]]
    ) -> None:
        """Robots that are blocked have more routes; choices with refused ends of a leg are left out."""
        self._query = query
        self._routes = {name: _routes_of(query, name, retimer, is_blocked=name in blocked) for name in query.movers}
        shape = [len(robot.routes) for robot in self._routes.values()]
        self._steps = np.full(shape if math.prod(shape) <= MOST_COMBINATIONS else [0], 0.0)
        for leg in range(LEGS if self._steps.size else 0):
            self._steps += reduce(np.maximum, np.ix_(*(robot.steps[:, leg] for robot in self._routes.values())))
        for ends in refused:
            self.refuse(ends)

    def refuse(self, ends: Mapping[str, Ends]) -> None:
        """Leave out choices in which some robots have given ends in a leg."""
        for leg in range(LEGS if self._steps.size else 0):
            routes = (
                np.flatnonzero(robot.going(leg, ends[name])) if name in ends else np.arange(len(robot.routes))
                for name, robot in self._routes.items()
            )
            self._steps[np.ix_(*routes)] = np.inf

    def fastest(self) -> list[Array] | None:
        """Stacked configurations at the ends of the legs of the fastest choice; None where none is left."""
        if not np.isfinite(self._steps).any():
            return None
        best = np.unravel_index(int(np.argmin(self._steps)), self._steps.shape)
        stops = np.tile(self._query.start, (LEGS + 1, 1))
        for (name, robot), choice in zip(self._routes.items(), best, strict=True):
            stops[:, self._query.scene.cell.columns(name)] = robot.stops[robot.routes[choice]]
        return [stops[0], *(q for before, q in pairwise(stops) if not np.array_equal(before, q))]


def legs_of(query: TransferQuery, retimer: Retimer, tried: Tried, moves: StraightMoves) -> list[Array]:
    """Stacked configurations at the ends of the legs of the fastest free move, shape (nq,) each; none where none is.

    Args:
        retimer: The limits of all joints and the step of the rows.
        tried: Receives the legs that were refused.
        moves: Verdicts on straight moves in the scene of the query.
    """
    refused, blocked = list[Mapping[str, Ends]](), set[str]()
    choices = RouteChoices(query, retimer, blocked, refused)
    while tried.legs < MOST_REFUSED and (ends := choices.fastest()) is not None:
        carriers = None
        for a, b in pairwise(ends):
            if (carriers := moves.refusing(a, b, query.movers)) is not None:
                columns = {name: query.scene.cell.columns(name) for name in sorted(carriers)}
                refused.append({name: (a[at].tobytes(), b[at].tobytes()) for name, at in columns.items()})
                break
        if carriers is None:
            return ends
        tried.legs += 1
        if carriers <= blocked:
            choices.refuse(refused[-1])
        else:
            blocked |= carriers
            choices = RouteChoices(query, retimer, blocked, refused)
    return []


def least_steps(query: TransferQuery, retimer: Retimer, refused: Mapping[str, Ends]) -> int:
    """Steps that a move in legs takes at least where some robots cannot go straight at once.

    Args:
        retimer: The limits of all joints and the step of the rows.
        refused: Ends of the move of those robots.
    """
    ends = RouteChoices(query, retimer, set(refused), [refused]).fastest()
    at = np.array([query.start, query.goal] if ends is None else ends)
    return int(straight_steps(at[:-1], at[1:], retimer.bounds, retimer.step).sum())


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
