"""Greatest feeds of two robots with one part: ``DUAL_ROBOTS=FOLDER python benchmarks/dual_robots.py``.

Curves, robots and poses are those of the published work on dual robots, of the repository
rpiRobotics/ARM-21-02-F-19-Robot-Motion-Program. They are not part of this project: the folder has
``curve_1_table_minimum/cell.yaml``, ``curve_2_table_minimum/cell.yaml`` and ``curve_2_raw_normals/cell.yaml``, the last
one with the normals as they are published, each with the robots ``holder`` and ``gun``, the task ``curve`` and its
``curve.csv``, whose path goes on straight at both ends. Without it the figures that were measured last are printed,
with their date. Speeds and deviations are judged by ``dual_kinematics.py``.
"""

import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dual_kinematics import Followed, followed
from options import benchmark_options

from cellplan import LayoutRequest, Solution, Stop, load_cell, search_layout, solve
from cellplan.runs.overrides import with_overrides

STRAIGHT_MM: Final = {"curve_1": 154, "curve_2": 158}  # length of path at both ends on which the tool comes to its feed
TRIALS: Final = 24
WITH_BASE_TRIALS: Final = 72
SETTINGS: Final = ("tasks.curve.duration_s=null", "tasks.curve.time_law=null", "tasks.curve.standoff_mm=[0, 5000]")
START: Final = ("start", "weights")
WITH_BASE: Final = (
    "holder.base={x_mm: [500, 3500], y_mm: [-1500, 1500], yaw_deg: [-180, 180]}",
    "holder.start_deg",
    "gun.start_deg",
    "holder.weights",
    "gun.weights",
)
TUBE: Final = ("tasks.curve.path.smooth={position_mm: 0.1, direction_deg: 0.3}",)
WIDE_TUBE: Final = ("tasks.curve.path.smooth={direction_deg: 2.9}",)
AS_GIVEN: Final = "base and start as given"
SMOOTHED: Final = ", smoothed within 0.1 mm and 0.3°"
SEARCHES: Final[dict[str, tuple[dict[str, tuple[str, ...]], tuple[str, ...]]]] = {
    "weights and path free, base and start as given": ({"free": ("weights", "path")}, ()),
    "start and weights free": ({"free": START}, ()),
    "base, start and weights free": ({"vary": WITH_BASE}, ()),
    f"start and weights free{SMOOTHED}": ({"free": START}, TUBE),
}
LAST: Final = {
    AS_GIVEN: ("549 (gun J1)", "999 (gun J1)"),
    f"{AS_GIVEN}, normals as published": ("–", "762 (gun J1)"),
    f"{AS_GIVEN}, normals as published, smoothed within 2.9°": ("–", "1153 (gun J1)"),
    "weights and path free, base and start as given": ("990", "2267"),
    "start and weights free": ("949 (gun J1)", "3054 (gun J1)"),
    "base, start and weights free": ("949 (gun J3)", "3103 (gun J4)"),
    f"start and weights free{SMOOTHED}": ("949 (holder J5)", "3204 (gun J1)"),
}  # [mm/s] and what binds
WHEN: Final = "30 November 2026"
LAST_HOW: Final = (
    f"Measured on\n{WHEN}, {TRIALS} trials a search, {WITH_BASE_TRIALS} with the base of curve 1 free, with start and "
    "weights\nfree at most 105 s of processors each."
)
TEXT: Final = """## Two robots, one part: the greatest feed

A robot with a gun works along a curve of a part that a smaller one holds, as published in arXiv 2404.06687 and
2506.03982. Limits are the minimum of the published tables of accelerations, margins 1°;
`process: {{feed_mm_s: greatest, ramp_mm: …}}` has its ramps on the straight ends of the paths, so the speed is constant
on the curve itself. The inputs are not part of the project. {how}

| greatest constant speed, mm/s, and the joint whose acceleration binds | curve 1 | curve 2 |
|---|---|---|
| published, controller in simulation | 551 to 602 | 1705 to 1807 |
| published, real robots | 452 | 1405 |
| the published joint path under its own limits | 689 | 2062 |
{rows}

Normals of curve 2 are smoothed by hand by at most 0.33° unless they are *as published*. Feeds of cellplan are those of
a verified plan, an upper bound of what a controller reaches.

{judged}
"""
JUDGED: Final = """By other kinematics, products of exponentials of the published joint screws, {which}: on the curve
the speed of the tool is within {speed:.1g} % of the feed, rows are at most {off:.3f} mm and {turned:.2f}° from the
points and axes of the files, with smoothing {tube:.3f} mm and {tube_turned:.2f}°. No bound is stated of what other
starts, weights or bases allow."""
LAST_JUDGED: Final = JUDGED.format(
    which="all rows but that with a free path", speed=0.0006, off=0.022, turned=0.02, tube=0.102, tube_turned=2.90
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The greatest feed of one program."""

    feed: float  # in [mm/s]
    binds: str  # joint, and the limit unless it is its acceleration
    has_tube: bool  # whether points or axes were smoothed
    by_other: Followed  # what other kinematics say
    seconds: float  # processor time

    @property
    def text(self) -> str:
        """For the table."""
        return f"{self.feed:.0f} ({self.binds})"


def main() -> None:
    """Measure where the inputs are there, and print the section."""
    benchmark_options(__doc__ or "", what="is run once whatever is said", rounds=1)
    folder = os.environ.get("DUAL_ROBOTS")
    if folder is None:
        rows, how, judged = LAST, LAST_HOW, LAST_JUDGED
    else:
        columns = {name: dict(answers(Path(folder), name)) for name in STRAIGHT_MM}
        every = [answer for column in columns.values() for answer in column.values()]
        names = dict.fromkeys(name for column in columns.values() for name in column)
        rows = {
            name: tuple(column[name].text if name in column else "–" for column in columns.values())
            for name in sorted(names, key=lambda name: (not name.startswith(AS_GIVEN), [*names].index(name)))
        }
        most, total = max(it.seconds for it in every), sum(it.seconds for it in every)
        how = f"{TRIALS} trials\na search, {WITH_BASE_TRIALS} with the base, at most {most:.0f} s of processors each, "
        how += f"{total:.0f} s in all."
        judged = judgement(every)
    lines = [f"| cellplan, {name} | {' | '.join(cells)} |" for name, cells in rows.items()]
    print(TEXT.format(how=how, rows="\n".join(lines), judged=judged))


def used() -> float:
    """Processor time in [s] of this process and of those that have ended for it."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def answers(folder: Path, curve: str) -> Iterator[tuple[str, Answer]]:
    """Greatest feeds along one curve, by what is free."""
    settings = (*SETTINGS, f"tasks.curve.process={{feed_mm_s: greatest, ramp_mm: {STRAIGHT_MM[curve]}}}")
    file, raw = (folder / f"{curve}_{kind}" / "cell.yaml" for kind in ("table_minimum", "raw_normals"))
    yield AS_GIVEN, as_given(file, settings)
    if raw.exists():
        yield f"{AS_GIVEN}, normals as published", as_given(raw, settings)
        yield f"{AS_GIVEN}, normals as published, smoothed within 2.9°", as_given(raw, (*settings, *WIDE_TUBE))
    for name, (words, more) in SEARCHES.items():
        begin = used()
        request = LayoutRequest(cell=file, settings=(*settings, *more), margin=1.0, **words)  # type: ignore[arg-type]
        with tempfile.TemporaryDirectory() as study:
            best = search_layout(
                request, Path(study) / "study", stop=Stop(trials=WITH_BASE_TRIALS if "vary" in words else TRIALS)
            ).best
        if best is not None and best.program is not None:
            yield name, answer(best.program.solution, file, used() - begin)


def as_given(file: Path, settings: tuple[str, ...]) -> Answer:
    """The greatest feed of a cell as it is."""
    begin = used()
    solution = solve(with_overrides(load_cell(file), settings))
    if not solution.passed:
        raise SystemExit(f"{file}: a check failed")
    return answer(solution, file, used() - begin)


def answer(solution: Solution, file: Path, seconds: float) -> Answer:
    """What a program comes to."""
    (run,) = solution.runs
    (feed,) = run.report.greatest_feeds
    straight = STRAIGHT_MM[file.parent.name[: len("curve_1")]]
    return Answer(
        feed=1e3 * feed.feed,
        binds=feed.binding if feed.kind == "acceleration" else f"{feed.binding}, {feed.kind}",
        has_tube=getattr(solution.cell.tasks[0].path, "smoothing", None) is not None,
        by_other=followed(solution.cell, run.motion.times, run.motion.q, file.parent / "curve.csv", straight),
        seconds=seconds,
    )


def judgement(every: list[Answer]) -> str:
    """What other kinematics say of all programs."""
    plain, tubes = ([it.by_other for it in every if it.has_tube == has_tube] for has_tube in (False, True))
    off = [max(abs(speed / it.feed - 1.0) for speed in (it.by_other.slowest, it.by_other.fastest)) for it in every]
    return JUDGED.format(
        which="all rows of cellplan",
        speed=100.0 * max(off),
        off=max(it.off for it in plain),
        turned=max(it.turned for it in plain),
        tube=max(it.off for it in tubes),
        tube_turned=max(it.turned for it in tubes),
    )


if __name__ == "__main__":
    main()
