"""Runs as long as the limits need: their lengths are found before anything else of the program is judged.

On a run of length L the tool speeds up to the feed v with an acceleration of at most 3 v^2 / 4 L. So a share of a limit
in a ramp says what the length is multiplied by, as the square of the share of the time; what of the joints' motion does
not fall with the length is met by trying again, between a length that holds and one that does not.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Indices
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.progress import Progress
from cellplan.model.report.greatest_feed import GreatestFeed
from cellplan.model.settings.runs import AUTO, LONGEST_RUN_MM
from cellplan.model.task.task import Task
from cellplan.model.units import MM
from cellplan.runs.solution import Solution
from cellplan.scene.scene import Scene

Solved = Callable[[Cell], tuple[Scene, Solution]]
FIRST: Final = 2.0  # [m/s2] of a tool on the runs that are tried first
SHORTER: Final = 0.25  # [-] of runs that are tried where the first ones leave the reach
MOST_SHORTER: Final = 3
MOST_TRIALS: Final = 12
NEAR: Final = 0.05  # [-] of the share of a limit, and of a length that holds: runs need not be shorter
SHY: Final = 1.01  # [-] by which a run is longer than shares say: differences over rows
HELPS: Final = 0.02  # [-] of a share that a longer run must lower, or none helps
BORDER: Final = 3  # rows on the work that see a run in their differences, and likewise
FEWEST_ROWS: Final = 10  # in a ramp: fewer say nothing about it
STEP_MM: Final = 0.1  # [mm] to which lengths are rounded up


@dataclass(slots=True, kw_only=True)
class OpenRun:
    """A run whose length is sought."""

    task: Task
    is_first: bool  # whether it is the run-in
    shortest: float  # the least length in [m] that is tried
    length: float  # in [m], to be tried
    fails: float = 0.0  # the greatest length in [m] that was found too short
    holds: float = np.inf  # the least one that was found long enough
    share: float = np.inf  # of the time, that limits asked for at the length that was too short
    held: float = 0.0  # likewise at the one that was long enough
    is_settled: bool = False

    @property
    def key(self) -> str:
        """Key of its length below the task."""
        return f"process.{'run_in_mm' if self.is_first else 'run_out_mm'}"

    @property
    def value(self) -> float:
        """Its length in [mm], as a cell file has it."""
        return float(f"{MM * self.length:.6g}")

    def note(self, share: float) -> None:
        """Learn from the share of the time that limits ask for at its length, and choose the next one."""
        if share <= 1.0:
            self.is_settled = share >= 1.0 - NEAR or self.length <= max(self.shortest, self.fails / (1.0 - NEAR))
            guess = SHY * share**2 * self.length if share > (1.0 + HELPS) * self.held else self.shortest
            self.holds, self.held = self.length, share
        else:
            self.is_settled = share > (1.0 - HELPS) * self.share or 2.0 * self.length > LONGEST_RUN_MM / MM
            guess = SHY * share**2 * self.length
            self.fails, self.share = self.length, share
        if not self.is_settled:
            is_inside = self.fails < guess < self.holds
            middle = np.sqrt(self.fails * min(self.holds, 4.0 * self.fails))
            self.length = _rounded(max(guess if is_inside else middle, self.shortest))


def open_runs(cell: Cell, task: str | None = None) -> list[OpenRun]:
    """The runs of a cell, or of one of its tasks, that are to be as long as the limits need."""
    runs = []
    for it in cell.tasks if task is None else [cell.task(task)]:
        process = it.process
        for is_first in (True, False):
            if process is not None and (process.run_in_mm if is_first else process.run_out_mm) == AUTO:
                least = 0.5 * FEWEST_ROWS * cell.motion.step * process.feed - 0.5 * np.pi * abs(process.arc)
                least = _rounded(max(least, STEP_MM / MM))
                first = _rounded(max(process.feed**2 / (2.0 * FIRST), least))
                runs.append(OpenRun(task=it, is_first=is_first, shortest=least, length=first))
    return runs


def _rounded(length: float) -> float:
    """A length in [m] rounded up to tenths of a millimetre."""
    return float(np.ceil(MM * length / STEP_MM - 1e-6) * STEP_MM / MM)


def stated_lengths(runs: Sequence[OpenRun]) -> dict[str, object]:
    """Values of the cell file, by address, that state the lengths of runs in place of auto."""
    return {f"tasks.{run.task.name}.{run.key}": run.value for run in runs}


def lengths_in(cell: Cell, runs: Sequence[OpenRun]) -> dict[str, object]:
    """Likewise with the lengths of a solved cell."""
    entries = [(run, getattr(cell.task(run.task.name).process, run.key.removeprefix("process."))) for run in runs]
    return {f"tasks.{run.task.name}.{run.key}": float(length) for run, length in entries}


def refuse_open_runs(cell: Cell, purpose: str) -> None:
    """Refuse runs whose length follows from a motion where the motion is what is sought."""
    for run in open_runs(cell):
        raise InputError(
            f"{run.task.where(run.key)}: expected a length in mm for {purpose}, got auto; `cellplan solve` states one "
            "that the limits need"
        )


def with_run_lengths(
    cell: Cell, runs: Sequence[OpenRun], solved: Solved, *, progress: Progress
) -> tuple[Scene, Solution]:
    """The program whose runs are as long as the limits of the joints need, to a twentieth.

    Where no length helps, the check of the limit fails in the program with the last one.

    Args:
        runs: The runs that are sought.
        solved: Plans a cell with stated lengths and verifies its motion.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: A run of a length that the limits need leaves the reach.
        NoSolutionError: Likewise.
    """
    written: dict[str, object] = {"motion.timing": str(Timing.AS_WRITTEN)}
    is_written = cell.motion.timing is Timing.AS_WRITTEN
    result, lengths = None, dict[str, object]()
    for trial in range(MOST_TRIALS):
        progress("lengths of runs", trial / MOST_TRIALS)
        lengths = stated_lengths(runs)
        try:
            result = solved(cell.with_values(lengths if is_written else lengths | written))
        except (InputError, NoSolutionError) as error:
            if trial >= MOST_SHORTER or any(run.fails for run in runs):
                raise _out_of_reach(runs, error) from error
            for run in runs:
                run.length = _rounded(max(SHORTER * run.length, run.shortest))
            continue
        shares = _shares(result[1])
        for run in runs:
            if not run.is_settled:
                run.note(shares.get((run.task.name, run.is_first), 1.0))
        if all(run.is_settled for run in runs) and stated_lengths(runs) == lengths:
            break
    for run in runs:
        run.length = min(run.length, run.holds)
    is_last = is_written and result is not None and stated_lengths(runs) == lengths
    return result if is_last and result is not None else solved(cell.with_values(stated_lengths(runs)))


def _out_of_reach(runs: Sequence[OpenRun], error: InputError | NoSolutionError) -> InputError | NoSolutionError:
    """What to say where runs of the lengths that the limits need cannot be planned."""
    names = [run for run in runs if f"'{run.task.name}'" in str(error) or f"tasks.{run.task.name}." in str(error)]
    run = next(iter(names or runs))
    feed = 0.0 if run.task.process is None else run.task.process.feed
    return type(error)(
        f"{run.task.where(run.key)}: auto tried {run.value:g} mm at the feed of {MM * feed:g} mm/s: {error}"
    )


def _shares(solution: Solution) -> Mapping[tuple[str, bool], float]:
    """Share of the time that limits ask for in the ramp of each run, by its task and whether it is the run-in."""
    shares = {}
    for run in solution.runs:
        answers = {feed.task: feed for feed in run.report.greatest_feeds}
        for scheduled in run.schedule.tasks:
            if (answer := answers.get(scheduled.task.name)) is not None:
                for is_first in (True, False):
                    near = on_run(scheduled, answer, is_first, border=BORDER)
                    least = float(answer.feeds[near].min(initial=np.inf))
                    shares[scheduled.task.name, is_first] = answer.feed / least
    return shares


def on_run(scheduled: TaskSchedule, answer: GreatestFeed, is_first: bool, *, border: int) -> Indices:
    """Numbers of the places of a curve of greatest feeds on the run-in or the run-out, and of some on the work."""
    places, end = answer.travelled, scheduled.length - sum(scheduled.runs)
    if is_first:
        return np.arange(max(0, int(np.searchsorted(places, 0.0)) + border))
    return np.arange(min(len(places), int(np.searchsorted(places, end, side="right")) - border), len(places))
