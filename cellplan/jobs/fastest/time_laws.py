"""The shortest cycle by the time laws of a cell, sought from both sides, and the feed that keeps it from any."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError, TooFewStepsError
from cellplan.jobs.fastest.timed_program import NEAR, Law, SolvedAt, TimedProgram, scaled_values
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import silent
from cellplan.model.units import MM
from cellplan.runs.greatest_feeds import OpenFeed, at_greatest_feeds
from cellplan.runs.solve import solve_motion

MOST_SLOWER: Final = 8  # programs tried until one keeps every limit
MOST_TRIALS: Final = 40  # programs tried in all: halving alone needs 21 among as many rows as a table may have
SLOWED: Final = 4.0  # [-] times as long: by then hardly anything but the feeds of processes loads the joints
FEED_TOL: Final = 1e-4  # [-] of a feed: what is less holds it


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
    values = scaled_values(base, SLOWED)
    opened = [
        OpenFeed(task=task, lowest=0.0, highest=task.feed)
        for task in base.tasks
        if task.process is not None and task.has_one_feed and task.feed is not None
    ]
    if opened:
        made = partial(solve_motion, task=None, progress=silent)
        _, slow = at_greatest_feeds(base.with_values(values), opened, made, is_leximin=True, progress=silent)
        answers = [answer for run in slow.runs for answer in run.report.greatest_feeds]
        stated = {feed.task.name: feed for feed in opened}
        reasons = [
            stated[it.task].refusal(stated[it.task].highest, it)
            for it in answers
            if it.feed < stated[it.task].highest * (1.0 - FEED_TOL)
        ]
        held = {feed.key: MM * answer.feed for feed in opened for answer in answers if answer.task == feed.task.name}
        if reasons and solved(Law.TIME_LAWS, values | held, "greatest feeds").load <= 1.0:
            return NoSolutionError("; ".join(reasons))
    return NoSolutionError(
        f"{base.origin.at('motion.time_law')}: expected time laws that keep all limits when slow enough, got "
        "speeds that jump; use the time law quintic, or write acceleration: unlimited"
    )
