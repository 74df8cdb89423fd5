"""The greatest feeds of processes that leave theirs open: found before anything else of the program is judged.

Along one joint path everything scales with time, so the rows at any feed say what the greatest one is. Ramps of a given
time, rows, and methods that depend on the clock do not scale: the program is planned again at that feed, then between
one that holds and one that does not until they are near each other. The feeds that hold need not be an interval: what
is found holds, while a little more does not.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.progress import Progress
from cellplan.model.report.greatest_feed import GreatestFeed, cure_of
from cellplan.model.settings.entry import FASTEST_MM_S
from cellplan.model.task.task import Task
from cellplan.model.units import MM
from cellplan.planning.path.build import build_toolpath
from cellplan.runs.run_lengths import BORDER, OpenRun, on_run, open_runs
from cellplan.runs.solution import Solution
from cellplan.scene.scene import Scene

Feeds = Mapping[str, GreatestFeed]  # by task
Solved = Callable[[Cell], tuple[Scene, Solution]]
SECONDS: Final = 4.0  # [s] that the longest path takes at the first feeds
SLOWER: Final = 0.25  # [-] of the feeds before, where a path cannot be run along at these
MOST_SLOWER: Final = 6  # times that they are tried slower
MOST_RETIMED: Final = 9  # programs of other rows, where the cell is retimed: each slower by twice as much
MOST_TRIALS: Final = 60  # programs that are planned
NEAR: Final = 5e-4  # [-] between a feed that fails and one that holds
SHY: Final = 1e-4  # [-] by which a feed is less than rows at another one say: rounding of ramps to rows
YIELDING: Final = 0.98  # [-] of a feed that binds, to which it may fall while others rise
ROUNDING: Final = 1e-9  # [-] of a feed
IN_RAMPS: Final = 2.0  # [-] power of a rise: in a ramp of a given time accelerations grow with the speed
DIGITS: Final = 6  # of feeds, rounded down


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenFeed:
    """A feed that is sought."""

    task: Task
    lowest: float  # the least one in [m/s] that will do
    highest: float  # the greatest one in [m/s] that is sought
    ratio: float = 1.0  # to the feeds of the tasks that are done together with it

    @classmethod
    def of(cls, task: Task) -> "OpenFeed | None":
        """The open feed of a task; None where it has none."""
        process = task.process
        if process is None or not process.has_open_feed:
            return None
        lowest, highest = process.open_feeds
        return cls(task=task, lowest=lowest, highest=min(highest, FASTEST_MM_S / MM), ratio=process.feed_ratio)

    @property
    def key(self) -> str:
        """Address of the feed in the cell file."""
        return f"tasks.{self.task.name}.process.feed_mm_s"

    def refusal(self, feed: float, greatest: GreatestFeed | None) -> str:
        """Why a feed in [m/s] cannot be held, as one located line; ``greatest`` is None where none can."""
        text = f"{self.task.where(self.task.feed_key)}: feed {MM * feed:.4g} mm/s cannot be held"
        if greatest is None:
            return text
        return f"{text}: {greatest.text}; the greatest is {MM * greatest.feed:.4g} mm/s{cure_of(greatest.kind)}"


@dataclass(slots=True, kw_only=True)
class _Group:
    """Tasks that are done together: the feeds of those that still rise are their ratios times one level in [m/s]."""

    rising: list[OpenFeed]
    feeds: dict[str, float]  # feeds in [m/s] of those that do not rise any more, by task
    level: float
    is_leximin: bool  # whether others go on rising where one is bound
    least: dict[str, float] = field(default_factory=dict)  # to which these may fall
    holds: float = 0.0  # the greatest level that was found to hold
    fails: float = math.inf  # the least one above that was found not to
    failing: set[str] = field(default_factory=set)  # tasks whose feeds did not hold then
    is_halved: bool = False  # whether the level is the middle between these two: in every other trial that fails

    @property
    def highest(self) -> float:
        """The greatest level that the ranges allow."""
        return min(feed.highest / feed.ratio for feed in self.rising)

    @property
    def tried(self) -> dict[str, float]:
        """The feeds in [m/s] to try, by task."""
        return self.feeds | {feed.task.name: _rounded(self.level * feed.ratio) for feed in self.rising}

    def note(self, answers: Feeds) -> None:
        """Learn from the greatest feeds along the path at the level that was tried, and choose the next one."""
        factors = {name: answers[name].greatest / feed if name in answers else 0.5 for name, feed in self.tried.items()}
        if self._yields(factors):
            return
        least, rise = min(factors.values()), min(factors[feed.task.name] for feed in self.rising)
        if least < 1.0 - ROUNDING:
            self.fails, rise = self.level, least
            self.failing = {name for name, factor in factors.items() if factor < 1.0 - ROUNDING}
        else:
            self.holds = self.level
            if min(rise, self.fails / self.level, self.highest / self.level) <= 1.0 + NEAR:
                self._settle(factors)
                return
        in_ramp = [name for name, answer in answers.items() if answer.is_in_ramp and factors.get(name) == rise]
        growth = rise**IN_RAMPS if in_ramp and rise > 1.0 else rise
        guess, most = min(self.level * growth * (1.0 - SHY), self.highest), min(self.fails, self.highest)
        is_trusted = self.is_halved or self.holds == 0.0 or least >= 1.0 - ROUNDING
        self.is_halved = not (is_trusted and self.holds < guess < self.fails)
        self.level = 0.5 * (self.holds + most) if self.is_halved else guess

    def _yields(self, factors: Mapping[str, float]) -> bool:
        """Whether feeds that rise no more were lowered a little, to be tried again: rows change with others."""
        slower = {name: _rounded(feed * factors[name] * (1.0 - NEAR)) for name, feed in self.feeds.items()}
        slower = {name: feed for name, feed in slower.items() if self.least[name] <= feed and factors[name] < 1.0}
        self.feeds |= slower
        return bool(slower)

    def is_held(self, answers: Feeds) -> bool:
        """Whether all feeds to try hold."""
        tried = self.tried.items()
        return all(name in answers and answers[name].greatest >= feed * (1.0 - ROUNDING) for name, feed in tried)

    def _settle(self, factors: Mapping[str, float]) -> None:
        """Let the tasks rise no more that are bound, or all."""
        feeds = self.tried
        bound = [
            feed
            for feed in self.rising
            if factors[feed.task.name] <= 1.0 + 2.0 * NEAR
            or feeds[feed.task.name] >= (1.0 - NEAR) * feed.highest
            or feed.task.name in self.failing
        ]
        if not bound or not self.is_leximin:
            bound = self.rising
        self.feeds |= {feed.task.name: feeds[feed.task.name] for feed in bound}
        self.least |= {feed.task.name: YIELDING * feeds[feed.task.name] for feed in bound}
        self.rising = [feed for feed in self.rising if feed not in bound]
        self.fails, self.failing = math.inf, set()


def stated_values(opened: Sequence[OpenFeed], feeds: Mapping[str, float]) -> dict[str, object]:
    """Values of the cell file, by address, that state feeds in [m/s], by task, in place of open ones."""
    values: dict[str, object] = {feed.key: float(f"{MM * feeds[feed.task.name]:.{DIGITS}g}") for feed in opened}
    return values | {f"tasks.{feed.task.name}.process.feed_ratio": None for feed in opened if feed.ratio != 1.0}


def open_values(opened: Sequence[OpenFeed]) -> dict[str, object]:
    """Values of the cell file, by address, that open feeds again that were stated."""
    values: dict[str, object] = {}
    for feed in opened:
        low, high = MM * feed.lowest, MM * feed.highest
        values[feed.key] = [low, high] if low > 0.0 else "greatest"
        values |= {f"tasks.{feed.task.name}.process.feed_ratio": feed.ratio} if feed.ratio != 1.0 else {}
    return values


def open_feeds(cell: Cell, task: str | None = None) -> list[OpenFeed]:
    """The open feeds of a cell, or of one of its tasks."""
    feeds = [OpenFeed.of(it) for it in cell.tasks if task in (None, it.name)]
    return [feed for feed in feeds if feed is not None]


class _Trials:
    """Programs of a cell at feeds in [m/s] by task; the last one is remembered."""

    def __init__(self, cell: Cell, opened: Sequence[OpenFeed], solved: Solved) -> None:
        """Nothing was tried."""
        self._cell, self._opened, self._solved = cell, opened, solved
        self._last: tuple[dict[str, object], tuple[Scene, Solution]] | None = None

    def at(self, feeds: Mapping[str, float], *, timing: Timing | None) -> tuple[Scene, Solution]:
        """The program at some feeds, and with another timing than that of the cell unless it is None."""
        values = stated_values(self._opened, feeds)
        if timing not in (None, self._cell.motion.timing):
            values["motion.timing"] = str(timing)
        if self._last is None or self._last[0] != values:
            self._last = (values, self._solved(self._cell.with_values(values)))
        return self._last[1]


def at_greatest_feeds(
    cell: Cell, opened: Sequence[OpenFeed], solved: Solved, *, is_leximin: bool = False, progress: Progress
) -> tuple[Scene, Solution]:
    """The program at the greatest feeds.

    Args:
        cell: The cell, whose feeds to be sought have any values.
        opened: What is sought.
        solved: Plans a cell with stated feeds and verifies its motion.
        is_leximin: Whether each of the tasks that are done together rises as far as the others leave it.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: A path cannot be run along at any feed.
        NoSolutionError: No feed that will do holds.
    """
    trials, sought = _Trials(cell, opened, solved), open_runs(cell)
    groups = _groups(cell, opened, trials, is_leximin=is_leximin)
    for trial in range(MOST_TRIALS):
        rising = [group for group in groups if group.rising]
        if not rising:
            break
        progress("greatest feeds", trial / MOST_TRIALS)
        try:
            answers = _answers(trials.at(_feeds(groups), timing=Timing.AS_WRITTEN)[1], sought)
        except (InputError, NoSolutionError) as error:
            named = [group for group in rising if any(f"tasks.{name}." in str(error) for name in group.tried)]
            rising, answers = named or rising, {}
        for group in rising:
            group.note(answers)
    for trial in range(MOST_RETIMED):
        scene, solution = trials.at(_feeds(groups), timing=None)
        answers = _answers(solution, sought)
        failing = [group for group in groups if not group.is_held(answers)]
        if not failing:
            break
        for group in failing:
            group.feeds = {name: _rounded((1.0 - NEAR * 2.0**trial) * feed) for name, feed in group.tried.items()}
            group.rising = []
    _refuse_too_slow(opened, _feeds(groups), answers)
    return scene, solution


def _groups(cell: Cell, opened: Sequence[OpenFeed], trials: _Trials, *, is_leximin: bool) -> list[_Group]:
    """Tasks that are done together, from the first program that can be planned."""
    together = _first(cell, opened, is_leximin=is_leximin)
    refused: InputError | None = None
    for _ in range(MOST_SLOWER):
        try:
            solution = trials.at(together.tried, timing=Timing.AS_WRITTEN)[1]
            break
        except InputError as error:
            refused, together.level = refused or error, SLOWER * together.level
    else:
        raise refused or InputError("greatest feeds: no path can be run along")
    of_runs = [[feed for feed in opened if feed.task.name in run.phase.tasks] for run in solution.runs]
    groups = [replace(together, rising=rising, feeds={}) for rising in of_runs if rising]
    for group in groups:
        if not is_leximin:
            _refuse_apart(group)
    return groups


def _refuse_apart(group: _Group) -> None:
    """Refuse ranges that no one feed, in the ratios of the tasks, is in."""
    fast = max(group.rising, key=lambda feed: feed.lowest / feed.ratio)
    if fast.lowest / fast.ratio > group.highest * (1.0 + ROUNDING):
        slow = min(group.rising, key=lambda feed: feed.highest / feed.ratio)
        raise InputError(
            f"{fast.task.where(fast.task.feed_key)}: expected at most {MM * group.highest * fast.ratio:.4g} mm/s as "
            f"the least feed, as task '{slow.task.name}' has one feed with it in their ratios and at most "
            f"{MM * slow.highest:.4g} mm/s, got {MM * fast.lowest:.4g}; widen a range or state motion.greatest_feeds: "
            "leximin"
        )


def _first(cell: Cell, opened: Sequence[OpenFeed], *, is_leximin: bool = False) -> _Group:
    """Feeds at which the longest path takes some seconds, of all tasks together."""
    lengths = [feed.task.repeat * build_toolpath(feed.task, cell.part).length for feed in opened]
    level = max(length / feed.ratio for length, feed in zip(lengths, opened, strict=True)) / SECONDS
    together = _Group(rising=list(opened), feeds={}, level=level, is_leximin=is_leximin)
    together.level = min(level, together.highest)
    return together


def with_first_feeds(cell: Cell) -> Cell:
    """The cell with feeds in place of open ones at which the longest path takes some seconds."""
    opened = open_feeds(cell)
    return cell.with_values(stated_values(opened, _first(cell, opened).tried)) if opened else cell


def _feeds(groups: Sequence[_Group]) -> dict[str, float]:
    """Feeds in [m/s] to try, by task."""
    return {name: feed for group in groups for name, feed in group.tried.items()}


def _answers(solution: Solution, sought: Sequence[OpenRun]) -> Feeds:
    """Greatest feeds along the paths of a program, by task; runs that are as long as limits need do not bind them."""
    answers = {feed.task: feed for run in solution.runs for feed in run.report.greatest_feeds}
    scheduled = {it.task.name: it for run in solution.runs for it in run.schedule.tasks}
    for run in sought:
        if (answer := answers.get(run.task.name)) is not None:
            inside = on_run(scheduled[run.task.name], answer, run.is_first, border=-BORDER)
            feeds = answer.feeds.copy()
            feeds[inside] = np.where(feeds[inside] >= answer.feed, np.inf, feeds[inside])
            is_in_ramp = answer.is_in_ramp and float(feeds.min()) == answer.greatest
            answers[run.task.name] = replace(answer, feeds=feeds, is_in_ramp=is_in_ramp)
    return answers


def _refuse_too_slow(opened: Sequence[OpenFeed], feeds: Mapping[str, float], answers: Feeds) -> None:
    """Refuse feeds below the least one that will do."""
    for feed in opened:
        name = feed.task.name
        if name not in answers or feeds[name] < feed.lowest * (1.0 - ROUNDING):
            raise NoSolutionError(feed.refusal(feed.lowest or feeds[name], answers.get(name)))


def _rounded(feed: float) -> float:
    """A feed in [m/s] rounded down to a few digits."""
    decimals = DIGITS - 1 - math.floor(math.log10(MM * feed))
    return math.floor(MM * feed * 10.0**decimals * (1.0 + ROUNDING)) / 10.0**decimals / MM
