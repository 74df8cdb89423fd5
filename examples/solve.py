"""Solve a cell, print the worst figures of its report and write the run folder."""

from pathlib import Path

import numpy as np

from cellplan import load_cell, solve, write_run

CELL = Path(__file__).resolve().parent / "plate.yaml"
FOLDER = Path("outputs/examples/solve")

cell = load_cell(CELL)
solution = solve(cell)
report = solution.runs[0].report

tightest = min(report.joints, key=lambda joint: joint.margin)
print(f"{tightest.robot} {tightest.joint}: {np.rad2deg(tightest.margin):.1f} deg from its position limit")
for task in report.accuracy:
    print(
        f"{task.task}: position error {1e3 * np.linalg.norm(task.position_error, axis=1).max():.2g} mm at the samples"
    )
for check in report.checks:
    if not check.passed:
        print(f"failed: {check.message}")

write_run(solution, FOLDER)
print(f"passed: {solution.passed}; report: {FOLDER / 'report.html'}")
