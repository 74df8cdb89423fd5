"""How long heavy work of a live cell takes: ``python benchmarks/live_work.py [CELL …]``, in turns with ``solve``.

Certificates by a warm process, once after the session has begun and then again, beside ``cellplan solve`` of the same
cell with the same priority; then the time to the first trial of a search and to the first tiles of a map. All times are
those of the clock; the ratio is the median of neighbouring runs.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.guard.event_process import NICENESS
from cellplan.session.document import Document
from cellplan.session.work import Works
from cellplan.session.works.request import request_of

ROOT = Path(__file__).resolve().parent.parent
CELLS = [ROOT / "cells" / f"{name}.yaml" for name in ("four_robots", "four_robots_initial", "two_robots", "in_turn")]
ROUNDS = 5


def clock(works: Works, is_wanted: Callable[[dict[str, Any]], bool], kind: str, *arguments: object) -> float | str:
    """Time in [s] from the start of some work to an event; or why it does not come."""
    begun = time.perf_counter()
    works.start(kind, *arguments)
    while works.running:
        for event in works.poll():
            if is_wanted(event):
                return time.perf_counter() - begun
            if event["event"] == "failed":
                return str(event["text"])
        time.sleep(0.002)
    return "nothing"


def solved(path: Path, folder: str) -> float:
    """Time in [s] of the command."""
    begun = time.perf_counter()
    command = [sys.executable, "-m", "cellplan", "solve", str(path), "--quiet", "-o", folder]
    subprocess.run(command, capture_output=True, check=False, preexec_fn=lambda: os.nice(NICENESS))
    return time.perf_counter() - begun


def row(path: Path) -> str:
    """One cell as a row of the table."""
    document, works = Document(path), Works(load_cell(path))
    try:
        with tempfile.TemporaryDirectory() as folder:
            named = [lambda event, name=name: event["event"] == name for name in ("verdict", "trial", "tiles")]
            first = clock(works, named[0], "certify", document.cell, 0)
            pairs = [
                (clock(works, named[0], "certify", document.cell, turn), solved(path, f"{folder}/run"))
                for turn in range(ROUNDS)
            ]
        certify, solve = (statistics.median(times) for times in zip(*pairs, strict=True))
        ratio = statistics.median(ours / theirs for ours, theirs in pairs)
        robots = [task.robot for task in document.cell.tasks if task.robot not in document.cell.positioners]
        tiles = clock(works, named[2], "map", document.cell, robots[0])
        trial = clock(works, named[1], "improve", *request_of(document))
    finally:
        works.close()
    figures = [first, certify, solve, ratio, trial, tiles]
    return f"| {path.stem} | {' | '.join(f'{it:.2f}' if isinstance(it, float) else it for it in figures)} |"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cells", nargs="*", type=Path, default=CELLS)
    print("| cell | first certificate, s | certificate, s | solve, s | ratio | first trial, s | first tiles, s |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    for path in parser.parse_args().cells:
        try:
            print(row(path), flush=True)
        except InputError as error:
            sys.exit(f"benchmark: {error}")


if __name__ == "__main__":
    main()
