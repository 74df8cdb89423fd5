"""Rules of a program between its tasks, as an assignment keeps them."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations, product
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.measures.weld_position import POINTS, resting_pairs
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.program import groups_of
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths
from cellplan.search.assign.problem.table import Key

ARC_TIMES: Final = 400  # at which the distance of two arcs is taken
ROUNDING: Final = 1e-9  # [steps] of a time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ServiceRule:
    """How the tool of a robot is cleaned."""

    q: Array  # configuration meanwhile in [rad] or [m], shape (n,)
    steps: int  # that it takes
    most: int  # tasks between two services
    is_due: bool = False  # whether it comes before the first task, as one cycle follows another


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskRules:
    """What holds between tasks beside what they come after."""

    same_robot: tuple[tuple[str, ...], ...] = ()  # groups of which one robot does all tasks
    together: tuple[tuple[str, ...], ...] = ()  # groups that are done in one block
    lags: Mapping[tuple[str, str], int] = field(default_factory=dict)  # steps from the begin of the block of the first
    # to that of the second at least, where it comes later; such tasks share a block only where they are together
    crowded: Mapping[tuple[str, str], frozenset[tuple[bool, bool]]] = field(default_factory=dict)  # of two tasks that
    # begin together: whether each is done backwards, where their arcs then come too near
    services: Mapping[str, ServiceRule] = field(default_factory=dict)  # by robot
    where: str = "program"  # where they stand

    @classmethod
    def of(cls, cell: Cell) -> Self:
        """The rules of a cell."""
        return cls(
            same_robot=groups_of(cell.program.same_robot),
            together=groups_of(cell.program.together),
            lags=_lags(cell),
            crowded=_crowded(cell),
            services=_services(cell),
            where=cell.origin.at("program"),
        )

    def with_longer_rests(self, short: float, step: float) -> Self:
        """The rules with rests that are longer by a time, in [s], in whole steps, in [s]."""
        return replace(self, lags={pair: lag + steps_over(short, step) for pair, lag in self.lags.items()})

    def is_crowded(self, tasks: tuple[str, str], are_reversed: tuple[bool, bool]) -> bool:
        """Whether the arcs of two tasks come too near where each is done backwards, or is not."""
        return are_reversed in self.crowded.get(tasks, ())

    @property
    def order_counts(self) -> bool:
        """Whether the time beside transfers depends on the order of the blocks."""
        return bool(self.lags or self.services)

    @property
    def grouped(self) -> int:
        """Number of groups."""
        return len(self.same_robot) + len(self.together)

    def covered(self, keys: Collection[Key], meet: Callable[[Key, Key], bool]) -> float:
        """How many groups can be done; of the same robot a share where it can do some of the tasks.

        Args:
            keys: Tasks, robots and stations that have a mode.
            meet: Whether two of them cannot be at work together.
        """
        count = 0.0
        for group in self.same_robot:
            able = {(by, task) for task, by, _ in keys if task in group}
            count += max((sum(by == robot for by, _ in able) for robot, _ in able), default=0) / len(group)
        for group in self.together:
            of_tasks = [[key for key in keys if key[0] == task] for task in group]
            count += any(
                all(a[2] == b[2] and a[1] != b[1] and not meet(a, b) for a, b in combinations(choice, 2))
                for choice in product(*of_tasks)
            )
        return count

    def hold_for(self, blocks: Sequence[Sequence[str]], chosen: Mapping[str, tuple[str, int]]) -> bool:
        """Whether they hold for blocks.

        Args:
            blocks: The tasks of each block.
            chosen: Robot and station of each task.
        """
        block_of = {task: number for number, block in enumerate(blocks) for task in block}
        return all(len({chosen[task][0] for task in group}) == 1 for group in self.same_robot) and all(
            len({block_of[task] for task in group}) == 1 for group in self.together
        )


def _services(cell: Cell) -> dict[str, ServiceRule]:
    """How the tools of robots are cleaned, by robot."""
    return {
        robot.name: ServiceRule(
            q=robot.service.posture,
            steps=steps_over(robot.service.takes, cell.motion.step),
            most=robot.service.most,
            is_due=cell.program.cycles > 1,
        )
        for robot in cell.robots
        if robot.service is not None
    }


def _lags(cell: Cell) -> dict[tuple[str, str], int]:
    """Steps between the begins of blocks that let the part cool in between."""
    program = cell.program
    if program.rest_s is None:
        return {}
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks if task.is_on_part}
    clocked = clock_paths(cell, toolpaths.values())
    paths = {name: toolpath.spread(POINTS)[:, :3, 3] for name, toolpath in toolpaths.items()}
    lags = {}
    for pair in resting_pairs(paths, program.apart):
        if not any({*pair} <= {*group} for group in groups_of(program.together)):
            for first, later in (pair, pair[::-1]):
                end = clocked[first].end + cell.task(first).off_delay
                lags[first, later] = steps_over(end + program.rest_s - cell.task(later).start, cell.motion.step)
    return lags


def _crowded(cell: Cell) -> dict[tuple[str, str], frozenset[tuple[bool, bool]]]:
    """Directions of two tasks that begin together in which their arcs come too near, in either order of the tasks."""
    least = cell.program.arcs_apart_mm
    if least is None:
        return {}
    clocked = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks if task.is_on_part])
    times = np.linspace(0.0, max(path.over for path in clocked.values()), ARC_TIMES)
    on, tips = dict[str, Flags](), dict[tuple[str, bool], Array]()
    for name, path in clocked.items():
        begin, end = path.task.moves_from, path.end
        on[name] = (times >= path.task.start) & (times <= end + path.task.off_delay)
        for is_reversed in (False, True):
            at = np.clip(begin + end - times if is_reversed else times, begin, end)
            tips[name, is_reversed] = path.targets(at)[0][:, :3, 3]
    crowded = {}
    for pair in permutations(clocked, 2):
        rows = on[pair[0]] & on[pair[1]]
        gaps = {
            both: np.linalg.norm(tips[pair[0], both[0]][rows] - tips[pair[1], both[1]][rows], axis=1)
            for both in product((False, True), (False, True))
        }
        crowded[pair] = frozenset(both for both, gap in gaps.items() if gap.min(initial=np.inf) < least.si)
    return crowded


def steps_over(time: float, step: float) -> int:
    """Whole steps that take at least a time in [s]."""
    return int(np.ceil(time / step - ROUNDING))


def tasks_before(cell: Cell) -> dict[str, tuple[str, ...]]:
    """Tasks that must be done before each one begins: those that it comes after, and those that rules put before it."""
    before = {task.name: dict.fromkeys(task.after) for task in cell.tasks}
    for first, later, _ in cell.program.in_order([task.name for task in cell.tasks if task.is_tack], before):
        before[later][first] = None
    return {name: tuple(names) for name, names in before.items()}
