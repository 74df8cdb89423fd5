"""How long a whole command takes: ``python benchmarks/solve_command.py``; ``--against DIR`` compares with a checkout.

The command (``solve cells/four_robots.yaml`` unless another one follows ``--``) runs several times in a process of its
own, with an output folder of its own. Clock and processor time count everything from the start of Python to the end,
child processes included. Both checkouts run with this interpreter and take turns, so that whatever else the machine
does meets both; what is said of them is the median of the ratios of neighbouring runs. A first run of each, which
compiles and fills caches, does not count.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
COMMAND = ("solve", "cells/four_robots.yaml", "--quiet")
KNOWN = {0, 1}  # exit statuses: 1 is a check that failed


class Spent(NamedTuple):
    """What one run took in [s]."""

    clock: float
    user: float
    system: float

    @property
    def processor(self) -> float:
        """Time of the processors."""
        return self.user + self.system


def timed(checkout: Path, command: list[str]) -> Spent:
    """What a command takes in a checkout."""
    with tempfile.TemporaryDirectory(prefix="cellplan-command-") as folder:
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        run = subprocess.run(
            [sys.executable, "-m", "cellplan", *command, "-o", str(Path(folder) / "run")],
            cwd=checkout,
            env={**os.environ, "PYTHONPATH": str(checkout)},
            capture_output=True,
            text=True,
            check=False,
        )
        clock, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    if run.returncode not in KNOWN:
        sys.exit(f"benchmark: {checkout}: {run.stderr or run.stdout}")
    return Spent(clock, after.ru_utime - before.ru_utime, after.ru_stime - before.ru_stime)


def measured(checkouts: list[Path], command: list[str], rounds: int) -> list[list[Spent]]:
    """What each checkout takes, run by run, in turns."""
    for checkout in checkouts:
        timed(checkout, command)
    turns = [[timed(checkout, command) for checkout in checkouts] for _ in range(rounds)]
    return [list(runs) for runs in zip(*turns, strict=True)]


def table(names: list[str], result: list[list[Spent]]) -> str:
    """Medians as Markdown, and the ratios to the first checkout."""
    lines = ["| checkout | clock, s | processor, s | user, s | system, s |", "|---|---:|---:|---:|---:|"]
    for name, runs in zip(names, result, strict=True):
        columns = [[run.clock, run.processor, run.user, run.system] for run in runs]
        figures = [f"{statistics.median(values):.2f}" for values in zip(*columns, strict=True)]
        lines.append(f"| {' | '.join([name, *figures])} |")
    for name, runs in zip(names[1:], result[1:], strict=True):
        pairs = list(zip(runs, result[0], strict=True))
        clock = statistics.median(ours.clock / other.clock for ours, other in pairs)
        processor = statistics.median(ours.processor / other.processor for ours, other in pairs)
        lines += [
            "",
            f"{name} / {names[0]}: clock {clock:.2f}, processor {processor:.2f} (medians of {len(pairs)} ratios).",
        ]
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Time a whole cellplan command.")
    parser.add_argument("--against", type=Path, metavar="DIR", help="another checkout, which takes turns with this one")
    parser.add_argument("--rounds", type=int, default=7, help="runs that count; medians are shown (default: 7)")
    parser.add_argument("command", nargs="*", default=list(COMMAND), help=f"default: {' '.join(COMMAND)}")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    checkouts = [ROOT] if options.against is None else [options.against.resolve(), ROOT]
    names = ["this one"] if options.against is None else ["the other", "this one"]
    print(f"`cellplan {' '.join(options.command)}`, {os.cpu_count()} processors\n")
    print(table(names, measured(checkouts, options.command, options.rounds)))


if __name__ == "__main__":
    main()
