"""Counts that say what work is done, the same on every machine: ``python benchmarks/counts.py``, ``--write`` to keep.

Seconds depend on the day; how many nodes a motion needs, or how often the collision engine is asked, does not.
`tests/test_counts.py` compares the counts of a few cells with those in counts.json and fails when one has grown.
"""

import argparse
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from cellplan import load_cell, solve

CELLS: Final = Path(__file__).resolve().parent.parent / "cells"
STORED: Final = Path(__file__).with_name("counts.json")
SLACK: Final = (
    0.1  # [-] share by which a count may grow null_space_projection: rounding differs a little between machines
)
SPARE: Final = 5  # [-] and this much besides, for counts near zero


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A cell on a clock that ticks slowly enough to be solved in a second or two.

    Attributes:
        name: The cell, without its ending.
        step_s: Step of the clock in [s] in place of the cell's own.
    """

    name: str
    step_s: float


CASES: Final = (
    Case(name="planar_pair", step_s=0.02),
    Case(name="turntable", step_s=0.01),
    Case(name="four_robots", step_s=0.01),
)


def counted(case: Case) -> dict[str, int]:
    """How much work it is to solve a cell, all its runs together."""
    cell = load_cell(CELLS / f"{case.name}.yaml")
    runs = solve(replace(cell, motion=replace(cell.motion, step=case.step_s))).runs
    reports = [run.report.clearance for run in runs]
    resolutions = [run.motion.resolution for run in runs if run.motion.resolution is not None]
    return {
        "nodes": sum(resolution.nodes for resolution in resolutions),
        "sweeps": sum(resolution.sweeps for resolution in resolutions),
        "systems solved": sum(resolution.solves for resolution in resolutions),
        "distance queries": sum(report.distance_queries for report in reports),
        "contact queries": sum(report.contact_queries for report in reports),
        "steps cut finer": sum(report.cut_steps for report in reports),
    }


def grown(case: Case, counts: Mapping[str, int]) -> list[str]:
    """One line on each count that is larger than it may be."""
    stored: dict[str, int] = json.loads(STORED.read_text(encoding="utf-8"))[case.name]
    most = {name: math.floor((1.0 + SLACK) * stored.get(name, 0)) + SPARE for name in counts}
    return [
        f"{case.name}: {name} grew from {stored.get(name, 0)} to {count}, at most {most[name]} expected; "
        "find out why, or keep the new count by: python benchmarks/counts.py --write"
        for name, count in counts.items()
        if count > most[name]
    ]


def main() -> None:
    """Count, print, and keep the counts if asked to."""
    parser = argparse.ArgumentParser(description="Count the work that it is to solve a few cells.")
    parser.add_argument("--write", action="store_true", help="keep the counts as those to compare with")
    options = parser.parse_args()
    result = {case.name: counted(case) for case in CASES}
    text = json.dumps(result, indent=2)
    print(text)
    if options.write:
        STORED.write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
