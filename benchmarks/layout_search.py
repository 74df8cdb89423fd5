"""Searching a layout: ``python benchmarks/layout_search.py --seconds 60 --rounds 10``.

The failing reference cell with rods as tools and a column below every base: shortest cycle with margins of 15 deg and
10 mm of clearance. Sequential programs with perturbations between them against random search and, where ``cma`` is
installed (group ``bench-search``), CMA-ES, each for the same processor time. The figures are those of the search
itself, at its nodes and keys; nothing is certified there. ``--command CELL`` runs the whole command instead, and says
what it certifies: ``--command cells/find_a_layout.yaml --seconds 60 --rounds 3 -- --margin 15deg``.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np
from sections import Section, table

from cellplan import load_cell
from cellplan.geometry.arrays import Array
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import Job
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.problem import perturbed
from cellplan.search.variables.variables import Variables

CELL: Final = Path(__file__).resolve().parent.parent / "cells" / "four_robots_initial.yaml"
NODES: Final = 64
TOOLS: Final = {"kuka": (150, 0, -45), "abb": (100, 60, 90), "staubli": (200, 30, -90)}  # [mm], [deg], [deg]
BUILD_UP: Final = np.array([0.25, 0.25, 0.25, 0.15, 0.15, 0.15])  # [s] to the full speed of each axis
POPULATION: Final = 48  # [-] of CMA-ES
MISSED: Final = 100.0  # [s] that a violation of nothing costs a black-box search: feasibility first
FARTHEST: Final = 1e9  # [s] likewise where a tool cannot follow
EVERY: Final = 3  # [-] perturbations of which one is of the given layout


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """The cell as a problem."""

    problem: LayoutProblem
    start: Array
    demands: Demands


Search = Callable[[Searched, int, float], tuple[float | None, int]]  # cell, seed, seconds -> cycle, points


def searched(*, tools: bool, accelerations: bool) -> Searched:
    """The problem, with tools free or as given, with limits of acceleration or none."""
    place = {"x_mm": [-1500, 4500], "y_mm": [-3000, 3500], "z_mm": [0, 600], "yaw_deg": [-180, 180]}
    shape = {"length_mm": [100, 250], "tilt_deg": [0, 60], "roll_deg": [-180, 180]}
    values: dict[str, object] = {"checks.clearance_mm": 10}
    vary: dict[str, object] = {"reis.start_deg": True}
    for name, (length, tilt, roll) in TOOLS.items():
        rod = {"length_mm": length, "tilt_deg": tilt, "roll_deg": roll, "radius_mm": 12, "stick_out_mm": 12}
        values[f"robots.{name}.tool"] = {"rod": {**rod, "holder": {"radius_mm": 40, "length_mm": 60}}}
        values[f"robots.{name}.pedestal"] = {"cylinder": {"radius_mm": 230}}
        vary[f"{name}.base"] = place
        if tools:
            vary[f"{name}.tool"] = shape
    values["layout"] = {"vary": vary, "margin_deg": 15}
    variables = Variables.of(load_cell(CELL).with_values(values))
    base = variables.base
    schedule = schedule_tasks(base, [build_toolpath(task, base.part) for task in base.tasks])
    limit = base.joint_limits.velocity / np.tile(BUILD_UP, len(base.robots))
    problem = LayoutProblem(
        job=Job.of(base, schedule, moving=[robot.name for robot in base.robots], nodes=NODES),
        variables=variables,
        bodies=CellDistances.of(Scene.from_cell(base), variables),
        acceleration=limit if accelerations else np.full(base.joint_count, np.inf),
    )
    return Searched(
        problem=problem,
        start=np.concatenate([robot.start for robot in base.robots if robot.start is not None]),
        demands=Demands(objective=Objective.CYCLE, margin=variables.margin),
    )


def by_programs(cell: Searched, seed: int, seconds: float) -> tuple[float | None, int]:
    """Sequential programs from the given layout, then from perturbations of the best and of the given one."""
    rng, begin, count = np.random.default_rng(seed), time.process_time(), 0
    problem, best = cell.problem, None
    x, start = problem.given, cell.start
    while time.process_time() - begin < seconds:
        if count or seed:
            of_given = best is None or count % EVERY == 0
            x, start = (problem.given, cell.start) if best is None or of_given else (best.x, best.start)
            point = perturbed(problem, x, start, rng, size=1.0 if of_given else 0.7)
            if point is None:
                continue
            x, start = point.x, point.start
        count += 1
        limit = None if best is None else 1.25 * best.cycle
        improvement = improve(problem, x, start, cell.demands, Effort(give_up_above=limit))
        best = _better(best, improvement)
    return None if best is None else best.cycle, count


def _better(best: Improved | None, improved: Improved | None) -> Improved | None:
    """The better one of two."""
    if improved is None or not improved.is_conforming:
        return best
    return improved if best is None or improved.cycle < best.cycle else best


def by_chance(cell: Searched, seed: int, seconds: float) -> tuple[float | None, int]:
    """Random points: of the whole bounds and about the best one, in turns."""
    rng, begin, count = np.random.default_rng(seed), time.process_time(), 0
    problem = cell.problem
    best, at = np.inf, (problem.given, cell.start)
    while time.process_time() - begin < seconds:
        near = at[0] + problem.scale * rng.normal(size=len(at[0]))
        x = rng.uniform(problem.lower, problem.upper) if count % 2 else np.clip(near, problem.lower, problem.upper)
        count += 1
        value, start = _value(cell, x, at[1])
        if value < best:
            best, at = value, (x, start)
    return best if best < MISSED else None, count


def by_cma(cell: Searched, seed: int, seconds: float) -> tuple[float | None, int]:
    """CMA-ES on the cycle, violations first."""
    import cma

    begin, count, best, problem = time.process_time(), 0, np.inf, cell.problem
    bounds = [((end - problem.given) / problem.scale).tolist() for end in (problem.lower, problem.upper)]
    options = {"seed": seed + 1, "popsize": POPULATION, "bounds": bounds, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(np.zeros(len(problem.given)), 1.0, options)
    while time.process_time() - begin < seconds and not strategy.stop():
        samples = strategy.ask()
        points = [np.clip(problem.given + z * problem.scale, problem.lower, problem.upper) for z in samples]
        values = [_value(cell, x, cell.start)[0] for x in points]
        strategy.tell(samples, values)
        best, count = min(best, *values), count + len(values)
    return best if best < MISSED else None, count


def _value(cell: Searched, x: Array, start: Array) -> tuple[float, Array]:
    """What a black-box search minimises: the cycle, or what is missed where a demand is; and the start posture."""
    point = cell.problem.evaluate(x, start)
    if point is None:
        return FARTHEST, start
    measures = Measures.of(cell.problem, point, cell.demands, Effort(within=0.003))
    missed = measures.missed(cell.problem, cell.demands, Effort().reserve).violation
    return (measures.cycle if missed == 0.0 else MISSED + missed), point.start


def methods() -> dict[str, Search]:
    """The searches by name."""
    results: dict[str, Search] = {"sequential programs": by_programs, "random search": by_chance}
    return {**results, "CMA-ES": by_cma} if find_spec("cma") is not None else results


def section(options: argparse.Namespace) -> Section:
    """Run all and tell."""
    cell = searched(tools=not options.fixed, accelerations=options.accelerations)
    cell.problem.evaluate(cell.problem.given, cell.start)
    rows = []
    for name, search in methods().items():
        cycles, points = list[float](), list[int]()
        for seed in range(options.rounds):
            cycle, count = search(cell, seed, options.seconds)
            print(f"layout search: {name}, seed {seed}: {cycle} s, {count} points", file=sys.stderr)
            points.append(count)
            cycles += [] if cycle is None else [cycle]
        figures = (f"{min(cycles):.3f}", f"{statistics.median(cycles):.3f}") if cycles else ("none", "none")
        rows.append((name, f"{len(cycles)} of {options.rounds}", *figures, f"{statistics.median(points):g}"))
    tools, limits = "as given" if options.fixed else "free", "with" if options.accelerations else "no"
    kinds = f"tools {tools}, {limits} acceleration limits"
    return Section(
        title="Search of a layout",
        lines=[
            f"The cell {CELL.name} with rods and columns, {kinds}; {options.seconds:g} s of processor time each.",
            "",
            *table(("search", "conforming", "best cycle, s", "median, s", "points or programs' starts"), rows),
        ],
    )


def commands(options: argparse.Namespace) -> Section:
    """Whole commands: what each seed certifies, and what it takes."""
    rows = []
    for seed in range(options.rounds):
        with tempfile.TemporaryDirectory() as folder:
            words = [
                sys.executable,
                "-m",
                "cellplan",
                "layout",
                str(options.command),
                "-o",
                folder,
                "--json",
                "--quiet",
            ]
            words += ["--seed", str(seed), "--budget", f"{options.seconds:g}s", "--workers", str(options.workers)]
            begin, before = time.perf_counter(), os.times()
            done = subprocess.run([*words, *options.more], stdout=subprocess.PIPE, check=False)
            wall, after = time.perf_counter() - begin, os.times()
        study = json.loads(done.stdout).get("study", {})
        best = study.get("best") or {}
        processor = sum(after[2:4]) - sum(before[2:4])
        cycle = f"{best['cycle_s']:.3f}" if best else study.get("status", "error")
        rows.append((str(seed), cycle, *(str(study.get(key)) for key in ("trials", "solves")), f"{wall:.1f}"))
        rows[-1] += (f"{processor:.1f}",)
        print(f"layout command: {rows[-1]}", file=sys.stderr)
    return Section(
        title="Whole searches",
        lines=[
            f"`cellplan layout {options.command.name}`, {options.workers} workers, budget {options.seconds:g} s; load "
            f"at the end {os.getloadavg()[0]:.1f}.",
            "",
            *table(("seed", "certified cycle, s", "trials", "solves", "wall, s", "processor, s"), rows),
        ],
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Sequential programs beside random search and CMA-ES.")
    parser.add_argument("--rounds", type=int, default=3, help="seeds (default: 3)")
    parser.add_argument("--seconds", type=float, default=60.0, help="processor time of each search (default: 60)")
    parser.add_argument("--fixed", action="store_true", help="tools as they are given")
    parser.add_argument("--accelerations", action="store_true", help="with limits of acceleration")
    parser.add_argument("--command", type=Path, metavar="CELL", help="run whole commands with this cell file instead")
    parser.add_argument("--workers", type=int, default=2, help="of whole commands (default: 2)")
    parser.add_argument("more", nargs="*", help="further options of whole commands, after --")
    options = parser.parse_args()
    print((commands(options) if options.command else section(options)).text())


if __name__ == "__main__":
    main()
