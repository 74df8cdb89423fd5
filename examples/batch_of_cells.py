"""Solve a batch of cells and print a line for each: what passed, what failed, and what could not be solved."""

from pathlib import Path

import numpy as np

from cellplan import CellplanError, load_cell, solve

ROOT = Path(__file__).resolve().parent.parent
BATCH = ["examples/plate.yaml", "cells/papers/nicolato_line.yaml", "examples/missing.yaml"]

for name in BATCH:
    try:
        cell = load_cell(ROOT / name)
        solution = solve(cell)
    except CellplanError as error:  # bad input, or no solution: one line
        print(f"{name}: {error}")
        continue
    for run in solution.runs:
        failed = [check.message for check in run.report.checks if not check.passed]
        margin = min(joint.margin for joint in run.report.joints)
        verdict = "passed" if not failed else f"failed: {failed[0]}"
        print(f"{name}: {verdict}; smallest joint margin {np.rad2deg(margin):.1f} deg")
