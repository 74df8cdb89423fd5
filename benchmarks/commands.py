"""Time whole commands as a user waits for them: ``python benchmarks/commands.py --help``.

Every command runs several times as a child process of its own. The table shows medians of processor time, waiting time
and peak memory, that of the processes it starts included, each also as a multiple of a baseline that is measured in the
same run: a Python that imports the big libraries and does nothing. Multiples can be compared between machines, seconds
cannot. This script itself imports next to nothing: a child is charged with the memory that its parent holds when it
starts.
"""

import contextlib
import json
import os
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from options import benchmark_options
from sections import Goal, Section, digits, table

ROOT = Path(__file__).resolve().parent.parent
CELL = "cells/four_robots.yaml"
OUTPUT = "{output}"  # stands for a folder that is new in every round
RUN = "{run}"  # stands for a run of the cell
MB = 1e6  # [bytes]
MAXRSS_UNIT = 1 if sys.platform == "darwin" else 1024  # [bytes] ru_maxrss is in kilobytes but on a Mac


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command, and the goals that are set for it: waiting time in [s], peak memory in [MB]."""

    name: str
    arguments: tuple[str, ...]
    goal_s: float | None = None
    goal_mb: float | None = None
    status: int = 0  # exit status


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What a command takes: processor time and waiting time in [s], peak memory in [MB]."""

    cpu_s: float
    wall_s: float
    peak_mb: float


BASELINE = Command(name="import libraries", arguments=("-c", "import numpy, pinocchio, fcl, matplotlib.pyplot"))
COMMANDS = (
    Command(name="--help", arguments=("-m", "cellplan", "--help"), goal_s=0.3),
    Command(
        name="export, refused",
        arguments=("-m", "cellplan", "export", RUN, "--format", "krl", "--cell", CELL, "--quiet"),
        goal_s=1.0,
        status=2,
    ),
    Command(
        name="check --for, refused",
        arguments=("-m", "cellplan", "check", CELL, "--for", "krl", "--quiet"),
        goal_s=1.0,
        status=2,
    ),
    Command(
        name="recover, refused",
        arguments=("-m", "cellplan", "recover", RUN, "--at", "1000", "--cell", CELL, "--quiet"),
        goal_s=1.0,
        status=2,
    ),
    Command(name="check", arguments=("-m", "cellplan", "check", CELL, "--quiet")),
    Command(
        name="solve",
        arguments=("-m", "cellplan", "solve", CELL, "--quiet", "-o", OUTPUT),
        goal_s=6.0,
        goal_mb=400.0,
    ),
    Command(
        name="solve --mode pairwise",
        arguments=("-m", "cellplan", "solve", CELL, "--quiet", "--mode", "pairwise", "-o", OUTPUT),
        goal_mb=400.0,
    ),
)


class Watch:
    """Looks again and again how much memory a process and those it has started hold together; on Linux only."""

    def __init__(self, process: int) -> None:
        """Begin to look."""
        self._process, self._peak, self._is_over = process, 0, threading.Event()
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    def end(self) -> int:
        """The most that was seen in [bytes]; what the processes share is counted for each of them."""
        self._is_over.set()
        self._looking.join()
        return self._peak

    def _look(self) -> None:
        while not self._is_over.wait(0.03):
            self._peak = max(self._peak, sum(map(held, [self._process, *started_by(self._process)])))


def started_by(process: int) -> list[int]:
    """Processes that a process has started."""
    with contextlib.suppress(OSError):
        text = "".join(path.read_text() for path in Path(f"/proc/{process}/task").glob("*/children"))
        return [int(number) for number in text.split()]
    return []


def held(process: int) -> int:
    """Memory that a process holds in [bytes]; 0 where the system does not tell."""
    with contextlib.suppress(OSError, IndexError):
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0


def run_once(command: Command, run: Path) -> Cost:
    """Cost of one run in a child process; the program ends when the command fails."""
    folder = Path(tempfile.mkdtemp(prefix="cellplan-bench-"))
    log = folder / "log.txt"
    places = {OUTPUT: str(folder / "run"), RUN: str(run)}
    arguments = [sys.executable, *(places.get(part, part) for part in command.arguments)]
    try:
        begin = time.perf_counter()
        child = os.posix_spawn(
            sys.executable,
            arguments,
            {**os.environ, "MPLBACKEND": "agg"},
            file_actions=[
                (os.POSIX_SPAWN_OPEN, 1, str(log), os.O_WRONLY | os.O_CREAT, 0o600),
                (os.POSIX_SPAWN_DUP2, 1, 2),
            ],
        )
        watch = Watch(child)
        _, status, usage = os.wait4(child, 0)
        wall_s = time.perf_counter() - begin
        peak = max(watch.end(), usage.ru_maxrss * MAXRSS_UNIT)
        if os.waitstatus_to_exitcode(status) != command.status:
            sys.exit(f"benchmark: '{command.name}' failed:\n{log.read_text(encoding='utf-8', errors='replace')}")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return Cost(cpu_s=usage.ru_utime + usage.ru_stime, wall_s=wall_s, peak_mb=peak / MB)


def measure(commands: Sequence[Command], rounds: int) -> dict[str, Cost]:
    """Median cost of each command; the rounds alternate between the commands, so that a slow minute hits all alike."""
    os.chdir(ROOT)
    runs: dict[str, list[Cost]] = {command.name: [] for command in commands}
    with tempfile.TemporaryDirectory(prefix="cellplan-bench-") as folder:
        run = Path(folder) / "run"
        run_once(Command(name="solve", arguments=("-m", "cellplan", "solve", CELL, "--quiet", "-o", RUN)), run)
        for number in range(rounds):
            for command in commands:
                print(f"round {number + 1} of {rounds}: {command.name}", file=sys.stderr)
                runs[command.name].append(run_once(command, run))
    return {
        name: Cost(
            cpu_s=statistics.median(cost.cpu_s for cost in costs),
            wall_s=statistics.median(cost.wall_s for cost in costs),
            peak_mb=statistics.median(cost.peak_mb for cost in costs),
        )
        for name, costs in runs.items()
    }


def section(rounds: int) -> Section:
    """The benchmark as a section of the page."""
    commands = (BASELINE, *COMMANDS)
    costs = measure(commands, rounds)
    base = costs[BASELINE.name]
    rows = [
        (
            f"`{command.name}`" if command is not BASELINE else command.name,
            f"{cost.cpu_s:.2f} s ({cost.cpu_s / base.cpu_s:.1f})",
            f"{cost.wall_s:.2f} s ({cost.wall_s / base.wall_s:.1f})",
            f"{cost.peak_mb:.0f} MB ({cost.peak_mb / base.peak_mb:.1f})",
        )
        for command in commands
        for cost in [costs[command.name]]
    ]
    return Section(
        title="Whole commands",
        lines=[
            f"As a user waits for them, each in a process of its own, on `{CELL}`; medians of {rounds} runs, taken in "
            f"turns. In brackets: multiples of *{BASELINE.name}*, a Python that imports the big libraries and ends.",
            "",
            *table(("command", "CPU", "waiting", "peak memory"), rows),
        ],
        goals=[goal for command in COMMANDS for goal in goals(command, costs[command.name])],
    )


def goals(command: Command, cost: Cost) -> list[Goal]:
    """The goals of a command and whether they are met."""
    desired = [("s", cost.wall_s, command.goal_s), ("MB", cost.peak_mb, command.goal_mb)]
    return [
        Goal(
            text=f"`{command.name}`: at most {goal:g} {unit}", measured=f"{digits(value, 3)} {unit}", met=value <= goal
        )
        for unit, value, goal in desired
        if goal is not None
    ]


def main() -> None:
    """Measure and print."""
    options = benchmark_options(
        "Time whole commands of cellplan as child processes.", what="runs of each command", rounds=3
    )
    if options.json:
        costs = measure((BASELINE, *COMMANDS), options.rounds)
        print(json.dumps({name: asdict(cost) for name, cost in costs.items()}, indent=1))
        return
    print(section(options.rounds).text())


if __name__ == "__main__":
    main()
