"""Shortest cycles with bases and tools as they are: ``python benchmarks/free_motion.py CELL --trials 8``.

For each set of what is free, with and without limits of acceleration: the certified cycle of the cell that the search
writes (margins of 15 deg, 10 mm of clearance, no limit of jerk, every check of ``solve`` passed), trials, and the
processor time of the finish; trials run in a process of their own. ``--layout`` adds bases and tools.
"""

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from sections import Section, table

from cellplan import LayoutRequest, Stop, load_cell, search_layout
from cellplan.search.programs.objective import CycleTiming

CELL: Final = Path(__file__).resolve().parent.parent / "cells" / "four_robots.yaml"
FREE: Final = (("start",), ("weights",), ("start", "weights"), ("path",), ("start", "weights", "path"))
RULES: Final = {
    "none": "unlimited",
    "stated": "{full_speed_in_s: [0.25, 0.25, 0.25, 0.15, 0.15, 0.15]}",
}  # limits of acceleration: no limit, and full speed in 0.25 s (axes 1 to 3) and 0.15 s (axes 4 to 6)
MARGIN: Final = 15.0  # [deg]
CLEARANCE: Final = 10.0  # [mm]
PLACE: Final = {"x_mm": [-1500, 4500], "y_mm": [-3000, 3500], "z_mm": [0, 600], "yaw_deg": [-180, 180]}
TOOL: Final = {"length_mm": [100, 250], "tilt_deg": [0, 60], "roll_deg": [-180, 180]}
THIN: Final = {"radius_mm": 1, "stick_out_mm": 90}  # of a rod in place of a tool without bodies


def request_for(cell: Path, limits: str, timing: CycleTiming, free: tuple[str, ...]) -> LayoutRequest:
    """A search with bases and tools as they are."""
    rules = [f"robots.{robot.name}.acceleration={RULES[limits]}" for robot in load_cell(cell).robots]
    return LayoutRequest(
        cell=cell,
        free=free,
        timing=timing,
        margin=MARGIN,
        clearance=CLEARANCE,
        settings=(*rules, "motion.jerk_build_up_s=unlimited"),
    )


def together(cell: Path) -> LayoutRequest:
    """A search of bases, tools and the path of the positioner; tools without bodies become thin rods."""
    given, request = load_cell(cell), request_for(cell, "none", CycleTiming.LAWS, ())
    settings, vary = list(request.settings), [f"{given.positioners[0]}.path"]
    for name in dict.fromkeys(task.robot for task in given.tasks):
        tool, tip = given.robot(name).tool, given.robot(name).tool.X_FT
        vary.append(f"{name}.base={json.dumps(PLACE)}")
        if tool.rod is not None or not tool.bodies:
            vary.append(f"{name}.tool={json.dumps(TOOL)}")
        if tool.rod is None and not tool.bodies:
            shape = {
                "length_mm": round(1000.0 * float(np.linalg.norm(tip[:3, 3])), 6),
                "tilt_deg": round(float(np.degrees(np.arccos(np.clip(tip[2, 2], -1.0, 1.0)))), 6),
                "roll_deg": round(float(np.degrees(np.arctan2(-tip[0, 1], tip[1, 1]))), 6),
            }
            settings.append(f"robots.{name}.tool={json.dumps({'rod': {**shape, **THIN}})}")
    return replace(request, vary=tuple(vary), settings=tuple(settings))


def measured(request: LayoutRequest, words: str, limits: str, trials: int) -> list[str]:
    """One line of the table."""
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        record = search_layout(request, Path(folder) / "study", stop=Stop(trials=trials)).record
    spent = time.process_time() - begin
    best = record["best"]
    keys = ("cycle_s", "margin_deg", "clearance_mm")
    figures = ["none"] * 3 if best is None else [f"{best[key]:.4g}" for key in keys]  # type: ignore[literal-required]
    return [words, limits, str(request.timing), *figures, str(trials), f"{spent:.0f}"]


def section(cell: Path, trials: int, timings: tuple[CycleTiming, ...], *, with_layout: bool) -> Section:
    """The whole table."""
    head = ("free", "accelerations", "timing", "certified, s", "margin, deg", "clearance, mm", "trials", "finish, s")
    rows = [
        measured(request_for(cell, limits, timing, free), ", ".join(free), limits, trials)
        for limits in RULES
        for timing in timings
        for free in FREE
    ]
    if with_layout:
        rows.append(measured(together(cell), "bases, tools, path", "none", trials))
    text = f"The cell {cell.name}, bases and tools as they are; margins of {MARGIN:g} deg, {CLEARANCE:g} mm apart."
    return Section(title="Free motion", lines=[text, "", *table(head, rows)])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cell", type=Path, nargs="?", default=CELL)
    parser.add_argument("--trials", type=int, default=4)
    parser.add_argument("--retimed", action="store_true", help="with the best common speed as well")
    parser.add_argument("--layout", action="store_true", help="bases, tools and path together as well")
    chosen = parser.parse_args()
    timings = (CycleTiming.LAWS, CycleTiming.RETIMED) if chosen.retimed else (CycleTiming.LAWS,)
    print(section(chosen.cell, chosen.trials, timings, with_layout=chosen.layout).text())


if __name__ == "__main__":
    main()
