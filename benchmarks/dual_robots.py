"""Greatest feeds of two robots with one part: ``DUAL_ROBOTS=FOLDER python benchmarks/dual_robots.py``.

Curves, robots and poses are those of the published work on dual robots, of the repository
rpiRobotics/ARM-21-02-F-19-Robot-Motion-Program. They are not part of this project: the folder has
``curve_1/cell.yaml`` and ``curve_2/cell.yaml``, each with the robots ``holder`` and ``gun`` and the task ``curve``,
whose path goes on straight at both ends. Without it the figures that were measured last are printed, with their date.
"""

import os
import tempfile
from pathlib import Path
from typing import Final

from options import benchmark_options

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve
from cellplan.runs.overrides import with_overrides

STRAIGHT_MM: Final = {"curve_1": 154, "curve_2": 158}  # length of path at both ends on which the tool comes to its feed
TRIALS: Final = 24
WITH_BASE: Final = (
    "holder.base={x_mm: [500, 3500], y_mm: [-1500, 1500], yaw_deg: [-180, 180]}",
    "holder.start_deg",
    "holder.weights",
    "gun.weights",
)
BASE_TOO: Final = "base, start and weights free"
LAST: Final = {
    "base and start as given": ("549", "999"),
    "weights and path free, base and start as given": ("990", "2267"),
    "start and weights free": ("941", "2934"),
    BASE_TOO: ("943", "3036"),
}  # [mm/s]
WHEN: Final = "30 November 2026"
TEXT: Final = """## Two robots, one part: the greatest feed

A robot with a gun works along a curve of a part that a smaller one holds, as published in arXiv 2404.06687 and
2506.03982. Limits are the minimum of the published tables of accelerations, margins 1°;
`process: {{feed_mm_s: greatest, ramp_mm: …}}` has its ramps on the straight ends of the paths, so the speed is constant
on the curve itself. The inputs are not part of the project. {how}

| greatest constant speed, mm/s | curve 1 | curve 2 |
|---|---|---|
| published, controller in simulation | 551 to 602 | 1705 to 1807 |
| published, real robots | 452 | 1405 |
| the published joint path under its own limits | 689 | 2062 |
{rows}

Feeds of cellplan are those of a verified plan, an upper bound of what a controller reaches.
"""


def main() -> None:
    """Measure where the inputs are there, and print the section."""
    benchmark_options(__doc__ or "", what="is run once whatever is said", rounds=1)
    folder = os.environ.get("DUAL_ROBOTS")
    if folder is None:
        rows, how = LAST, f"Measured on\n{WHEN}, 24 trials a search, 267 s of processors in all."
    else:
        begin = used()
        columns = [measured(Path(folder) / name / "cell.yaml", length) for name, length in STRAIGHT_MM.items()]
        rows = {name: (columns[0][name], columns[1][name]) for name in LAST}
        how = f"{TRIALS} trials\na search, {used() - begin:.0f} s of processors in all."
    lines = [f"| cellplan, {name} | {one} | {other} |" for name, (one, other) in rows.items()]
    print(TEXT.format(how=how, rows="\n".join(lines)))


def used() -> float:
    """Processor time in [s] of this process and of those that have ended for it."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def measured(file: Path, length: int) -> dict[str, str]:
    """Greatest feeds of one cell in [mm/s], by what is free."""
    settings = (
        f"tasks.curve.process={{feed_mm_s: greatest, ramp_mm: {length}}}",
        "tasks.curve.duration_s=null",
        "tasks.curve.time_law=null",
        "tasks.curve.standoff_mm=[0, 5000]",
    )
    (run,) = solve(with_overrides(load_cell(file), settings)).runs
    feeds = {"base and start as given": f"{1e3 * run.report.greatest_feeds[0].feed:.0f}"}
    searched = (
        ("weights and path free, base and start as given", {"free": ("weights", "path")}),
        ("start and weights free", {"free": ("start", "weights")}),
        (BASE_TOO, {"vary": WITH_BASE}),
    )
    for name, words in searched:
        request = LayoutRequest(cell=file, settings=settings, margin=1.0, **words)  # type: ignore[arg-type]
        with tempfile.TemporaryDirectory() as folder:
            record = search_layout(request, Path(folder) / "study", stop=Stop(trials=TRIALS)).record
        (feed,) = [remark for remark in record["remarks"] if "greatest feed" in remark] or ["nan mm/s"]
        feeds[name] = f"{float(feed.partition(' mm/s')[0].rpartition(' ')[2]):.0f}"
    return feeds


if __name__ == "__main__":
    main()
