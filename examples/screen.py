"""Screen layouts: carry out one job with the robot's base in 32 places at once, then solve the best candidate."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from cellplan import Candidates, load_cell, screen, solve

CELL = Path(__file__).resolve().parent / "plate.yaml"

cell = load_cell(CELL)
start = np.concatenate([robot.start for robot in cell.robots])  # the tools need only be near their paths

offsets = np.random.default_rng(0).uniform(-0.5, 0.5, (32, 2))  # [m] of the right robot's base on the floor
left, right = cell.robots
layouts = []
for offset in offsets:
    X_WB = right.X_WB.copy()
    X_WB[:2, 3] += offset
    layouts.append(replace(cell, robots=(left, replace(right, X_WB=X_WB))))

result = screen(cell, Candidates.of(layouts, np.tile(start, (len(layouts), 1))))
best = int(np.argmax(np.where(result.is_feasible, result.margins.min(axis=1), -np.inf)))
print(f"{result.is_followed.sum()} of {len(layouts)} follow the path, {result.is_feasible.sum()} within all limits")
x, y = 1e3 * offsets[best]
print(f"best: base moved by ({x:.0f}, {y:.0f}) mm, smallest margin {np.rad2deg(result.margins[best].min()):.1f} deg")

robots = [replace(robot, start=result.start[best, cell.columns(robot.name)]) for robot in layouts[best].robots]
solution = solve(replace(cell, robots=tuple(robots)))  # collisions are checked here, not by the screening
print(f"solved and verified: {'passed' if solution.passed else 'failed'}")
