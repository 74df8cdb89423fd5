"""Progress of robots through their sequences of tasks and marks."""

from collections.abc import Iterable, Iterator

from cellplan.errors import InputError
from cellplan.model.cell import Cell
from cellplan.model.sequence import sequence_of
from cellplan.model.task import Task


class SequenceProgress:
    """How far each robot of a cell is in its sequence of tasks and marks.

    Attributes:
        cell: The cell; all names in its orders exist.
    """

    def __init__(self, cell: Cell) -> None:
        """Begin before the first task and mark of every robot."""
        self.cell = cell
        self._sequences = {robot.name: sequence_of(cell, robot.name) for robot in cell.robots}
        self._places = dict.fromkeys(self._sequences, 0)
        self._dwells = {mark.name: mark.dwell_s for mark in cell.program.all_marks} if cell.program is not None else {}
        self._robots_of = {
            mark: [robot for robot, sequence in self._sequences.items() if mark in sequence] for mark in self._dwells
        }
        self._tasks = {task.name: task for task in cell.tasks}

    @property
    def is_finished(self) -> bool:
        """Whether every robot is at the end of its sequence."""
        return not any(True for _ in self._unfinished())

    def pass_marks(self) -> float:
        """Pass all marks to which every robot that takes part has come; the time in [s] for which all stand there."""
        total, is_stuck = 0.0, False
        while not is_stuck:
            is_stuck = True
            for mark in dict.fromkeys(self._next(robot) for robot in self._unfinished()):
                if mark in self._dwells and all(self._next(robot) == mark for robot in self._robots_of[mark]):
                    self._advance(self._robots_of[mark])
                    total, is_stuck = total + self._dwells[mark], False
        return total

    def ready(self) -> list[Task]:
        """Tasks that may begin, in the order of the cell."""
        names = {self._next(robot) for robot in self._unfinished()}
        return [task for task in self.cell.tasks if task.name in names and all(map(self._is_done, task.after))]

    def finish(self, tasks: Iterable[Task]) -> None:
        """Work off tasks that may begin."""
        self._advance([task.robot for task in tasks])

    def deadlock(self) -> InputError:
        """The circle of robots that wait for one another; no task may begin and no mark be passed."""
        circle: list[str] = []
        robot = next(self._unfinished())
        while robot not in circle:
            circle.append(robot)
            robot = self._awaited(robot)[0]
        circle = circle[circle.index(robot) :]
        first = min(range(len(circle)), key=lambda index: self.cell.index(circle[index]))
        circle = circle[first:] + circle[:first]
        words = f"'{self._next(circle[0])}' of {circle[0]} waits for " + ", which waits for ".join(
            self._awaited_words(robot) for robot in circle
        )
        name, place = self._next(circle[0]), self._places[circle[0]]
        key = f"robots.{circle[0]}.order[{place}]" if name in self._dwells else f"tasks.{name}.after"
        return InputError(
            f"{self.cell.origin.at(key)}: expected an order that can be worked off, got a circle: {words}: change "
            "order, after or marks"
        )

    def _awaited_words(self, robot: str) -> str:
        """What a robot waits for, and what comes before it where that is not next."""
        other, name = self._awaited(robot)
        before = "" if self._next(other) == name else f", which comes after '{self._next(other)}'"
        return f"'{name}' of {other}{before}"

    def _awaited(self, robot: str) -> tuple[str, str]:
        """The robot, and its task or mark, that a robot waits for."""
        name = self._next(robot)
        if name in self._dwells:
            return next((other, name) for other in self._robots_of[name] if self._next(other) != name)
        task = next(before for before in self._tasks[name].after if not self._is_done(before))
        return self._tasks[task].robot, task

    def _unfinished(self) -> Iterator[str]:
        """Robots that are not at the end of their sequences, in the order of the cell."""
        return (robot for robot, place in self._places.items() if place < len(self._sequences[robot]))

    def _next(self, robot: str) -> str:
        """The next task or mark of an unfinished robot."""
        return self._sequences[robot][self._places[robot]]

    def _is_done(self, task: str) -> bool:
        """Whether a task is worked off."""
        robot = self._tasks[task].robot
        return self._sequences[robot].index(task) < self._places[robot]

    def _advance(self, robots: Iterable[str]) -> None:
        """Go on to the next task or mark of robots."""
        for robot in robots:
            self._places[robot] += 1
