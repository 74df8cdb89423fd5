"""Verdicts of the live cell beside those of ``solve``: ``python benchmarks/live_verdicts.py``.

Bases of shipped cells, two programs among them, are dragged at random, in several changes each as a mouse does. What
the session says of the whole job once it has settled, of all blocks where there are several, is compared with a solve
of the cell as it would be saved; with --certify also what certifying it comes to. Processor times are those of this
process.
"""

import argparse
import json
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from sections import Goal, Section, table

from cellplan import CellplanError, Session, edit, solve
from cellplan.model.report.report import Check
from cellplan.session.works.certify import certify

CELLS: Final = ("four_robots", "four_robots_initial", "two_robots", "in_turn", "three_tasks_each", "gripper")
FOLDER: Final = Path(__file__).resolve().parents[1] / "cells"
FAR_MM: Final = 120.0  # standard deviation of where a drag ends, from the given layout
TURN_DEG: Final = 8.0  # likewise of a turn about the vertical
CHANGES: Final = 6  # of one drag
SMALL_DEG: Final = 0.5  # by which a solve may fail that the live cell says to pass
SMALL_MM: Final = 1.0
QUICK_S: Final = 0.05  # [s] of processor time for one change of the four-robot cell
PASSES: Final = {"planned", "certified"}  # states in which nothing is said to fail
AGREED: Final = 0.99  # share of verdicts that are to be equal


@dataclass(frozen=True, slots=True, kw_only=True)
class Drag:
    """One drag."""

    cell: str
    robot: str
    live: str  # state that the session ends in
    solved: str  # passed, failed or refused
    certified: str  # passed or failed by certifying it; empty where that was not asked
    worst: str  # what the session says, and what fails worst in a solve
    is_agreed: bool
    is_small: bool  # whether what fails is within what may be overlooked
    change_s: float  # processor time of the median change
    settle_s: float  # processor time until the verdict
    piece_s: float  # processor time of the longest piece
    options: str  # that give ``solve`` the same cell


def drags(name: str, rounds: int, seed: int = 0, *, is_certified: bool = False) -> Iterator[Drag]:
    """Random drags of one cell."""
    rng, session = np.random.default_rng([len(name), rounds, seed]), edit(FOLDER / f"{name}.yaml")
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
        drag = _compared(session, name, robot, statistics.median(times))
        yield replace(drag, certified=_certified(session)) if is_certified else drag
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
    solved, words, failed = _solved(session)
    live_passes = {answer["state"], *(block["state"] for block in answer["strip"])} <= PASSES
    said = next((it for it in answer["strip"] if it["state"] not in PASSES), {"name": "", "text": answer["verdict"]})
    return Drag(
        cell=name,
        robot=robot,
        live=answer["state"] if live_passes or answer["state"] not in PASSES else f"{said['name']}: {said['state']}",
        solved=solved,
        certified="",
        worst=f"{said['text']} / {words}",
        is_agreed=live_passes == (solved == "passed"),
        is_small=not live_passes or (solved != "refused" and all(_excess(check) <= 1.0 for check in failed)),
        change_s=change_s,
        settle_s=sum(pieces),
        piece_s=max(pieces),
        options=" ".join(session.document.history),
    )


def _solved(session: Session) -> tuple[str, str, list[Check]]:
    """What ``solve`` says of the cell as it would be saved, in short and in words, and the checks that fail."""
    try:
        solution = solve(session.document.cell, is_reported=False)
    except CellplanError as error:
        return "refused", str(error).splitlines()[0], []
    failed = [check for run in solution.runs for check in run.report.checks if not check.passed]
    words = max(failed, key=_excess).message if failed else ""
    return ("passed" if solution.passed else "failed"), words, failed


def _certified(session: Session) -> str:
    """What certifying says of it."""
    events = list[dict[str, Any]]()
    certify(session.document.cell, 0, send=events.append)
    return "passed" if events[-1]["passed"] else "failed"


def _excess(check: Check) -> float:
    """How far a check fails, 1 at what may be overlooked; a share of 1 % of the limit of anything else."""
    by = abs(check.value - check.limit)
    if check.unit in {"deg", "mm"}:
        return by / (SMALL_DEG if check.unit == "deg" else SMALL_MM)
    return 100.0 * by / abs(check.limit) if check.limit else float("inf")


def section(results: list[Drag]) -> Section:
    """The comparison as a section of the page."""
    rows, agreed = [], sum(drag.is_agreed for drag in results)
    for name in dict.fromkeys(drag.cell for drag in results):
        some = [drag for drag in results if drag.cell == name]
        passes, equal = sum(drag.solved == "passed" for drag in some), sum(drag.is_agreed for drag in some)
        change, settle, piece = (
            f"{1e3 * statistics.median(getattr(drag, key) for drag in some):.0f} ms"
            for key in ("change_s", "settle_s", "piece_s")
        )
        rows.append((name, str(len(some)), str(passes), str(equal), change, settle, piece))
    overlooked = [drag for drag in results if not drag.is_small]
    certified = [drag for drag in results if drag.certified]
    differ = sum((drag.certified == "passed") != (drag.solved == "passed") for drag in certified)
    quick = statistics.median(drag.change_s for drag in results if drag.cell == results[0].cell)
    return Section(
        title="Verdicts of the live cell",
        lines=[
            f"{len(results)} random drags. Medians of processor times on one thread.",
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
            Goal(
                text="verdicts of certify that are others than those of solve",
                measured=f"{differ} of {len(certified)}",
                met=not differ,
            ),
            Goal(text=f"a change of {results[0].cell}", measured=f"{1e3 * quick:.0f} ms", met=quick <= QUICK_S),
        ],
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cells", nargs="*", default=CELLS, help=f"names of shipped cells (default: {' '.join(CELLS)})")
    parser.add_argument("--rounds", type=int, default=20, help="drags of each cell (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="another one gives other drags (default: 0)")
    parser.add_argument("--certify", action="store_true", help="certify each cell, too")
    parser.add_argument("--json", action="store_true", help="print each drag as a line of JSON instead of the table")
    parser.add_argument("--of", nargs="+", type=Path, help="files of such lines, of which the table is printed")
    options = parser.parse_args()
    if options.of:
        lines = [line for path in options.of for line in path.read_text().splitlines()]
        print(section([Drag(**json.loads(line)) for line in lines]).text())
        return
    results: list[Drag] = []
    for name in options.cells:
        for drag in drags(name, options.rounds, options.seed, is_certified=options.certify):
            results.append(drag)
            if options.json:
                print(json.dumps(asdict(drag), default=bool), flush=True)
            if not drag.is_agreed:
                print(f"live verdicts: {name}: {drag.live}, solve {drag.solved}: {drag.worst}", file=sys.stderr)
    if not options.json:
        print(section(results).text())


if __name__ == "__main__":
    main()
