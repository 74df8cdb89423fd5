"""Shortest cycles with bases and tools as they are: ``python benchmarks/free_motion.py CELL --trials 8``.

For each set of what is free, with and without limits of acceleration: the certified cycle of the cell that the search
writes (margins of 15 deg, 10 mm of clearance, every check of ``solve`` passed), trials and processor time.
"""

import argparse
import tempfile
import time
from pathlib import Path
from typing import Final

from sections import Section, table

from cellplan import LayoutRequest, Stop, load_cell, search_layout
from cellplan.search.programs.objective import Timing

CELL: Final = Path(__file__).resolve().parent.parent / "cells" / "four_robots.yaml"
FREE: Final = (("start",), ("weights",), ("start", "weights"), ("path",), ("start", "weights", "path"))
RULES: Final = {
    "none": "unlimited",
    "stated": "{full_speed_in_s: [0.25, 0.25, 0.25, 0.15, 0.15, 0.15]}",
}  # limits of acceleration: no limit, and full speed in 0.25 s (axes 1 to 3) and 0.15 s (axes 4 to 6)
MARGIN: Final = 15.0  # [deg]
CLEARANCE: Final = 10.0  # [mm]


def measured(cell: Path, free: tuple[str, ...], limits: str, timing: Timing, trials: int) -> list[str]:
    """One line of the table."""
    robots = [robot.name for robot in load_cell(cell).robots]
    request = LayoutRequest(
        cell=cell,
        free=free,
        timing=timing,
        margin=MARGIN,
        clearance=CLEARANCE,
        settings=tuple(f"robots.{name}.acceleration={RULES[limits]}" for name in robots),
    )
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        record = search_layout(request, Path(folder) / "study", stop=Stop(trials=trials)).record
    spent = time.process_time() - begin
    best = record["best"]
    keys = ("cycle_s", "margin_deg", "clearance_mm")
    figures = ["none"] * 3 if best is None else [f"{best[key]:.4g}" for key in keys]  # type: ignore[literal-required]
    return [", ".join(free), limits, str(timing), *figures, str(trials), f"{spent:.0f}"]


def section(cell: Path, trials: int, timings: tuple[Timing, ...]) -> Section:
    """The whole table."""
    head = ("free", "accelerations", "timing", "certified, s", "margin, deg", "clearance, mm", "trials", "processor, s")
    rows = [measured(cell, free, limits, timing, trials) for limits in RULES for timing in timings for free in FREE]
    text = f"The cell {cell.name}, bases and tools as they are; margins of {MARGIN:g} deg, {CLEARANCE:g} mm apart."
    return Section(title="Free motion", lines=[text, "", *table(head, rows)])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cell", type=Path, nargs="?", default=CELL)
    parser.add_argument("--trials", type=int, default=4)
    parser.add_argument("--retimed", action="store_true", help="with the best common speed as well")
    chosen = parser.parse_args()
    timings = (Timing.LAWS, Timing.RETIMED) if chosen.retimed else (Timing.LAWS,)
    print(section(chosen.cell, chosen.trials, timings).text())


if __name__ == "__main__":
    main()
