"""Nominal times of a retimed program: all that is taken from a run beside its times and joint positions."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.io.run.clock_table import ClockText
from cellplan.model.cell import Cell, Timing
from cellplan.model.phase import Phase
from cellplan.model.plan import Plan
from cellplan.pipeline.plan.program import ProgramClock

RATE_TOL: Final = 1e-9  # [s] by which a step may fall short of the rest in it: nominal times have twelve decimals


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
        if cell.program is None and steps not in (None, last - row):
            raise InputError(
                f"{file}:{written.line(last)}: expected a phase of {cell.motion.cycle:g} s (motion.timing), got "
                f"{(last - row) * cell.motion.step:g} s"
            )
        row = last + 1
    whole = 0 if cell.program is None or cell.motion.cycle is None else cell.program.cycles * cell.motion.cycle
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
