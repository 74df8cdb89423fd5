"""Stages of a program from home to home: each of its phases, with the cell as it is meanwhile.

The stages follow from the cell alone; verification makes them again from the cell of a run.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Mode, Robot
from cellplan.model.motion.plan import Hold, Phase, Role, Transfer
from cellplan.model.settings.program import PartPlaceEntry, ProgramEntry
from cellplan.model.task.task import Task
from cellplan.planning.modes import plan_phases
from cellplan.planning.sequence.arrangement import Block, arrange
from cellplan.planning.sequence.part_moves import PartMove, part_lying, with_move
from cellplan.planning.timing.schedule import TIME_DECIMALS

HOME: Final = "home"
WHOLE_STEPS: Final = 1e-9  # [-] share of a step by which a dwell may outlast whole ones: rounding of a quotient
LEADING: Final = 1e3  # times as much the weights of operators count where the holder moves: it does what it can
AT_REST: Final = frozenset({Mode.PART_AT_REST, Mode.SEMI_COORDINATED})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """One phase of a program and the cell meanwhile."""

    phase: Phase  # the phase, not yet on a clock
    cell: Cell  # the cell with the tasks of the phase only, the starts of their robots, and the part where it is
    place: PartPlaceEntry | None = None  # where the part lies; None while it is held, or fixed anyway
    move: PartMove | None = None  # the straight move that grips or puts down the part; None in all other stages
    dwell: float | None = None  # time in [s] for which all robots stand; None for a motion

    @property
    def dwell_times(self) -> Array:
        """Times of the rows of a dwell in [s], rounded up to whole steps, shape (N,)."""
        step = self.cell.motion.step
        count = max(1, int(np.ceil((self.dwell or 0.0) / step - WHOLE_STEPS)))
        return np.round(np.arange(count + 1) * step, TIME_DECIMALS)


def program_stages(cell: Cell) -> tuple[Stage, ...]:
    """The stages of one cycle from home to home, none of other programs; starts and homes may be None in them too."""
    if not cell.program.is_home_to_home:
        return ()
    between = [*_picked_up(cell, cell.program), *_worked_on(cell), *_put_down(cell, cell.program)]
    return tuple(_with_transfers(cell, cell.program, between))


def first_blocks(cell: Cell) -> dict[str, str]:
    """Name of the first task of each operator in the order of the program, by robot."""
    first: dict[str, str] = {}
    for block in arrange(cell):
        for name in block.tasks:
            first.setdefault(cell.task(name).robot, name)
    return first


def _worked_on(cell: Cell) -> Iterator[Stage]:
    """A stage for each block of tasks, after one in which all robots stand where a mark asks for it."""
    first = first_blocks(cell)
    for number, block in enumerate(arrange(cell), start=1):
        if not block.tasks:
            yield Stage(phase=_at_home(cell, f"dwell-{number}"), cell=_without_tasks(cell), dwell=block.dwell)
            continue
        block_cell = _cell_of_block(cell, block, first)
        work = _phase(block_cell, f"work-{number}")
        if block.dwell > 0.0:
            standing = {robot: Hold(at_home=robot in work.idle) for robot in work.roles}
            dwell = Phase(name=f"dwell-{number}", roles=standing)
            yield Stage(phase=dwell, cell=_without_tasks(block_cell), dwell=block.dwell)
        yield Stage(phase=work, cell=block_cell)


def _at_home(cell: Cell, name: str) -> Phase:
    """A phase in which all operators stand at their homes and the holders stand still."""
    return Phase(
        name=name, roles={robot.name: Hold(at_home=robot.name not in cell.positioners) for robot in cell.robots}
    )


def _without_tasks(cell: Cell) -> Cell:
    """The cell while no task is worked on: no cycle is closed meanwhile."""
    return replace(cell, tasks=(), motion=replace(cell.motion, cyclic=False))


def _picked_up(cell: Cell, program: ProgramEntry) -> Iterator[Stage]:
    if program.attach is not None:
        yield _straight(cell, PartMove.GRIP, program.attach)
        yield _straight(cell, PartMove.LIFT, program.attach)


def _put_down(cell: Cell, program: ProgramEntry) -> Iterator[Stage]:
    if program.detach is not None:
        yield _straight(cell, PartMove.LOWER, program.detach)
        yield _straight(cell, PartMove.RELEASE, program.detach)


def _straight(cell: Cell, move: PartMove, place: PartPlaceEntry) -> Stage:
    """A straight move of the holder; all others stand at their homes."""
    robots = tuple(replace(robot, start=robot.home if robot.home is not None else robot.start) for robot in cell.robots)
    holder = cell.positioners[0]
    move_cell = with_move(replace(cell, robots=robots), move, place, holder)
    motion = replace(move_cell.motion, mode=Mode.SIMULTANEOUS, duration=None, cyclic=False)
    robots = tuple(replace(robot, start=None) if robot.name == holder else robot for robot in move_cell.robots)
    move_cell = replace(move_cell, robots=robots, motion=motion)
    is_lying = move in (PartMove.GRIP, PartMove.RELEASE)
    return Stage(phase=_phase(move_cell, move.value), cell=move_cell, move=move, place=place if is_lying else None)


def _phase(cell: Cell, name: str) -> Phase:
    """The only phase of a cell whose tasks are all worked on together."""
    return replace(plan_phases(cell).program[0], name=name)


def _cell_of_block(cell: Cell, block: Block, first: dict[str, str]) -> Cell:
    """The cell while a block is worked on; robots without a task in it are at their homes."""
    tasks = tuple(task for task in cell.tasks if task.name in block.tasks)
    by_robot = {task.robot: task for task in tasks}
    held_at = next((task.holder_posture for task in tasks if task.holder_posture is not None), None)
    is_moving = any(task.holder_moves for task in tasks)
    robots = []
    for robot in cell.robots:
        start = robot.start if robot.home is None or robot.name in cell.positioners else robot.home
        if robot.name in by_robot:
            start = task_start(robot, by_robot[robot.name], first)
        elif robot.name in cell.positioners[:1] and held_at is not None:
            start = held_at
        is_led = is_moving and robot.name not in cell.positioners
        robots.append(replace(robot, start=start, weights=robot.weights * (LEADING if is_led else 1.0)))
    mode = Mode.PART_AT_REST if cell.motion.mode in AT_REST and not is_moving else Mode.SIMULTANEOUS
    return replace(cell, robots=tuple(robots), tasks=tasks, motion=replace(cell.motion, mode=mode))


def task_start(robot: Robot, task: Task, first: dict[str, str]) -> Array | None:
    """Configuration in [rad] or [m] in which a robot begins a task, shape (n,); None when it is to be found."""
    if task.start_posture is not None:
        return task.start_posture
    return robot.start if first[robot.name] == task.name else None


def _with_transfers(cell: Cell, program: ProgramEntry, between: Sequence[Stage]) -> Iterator[Stage]:
    """The stages with transfer moves from home to the first, from each to the next and from the last to home."""
    yield _transfer(cell, None, between[0], name="transfer-1", place=program.attach)
    number = 1
    for before, after in zip(between, [*between[1:], None], strict=True):
        yield before
        if before.dwell is not None or PartMove.GRIP is before.move or PartMove.LOWER is before.move:
            continue
        number += 1
        place = program.detach if after is None else None
        yield _transfer(cell, before, after, name=f"transfer-{number}", place=place)


def _transfer(
    cell: Cell, before: Stage | None, after: Stage | None, *, name: str, place: PartPlaceEntry | None
) -> Stage:
    """Transfer moves between two stages, of all robots that are at work in one of them; the others are at home."""
    at_work = {robot for stage in (before, after) if stage is not None for robot in _at_work(stage)}
    to = HOME if after is None else after.phase.name
    held_by = cell.positioners
    roles: dict[str, Role] = {}
    for robot in cell.robots:
        is_moving = len(held_by) == 1 if robot.name in held_by else robot.name in at_work
        roles[robot.name] = Transfer(to) if is_moving else Hold(at_home=robot.name not in held_by)
    idle_cell = _without_tasks(cell if place is None else part_lying(cell, place))
    return Stage(phase=Phase(name=name, roles=roles), cell=idle_cell, place=place)


def _at_work(stage: Stage) -> set[str]:
    """Robots that are not at their homes in a stage."""
    return {name for name, role in stage.phase.roles.items() if role != Hold(at_home=True)}
