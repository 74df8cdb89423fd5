"""Rules of a program between its tasks, as an assignment keeps them."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Self

from cellplan.model.cell.cell import Cell
from cellplan.model.settings.program import groups_of
from cellplan.search.assign.table import Key


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskRules:
    """What holds between tasks beside what they come after."""

    same_robot: tuple[tuple[str, ...], ...] = ()  # groups of which one robot does all tasks
    together: tuple[tuple[str, ...], ...] = ()  # groups that are done in one block
    where: str = "program"  # where they stand

    @classmethod
    def of(cls, cell: Cell) -> Self:
        """The rules of a cell."""
        return cls(
            same_robot=groups_of(cell.program.same_robot),
            together=groups_of(cell.program.together),
            where=cell.origin.at("program"),
        )

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


def tasks_before(cell: Cell) -> dict[str, tuple[str, ...]]:
    """Tasks that must be done before each one begins: those that it comes after, and those that rules put before it."""
    before = {task.name: dict.fromkeys(task.after) for task in cell.tasks}
    for first, later, _ in cell.program.in_order([task.name for task in cell.tasks if task.is_tack], before):
        before[later][first] = None
    return {name: tuple(names) for name, names in before.items()}
