"""One robot after the other: each straight or by trees in its joint space, while all others stand.

Robots that have moved stand at their goals, the others at their starts. Orders of straight moves are tried first, then
those in which trees may grow; what was found for a robot among the same standing robots is used again.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.progress import Progress
from cellplan.model.seeds import generator
from cellplan.planning.transfer.best_try import Try, one_by_one, rows_through
from cellplan.planning.transfer.blended_lines import BlendedLine
from cellplan.planning.transfer.move_check import MoveCheck, Others
from cellplan.planning.transfer.query import STAGE, TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.trees import connected

MOST_ORDERS: Final = 120  # orders of the robots that are tried
SAMPLES: Final = 1000  # configurations drawn for one robot among others that stand
MOST_SHOWN: Final = 24  # orders of which the best is shown where none is free
MOST_FAILED: Final = 6  # searches by trees that fail before no further one is begun
SHORTCUTS: Final = 60  # straight lines between two places of the way that are tried
GAIN: Final = 0.01  # [-] share of its length by which a shortcut is shorter at least
HALVINGS: Final = 7  # of what is cut off at a corner, until it is free


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotMove:
    """Move of one robot while the others stand."""

    robot: str  # its name
    line: BlendedLine  # its way, smooth

    @property
    def is_straight(self) -> bool:
        """Whether it goes straight from start to goal."""
        return len(self.line.q) == 2


class InTurn:
    """Moves of one robot after the other."""

    def __init__(self, query: TransferQuery, tried: Tried, *, reserve: float, progress: Progress) -> None:
        """Prepare a query to be planned with ``reserve`` in [m] beyond the demanded distance."""
        self.tried, self.query, self._reserve, self._progress = tried, query, reserve, progress
        self._checks: dict[tuple[str, frozenset[str]], MoveCheck | None] = {}
        self._known: dict[tuple[str, frozenset[str], bool], RobotMove | None] = {}
        self._over_gaps: dict[tuple[str, frozenset[str]], Array] = {}

    def moves(self) -> Iterator[list[RobotMove]]:
        """Moves of all robots in their order, one list for each order that is free."""
        orders = list(permutations(self.query.movers))[:MOST_ORDERS]
        for planned in (False, True):
            for order in orders:
                self.tried.orders += not planned
                moves = self._in_order(order, planned=planned)
                if moves is not None:
                    yield moves

    def tries(self) -> Iterator[Try]:
        """Each order in which robots may move, as far as its moves are known; see ``best_try``."""
        query, cell = self.query, self.query.scene.cell
        velocity = np.concatenate([robot.model.velocity for robot in cell.robots])
        for order in list(permutations(query.movers))[:MOST_SHOWN]:
            legs = [(robot, frozenset(order[:place])) for place, robot in enumerate(order)]
            paths = [(cell.columns(robot), self._known_path(robot, moved)) for robot, moved in legs]
            names = [f"'{robot}'{self._manner(robot, moved)}" for robot, moved in legs]
            yield Try(words=" then ".join(names), q=rows_through(one_by_one(query.start, paths), velocity))

    def _known_move(self, robot: str, moved: frozenset[str]) -> RobotMove | None:
        """The move that was found for a robot after some others have moved; None where none was."""
        return self._known.get((robot, moved, True)) or self._known.get((robot, moved, False))

    def _known_path(self, robot: str, moved: frozenset[str]) -> Array:
        """Via points of a robot after some others have moved: those that were found, over the gap, or straight."""
        move = self._known_move(robot, moved)
        straight = np.array(self.query.ends_of(robot))
        return self._over_gaps.get((robot, moved), straight) if move is None else move.line.q

    def _manner(self, robot: str, moved: frozenset[str]) -> str:
        if self._known_move(robot, moved) is not None:
            return ""
        return ", straight over the gap between its trees" if (robot, moved) in self._over_gaps else " straight"

    def _in_order(self, order: tuple[str, ...], *, planned: bool) -> list[RobotMove] | None:
        moves: list[RobotMove] = []
        for place, robot in enumerate(order):
            move = self._move(robot, frozenset(order[:place]), planned=planned)
            if move is None:
                return None
            moves.append(move)
        return moves

    def _move(self, robot: str, moved: frozenset[str], *, planned: bool) -> RobotMove | None:
        """The move of a robot after some others have moved; None where none was found."""
        key = (robot, moved, planned)
        if key not in self._known:
            straight = self._known.get((robot, moved, False)) if planned else None
            self._known[key] = straight or self._plan(robot, moved, planned=planned)
        return self._known[key]

    def _plan(self, robot: str, moved: frozenset[str], *, planned: bool) -> RobotMove | None:
        query, check = self.query, self._check(robot, moved)
        if check is None:
            return None
        ends, box = query.ends_of(robot), query.box(robot)
        if not planned:
            return self._rounded(check, np.array(ends)) if check.is_free(*ends) else None
        if self.tried.searches >= MOST_FAILED:
            return None
        rng = generator(f"transfer of {robot} after {sorted(moved)}", query.seed)
        connection = connected(check, ends, box=box, samples=SAMPLES, rng=rng, tick=self._tick)
        if connection.path is None:
            self.tried.failed(robot, SAMPLES, connection.reached)
            if connection.over_gap is not None:
                self._over_gaps[robot, moved] = connection.over_gap
            return None
        return self._rounded(check, shortened(check, connection.path, box.velocity, rng))

    def _rounded(self, check: MoveCheck, path: Array) -> RobotMove:
        """A way through via points, shape (K, n), as a smooth move."""
        cell = self.query.scene.cell
        velocity = cell.robot(check.robot).model.velocity
        return RobotMove(robot=check.robot, line=rounded_line(check, path, cell.columns(check.robot), velocity))

    def _check(self, robot: str, moved: frozenset[str]) -> MoveCheck | None:
        """The check among robots that stand; None where an end of the move is blocked by one of them."""
        key = (robot, moved)
        if key not in self._checks:
            query = self.query
            standing = query.standing(moved)
            check = MoveCheck(query.scene, robot, Others.moving(query.scene, standing[None]), reserve=self._reserve)
            check.refused = self.tried.refused
            ends = query.ends_of(robot)
            for end in ends:
                check.relax_at(end)
            is_open = all(check.are_free(end[None]) for end in ends)
            self._checks[key] = check if is_open else None
        return self._checks[key]

    def _tick(self, share: float) -> None:
        self._progress(STAGE, share)


def shortened(check: MoveCheck, path: Array, velocity: Array, rng: np.random.Generator) -> Array:
    """A shorter way between the same ends, shape (K', n).

    Args:
        path: Via points in [rad] or [m], shape (K, n).
        velocity: Top speeds, shape (n,); lengths are times at these.
    """
    path = _without_detours(check, path)
    for _ in range(SHORTCUTS):
        if len(path) == 2:
            break
        lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0) / velocity, axis=1)))
        first, last = np.sort(rng.uniform(0.0, lengths[-1], 2))
        a, b = (np.array([np.interp(at, lengths, column) for column in path.T]) for at in (first, last))
        if float(np.linalg.norm((b - a) / velocity)) > (1.0 - GAIN) * (last - first):
            continue
        if check.is_free(a, b):
            before, after = path[lengths < first], path[lengths > last]
            path = np.concatenate([before, [a, b], after])
    return _without_detours(check, path)


def rounded_line(check: MoveCheck, path: Array, columns: slice, velocity: Array) -> BlendedLine:
    """A way with its corners rounded off as far as that is free.

    Args:
        path: Via points in [rad] or [m], shape (K, n), K at least 2.
        velocity: Top speeds, shape (n,): between via points the fastest joint goes at its own.
    """
    times = np.append(0.0, np.cumsum((np.abs(np.diff(path, axis=0)) / velocity).max(axis=1)))
    shares = np.ones(len(path))
    for corner in range(1, len(path) - 1):
        for _ in range(HALVINGS):
            line = BlendedLine.through(columns, times, path, shares=shares)
            at, half = times[corner], line.halves[corner]
            if check.are_free(line.at(np.linspace(at - half, at + half, check.samples(path[corner - 1 : corner + 2])))):
                break
            shares[corner] *= 0.5
    return BlendedLine.through(columns, times, path, shares=shares)


def _without_detours(check: MoveCheck, path: Array) -> Array:
    """Via points left out, from each one straight to the last one that is free."""
    vertices = [0]
    while vertices[-1] < len(path) - 1:
        here = vertices[-1]
        free = (k for k in range(len(path) - 1, here + 1, -1) if check.is_free(path[here], path[k]))
        vertices.append(next(free, here + 1))
    return path[vertices]
