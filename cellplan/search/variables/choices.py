"""Discrete choices of a layout search: who does which task, in which mode, and whose branches are tried."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, cast

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.layout import ChoiceKind, LayoutChoice


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Choices:
    """The discrete choices that a cell file gives."""

    cell: Cell
    chosen: tuple[LayoutChoice, ...]  # choices between robots and between modes
    branches: tuple[str, ...]  # names of the robots of which all branches of the start posture are tried

    @classmethod
    def of(cls, cell: Cell) -> "Choices":
        """Those of a cell."""
        if cell.layout is None:
            raise InputError(f"cell '{cell.name}': expected a cell that was read from a file, got one built in Python")
        choices = cell.layout.choices
        return cls(
            cell=cell,
            chosen=tuple(choice for choice in choices if choice.kind is not ChoiceKind.BRANCH),
            branches=tuple(choice.name for choice in choices if choice.kind is ChoiceKind.BRANCH),
        )

    def values(self) -> Iterator[dict[str, object]]:
        """Every combination as values by address for ``Cell.with_values``; the present one, without values, first.

        Combinations in which a robot would have two tasks, without a program, are left out. Robots whose tasks change
        have their start posture searched, and so has a task of a program that another robot does.
        """
        present = tuple(self._present(choice) for choice in self.chosen)
        yield {}
        for picks in product(*(choice.options for choice in self.chosen)):
            if picks != present and self._is_possible(picks):
                yield self._values(picks)

    def _present(self, choice: LayoutChoice) -> str:
        """What the cell has now."""
        return str(self.cell.motion.mode) if choice.kind is ChoiceKind.MODE else self.cell.task(choice.name).robot

    def _robots(self, picks: tuple[str, ...]) -> dict[str, str]:
        """Robot of every task in a combination."""
        robots = {task.name: task.robot for task in self.cell.tasks}
        for choice, pick in zip(self.chosen, picks, strict=True):
            if choice.kind is ChoiceKind.ROBOT:
                robots[choice.name] = pick
        return robots

    def _is_possible(self, picks: tuple[str, ...]) -> bool:
        """Whether every robot has one task at most, or there is a program."""
        robots = list(self._robots(picks).values())
        return self.cell.program.is_home_to_home or len(set(robots)) == len(robots)

    def _values(self, picks: tuple[str, ...]) -> dict[str, object]:
        values, document = dict[str, object](), cast("dict[str, Any]", self.cell.origin.document)
        for choice, pick in zip(self.chosen, picks, strict=True):
            if pick != self._present(choice):
                values[choice.address] = pick
        given = {task.name: task.robot for task in self.cell.tasks}
        moved = {task: robot for task, robot in self._robots(picks).items() if robot != given[task]}
        changed = {*moved.values(), *(given[task] for task in moved if self.cell.program.is_home_to_home)}
        for task in moved:
            for key in {"start", "start_deg"}.intersection(document["tasks"][task]):
                values[f"tasks.{task}.{key}"] = "auto"
        for robot in self.cell.robots:
            if robot.name in changed:
                key = "start" if "start" in document["robots"][robot.name] else "start_deg"
                turns = all(joint.is_revolute for joint in robot.model.joints)
                values[f"robots.{robot.name}.{key if turns else 'start'}"] = "auto"
        return values
