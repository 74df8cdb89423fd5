"""All robots in the same span of time: one after the other is planned, against the motion of those planned before.

A robot goes straight as soon as that is free, or waits until it is, or trees grow in its joint space and time. Those
that are still to be planned are not there for it: they keep away from it later, which is prioritised planning (Erdmann
and Lozano-Perez 1987). Several orders of the robots and two spans are tried.
"""

from collections.abc import Iterator
from itertools import permutations
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows
from cellplan.geometry.arrays import Array
from cellplan.model.progress import Progress
from cellplan.model.seeds import generator
from cellplan.planning.transfer.blended_lines import BlendedLine
from cellplan.planning.transfer.move_check import MoveCheck, Others
from cellplan.planning.transfer.query import STAGE, TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.timed_trees import TICK, SpaceTimePath, connected_in_time, moves_at, shortened_in_time

SPANS: Final = (2.5, 5.0)  # [-] of the time that the slowest robot takes straight at top speed
DELAYS: Final = 9  # waits before a straight move that are tried
LEAST_SPAN: Final = 0.5  # [s]
MOST_ORDERS: Final = 6  # orders of the robots that are tried
SAMPLES: Final = 800  # configurations drawn for one robot
HALVINGS: Final = 5  # of what is cut off at corners, until it is free


class InTime:
    """Moves of all robots in the same span of time.

    Attributes:
        tried: What was tried in vain.
    """

    def __init__(self, query: TransferQuery, tried: Tried, *, reserve: float, progress: Progress) -> None:
        """Prepare; nothing is planned yet.

        Args:
            query: Who moves from where to where.
            reserve: Distance in [m] beyond the demanded one while planning.
        """
        self.tried, self._query, self._reserve, self._progress = tried, query, reserve, progress

    def lines(self) -> Iterator[list[BlendedLine]]:
        """Lines of all robots on one nominal time, one list for each order and span that is free."""
        slowest = max(self._straight_time(robot) for robot in self._query.movers)
        orders = list(permutations(self._query.movers))[:MOST_ORDERS]
        for share in SPANS:
            count = round(max(LEAST_SPAN, share * slowest) / TICK)
            for order in orders:
                self.tried.orders += 1
                lines = self._in_order(order, count)
                if lines is not None:
                    yield lines

    def _straight_time(self, robot: str) -> float:
        """Time in [s] of the straight move of a robot at top speed."""
        start, goal = self._query.ends_of(robot)
        return float((np.abs(goal - start) / self._query.box(robot).velocity).max())

    def _in_order(self, order: tuple[str, ...], count: int) -> list[BlendedLine] | None:
        """Lines of the robots of one order; None where one finds none."""
        lines: list[BlendedLine] = []
        times = np.linspace(0.0, count * TICK, count + 1)
        for place, robot in enumerate(order):
            q = np.tile(self._query.start, (len(times), 1))
            for line in lines:
                q[:, line.columns] = line.at(times)
            move = self._line(robot, order[place + 1 :], q, times)
            if move is None:
                return None
            lines.append(move)
        return lines

    def _line(self, robot: str, later: tuple[str, ...], q: Array, times: Array) -> BlendedLine | None:
        """A line of one robot against the motion of the others, at stacked joint positions of shape (ticks, nq)."""
        query = self._query
        away = {row for name in later for row in rows_moved_by(query.scene, name)}
        scene = scene_of_rows(query.scene, [row for row in range(len(query.scene.pairs)) if row not in away])
        check = MoveCheck(scene, robot, Others.moving(scene, q), reserve=self._reserve)
        check.refused = self.tried.refused
        start, goal = query.ends_of(robot)
        check.relax_at(start, 0)
        check.relax_at(goal, len(times) - 1)
        line = self._waiting(check, times)
        return line or self._searched(check, times, generator(f"transfer of {robot} before {later}", query.seed))

    def _waiting(self, check: MoveCheck, times: Array) -> BlendedLine | None:
        """Straight, after a wait; the shortest one that is free."""
        ends, seconds = np.array(self._query.ends_of(check.robot)), self._straight_time(check.robot)
        columns = self._query.scene.cell.columns(check.robot)
        for wait in np.linspace(0.0, float(times[-1]) - 2.0 * seconds, DELAYS):
            at = wait + np.array([0.5, 1.5]) * seconds
            line = BlendedLine.through(columns, at, ends)
            if check.are_free(line.at(times), np.arange(len(times))):
                return line
        return None

    def _searched(self, check: MoveCheck, times: Array, rng: np.random.Generator) -> BlendedLine | None:
        """By trees in joint space and time."""
        start, goal = self._query.ends_of(check.robot)
        margin = len(times) // 10  # in which the robot gains and loses its speed
        ends = (start, margin), (goal, len(times) - 1 - margin)
        path = connected_in_time(
            check, ends, box=self._query.box(check.robot), samples=SAMPLES, rng=rng, tick=self._tick
        )
        if isinstance(path, SpaceTimePath):
            return self._rounded(check, shortened_in_time(check, path, rng), times)
        self.tried.failed(check.robot, SAMPLES, path)
        return None

    def _rounded(self, check: MoveCheck, path: SpaceTimePath, times: Array) -> BlendedLine | None:
        """A way with its corners rounded off as far as that is free; None where even the least rounding is not."""
        moving = np.flatnonzero(moves_at(path))
        first, last = int(moving[0]), int(moving[-1]) + 1  # it stands before and after
        columns = self._query.scene.cell.columns(check.robot)
        at, via, share = times[path.ticks[first : last + 1]], path.q[first : last + 1], 1.0
        for _ in range(HALVINGS):
            line = BlendedLine.through(columns, at, via, shares=share)
            is_within = line.begin >= 0.0 and line.end <= times[-1]
            if is_within and check.are_free(line.at(times), np.arange(len(times))):
                return line
            share *= 0.5
        return None

    def _tick(self, share: float) -> None:
        self._progress(STAGE, share)
