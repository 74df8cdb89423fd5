"""What more robots round one part cost: ``python benchmarks/scaling.py``.

Cells with 4 to 32 robots are generated, start postures given, and resolved by the accurate mode; the rounds alternate
between the cells. Processor time per node is that of the run alone, the model of the cell and the sampling included;
beside it stands the same per robot, which does not grow as long as the cost grows no faster than the cell.
"""

import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
from generated_cells import cell_with
from options import benchmark_options
from sections import Goal, Section, digits, table

from cellplan import Cell, load_cell
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask

ROBOTS: Final = (4, 8, 16, 32)  # [-] the positioner among them
MOST: Final = 10.0  # [-] goal: the cost per node of the largest cell, as a multiple of the smallest


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What one cell costs.

    Attributes:
        robots: How many robots it has.
        joints: How many joints.
        nodes: Times at which its joints are solved for.
        cpu_s: Median processor time in [s].
    """

    robots: int
    joints: int
    nodes: int
    cpu_s: float

    @property
    def node_s(self) -> float:
        """Processor time per node in [s]."""
        return self.cpu_s / self.nodes


def measure(rounds: int) -> list[Cost]:
    """Costs of all cells, the smallest first."""
    cells = [generated(robots) for robots in ROBOTS]
    runs = [prepared(cell) for cell in cells]
    seconds: list[list[float]] = [[] for _ in cells]
    for number in range(rounds + 1):
        print(f"scaling: {f'round {number} of {rounds}' if number else 'warming up'}", file=sys.stderr)
        for run, second in zip(runs, seconds, strict=True):
            begin = time.process_time()
            run()
            second.append(time.process_time() - begin)
    return [
        Cost(robots=len(cell.robots), joints=cell.joint_count, nodes=run(), cpu_s=statistics.median(second[1:]))
        for cell, run, second in zip(cells, runs, seconds, strict=True)
    ]


def generated(robots: int) -> Cell:
    """A cell with so many robots."""
    with tempfile.TemporaryDirectory(prefix="cellplan-bench-") as folder:
        path = Path(folder) / "cell.yaml"
        path.write_text(cell_with(robots), encoding="utf-8")
        return load_cell(path)


def prepared(cell: Cell) -> Callable[[], int]:
    """Set the clock; a run resolves the cell and says at how many nodes."""
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    moving = [robot.name for robot in cell.robots]

    def run() -> int:
        resolution = plan_motion(MotionTask(cell, schedule, moving, start)).resolution
        if resolution is None or resolution.euler_from is not None:
            sys.exit(f"benchmark: {cell.name}: the accurate mode did not reach the end")
        return resolution.nodes

    return run


def section(costs: Sequence[Cost], rounds: int) -> Section:
    """The figures as a section of the page."""
    first, last = costs[0], costs[-1]
    rows = [
        (
            str(cost.robots),
            str(cost.joints),
            f"{1e3 * cost.cpu_s:.0f} ms",
            str(cost.nodes),
            f"{1e6 * cost.node_s:.0f} µs",
            digits(cost.node_s / first.node_s),
            f"{1e6 * cost.node_s / cost.robots:.0f} µs",
        )
        for cost in costs
    ]
    return Section(
        title="More robots round one part",
        lines=[
            "One robot carries a plate, the others work on it at once, each on a task of its own, for 4 s "
            "(`benchmarks/generated_cells.py`); start postures are given, nothing is checked. CPU: median of "
            f"{rounds} runs of the accurate mode after one that does not count, in turns.",
            "",
            *table(("robots", "joints", "CPU", "nodes", "CPU per node", f"× {first.robots} robots", "per robot"), rows),
        ],
        goals=[
            Goal(
                text=f"a node with {last.robots} robots costs at most {MOST:g} times one with {first.robots}",
                measured=f"{digits(last.node_s / first.node_s)} times",
                met=last.node_s <= MOST * first.node_s,
            )
        ],
    )


def main() -> None:
    """Measure and print."""
    options = benchmark_options(
        "Resolve generated cells with more and more robots.", what="runs of each cell", rounds=5
    )
    costs = measure(options.rounds)
    print(
        json.dumps([asdict(cost) for cost in costs], indent=1)
        if options.json
        else section(costs, options.rounds).text()
    )


if __name__ == "__main__":
    main()
