"""Arrangement of the tasks of a cell into blocks that are worked on one after another."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.cell.sequence import order_faults, sequence_of
from cellplan.model.task.task import Task


@dataclass(frozen=True, slots=True)
class Block:
    """Tasks that begin together with everything at rest; the next block begins when all of them are done."""

    tasks: tuple[str, ...]  # in the order of the cell, at most one for each robot; none for a rest after them all
    dwell: float = 0.0  # time in [s] for which all robots stand still before the tasks begin


def arrange(cell: Cell) -> tuple[Block, ...]:
    """The tasks of one cycle that are worked on together, block after block.

    In every mode the orders of the robots, ``after`` and the marks hold, and a task comes as early as they allow.
    Pairwise has one task in each block, the first of the cell that may begin; semi-coordinated only tasks at one
    configuration of the first holder, the present one as long as there are any for it; during all or none of them that
    holder moves.

    Raises:
        InputError: A name does not exist or stands in the order of another robot, robots wait for one another in a
            circle, or tasks that begin together need different configurations of the holder.
    """
    _require_names(cell)
    progress = SequenceProgress(cell)
    blocks: list[Block] = []
    while True:
        dwell = progress.pass_marks()
        if progress.is_finished:
            return (*blocks, Block((), dwell)) if dwell > 0.0 else tuple(blocks)
        previous = cell.task(blocks[-1].tasks[0]) if blocks else None
        tasks = _chosen(cell, progress.ready(), previous)
        if not tasks:
            raise progress.deadlock()
        progress.finish(tasks)
        blocks.append(Block(tuple(task.name for task in tasks), dwell))


def _chosen(cell: Cell, ready: Sequence[Task], previous: Task | None) -> list[Task]:
    """Those of the tasks that may begin which the mode lets begin together."""
    match cell.motion.mode:
        case Mode.PAIRWISE:
            return list(ready[:1])
        case Mode.SEMI_COORDINATED:
            groups = [
                [task for task in ready if _same_configuration(cell, task, other) and _move_alike(task, other)]
                for other in (previous, *ready)
                if other
            ]
            return next((group for group in groups if group), [])
        case Mode.SIMULTANEOUS:
            _require_one_configuration(cell, ready, "choose semi_coordinated, or let one come after the other")
        case Mode.PART_AT_REST:
            _require_one_configuration(cell, cell.tasks, "choose semi_coordinated")
    return list(ready)


def _require_one_configuration(cell: Cell, tasks: Sequence[Task], cure: str) -> None:
    """Refuse tasks that are worked on together at different configurations of the first holder.

    Where the holder has a task of its own, the others need not name the configuration in which that begins.
    """
    carrier_tasks = [task for task in tasks if task.robot in cell.positioners[:1]]
    first = next(iter(carrier_tasks or tasks), None)
    for task in tasks:
        if first and not (carrier_tasks and task.holder_posture is None) and not _same_configuration(cell, first, task):
            raise InputError(
                f"{task.where('holder_deg')}: expected the configuration of the holder for '{first.name}' in the mode "
                f"{cell.motion.mode}, got another: {cure}"
            )


def _same_configuration(cell: Cell, one: Task, other: Task) -> bool:
    """Whether two tasks begin at the same configuration of the first holder."""
    a, b = (_holder_configuration(cell, task) for task in (one, other))
    return bool(np.array_equal(a, b)) if a is not None and b is not None else a is b


def _move_alike(one: Task, other: Task) -> bool:
    """Whether the first holder moves during two tasks, or rests during both."""
    return one.holder_moves == other.holder_moves


def _holder_configuration(cell: Cell, task: Task) -> Array | None:
    """Configuration of the first holder at the start of a task; None for its start posture, when it is to be found."""
    if cell.carrier is None:
        return None
    start = task.start_posture if task.robot == cell.robots[cell.carrier].name else task.holder_posture
    return cell.robots[cell.carrier].start if start is None else start


def _require_names(cell: Cell) -> None:
    """Refuse orders and ``after`` with names that the cell does not have."""
    operators = {task.name: task.robot for task in cell.tasks}
    marks = [mark.name for mark in cell.program.all_marks]
    for robot in cell.robots:
        for index, text in order_faults(robot.name, robot.order, operators, marks) if robot.order else ():
            place = f"robots.{robot.name}.order" if index is None else f"robots.{robot.name}.order[{index}]"
            raise InputError(f"{cell.origin.at(place)}: {text}")
    for task in cell.tasks:
        for other in task.after:
            if other not in operators:
                raise InputError(f"{task.where('after')}: expected a task of this cell, got '{other}'")


class SequenceProgress:
    """How far each robot of a cell is in its sequence of tasks and marks."""

    def __init__(self, cell: Cell) -> None:
        """Begin before the first task and mark of every robot."""
        self.cell = cell
        self._sequences = {robot.name: sequence_of(cell, robot.name) for robot in cell.robots}
        self._places = dict.fromkeys(self._sequences, 0)
        self._dwells = {mark.name: mark.dwell_s for mark in cell.program.all_marks}
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


def with_only_task(cell: Cell, name: str) -> Cell:
    """The cell with one of its tasks only, in the order of its robot and after nothing else."""
    chosen = next((task for task in cell.tasks if task.name == name), None)
    if chosen is None:
        raise InputError(f"task: expected one of {', '.join(task.name for task in cell.tasks)}, got '{name}'")
    return with_tasks(cell, [name])


def with_tasks(cell: Cell, names: Collection[str]) -> Cell:
    """The cell with some of its tasks only, in the orders of its robots and after nothing else."""
    tasks = tuple(replace(task, after=()) for task in cell.tasks if task.name in names)
    left_out = {task.name for task in cell.tasks if task.name not in names}
    robots = (
        replace(robot, order=tuple(item for item in robot.order if item not in left_out)) for robot in cell.robots
    )
    return replace(cell, robots=tuple(robots), tasks=tasks)
