"""Programs of a run: each with its phases, where tools are in process, and where holders move."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.plan import Phase
from cellplan.model.report.verified_run import AnyRun, UnsolvedRun
from cellplan.model.task.clocked_path import are_within
from cellplan.model.task.task import Frame
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.programs.elements.joints import unit_of
from cellplan.runs.plan.demanded import DemandedProgram
from cellplan.runs.plan.program import STILL_TOL


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPhase:
    """A phase of a program."""

    name: str
    place: int  # number of the motion of the run that it repeats
    first: int  # its first row in the program
    last: int  # its last row, which the next phase may share


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunProgram:
    """A program of all robots of a cell."""

    name: str | None  # name of the program; None for the only one
    times: Array  # times of its rows in [s], from 0, shape (N,)
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    phases: tuple[RunPhase, ...]  # its phases in their order
    process: dict[str, Flags]  # whether the tool of a task is in process, both ends included, shape (N,), by task

    def phase_at(self, row: int) -> RunPhase:
        """The phase of a row; the earlier one of two that share it."""
        return next((phase for phase in self.phases if phase.first <= row <= phase.last), self.phases[-1])

    def busy(self) -> Flags:
        """Whether some tool stays in process from the row before to the row after, shape (N,)."""
        is_busy = np.zeros(len(self.times), dtype=bool)
        for inside in self.process.values():
            is_busy[1:-1] |= inside[:-2] & inside[1:-1] & inside[2:]
        return is_busy


def run_programs(run: AnyRun) -> tuple[RunProgram, ...]:
    """The programs of a run: one from home to home, or one for each of its phases; none yet of a cell."""
    if isinstance(run, UnsolvedRun):
        return ()
    motion = run.motion
    process = {task: are_within(motion.sigma, stretches) for task, stretches in motion.plan.process.items()}
    return tuple(
        RunProgram(
            name=piece.name,
            times=np.round(motion.times[piece.rows] - motion.times[piece.rows.start], TIME_DECIMALS),
            q=motion.q[piece.rows],
            phases=tuple(
                RunPhase(name=phase.name, place=place % len(run.motions), first=rows.start, last=rows.stop - 1)
                for place, phase, rows in piece.phases
            ),
            process={task: process[task][piece.rows] for _, phase, _ in piece.phases for task in phase.tasks},
        )
        for piece in motion.pieces
    )


def program_names(run: AnyRun) -> tuple[str | None, ...]:
    """Names of the programs of a run, or of those that a cell demands, in their order; None for the only one."""
    if not isinstance(run, UnsolvedRun):
        return tuple(program.name for program in run_programs(run))
    phases = DemandedProgram.of(run.cell).plan.phases
    pieces = [[*piece] for in_program, piece in groupby(phases, key=lambda phase: phase.in_program) if in_program]
    return tuple(piece[0].label if len(piece) == 1 else None for piece in pieces)


def spoilt_by_another_order(cell: Cell, program: RunProgram) -> Iterator[str]:
    """What another order of the robots spoils, one reason each: the first times at which it would.

    While a tool is in process on the part, every holder must stand still that does not move in step with it: otherwise
    the path of the tool on the part depends on both clocks. Two holders of one part must not move at all.
    """
    holders = cell.positioners
    moves = _moves(cell, program.q, holders)
    if len(holders) > 1 and moves.any():
        yield f"{_where(program, moves)}: the holders {' and '.join(holders)} move the part: another order strains it"
    for task, inside in program.process.items():
        work = next((other for other in cell.tasks if other.name == task), None)
        if work is None or work.relative_to is Frame.WORLD or set(holders) <= set(unit_of(cell, work.robot)):
            continue
        spoilt = moves & inside[:-1] & inside[1:]
        if spoilt.any():
            yield (
                f"{_where(program, spoilt)}: the part moves while the tool of '{work.robot}' is in process ('{task}'): "
                f"another order spoils the tool path"
            )


def holders_rest(cell: Cell, phases: Iterable[Phase]) -> bool:
    """Whether no order of the robots spoils anything in any motion of some phases: see ``spoilt_by_another_order``."""
    tasks = [(phase, task) for phase in phases for task in cell.tasks if task.name in phase.tasks]
    return len(cell.positioners) < 2 and all(
        task.relative_to is Frame.WORLD or not ({*cell.positioners} - {*unit_of(cell, task.robot)}) & {*phase.moving}
        for phase, task in tasks
    )


def moving_robots(cell: Cell, program: RunProgram) -> tuple[str, ...]:
    """Names of the robots that move in a program."""
    return tuple(robot.name for robot in cell.robots if _moves(cell, program.q, (robot.name,)).any())


def _moves(cell: Cell, q: Array, robots: tuple[str, ...]) -> Flags:
    """Whether one of some robots moves in each step, shape (N - 1,)."""
    moves = np.zeros(len(q) - 1, dtype=bool)
    for name in robots:
        moves |= np.any(np.abs(np.diff(q[:, cell.columns(name)], axis=0)) > STILL_TOL, axis=1)
    return moves


def _where(program: RunProgram, steps: Flags) -> str:
    """Phase and instant of the first of some steps."""
    step = int(np.flatnonzero(steps)[0])
    name = "" if program.name is None or program.name == program.phase_at(step + 1).name else f"{program.name}, "
    return f"{name}phase '{program.phase_at(step + 1).name}', {program.times[step]:g} s"
