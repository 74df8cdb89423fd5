"""Processor time of exports: ``python benchmarks/export_formats.py [RUN --cell CELL] [--texts]``.

``cells/four_robots.yaml`` is solved, 4001 rows of four robots, and exported in all formats that can take it as
``cellplan export --format all`` does it, checks included, the gate apart: the median of some repetitions. With a run,
that one is exported. With ``--texts`` every format only writes and reads back 4000 rows of four robots that move
between drawn configurations; a format that cannot take these robots says why.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cellplan import export_programs, load_cell, open_gate, solve, write_run
from cellplan.errors import CellplanError
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, RobotRows
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.timed_rows import cycle_of

ROOT = Path(__file__).resolve().parent.parent
CELL = ROOT / "cells" / "four_robots.yaml"
ROWS = 4000
STEP = 0.01  # [s] between rows
REST = 0.12  # [s] at both ends
GOAL = 10.0  # [s] of processor time for all formats


class Stages:
    """Processor time by stage, from the progress that is reported."""

    def __init__(self) -> None:
        """Begin with no stage."""
        self.seconds: dict[str, float] = {}
        self.begun = time.process_time()

    def passed(self, stage: str, _share: float) -> None:
        """Count the time since the last report for a stage."""
        now = time.process_time()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self.begun
        self.begun = now


def rows_of(robot: Robot, times: np.ndarray, rng: np.random.Generator) -> RobotRows:
    """Rows that move from one drawn configuration to another and rest at both ends."""
    lower, upper = (np.array([getattr(joint, end) for joint in robot.model.joints]) for end in ("lower", "upper"))
    lower, upper = np.maximum(lower, -3.0), np.minimum(upper, 3.0)
    begin, end = rng.uniform(lower, upper, (2, len(lower)))
    duration = times[-1] - 2.0 * REST
    u = np.clip((times - REST) / duration, 0.0, 1.0)[:, None]
    return RobotRows(
        robot=robot.name,
        q=begin + (end - begin) * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5),
        times=times,
        qd=(end - begin) * 30.0 * (u - u**2) ** 2 / duration,
        process=(times > 0.2 * times[-1]) & (times < 0.8 * times[-1]),
    )


def random_job(cell: Cell, dialect: Dialect) -> ExportJob:
    """A job of all robots of a cell: 4000 rows, or as many as the cycle of a controller gives in the same time."""
    rng, robots = np.random.default_rng(0), {}
    for robot in cell.robots:
        step = cycle_of(robot) if dialect.at_cycle else STEP
        times = np.arange(round(ROWS * STEP / step) + 1) * step
        robots[robot.name] = rows_of(robot, times, rng)
    frame = ExportFrame(cell=cell, robots=tuple(robots), programs=(None,), promise=dialect.promises[0])
    return ExportJob(frame=frame, programs=(ProgramRows(name=None, robots=robots),), notes=("drawn",))


def timed(work: Callable[[], None], name: str) -> float:
    """Processor time of some work; what it refuses is printed."""
    begun = time.process_time()
    try:
        work()
    except CellplanError as error:
        print(f"{name:12} not written: {error}")
    return time.process_time() - begun


def texts_only() -> float:
    """Write and read back every format; processor time of all."""
    cell, total = load_cell(CELL), 0.0
    for name, dialect in DIALECTS.items():
        job = random_job(cell, dialect)
        stages = Stages()

        def work(dialect: Dialect = dialect, job: ExportJob = job, stages: Stages = stages) -> None:
            files = dialect.render(job)
            stages.passed("written", 1.0)
            dialect.read(job.frame, files)
            stages.passed("read back", 1.0)

        total += timed(work, name)
        for stage, seconds in stages.seconds.items():
            print(f"{name:12} {stage:40} {seconds:8.2f} s")
    return total


def whole_exports(run_folder: Path, cell: Path, repeats: int) -> float:
    """Export a run in every format that can take it, as ``--format all``; median processor time of the whole.

    What is shared by formats counts with the one that needs it first.
    """
    run, totals, by_stage = open_gate(run_folder, cell=cell), list[float](), dict[str, list[float]]()
    for repeat in range(repeats):
        stages = Stages()
        begun = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            exports = export_programs(run, Path(folder), progress=stages.passed)
        totals.append(time.process_time() - begun)
        for stage, seconds in stages.seconds.items():
            by_stage.setdefault(stage, []).append(seconds)
        for entry in exports if repeat == 0 else ():
            print(f"{entry.form:12} {'written' if entry.refusal is None else f'not written: {entry.refusal}'}")
    for stage, times in by_stage.items():
        print(f"{stage:53} {statistics.median(times):8.2f} s")
    return statistics.median(totals)


def main() -> None:
    """Print processor time per stage and in total, against the goal."""
    parser = argparse.ArgumentParser(description="Processor time of exports, by format and stage.")
    parser.add_argument("run", nargs="?", type=Path, help="run folder; without one four_robots.yaml is solved")
    parser.add_argument("--cell", type=Path, default=CELL, help="its cell file")
    parser.add_argument("--repeats", type=int, default=3, help="exports, of which the median counts")
    parser.add_argument("--texts", action="store_true", help="write and read drawn rows only")
    options = parser.parse_args()
    if options.texts:
        total = texts_only()
    elif options.run is not None:
        total = whole_exports(options.run, options.cell, options.repeats)
    else:
        with tempfile.TemporaryDirectory() as folder:
            write_run(solve(load_cell(CELL)), Path(folder) / "run")
            total = whole_exports(Path(folder) / "run", CELL, options.repeats)
    print(f"{'total':53} {total:8.2f} s, goal {GOAL:g} s")


if __name__ == "__main__":
    main()
