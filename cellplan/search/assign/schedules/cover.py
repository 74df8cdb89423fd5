r"""Blocks chosen from all that are possible: a bound of the cycle with the least moves of the robots, and schedules.

Between two blocks a robot takes at least as long as its shortest move to its next task, and as its shortest move away
from the last one; half of either counts for each block, up to a limit :math:`\kappa`. So the cycle is at least

.. math:: \sum_{B \text{ chosen}} \bigl(d_B + \tfrac12 (t^\text{in}_B + t^\text{out}_B)\bigr)
    + \sum_{\text{moves of the part}} \max(t - \kappa, 0)

where the blocks chosen have all tasks. The linear relaxation is solved for all blocks, the whole problem for those of
the least reduced costs. Of the rules between tasks those count that decide what a block may have; the others are left
out, which keeps the bound a bound.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice, permutations, product
from typing import Any, Final, Self

import numpy as np

from cellplan.geometry.arrays import Indices
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.problem.table import Key
from cellplan.search.assign.schedules.blocks import BlockAnswer, solve_blocks
from cellplan.search.assign.schedules.schedule import BlockSchedule, Choice, in_order
from cellplan.search.assign.schedules.solver import Relaxed, Solved, new_model, new_relaxation
from cellplan.search.assign.schedules.transfers import is_possible

MOST_BLOCKS: Final = 60_000  # where more are possible the block model stands alone
MANY: Final = 25  # tasks; with more of them the block model gets more work, by the square of their number
MOST_CHOSEN_FROM: Final = 500  # blocks of which the whole problem is solved
LIMITS: Final = (0.5, 0.75, 0.9)  # shares of the blocks whose moves a limit that is tried does not cut
FAR: Final = 10**6  # [steps]

Place = int | None  # a station, or None for home
Arcs = dict[tuple[Place, Place], int]


def best_blocks(instance: Instance, *, least: int, effort: float, hint: BlockSchedule | None = None) -> BlockAnswer:
    """The best of what a choice from all blocks and the block model come to.

    The block model is asked only where not all blocks can be listed, or where the choice breaks rules between tasks.

    Args:
        least: Steps that every transfer between two blocks takes at least.
        effort: Work of either one in units of deterministic time, about seconds of one processor.
        hint: A schedule that is known.
    """
    covered = cover_blocks(instance, effort=effort, hint=hint)
    if covered is not None and covered.schedule is not None and not instance.rules.order_counts:
        return covered
    more = effort * max(1.0, len(instance.tasks) / MANY) ** 2
    answer = solve_blocks(instance, least=least, effort=more, hint=hint)
    return answer if covered is None else replace(answer, bound=max(answer.bound or 0, covered.bound or 0))


def cover_blocks(instance: Instance, *, effort: float, hint: BlockSchedule | None = None) -> BlockAnswer | None:
    """The cheapest choices of blocks, as far as they keep the rules; None where too many blocks are possible.

    Args:
        effort: Work in units of deterministic time, about seconds of one processor.
        hint: A schedule that is known.
    """
    relaxed = _Cover.relaxed_of(instance)
    return None if relaxed is None else relaxed[0].chosen(relaxed[1], effort, hint)


def bound_of_blocks(instance: Instance, *, least: int, effort: float, hint: BlockSchedule | None = None) -> int | None:
    """The bound of ``best_blocks``, of the linear relaxation alone where that decides."""
    relaxed = None if instance.rules.order_counts else _Cover.relaxed_of(instance)
    if relaxed is None:
        return best_blocks(instance, least=least, effort=effort, hint=hint).bound
    return int(np.ceil(relaxed[1].bound / 2.0))


def possible_blocks(instance: Instance) -> Iterator[frozenset[Key]]:
    """Tasks of robots that can begin together, at each station; of a column and of tasks by rule together all."""
    apart = tasks_apart(instance)
    for station in instance.used:
        if station in instance.columns:
            yield instance.columns[station]
            continue
        keys = [key for key in instance.modes if key[2] == station]
        fits = {a: [b for b in keys[place + 1 :] if _fit(instance, apart, a, b)] for place, a in enumerate(keys)}
        left: list[tuple[tuple[Key, ...], list[Key]]] = [((key,), fits[key]) for key in reversed(keys)]
        while left:
            block, others = left.pop()
            tasks = {key[0] for key in block}
            if all(tasks.isdisjoint(group) or tasks.issuperset(group) for group in instance.rules.together):
                yield frozenset(block)
            left += [((*block, key), [it for it in fits[key] if it in others]) for key in reversed(others)]


def tasks_apart(instance: Instance) -> frozenset[frozenset[str]]:
    """Pairs of tasks that never begin together: one comes after the other, or one robot does both."""
    pairs = {frozenset(pair) for group in instance.rules.same_robot for pair in combinations(group, 2)}
    for task in instance.tasks:
        left, before = [task], set[str]()
        while left:
            more = set(instance.goals[left.pop()].after) & set(instance.goals) - before
            before |= more
            left += more
        pairs |= {frozenset((task, first)) for first in before}
    return frozenset(pairs)


def _fit(instance: Instance, apart: Collection[frozenset[str]], first: Key, second: Key) -> bool:
    """Whether two tasks of robots can begin together."""
    is_apart = first[0] == second[0] or frozenset((first[0], second[0])) in apart
    return not is_apart and first[1] != second[1] and frozenset((first, second)) not in instance.conflicts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LeastMoves:
    """The shortest moves by task, robot and station, each in [steps] with one entry for each way to do the task."""

    coming: Mapping[Key, Indices]  # to its begin from any other task, or from home
    leaving: Mapping[Key, Indices]  # from its end
    from_home: Mapping[Key, int]
    to_home: Mapping[Key, int]

    def of(self, blocks: Sequence[frozenset[Key]], limit: int) -> tuple[Indices, Indices, Indices]:
        """What moves to and from blocks take together, each up to a limit, and moves from and to home, shape (K,)."""
        sides = {key: np.minimum([it, self.leaving[key]], limit) for key, it in self.coming.items()}
        both = {key: int(it.sum(axis=0).min()) for key, it in sides.items()}
        apart = {key: it.min(axis=1) for key, it in sides.items()}
        together = [
            max(*(both[key] for key in it), int(np.max([apart[key] for key in it], axis=0).sum())) for it in blocks
        ]
        homes = ([max(table[key] for key in it) for it in blocks] for table in (self.from_home, self.to_home))
        first, last = (np.array(it) for it in homes)
        return np.array(together), first, last


def least_moves(instance: Instance) -> LeastMoves:
    """The shortest moves to and from every task, with those of the part from station to station."""
    coming, leaving = dict[Key, Indices](), dict[Key, Indices]()
    from_home, to_home = dict[Key, int](), dict[Key, int]()
    part = {(a, b): instance.station_steps(a, b) for a, b in product(instance.used, repeat=2)}
    for robot in instance.robots:
        keys = [key for key in instance.modes if key[1] == robot]
        ends = [(key, end) for key in keys for end in instance.ends(*key)]
        if not ends:
            continue
        begins, leaves = (np.array([getattr(end, side) for _, end in ends]) for side in ("begin", "end"))
        home = instance.homes[robot]
        come = instance.transfer_steps(robot, home, begins).astype(np.int64)
        leave = instance.transfer_steps(robot, leaves, home).astype(np.int64)
        rows = {key: np.array([place for place, (name, _) in enumerate(ends) if name == key]) for key in keys}
        from_home |= {key: int(come[at].min()) for key, at in rows.items()}
        to_home |= {key: int(leave[at].min()) for key, at in rows.items()}
        for key, at in rows.items():
            moved = np.array([part[key[2], other[2]] for other, _ in ends])
            steps = np.maximum(instance.transfer_steps(robot, leaves[at, None], begins[None]), moved)
            steps[:, [other[0] == key[0] for other, _ in ends]] = FAR
            leave[at] = np.minimum(leave[at], steps.min(axis=1))
            come = np.minimum(come, steps.min(axis=0))
        coming |= {key: come[at] for key, at in rows.items()}
        leaving |= {key: leave[at] for key, at in rows.items()}
    return LeastMoves(coming=coming, leaving=leaving, from_home=from_home, to_home=to_home)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cover:
    """Blocks with their costs in half steps, of which some have all tasks together."""

    instance: Instance
    blocks: Sequence[tuple[frozenset[Key], int]]  # and what they cost
    arcs: Arcs  # what moves of the part cost from station to station, from home and back

    @classmethod
    def of(cls, instance: Instance, blocks: Sequence[frozenset[Key]], moves: LeastMoves, limit: int) -> Self:
        """The cheapest block for each set of tasks at a station, with moves up to a limit in [steps]."""
        together, comes, goes = (it.tolist() for it in moves.of(blocks, limit))
        cheapest: dict[tuple[int, frozenset[str]], tuple[frozenset[Key], int]] = {}
        ends: Arcs = {}
        for block, both, first, last in zip(blocks, together, comes, goes, strict=True):
            station, tasks = place_of(block)
            cost = both + 2 * max(instance.steps(task) for task in tasks)
            if cost < cheapest.get((station, tasks), (block, FAR))[1]:
                cheapest[station, tasks] = block, cost
            for arc, steps in (((None, station), first), ((station, None), last)):
                ends[arc] = min(ends.get(arc, FAR), steps)
        return cls(instance=instance, blocks=list(cheapest.values()), arcs=_arcs(instance, ends, limit))

    @classmethod
    def relaxed_of(cls, instance: Instance) -> tuple[Self, Relaxed] | None:
        """All possible blocks with the limit that makes the largest bound; None where there are too many or too few."""
        blocks = list(islice(possible_blocks(instance), MOST_BLOCKS + 1))
        if len(blocks) > MOST_BLOCKS or len({task for it in blocks for task, _, _ in it}) < len(instance.tasks):
            return None
        moves = least_moves(instance)
        limits = np.unique(np.quantile(moves.of(blocks, FAR)[0], LIMITS).astype(np.int64) // 2).tolist()
        covers = (cls.of(instance, blocks, moves, limit) for limit in limits)
        return max(((it, it.relaxed()) for it in covers), key=lambda it: it[1].bound)

    def relaxed(self) -> Relaxed:
        """The linear relaxation over all blocks."""
        model = new_relaxation()
        chosen = [model.new_num_var(0.0, np.inf, "") for _ in self.blocks]
        self._add_rows(model, chosen, {arc: model.new_num_var(0.0, np.inf, "") for arc in self.arcs})
        return Relaxed(model, chosen)

    def chosen(self, relaxed: Relaxed, effort: float, hint: BlockSchedule | None) -> BlockAnswer:
        """The best schedules of the blocks with the least reduced costs, and what that proves of all."""
        known = [] if hint is None else [(hint.station_of(block), frozenset(block)) for block in hint.blocks]
        is_known = [place_of(block) in known for block, _ in self.blocks]
        order = sorted(range(len(self.blocks)), key=lambda it: (not is_known[it], relaxed.reduced[it], it))
        places, left = order[:MOST_CHOSEN_FROM], order[MOST_CHOSEN_FROM:]
        cover, model = replace(self, blocks=[self.blocks[it] for it in places]), new_model()
        chosen = {self.blocks[it][0]: model.new_bool_var("") for it in places}
        goes = {arc: model.new_bool_var("") for arc in self.arcs}
        cover._add_rows(model, list(chosen.values()), goes)
        rests = {station: model.new_bool_var("") for station in self.instance.used}
        number = {place: count for count, place in enumerate((None, *rests))}
        for station, it in rests.items():
            model.add(_entries(goes, station) + it == 1)
        circuit = [(number[a], number[b], it) for (a, b), it in goes.items()]
        model.add_circuit([*circuit, *((number[station], number[station], it) for station, it in rests.items())])
        solved = Solved(model, effort, [(it, is_known[at]) for it, at in zip(chosen.values(), places, strict=True)])
        schedules = (self._schedule(solved.true(chosen, answer)) for answer in range(len(solved.answers)))
        different = list({it.identity: it for it in schedules if it is not None}.values())
        least = relaxed.bound + min((relaxed.reduced[it] for it in left), default=np.inf)
        bound = max(relaxed.bound, min(solved.bound, least)) if solved.answers else relaxed.bound
        return BlockAnswer(
            schedule=next(iter(different), None),
            bound=int(np.ceil(bound / 2.0)),
            is_proved=solved.is_proved and solved.objective <= bound,
            others=tuple(different[1:]),
        )

    def _schedule(self, blocks: Sequence[frozenset[Key]]) -> BlockSchedule | None:
        """Blocks without the tasks that others have; None where that breaks rules."""
        instance, chosen, split = self.instance, dict[str, Choice](), list[tuple[str, ...]]()
        for block in sorted(blocks, key=lambda it: (place_of(it)[0] not in instance.columns, -len(it), sorted(it))):
            more = {task: (robot, at) for task, robot, at in sorted(block) if task not in chosen}
            chosen |= more
            split += [tuple(more)] if more else []
        schedule = BlockSchedule(blocks=in_order(split, instance.goals) or (), chosen=chosen)
        return schedule if is_possible(instance, schedule) else None

    def _add_rows(self, model: Any, chosen: Sequence[Any], goes: Mapping[tuple[Place, Place], Any]) -> None:
        """Every task is in a block, and the part comes from home to the stations of the blocks, and goes back."""
        instance = self.instance
        having: dict[tuple[str, int], list[Any]] = {}
        for (block, _), it in zip(self.blocks, chosen, strict=True):
            for task, _, station in sorted(block):
                having.setdefault((task, station), []).append(it)
        for task in instance.tasks:
            model.add(sum(it for (name, _), places in having.items() if name == task for it in places) >= 1)
        for (_, station), places in having.items():
            model.add(sum(places) <= _entries(goes, station))
        for place in (None, *instance.used):
            model.add(_entries(goes, place) == sum(it for (first, _), it in goes.items() if first == place))
        model.add(_entries(goes, None) == 1)
        model.add(sum(chosen) >= -(-len(instance.tasks) // len(instance.robots)))
        work = sum(it * cost for (_, cost), it in zip(self.blocks, chosen, strict=True))
        model.minimize(work + sum(it * self.arcs[arc] for arc, it in goes.items()))


def place_of(block: frozenset[Key]) -> tuple[int, frozenset[str]]:
    """Station and tasks of a block."""
    return next(iter(block))[2], frozenset(task for task, _, _ in block)


def _entries(goes: Mapping[tuple[Place, Place], Any], place: Place) -> Any:
    """How often the part comes to a place."""
    return sum(it for (_, to), it in goes.items() if to == place)


def _arcs(instance: Instance, ends: Arcs, limit: int) -> Arcs:
    """What moves of the part cost beyond those to and from blocks up to a limit, over other stations where cheaper.

    Args:
        ends: Least steps of the robots from home to the blocks at a station, and back.
    """
    arcs: Arcs = {}
    for a, b in permutations((None, *instance.used), 2):
        steps = max(instance.station_steps(a, b), ends.get((a, b), 0))
        arcs[a, b] = max(2 * steps - limit * (1 if None in (a, b) else 2), 0)
    for by in (it for it in instance.used if it not in instance.columns):
        for a, b in permutations((None, *(it for it in instance.used if it != by)), 2):
            arcs[a, b] = min(arcs[a, b], arcs[a, by] + arcs[by, b])
    return arcs
