"""Where the time of ``cellplan solve`` goes: ``python benchmarks/stages.py``; ``--write`` renews the page of the docs.

The command runs several times in a process of its own in which the functions of the stages are timed. What a stage
spends in another one counts for that other one alone, and so does what it spends in importing libraries; what is left
counts as the rest. The work of child processes, which goes on meanwhile, is counted as a whole.
"""

import argparse
import functools
import importlib.machinery
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "concepts" / "profile.md"
CELL = "cells/four_robots.yaml"
BEGUN = "CELLPLAN_BENCHMARK_BEGUN"  # the moment in [s] at which the process was asked for

STARTING, IMPORTS, REST = "starting Python", "importing libraries", "the rest"
CHILDREN = "in child processes, meanwhile"
STAGES: dict[str, dict[str, tuple[str, ...]]] = {  # stage, module, functions
    "reading the cell and its robots": {"cellplan.files.cell.load": ("load_cell",)},
    "bodies, hulls and pairs": {"cellplan.scene.scene": ("Scene.from_cell",)},
    "paths and times of the tools": {
        "cellplan.planning.path.build": ("build_toolpath",),
        "cellplan.planning.timing.schedule": ("schedule_paths", "clock_paths"),
    },
    "start postures": {
        "cellplan.planning.start.given": ("examine_given_starts",),
        "cellplan.planning.start.search": ("choose_start",),
    },
    "joint motion": {"cellplan.planning.plan_motion": ("plan_motion",)},
    "writing and reading back the tables": {
        "cellplan.files.run.joint_tables": ("render_table", "parse_table", "replace_header")
    },
    "verifying tools, joints, conditioning": {"cellplan.checks.verify": ("verify_motion", "with_clearance")},
    "certifying the clearance": {"cellplan.checks.clearance.check": ("check_clearance",)},
    "copying the process, waiting for the copy": {
        "cellplan.guard.forked": ("ForkedWork.begin",),
        "cellplan.runs.early_clearance": ("EarlyClearance.of",),
    },
    "plots": {
        "cellplan.report.plots.run": ("run_figures",),
        "cellplan.report.plots.svg": ("svg_text",),
        "cellplan.report.plots.rendering": ("pictures",),
    },
    "picture of the worst instant, floor plan": {
        "cellplan.runs.drawings.picture": ("phase_drawings", "phase_floor_plan"),
    },
    "report.json": {
        "cellplan.report.record.run": ("run_record",),
        "cellplan.report.record.series": ("series_head", "series_json"),
    },
    "report.html": {"cellplan.report.page.render": ("report_page",)},
    "writing the run folder": {
        "cellplan.files.run.folder": ("RunFolder.__enter__", "RunFolder.write_bytes", "RunFolder.__exit__"),
        "cellplan.files.cell.write": ("render_cell",),
        "cellplan.files.run.manifest": ("render_manifest",),
        "cellplan.runs.write_run": ("versions",),
    },
    "telling the result": {"cellplan.report.text.run": ("summary_lines",)},
}


Seconds = tuple[float, float]  # waited, and worked by the processor


def now() -> Seconds:
    """What a clock on the wall shows, and what this process has worked so far."""
    return time.perf_counter(), time.process_time()


class Clock:
    """Adds up the time of each stage, without that of the stages within it."""

    def __init__(self) -> None:
        """Start with the rest."""
        self.spent: dict[str, Seconds] = {}
        self._stages = [REST]
        self._since = now()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time of the block for a stage."""
        self._turn()
        self._stages.append(name)
        try:
            yield
        finally:
            self._turn()
            self._stages.pop()

    def _turn(self) -> None:
        """Count what has gone by for the stage that was on."""
        wall, cpu = self.spent.get(self._stages[-1], (0.0, 0.0))
        at = now()
        self.spent[self._stages[-1]] = wall + at[0] - self._since[0], cpu + at[1] - self._since[1]
        self._since = at

    def timed(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        """The function, timed."""

        @functools.wraps(function)
        def wrapper(*arguments: Any, **options: Any) -> Any:
            with self.stage(name):
                return function(*arguments, **options)

        return wrapper


class Timing:
    """Puts timed functions into modules as soon as they are imported."""

    def __init__(self, clock: Clock) -> None:
        """Turn the table of stages round."""
        self._clock = clock
        self._desired: dict[str, list[tuple[str, str]]] = {}
        for stage, modules in STAGES.items():
            for module, names in modules.items():
                self._desired.setdefault(module, []).extend((name, stage) for name in names)

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        """The module as it would be found, with a loader that puts the timed functions in."""
        if name not in self._desired:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is None or spec.loader is None:
            return spec
        load = spec.loader.exec_module

        def load_and_time(module: Any) -> None:
            load(module)
            for dotted, stage in self._desired[name]:
                *owners, last = dotted.split(".")
                owner = functools.reduce(getattr, owners, module)
                members = vars(owner)[last]
                is_class = isinstance(members, classmethod)
                timed = self._clock.timed(members.__func__ if is_class else members, stage)
                setattr(owner, last, classmethod(timed) if is_class else timed)

        spec.loader.exec_module = load_and_time  # type: ignore[method-assign]
        return spec


def solve_timed(cell: str, folder: str) -> dict[str, Seconds]:
    """Seconds of each stage of one solve in this process, which has done nothing else so far."""
    import builtins

    started = time.time() - float(os.environ[BEGUN]), time.process_time()
    clock = Clock()
    sys.meta_path.insert(0, Timing(clock))  # type: ignore[arg-type]
    load = builtins.__import__
    depth = 0

    def timed_import(name: str, *arguments: Any, **options: Any) -> Any:
        nonlocal depth
        if depth or name in sys.modules:
            return load(name, *arguments, **options)
        depth += 1
        try:
            with clock.stage(IMPORTS):
                return load(name, *arguments, **options)
        finally:
            depth -= 1

    builtins.__import__ = timed_import
    from cellplan.cli.main import run

    if run(["solve", cell, "--quiet", "-o", folder]) not in (0, 1):
        sys.exit(f"benchmark: solving {cell} failed")
    with clock.stage(REST):
        return {STARTING: started, **clock.spent, CHILDREN: (0.0, sum(os.times()[2:4]))}


def measured(cell: str, rounds: int) -> tuple[dict[str, Seconds], float]:
    """Median seconds of each stage, and of the whole command with its end."""
    results: list[dict[str, Seconds]] = []
    whole = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory(prefix="cellplan-profile-") as folder:
            begin = time.time()
            run = subprocess.run(
                [sys.executable, __file__, "--once", cell, str(Path(folder) / "run")],
                env={**os.environ, BEGUN: repr(begin)},
                capture_output=True,
                text=True,
                check=False,
            )
            whole.append(time.time() - begin)
        if run.returncode != 0:
            sys.exit(run.stderr)
        results.append(json.loads(run.stdout.splitlines()[-1]))
    medians = {}
    for name in (STARTING, IMPORTS, *STAGES, REST, CHILDREN):
        walls, cpus = zip(*(entry.get(name, (0.0, 0.0)) for entry in results), strict=True)
        medians[name] = statistics.median(walls), statistics.median(cpus)
    return medians, statistics.median(whole)


def page(spent: dict[str, Seconds], whole_s: float, *, cell: str, rounds: int) -> str:
    """The table as Markdown."""
    worked = sum(cpu for _, cpu in spent.values())
    rows = [
        f"| {name} | {1000.0 * cpu:.0f} | {100.0 * cpu / worked:.0f} % | {1000.0 * wall:.0f} |"
        for name, (wall, cpu) in spent.items()
    ]
    return "\n".join(
        [
            f"Stages of `cellplan solve {cell}`, medians of {rounds} runs; the whole command took {whole_s:.2f} s.",
            f"{machine()}.",
            "",
            "| stage | processor, ms | share | clock, ms |",
            "|---|---:|---:|---:|",
            *rows,
            f"| together | {1000.0 * worked:.0f} | 100 % | {1000.0 * sum(wall for wall, _ in spent.values()):.0f} |",
            "",
        ]
    )


def machine() -> str:
    """What the figures were measured on."""
    return f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors, Python {platform.python_version()}"


def main() -> None:
    """Measure and print, or write the page."""
    parser = argparse.ArgumentParser(description="Show where the time of 'cellplan solve' goes.")
    parser.add_argument("cell", nargs="?", default=CELL, help=f"cell file (default: {CELL})")
    parser.add_argument("--rounds", type=int, default=5, help="runs; medians are shown (default: 5)")
    parser.add_argument("--write", action="store_true", help=f"renew the table in {PAGE.relative_to(ROOT)}")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    os.chdir(ROOT)
    table = page(*measured(options.cell, options.rounds), cell=options.cell, rounds=options.rounds)
    if options.write:
        head, mark, _ = PAGE.read_text(encoding="utf-8").partition("<!-- measured -->\n")
        PAGE.write_text(f"{head}{mark}\n{table}", encoding="utf-8")
    print(table)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--once"]:
        print(json.dumps(solve_timed(*sys.argv[2:4])))
    else:
        main()
