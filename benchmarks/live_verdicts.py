"""Verdicts of the live cell beside those of ``solve``: ``python benchmarks/live_verdicts.py``.

Bases of shipped cells are dragged at random, in several changes each as a mouse does. What the session says once it has
settled is compared with a solve of the cell as it would be saved. Processor times are those of this process.
"""

import json
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from options import benchmark_options
from sections import Goal, Section, table

from cellplan import CellplanError, Session, edit, solve
from cellplan.model.report.report import Check

CELLS: Final = ("four_robots", "four_robots_initial", "two_robots", "fixed_part", "rail", "dual_arm")
FOLDER: Final = Path(__file__).resolve().parents[1] / "cells"
FAR_MM: Final = 120.0  # standard deviation of where a drag ends, from the given layout
TURN_DEG: Final = 8.0  # likewise of a turn about the vertical
CHANGES: Final = 6  # of one drag
SMALL_DEG: Final = 0.5  # by which a solve may fail that the live cell says to pass
SMALL_MM: Final = 1.0
QUICK_S: Final = 0.05  # [s] of processor time for one change of the four-robot cell
AGREED: Final = 0.99  # share of verdicts that are to be equal


@dataclass(frozen=True, slots=True, kw_only=True)
class Drag:
    """One drag."""

    cell: str
    robot: str
    live: str  # state that the session ends in
    solved: str  # passed, failed, or refused with the reason
    worst: str  # what fails worst; empty where nothing does
    is_agreed: bool
    is_small: bool  # whether what fails is within what may be overlooked
    change_s: float  # processor time of the median change
    settle_s: float  # processor time until the verdict
    piece_s: float  # processor time of the longest piece


def drags(name: str, rounds: int) -> Iterator[Drag]:
    """Random drags of one cell."""
    rng, session = np.random.default_rng([len(name), rounds]), edit(FOLDER / f"{name}.yaml")
    given = session.answer()["values"]
    robots = [address.split(".")[1] for address in given if address.endswith(".base.x_mm")]
    for _ in range(rounds):
        robot = str(rng.choice(robots))
        keys = [f"robots.{robot}.base.{key}" for key in ("x_mm", "y_mm", "yaw_deg")]
        now = session.answer()["values"]
        goal = [given[key] + by for key, by in zip(keys, rng.normal(size=3) * (FAR_MM, FAR_MM, TURN_DEG), strict=True)]
        times = []
        for share in np.linspace(0.0, 1.0, CHANGES + 1)[1:]:
            values = {key: round((1.0 - share) * now[key] + share * to, 3) for key, to in zip(keys, goal, strict=True)}
            begin = time.process_time()
            session.change(values)
            times.append(time.process_time() - begin)
        yield _compared(session, name, robot, statistics.median(times))
        if rng.random() < 0.5:
            session.do("reset")


def _compared(session: Session, name: str, robot: str, change_s: float) -> Drag:
    """The settled answer beside a solve."""
    answer, pieces = session.answer(), list[float]()
    while True:
        begin = time.process_time()
        more = session.settle()
        pieces.append(time.process_time() - begin)
        if more is None:
            break
        answer = more
    solved, failed = _solved(session)
    live_passes = answer["state"] == "planned"
    worst = max(failed, key=_excess, default=None)
    return Drag(
        cell=name,
        robot=robot,
        live=answer["state"],
        solved=solved,
        worst=answer["verdict"] if worst is None else worst.message,
        is_agreed=live_passes == (solved == "passed"),
        is_small=not live_passes or (solved != "refused" and all(_excess(check) <= 1.0 for check in failed)),
        change_s=change_s,
        settle_s=sum(pieces),
        piece_s=max(pieces),
    )


def _solved(session: Session) -> tuple[str, list[Check]]:
    """What ``solve`` says of the cell as it would be saved."""
    try:
        solution = solve(session.document.cell, is_reported=False)
    except CellplanError:
        return "refused", []
    return ("passed" if solution.passed else "failed"), [
        check for run in solution.runs for check in run.report.checks if not check.passed
    ]


def _excess(check: Check) -> float:
    """How far a check fails, 1 at what may be overlooked; a share of 1 % of the limit of anything else."""
    by = abs(check.value - check.limit)
    if check.unit in {"deg", "mm"}:
        return by / (SMALL_DEG if check.unit == "deg" else SMALL_MM)
    return 100.0 * by / abs(check.limit) if check.limit else float("inf")


def section(results: list[Drag], rounds: int) -> Section:
    """The comparison as a section of the page."""
    rows, agreed = [], sum(drag.is_agreed for drag in results)
    for name in CELLS:
        some = [drag for drag in results if drag.cell == name]
        passes, equal = sum(drag.solved == "passed" for drag in some), sum(drag.is_agreed for drag in some)
        change, settle, piece = (
            f"{1e3 * statistics.median(getattr(drag, key) for drag in some):.0f} ms"
            for key in ("change_s", "settle_s", "piece_s")
        )
        rows.append((name, str(len(some)), str(passes), str(equal), change, settle, piece))
    overlooked = [drag for drag in results if not drag.is_small]
    quick = statistics.median(drag.change_s for drag in results if drag.cell == CELLS[0])
    return Section(
        title="Verdicts of the live cell",
        lines=[
            f"{rounds} random drags of each cell. Medians of processor times on one thread.",
            "",
            *table(("cell", "drags", "solve passes", "equal", "change", "until settled", "longest piece"), rows),
        ],
        goals=[
            Goal(
                text="settled verdicts equal to those of solve",
                measured=f"{agreed} of {len(results)}",
                met=agreed >= AGREED * len(results),
            ),
            Goal(
                text=f"said to pass where solve fails by more than {SMALL_DEG:g} deg or {SMALL_MM:g} mm",
                measured=str(len(overlooked)),
                met=not overlooked,
            ),
            Goal(text="a change of the four-robot cell", measured=f"{1e3 * quick:.0f} ms", met=quick <= QUICK_S),
        ],
    )


def main() -> None:
    """Measure and print."""
    options = benchmark_options("Verdicts of the live cell beside solve.", what="drags of each cell", rounds=20)
    results: list[Drag] = []
    for name in CELLS:
        for drag in drags(name, options.rounds):
            results.append(drag)
            if not drag.is_agreed:
                print(f"live verdicts: {name}: {drag.live}, solve {drag.solved}: {drag.worst}", file=sys.stderr)
        print(f"live verdicts: {name}: {options.rounds} drags", file=sys.stderr)
    if options.json:
        records: list[Any] = [asdict(drag) for drag in results]
        print(json.dumps(records, indent=1, default=bool))
    else:
        print(section(results, options.rounds).text())


if __name__ == "__main__":
    main()
