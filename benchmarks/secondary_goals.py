"""Time secondary goals in both modes on one cell: ``python benchmarks/secondary_goals.py --help``.

Cost is the processor time of following the tasks alone, without search for a start, checks or files. The motions take
turns, so that a slow minute hits all alike; what counts are the medians' ratios to the accurate mode without goals.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from cellplan import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Motion
from cellplan.model.settings.solver import SecondaryEntry
from cellplan.model.solver import Integrator
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.plan_motion import plan_within_accuracy
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask

ROOT = Path(__file__).resolve().parent.parent
GOALS = tuple(SecondaryEntry.model_fields)


def motion_task(cell: Cell, goals: Mapping[str, Mapping[str, float]], integrator: Integrator) -> MotionTask:
    """The cell's tasks with these goals; it has its start postures."""
    cell = replace(cell, solver=cell.solver.changed(secondary=goals, integrator=integrator))
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    return MotionTask(cell, schedule, tuple(robot.name for robot in cell.robots), start)


def main() -> None:
    """Measure and print a table in Markdown."""
    parser = argparse.ArgumentParser(description="Time secondary goals in both modes.")
    parser.add_argument("--cell", default="cells/four_robots.yaml", help="a cell with start postures")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each motion (default: 3)")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    cell = load_cell(ROOT / options.cell)
    goals: dict[str, dict[str, dict[str, float]]] = {"none": {}, **{name: {name: {}} for name in GOALS}}
    cases = [(name, integrator) for name in goals for integrator in (Integrator.ACCURATE, Integrator.EULER)]
    times: dict[tuple[str, Integrator], list[float]] = {case: [] for case in cases}
    motions: dict[tuple[str, Integrator], Motion] = {}
    for number in range(options.rounds):
        for name, integrator in cases:
            print(f"{name}, {integrator}, round {number + 1} of {options.rounds}", file=sys.stderr)
            task = motion_task(cell, goals[name], integrator)
            begin = time.process_time()
            motions[name, integrator] = plan_within_accuracy(task)
            times[name, integrator].append(time.process_time() - begin)
    costs = {case: statistics.median(time) for case, time in times.items()}
    print("| goal | mode | systems | processor time | × no goal, accurate | farthest joint from the accurate motion |")
    print("|---|---|---|---|---|---|")
    for (name, integrator), cost in costs.items():
        motion, exact = motions[name, integrator], motions[name, Integrator.ACCURATE]
        solves = motion.resolution.solves if motion.resolution is not None else 0
        apart = np.degrees(np.abs(motion.q - exact.q).max())
        ratio = cost / costs["none", Integrator.ACCURATE]
        print(f"| `{name}` | {integrator} | {solves} | {cost:.2f} s | {ratio:.1f} | {apart:.4f}° |")


if __name__ == "__main__":
    main()
