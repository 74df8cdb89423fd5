"""What a cell demands of the rows of its program: its phases on the clock, and the scene of each of them.

Of a stored program only the number of rows of its transfer moves is used here: their duration is free, their limits,
ends and clearance are checked.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import listed
from cellplan.files.run.clock_table import ClockText
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.motion.motion import Schedule
from cellplan.model.motion.plan import Phase, Plan
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.planning.timing.schedule import TIME_DECIMALS, schedule_tasks
from cellplan.runs.plan.program import ProgramClock

if TYPE_CHECKING:
    from cellplan.scene.scene import Scene

RATE_TOL: Final = 1e-9  # [s] by which a step may fall short of the rest in it: nominal times have twelve decimals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DemandedProgram:
    """The program that a cell demands."""

    plan: Plan  # its phases, on no clock yet; those of all cycles
    cells: tuple[Cell, ...]  # the cell as it is in each phase of the first cycle
    stages: tuple[Stage, ...] = ()  # the stages of one cycle of a program from home to home; empty for any other

    @classmethod
    def of(cls, cell: Cell, *, only: str | None = None) -> "DemandedProgram":
        """The program of a solved cell.

        Args:
            cell: The cell, its starts and homes filled in.
            only: Name of the only task of a program that is not from home to home; None for all.
        """
        stages = program_stages(cell)
        if not stages:
            plan = plan_phases(cell, only=only)
            return cls(plan=plan, cells=(cell,) * len(plan.program))
        plan = Plan(phases=tuple(stage.phase for stage in stages) * cell.program.cycles)
        return cls(plan=plan, cells=tuple(stage.cell for stage in stages), stages=stages)

    @property
    def labels(self) -> list[str]:
        """Names of the phases of one cycle; empty for the only one of a program."""
        return [phase.label or "" for phase in self.plan.program[: len(self.cells)]]

    def clock(self, cell: Cell, written: ClockText, *, file: str) -> ProgramClock:
        """The program on its clock.

        Args:
            written: The clock of a run, for the number of rows of transfer moves, and the nominal times of a retimed
                program.

        Raises:
            InputError: With file and line, when it has other phases, or the nominal times do not rise through them.
        """
        if not self.stages:
            return with_nominal_times(ProgramClock.from_cell(cell, self.plan), written, cell, file=file)
        steps = self._steps(written, file)
        schedules = [self._schedule(place, steps[place]) for place in range(len(self.plan.phases))]
        return with_nominal_times(ProgramClock.of(cell, self.plan, schedules), written, cell, file=file)

    def scenes(self, cell: Cell) -> "list[Scene]":
        """The scene of each phase of the first cycle."""
        from cellplan.planning.sequence.scenes import StageScenes  # what is refused as read needs none
        from cellplan.scene.scene import Scene

        if not self.stages:
            return [Scene.from_cell(cell)] * len(self.cells)
        made = StageScenes.of(cell)
        return [made.of_stage(stage) for stage in self.stages]

    def _steps(self, written: ClockText, file: str) -> list[int]:
        """Steps of each phase as the clock of a run has them."""
        names, first = [], [0]
        for name, rows in groupby(written.table.phases):
            names.append(name)
            first.append(first[-1] + len(list(rows)))
        demanded = [phase.name for phase in self.plan.phases]
        for place, name in enumerate(demanded):
            if names[place : place + 1] != [name]:
                line = written.line(min(first[min(place, len(first) - 1)], len(written.table.times) - 1))
                got = listed(names[place : place + 1]) or "none"
                raise InputError(f"{file}:{line}: phase: expected '{name}' as in the plan of the cell, got {got}")
        if len(names) > len(demanded):
            line = written.line(first[len(demanded)])
            raise InputError(f"{file}:{line}: phase: expected the end after '{demanded[-1]}', got '{names[-1]}'")
        first[-1] -= 1  # every other phase ends in the first row of the next one
        return np.diff(first).tolist()

    def _schedule(self, place: int, steps: int) -> Schedule:
        """Desired tool poses of one phase as the time laws of its cell have them."""
        stage = self.stages[place % len(self.stages)]
        if stage.phase.tasks:
            return schedule_tasks(stage.cell, [build_toolpath(task, stage.cell.part) for task in stage.cell.tasks])
        if stage.dwell is not None:
            return Schedule(times=stage.dwell_times, tasks=())
        times = np.round(np.arange(max(1, steps) + 1) * stage.cell.motion.step, TIME_DECIMALS)
        return Schedule(times=times, tasks=())


def others_than_first_cycle(q: Sequence[np.ndarray]) -> tuple[int, int] | None:
    """The first cycle and row in which a phase has other rows than in the first cycle; None where all repeat it.

    Args:
        q: Rows of one phase in each cycle, shape (n, joints) each.
    """
    for cycle, rows in enumerate(q[1:], start=1):
        other = np.flatnonzero(np.any(rows != q[0], axis=1)) if rows.shape == q[0].shape else np.array([0])
        if len(other):
            return cycle, int(other[0])
    return None


def with_nominal_times(clock: ProgramClock, written: ClockText, cell: Cell, *, file: str) -> ProgramClock:
    """A program on the clock of a run; the desired poses at its nominal times still come from the cell.

    Args:
        clock: The program as the time laws of the cell have it; it stays where the cell demands it as written.

    Raises:
        InputError: With file and line, when the nominal times do not rise from the beginning of each phase to its end,
            a phase lasts for another time than the demanded one, or a delay or a dwell for less.
    """
    if cell.motion.timing is Timing.AS_WRITTEN:
        return clock
    _refuse_other(written, cell, clock.plan.program, file=file)
    _refuse_shorter_rests(written, clock.plan, file=file)
    return clock.retimed(written.table.sigma)


def _refuse_other(written: ClockText, cell: Cell, phases: Sequence[Phase], *, file: str) -> None:
    """Refuse nominal times of a retimed program that do not rise from the beginning of each phase to its end."""
    sigma, row, end = written.table.sigma, 0, -1.0
    for phase in phases:
        row -= phase.begin == end  # a phase begins in the last row of the one before it
        end = phase.end
        last = row + int(np.searchsorted(sigma[row:], phase.end, side="right")) - 1
        for place, demanded in ((min(row, len(sigma) - 1), phase.begin), (max(last, 0), phase.end)):
            if sigma[place] != demanded:
                raise InputError(
                    f"{file}:{written.line(place)}: sigma_s: expected {demanded!r}, at which the phase '{phase.name}' "
                    f"{'begins' if demanded == phase.begin else 'ends'}, got {float(sigma[place])!r}"
                )
        still = np.flatnonzero(np.diff(sigma[row : last + 1]) <= 0.0)
        if len(still):
            place = row + int(still[0]) + 1
            got = float(sigma[place])
            raise InputError(
                f"{file}:{written.line(place)}: sigma_s: expected more than in the row before, got {got!r}"
            )
        steps = None if cell.motion.cycle is None else round(cell.motion.cycle / cell.motion.step)
        if not cell.program.is_home_to_home and steps not in (None, last - row):
            raise InputError(
                f"{file}:{written.line(last)}: expected a phase of {cell.motion.cycle:g} s (motion.timing), got "
                f"{(last - row) * cell.motion.step:g} s"
            )
        row = last + 1
    whole = cell.program.cycles * (cell.motion.cycle or 0.0) if cell.program.is_home_to_home else 0.0
    if whole and round(whole / cell.motion.step) != len(sigma) - 1:
        raise InputError(
            f"{file}:{written.line(len(sigma) - 1)}: expected a program of {whole:g} s (motion.timing), got "
            f"{(len(sigma) - 1) * cell.motion.step:g} s"
        )
    if row < len(sigma):
        raise InputError(
            f"{file}:{written.line(row)}: expected no row after the end of the last phase, got another one"
        )


def _refuse_shorter_rests(written: ClockText, plan: Plan, *, file: str) -> None:
    """Refuse a step of the rows that takes less time than the part of a delay or a dwell in it."""
    sigma, step = written.table.sigma, np.diff(written.table.times)
    for begin, end in plan.dwells:
        within = np.minimum(sigma[1:], end) - np.maximum(sigma[:-1], begin)
        short = np.flatnonzero(within > step + RATE_TOL)
        if len(short):
            place = int(short[0])
            raise InputError(
                f"{file}:{written.line(place + 1)}: sigma_s: expected at most {float(step[place]):g} s more than in "
                f"the row before, as the delay or dwell from {begin:g} to {end:g} s of the nominal time keeps its "
                f"time, got {float(sigma[place + 1] - sigma[place]):g} s more"
            )
