"""The shortest cycle by the time laws of a cell, sought from both sides, and the feed that keeps it from any."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError, TooFewStepsError
from cellplan.jobs.fastest.timed_program import NEAR, Binding, Law, SolvedAt, TimedProgram, scaled_values
from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import ProgrammedPath, Task
from cellplan.model.units import MM

MOST_SLOWER: Final = 8  # programs tried until one keeps every limit
MOST_TRIALS: Final = 40  # programs tried in all: halving alone needs 21 among as many rows as a table may have
SLOWED: Final = 4.0  # [-] times as long: by then hardly anything but the feeds of processes loads the joints
DIGITS: Final = 4  # of the greatest feed that holds


@dataclass(slots=True)
class RootBracket:
    """Whole numbers from below and above, the largest that fails and the smallest that is known to hold."""

    fails: int = 0
    holds: int | None = None

    @property
    def is_closed(self) -> bool:
        """Whether no number is left between them."""
        return self.holds is not None and self.holds - self.fails <= 1

    def note(self, number: int, *, holds: bool) -> None:
        """What came of a number."""
        if holds:
            self.holds = number
        else:
            self.fails = number

    def following(self, guess: int, *, trial: int) -> int:
        """The number to try: a guess, and in every other trial between both sides the one in the middle."""
        if self.holds is None:
            return max(guess, self.fails + 1)
        if self.fails and trial % 2:
            return (self.fails + self.holds) // 2
        return min(max(guess, self.fails + 1), self.holds - 1)


def shortest_by_time_laws(base: Cell, written: TimedProgram, solved: SolvedAt) -> TimedProgram:
    """The program that keeps all limits while a step less would break one, or leave a task fewer steps than it needs.

    Limits are seen in the rows, so a load does not simply fall with the time: the cycle is sought from both sides.

    Raises:
        NoSolutionError: No program keeps them.
    """
    whole, step = base.motion.duration or written.cycle, base.motion.step
    number = max(1, round(whole / step))

    def at(steps: int) -> TimedProgram:
        return solved(Law.TIME_LAWS, scaled_values(base, steps * step / whole), "time laws")

    now = replace(written, law=Law.TIME_LAWS, values=scaled_values(base, number * step / whole))
    best = from_both_sides(number, now, at, lambda program: program.load)
    if best is None:
        raise _no_time_law(base, solved)
    return best


def from_both_sides(
    number: int, first: TimedProgram, at: Callable[[int], TimedProgram], demanded_share: Callable[[TimedProgram], float]
) -> TimedProgram | None:
    """The program that keeps all limits in so many steps while it would not in a step less; None where none does.

    Args:
        at: The program in a number of steps; a ``TooFewStepsError`` says that a task needs more of them.
        demanded_share: How many times as long a program must last, at most 1 where it keeps its limits.
    """
    best, now, bracket = None, first, RootBracket()
    share = demanded_share(first)
    for trial in range(MOST_TRIALS):
        bracket.note(number, holds=share <= 1.0)
        best = now if share <= 1.0 else best
        if bracket.is_closed or (best is None and trial >= MOST_SLOWER):
            break
        guess = number + 1 if np.isinf(share) else int(np.ceil(number * share * (1.0 - NEAR)))
        number = bracket.following(guess, trial=trial)
        try:
            now = at(number)
            share = demanded_share(now)
        except TooFewStepsError:
            share = np.inf
    return best


def _no_time_law(base: Cell, solved: SolvedAt) -> NoSolutionError:
    """Why no clock is slow enough: feeds of processes that joints cannot hold, else speeds that jump."""
    values, reasons = scaled_values(base, SLOWED), list[str]()
    slow = solved(Law.TIME_LAWS, values, "time laws")
    left = [task for task in base.tasks if task.process is not None and not isinstance(task.path, ProgrammedPath)]
    while slow.load > 1.0 and left:
        worst = max(slow.bindings, key=lambda binding: binding.time_share)
        left.sort(key=lambda task: task.robot != worst.robot)  # a positioner holds the feeds of all its operators
        task = left.pop(0)
        program = _at_greatest_feed(task, values, slow, worst.robot, solved)
        if program is not None:
            slow, values = program, dict(program.values)
            reasons.append(_held(task, worst, float(str(values[_key(task)]))))
    if reasons and slow.load <= 1.0:
        return NoSolutionError("; ".join(reasons))
    return NoSolutionError(
        f"{base.origin.at('motion.time_law')}: expected time laws that keep all limits when slow enough, got "
        "speeds that jump; use the time law quintic, or write acceleration: unlimited"
    )


def _key(task: Task) -> str:
    """Address of the feed of a process."""
    return f"tasks.{task.name}.process.feed_mm_s"


def _at_greatest_feed(
    task: Task, values: dict[str, object], program: TimedProgram, robot: str, solved: SolvedAt
) -> TimedProgram | None:
    """The program at the greatest feed of a task at which the joints of a robot keep their limits; None for none.

    Args:
        values: What else is set in the cell, by address.
        program: The program at the feed as it is written, at which they do not.
    """
    feed = MM * (task.feed or 0.0)
    unit = 10.0 ** (np.floor(np.log10(feed)) - DIGITS + 1)
    highest, less, bracket, best = int(np.floor(feed / unit + NEAR)), 0, RootBracket(), None
    for trial in range(MOST_TRIALS):
        load = program.load_of(robot)
        bracket.note(less, holds=load <= 1.0)
        best = program if load <= 1.0 else best
        less = bracket.following(highest - int((highest - less) / load), trial=trial)
        if bracket.is_closed or less >= highest:
            break
        slower = {_key(task): float(f"{(highest - less) * unit:.{DIGITS}g}")}
        program = solved(Law.TIME_LAWS, values | slower, "greatest feed")
    return best


def _held(task: Task, worst: Binding, greatest: float) -> str:
    """Which feed a joint cannot hold, and the greatest that it does."""
    return (
        f"{task.where('process.feed_mm_s')}: expected at most {greatest:g} mm/s, the greatest feed at which "
        f"{worst.robot} {worst.joint} keeps its {worst.kind} limit, got {MM * (task.feed or 0.0):g}, at which it is at "
        f"{100.0 * worst.share:.4g} % of it however slow all else is"
    )
