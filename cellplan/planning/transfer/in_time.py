"""All robots in the same span of time: one after the other is planned, against the motion of those planned before.

A robot goes straight as soon as that is free, or waits until it is, or trees grow in its joint space and time. Those
that are still to be planned are not there for it: they keep away from it later, which is prioritised planning (Erdmann
and Lozano-Perez 1987). Several orders of the robots and two spans are tried.

Nodes are configurations at whole ticks. The one tree grows from the start at the first tick forwards in time, the other
one from the goal at the last tick backwards; time strictly rises along every way, and no joint is faster than its limit
on any edge, so neither is it on a straight line in place of several edges.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import permutations
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.progress import Progress
from cellplan.model.seeds import generator
from cellplan.planning.transfer.blended_lines import BlendedLine
from cellplan.planning.transfer.move_check import MoveCheck, Others
from cellplan.planning.transfer.query import STAGE, TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.trees import JointBox

SPANS: Final = (2.5, 5.0)  # [-] of the time that the slowest robot takes straight at top speed
DELAYS: Final = 9  # waits before a straight move that are tried
LEAST_SPAN: Final = 0.5  # [s]
MOST_ORDERS: Final = 6  # orders of the robots that are tried
SAMPLES: Final = 800  # configurations drawn for one robot
HALVINGS: Final = 5  # of what is cut off at corners, until it is free
TICK: Final = 0.002  # [s] of nominal time
STEP: Final = 150  # [-] ticks of the longest edge
TIME_WEIGHT: Final = 0.3  # [-] of a second of time beside a second at top speed, where the nearest node is looked up
STANDING: Final = 4  # every so many draws are the start or the goal at some time, so that waiting is found
SHORTCUTS: Final = 60  # straight lines between two nodes of a way that are tried
ROUNDING: Final = 1e-9  # [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpaceTimePath:
    """A way in joint space and time."""

    ticks: Indices  # ticks of the via points, increasing, shape (K,)
    q: Array  # the via points in [rad] or [m], shape (K, n)


class InTime:
    """Moves of all robots in the same span of time."""

    def __init__(self, query: TransferQuery, tried: Tried, *, reserve: float, progress: Progress) -> None:
        """Prepare a query to be planned with ``reserve`` in [m] beyond the demanded distance."""
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
        moving = np.flatnonzero(np.any(np.diff(path.q, axis=0) != 0.0, axis=1))  # edges on which the robot moves
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


@dataclass(slots=True, kw_only=True, eq=False)
class TimedTree:
    """Configurations at ticks, each with the one it was reached from."""

    sign: int  # 1 for the tree that grows forwards in time, -1 for the other one
    x: list[Array]  # configurations divided by top speeds in [s], shape (n,) each; the root first
    ticks: list[int]  # their ticks
    parents: list[int] = field(default_factory=lambda: [0])  # index of the node each was reached from

    def nearest(self, x: Array, tick: int) -> int | None:
        """Index of the nearest node from which a configuration can be reached in time; None without any."""
        apart, left = np.array(self.x) - x, self.sign * (tick - np.array(self.ticks)) * TICK
        reaches = (np.abs(apart).max(axis=1) <= left + ROUNDING) & (left > 0.0)
        if not reaches.any():
            return None
        far = np.einsum("ij,ij->i", apart, apart) + (TIME_WEIGHT * left) ** 2
        return int(np.argmin(np.where(reaches, far, np.inf)))

    def add(self, x: Array, tick: int, parent: int) -> int:
        """Add a node; its index."""
        self.x.append(x)
        self.ticks.append(tick)
        self.parents.append(parent)
        return len(self.x) - 1

    def path_to(self, index: int) -> list[int]:
        """Indices of the nodes from one of them to the root."""
        path = [index]
        while index:
            index = self.parents[index]
            path.append(index)
        return path


def is_free_in_time(check: MoveCheck, first: tuple[Array, int], second: tuple[Array, int]) -> bool:
    """Whether the even move between two configurations at ticks is free of everything at its place at that time."""
    (before, begin), (after, end) = first, second
    share = (np.arange(begin, end + 1) - begin)[:, None] / (end - begin)
    return check.are_free(before + share * (after - before), np.arange(begin, end + 1))


def connected_in_time(
    check: MoveCheck,
    ends: tuple[tuple[Array, int], tuple[Array, int]],
    *,
    box: JointBox,
    samples: int,
    rng: np.random.Generator,
    tick: Callable[[float], object],
) -> SpaceTimePath | tuple[int, int]:
    """A way from a configuration at a tick to another one at a later tick.

    Args:
        ends: Start and goal in [rad] or [m], shape (n,) each, with their ticks.
        samples: How many of them at most.

    Returns:
        The way; or the numbers of configurations reached from the start and from the goal where none was found.
    """
    (start, begin), (goal, end) = ends
    search = _TreeSearch(check, box.velocity)
    trees = [
        TimedTree(sign=1, x=[start / box.velocity], ticks=[begin]),
        TimedTree(sign=-1, x=[goal / box.velocity], ticks=[end]),
    ]
    for number in range(samples):
        tick(number / samples)
        mine, other = trees[number % 2], trees[1 - number % 2]
        q = box.draw(rng, number, start, goal)
        if number // 2 % STANDING == 0:
            q = (start, goal)[number % 2]
        x, at = q / box.velocity, int(rng.integers(begin + 1, end))
        new = search.extended(mine, x, at)
        met = None if new is None else search.run(other, mine.x[new], mine.ticks[new])
        if new is not None and met is not None:
            ahead, back = (new, met) if number % 2 == 0 else (met, new)
            return _joined(trees, ahead, back, ends, box.velocity)
    return len(trees[0].x), len(trees[1].x)


def shortened_in_time(check: MoveCheck, path: SpaceTimePath, rng: np.random.Generator) -> SpaceTimePath:
    """A way with straight lines in joint space and time in place of several edges, each in the same time as these."""
    for _ in range(SHORTCUTS):
        if len(path.ticks) == 2:
            break
        first, last = np.sort(rng.integers(path.ticks[0], path.ticks[-1] + 1, 2)).tolist()
        inner = (path.ticks > first) & (path.ticks < last)
        if not inner.any():
            continue
        a, b = (np.array([np.interp(at, path.ticks, column) for column in path.q.T]) for at in (first, last))
        if is_free_in_time(check, (a, first), (b, last)):
            before, after = path.ticks < first, path.ticks > last
            path = SpaceTimePath(
                ticks=np.concatenate([path.ticks[before], [first, last], path.ticks[after]]),
                q=np.concatenate([path.q[before], [a, b], path.q[after]]),
            )
    return path


@dataclass(frozen=True, slots=True, eq=False)
class _TreeSearch:
    """What trees grow among."""

    check: MoveCheck
    velocity: Array

    def extended(self, tree: TimedTree, x: Array, tick: int) -> int | None:
        """Index of a new node at most one step from the nearest one; None where there is none, or it is blocked."""
        near = tree.nearest(x, tick)
        if near is None:
            return None
        from_tick, left = tree.ticks[near], abs(tick - tree.ticks[near])
        new_tick = from_tick + tree.sign * min(left, STEP)
        new = tree.x[near] + (x - tree.x[near]) * (min(left, STEP) / left) if left > STEP else x
        pair = sorted([(from_tick, tree.x[near]), (new_tick, new)], key=lambda node: node[0])
        (begin, first), (end, second) = pair
        if not is_free_in_time(self.check, (first * self.velocity, begin), (second * self.velocity, end)):
            return None
        return tree.add(new, new_tick, near)

    def run(self, tree: TimedTree, x: Array, tick: int) -> int | None:
        """Index of the node of a tree at a configuration and tick, after steps towards it; None where blocked."""
        while True:
            new = self.extended(tree, x, tick)
            if new is None or tree.ticks[new] == tick:
                return new


def _joined(
    trees: list[TimedTree], ahead: int, back: int, ends: tuple[tuple[Array, int], tuple[Array, int]], velocity: Array
) -> SpaceTimePath:
    """The way along both trees to the nodes where they met."""
    there, home = trees[0].path_to(ahead)[::-1], trees[1].path_to(back)[1:]
    ticks = np.array([trees[0].ticks[k] for k in there] + [trees[1].ticks[k] for k in home])
    q = np.array([trees[0].x[k] for k in there] + [trees[1].x[k] for k in home]) * velocity
    q[0], q[-1] = ends[0][0], ends[1][0]
    return SpaceTimePath(ticks=ticks, q=q)
