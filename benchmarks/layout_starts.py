"""Layouts of real arms from nothing: ``python benchmarks/layout_starts.py --robots FOLDER``.

All bases of the operators stand at corners of the floor, where no tool reaches its path, so sequential programs alone
cannot begin. One row per cell and seed: starts are sampled one by one, the best is improved where it falls
short of a demand, and solved by the product, until one is certified. The robot descriptions are real ones that are not
part of this project: a folder with kuka_kr16_2, abb_irb1600_8_145, staubli_rx160 and abb_irb2400_12_155. Times are
those of the processor.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from cellplan import load_cell, solve
from cellplan.errors import CellplanError
from cellplan.search.programs.improve import improve
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.starts.generator import Start, StartGenerator
from cellplan.search.starts.problem import StartProblem
from cellplan.search.variables.variables import Variables

FOLDER: Final = "CELLPLAN_ROBOT_DESCRIPTIONS"
CELLS: Final = Path(__file__).parent / "cells"
GOALS: Final = {"real_arms_corners": 15.0, "real_arms_tight": 60.0}  # [s] to a certified layout
MOST_STARTS: Final = 8  # numbers of starts that are tried for one seed
SOLVED: Final = 2  # candidates of one number that are solved at most
PROGRAMS: Final = 25  # iterations of one local optimisation
SPARE: Final = 0.02  # share of the duration that it leaves, for what lies between nodes


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What became of one seed.

    Attributes:
        cell: Name of the cell.
        seed: The seed.
        is_certified: Whether a layout was certified.
        seconds: Processor time in [s] up to then, of it ``solve_seconds`` in the product's solve.
        starts: Numbers of starts that were sampled.
        found: Candidates that these gave, of which all tools follow their paths.
        improved: Local optimisations.
        solved: Calls of the product's solve.
        solve_seconds: See ``seconds``.
    """

    cell: str
    seed: int
    is_certified: bool
    seconds: float
    starts: int
    successes: int
    improved: int
    solved: int
    solve_seconds: float


class Bench:
    """One cell, prepared once."""

    def __init__(self, name: str, robots: Path) -> None:
        """Read the cell and prepare its search."""
        began = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{name}.yaml"
            file.write_text((CELLS / f"{name}.yaml").read_text().replace("{robots}", str(robots)))
            self._variables = Variables.of(load_cell(file, allow_dirs=[robots]))
        self._name, cell = name, self._variables.base
        self._starts = StartProblem.of(cell, self._variables, margin=self._variables.margin)
        self._problem = LayoutProblem(
            job=self._starts.job,
            variables=self._variables,
            bodies=self._starts.distances,
            acceleration=self._starts.acceleration,
        )
        duration = (1.0 - SPARE) * float(self._starts.job.times[-1])
        self._demands = Demands(objective=Objective.CONFORMING, margin=self._variables.margin, duration=duration)
        self._counts = dict.fromkeys(("starts", "found", "improved", "solved"), 0)
        self._solve_seconds = 0.0
        self.set_up = time.process_time() - began

    def row(self, seed: int) -> Row:
        """Search with one seed."""
        self._counts, self._solve_seconds = dict.fromkeys(self._counts, 0), 0.0
        began = time.process_time()
        generator = StartGenerator(self._starts, seed=seed)
        is_certified = any(self._is_certified(generator, index) for index in range(1, MOST_STARTS + 1))
        return Row(
            cell=self._name,
            seed=seed,
            is_certified=is_certified,
            seconds=time.process_time() - began,
            solve_seconds=self._solve_seconds,
            **self._counts,
        )

    def _is_certified(self, generator: StartGenerator, index: int) -> bool:
        """Whether one number of starts gives a certified layout."""
        starts = generator.at(index)
        self._counts["starts"] += 1
        self._counts["found"] += len(starts.starts)
        return any(self._passes(start) for start in starts.starts[:SOLVED])

    def _passes(self, start: Start) -> bool:
        """Whether a start, improved where it has to be, passes the product's solve."""
        x, q = start.x, start.start
        if start.violation > 0.0 or start.cycle > (self._demands.duration or 0.0):
            self._counts["improved"] += 1
            better = improve(self._problem, x, q, self._demands, Effort(iterations=PROGRAMS))
            if better is None or not better.is_conforming:
                return False
            x, q = better.point.x, better.point.start
        self._counts["solved"] += 1
        began = time.process_time()
        try:
            return bool(solve(self._variables.cell(x, q)).passed)
        except CellplanError:
            return False
        finally:
            self._solve_seconds += time.process_time() - began


def rows(robots: Path, seeds: int, cells: list[str]) -> Iterator[Row]:
    """All rows, cell by cell."""
    for name in cells:
        bench = Bench(name, robots)
        print(f"{name}: prepared in {bench.set_up:.1f} s", file=sys.stderr)
        for seed in range(seeds):
            yield bench.row(seed)


def main() -> int:
    """Print one line per seed and the counts; 0 when all cells meet their goals for 9 of 10 seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=Path, default=os.environ.get(FOLDER), help=f"folder, or set {FOLDER}")
    parser.add_argument("--seeds", type=int, default=10, help="number of seeds (default: 10)")
    parser.add_argument("--cell", choices=list(GOALS), action="append", help="one cell only")
    parser.add_argument("--json", action="store_true", help="print JSON lines instead of the table")
    options = parser.parse_args()
    if options.robots is None or not Path(options.robots).is_dir():
        print(f"skipped: no robot descriptions; give their folder with --robots or {FOLDER}")
        return 0
    met = dict.fromkeys(options.cell or list(GOALS), 0)
    for row in rows(Path(options.robots).resolve(), options.seeds, list(met)):
        met[row.cell] += row.is_certified and row.seconds <= GOALS[row.cell]
        print(json.dumps(asdict(row)) if options.json else _line(row), flush=True)
    for name, count in met.items():
        print(f"{name}: certified within {GOALS[name]:g} s of processor time with {count} of {options.seeds} seeds")
    return 0 if all(count >= 0.9 * options.seeds for count in met.values()) else 1


def _line(row: Row) -> str:
    """One row of the table."""
    verdict = "certified" if row.is_certified else "NOT certified"
    return (
        f"{row.cell:18} seed {row.seed:2}  {verdict:13} {row.seconds:6.1f} s (solve {row.solve_seconds:5.1f} s)  "
        f"{row.starts} starts, {row.successes} candidates, {row.improved} improved, {row.solved} solved"
    )


if __name__ == "__main__":
    sys.exit(main())
