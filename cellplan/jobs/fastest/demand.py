"""Demand: parts per hour, and the calmest program that makes them."""

import re
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final, Self

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.input.findings import shown
from cellplan.jobs.fastest.timed_program import Law, SolvedAt, TimedProgram, scaled_values, steps_within
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress

HOUR: Final = 3600.0  # [s]
PER_HOUR: Final = {"h": 1.0, "min": 60.0}  # [1/h] of one in each unit
WRITTEN: Final = re.compile(r"(\d{1,9}(?:\.\d{1,9})?)\s*/\s*(h|min)")
SLOWEST: Final = 10.0  # [-] of the shortest cycle, unless the written one is longer: then the robots wait instead
MOST_TRIALS: Final = 8  # factors tried until all phases fit the cycle
NEAR: Final = 1e-9  # [s] of a cycle: rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MetDemand:
    """The calmest program that meets a demand."""

    per_hour: float
    allowed: float  # longest cycle in whole steps that makes them, in [s]
    program: TimedProgram

    def certified(self, progress: Progress) -> Self:
        """The same with the clearance of the program checked."""
        return replace(self, program=self.program.certified(progress))


def read_demand(text: str) -> float:
    """Parts per hour of a demand such as ``900/h`` or ``15/min``; any other form is refused."""
    match = WRITTEN.fullmatch(text.strip())
    per_hour = float(match[1]) * PER_HOUR[match[2]] if match else 0.0
    if not per_hour > 0.0:
        raise InputError(f"--demand: expected parts in a time, N/h or N/min with N above 0, got {shown(text)}")
    return per_hour


def refuse_unless_possible(per_hour: float, shortest: TimedProgram, step: float) -> None:
    """Refuse a demand for which no cycle is short enough, with the shortest one and what binds it; the step in [s]."""
    allowed = steps_within(HOUR / per_hour, step) * step
    if shortest.cycle <= allowed + NEAR:
        return
    binding = max(shortest.bindings, key=lambda binding: binding.time_share)
    raise NoSolutionError(
        f"--demand: expected at most {_floored(HOUR / shortest.cycle)}/h, one part in {shortest.cycle:.6g} s, where "
        f"{binding.text}; got {per_hour:g}/h, one part in {HOUR / per_hour:.6g} s"
    )


def calmest(
    base: Cell, per_hour: float, *, written: TimedProgram, laws: TimedProgram, common: TimedProgram, solved: SolvedAt
) -> MetDemand:
    """The program that makes ``per_hour`` parts at the smallest load, by the time laws or by the common speed."""
    step = base.motion.step
    allowed = steps_within(HOUR / per_hour, step) * step
    cycle = min(allowed, max(steps_within(SLOWEST * common.cycle, step) * step, written.cycle))
    fitting = [program for program in (common, laws) if program.cycle <= cycle + NEAR]
    if laws.cycle < cycle:
        with suppress(InputError, NoSolutionError):
            fitting += _by_time_laws(base, cycle, written, solved)
    between = common.cycle - sum(common.phases)
    duration = steps_within((cycle - between) / len(common.phases), step) * step
    if common.cycle < cycle and duration >= max(common.phases) - NEAR:
        with suppress(InputError, NoSolutionError):  # demanded feeds may leave no choice of the cycle
            fitting.append(solved(Law.COMMON_SPEED, {"motion.timing": {"cycle_s": round(duration, 9)}}, "demand"))
    fitting = [program for program in fitting if program.cycle <= cycle + NEAR]
    return MetDemand(per_hour=per_hour, allowed=allowed, program=min(fitting, key=lambda program: program.load))


def _by_time_laws(base: Cell, cycle: float, written: TimedProgram, solved: SolvedAt) -> list[TimedProgram]:
    """The program by the time laws that takes a cycle, or a few steps less; none where it does not fit."""
    duration, step = base.motion.duration, base.motion.step
    factor = cycle / written.cycle
    for _ in range(MOST_TRIALS):
        if duration is not None:
            factor = steps_within(factor * duration, step) * step / duration
        program = solved(Law.TIME_LAWS, scaled_values(base, factor), "demand")
        if program.cycle <= cycle + NEAR:
            return [program]
        factor *= (cycle - 0.5 * step) / program.cycle
    return []


def _floored(value: float) -> str:
    """A rate with one decimal, rounded down."""
    return f"{int(10.0 * value) / 10.0:g}"
