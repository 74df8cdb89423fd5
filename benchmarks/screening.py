"""Many layouts of one cell, screened: ``python benchmarks/screening.py``.

The reference cell is the job; in the candidates every operator stands somewhere near its place and its start posture is
brought to its path. They are resolved in batches, by one process and by one for each core, and a few of them one by
one.
"""

import json
import os
import statistics
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from multiprocessing import get_context
from typing import Final

import numpy as np
from options import benchmark_options
from reference_job import CELL
from sections import Goal, Section, digits, table

from cellplan import Cell, load_cell
from cellplan.geometry.transforms import rotation_about
from cellplan.model.motion.motion import Schedule
from cellplan.planning.layout_screening import AT_ONCE, Candidates, Screening, screen_layouts
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks

COUNT: Final = 256  # [-] candidates
ALONE: Final = 8  # [-] of them that are screened one by one as well
PROCESSES: Final = min(2, os.cpu_count() or 1)
PLACE, TURN = 0.05, np.radians(5.0)  # [m], [rad] standard deviations of a base
LEAST_PER_S: Final = 150.0  # [1/s] goal: candidates on two cores


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What screening takes.

    Attributes:
        followed: How many candidates can do the whole job.
        batch_s: Processor time per candidate in batches in [s].
        alone_s: The same one by one.
        per_s: Candidates per second when each process has a core for itself, from their processor time while all are at
            work.
        waiting_per_s: Candidates per second of waiting, whatever else the machine had to do.
    """

    followed: int
    batch_s: float
    alone_s: float
    per_s: float
    waiting_per_s: float


def measure(rounds: int) -> Figures:
    """Screen all candidates over and over; medians."""
    candidates = candidates_near(job()[0], COUNT)
    batches = [part(candidates, slice(first, first + AT_ONCE)) for first in range(0, COUNT, AT_ONCE)]
    singles = [part(candidates, slice(number, number + 1)) for number in range(ALONE)]
    batch_s, alone_s, pool_s, waiting_s = [], [], [], []
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as pool:
        for number in range(rounds + 1):
            print(f"screening: {f'round {number} of {rounds}' if number else 'warming up'}", file=sys.stderr)
            result, seconds = screened(batches)
            batch_s.append(seconds / COUNT)
            alone_s.append(screened(singles)[1] / ALONE)
            begin = time.perf_counter()
            pool_s.append(sum(pool.map(processor_time, batches)))
            waiting_s.append(time.perf_counter() - begin)
    return Figures(
        followed=sum(int(screening.is_followed.sum()) for screening in result),
        batch_s=statistics.median(batch_s[1:]),
        alone_s=statistics.median(alone_s[1:]),
        per_s=PROCESSES * COUNT / statistics.median(pool_s[1:]),
        waiting_per_s=COUNT / statistics.median(waiting_s[1:]),
    )


@cache
def job() -> tuple[Cell, Schedule]:
    """The cell and its tasks on the clock, prepared once in each process."""
    cell = load_cell(CELL)
    return cell, schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])


def candidates_near(cell: Cell, count: int) -> Candidates:
    """The cell with every operator's base moved and turned on the floor by chance."""
    rng = np.random.default_rng(0)
    X_WB = np.tile([robot.X_WB for robot in cell.robots], (count, 1, 1, 1))
    for index, robot in enumerate(cell.robots):
        if robot.name not in cell.positioners:
            turned = rotation_about(np.array([0.0, 0.0, 1.0]), rng.normal(0.0, TURN, count))
            X_WB[:, index, :3, :3] = turned @ X_WB[:, index, :3, :3]
            X_WB[:, index, :2, 3] += rng.normal(0.0, PLACE, (count, 2))
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    X_FT = np.tile([robot.tool.X_FT for robot in cell.robots], (count, 1, 1, 1))
    return Candidates(X_WB=X_WB, X_FT=X_FT, start=np.tile(start, (count, 1)))


def part(candidates: Candidates, which: slice) -> Candidates:
    """Some of the candidates."""
    return Candidates(X_WB=candidates.X_WB[which], X_FT=candidates.X_FT[which], start=candidates.start[which])


def screen(candidates: Candidates) -> Screening:
    """What comes of candidates."""
    cell, timed = job()
    return screen_layouts(cell, timed, candidates, moving=[robot.name for robot in cell.robots])


def screened(batches: Sequence[Candidates]) -> tuple[list[Screening], float]:
    """What comes of several batches, one after the other, and the processor time in [s]."""
    begin = time.process_time()
    result = [screen(batch) for batch in batches]
    return result, time.process_time() - begin


def processor_time(candidates: Candidates) -> float:
    """What it takes this process to screen candidates, in [s]."""
    return screened([candidates])[1]


def section(figures: Figures, rounds: int) -> Section:
    """The figures as a section of the page."""
    rows = [
        (f"batches of {AT_ONCE}", f"{1e3 * figures.batch_s:.1f} ms", "1"),
        ("one by one", f"{1e3 * figures.alone_s:.1f} ms", digits(figures.alone_s / figures.batch_s)),
    ]
    return Section(
        title="Screening of layouts",
        lines=[
            f"{COUNT} candidates for the reference cell, every operator's base moved by some {1e3 * PLACE:g} mm and "
            f"turned by some {np.degrees(TURN):g}° by chance; {figures.followed} of them can do the whole job. Each is "
            "resolved from its start to the end, to errors, joint margins and speeds; nothing is said of collisions. "
            f"Medians of {rounds} runs after one that does not count. Candidates a second: from the processor time of "
            "all processes while they work at once; in brackets by the clock on the wall.",
            "",
            *table(("candidates", "CPU per candidate", "× batches"), rows),
        ],
        goals=[
            Goal(
                text=f"{LEAST_PER_S:g} candidates a second with {PROCESSES} processes",
                measured=f"{figures.per_s:.0f} a second ({figures.waiting_per_s:.0f} by the clock)",
                met=figures.per_s >= LEAST_PER_S,
            )
        ],
    )


def main() -> None:
    """Measure and print."""
    options = benchmark_options("Screen many candidate layouts of the reference cell.", what="screenings", rounds=5)
    figures = measure(options.rounds)
    print(json.dumps(asdict(figures), indent=1) if options.json else section(figures, options.rounds).text())


if __name__ == "__main__":
    main()
