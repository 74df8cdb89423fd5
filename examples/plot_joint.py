"""Plot the positions of one joint over time, with its limits, from a solved cell."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

from cellplan import load_cell, solve

mpl.use("Agg")
from matplotlib import pyplot as plt

CELL = Path(__file__).resolve().parent / "plate.yaml"
PICTURE = Path("outputs/examples/joint.png")

cell = load_cell(CELL)
solution = solve(cell)
motion = solution.runs[0].motion
robot = solution.cell.robot("right")
joint = robot.model.joints[1]

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(motion.times, np.rad2deg(motion.q[:, solution.cell.columns("right")][:, 1]), label=joint.name)
axes.axhspan(*np.rad2deg([robot.model.lower[1], robot.model.upper[1]]), alpha=0.1, label="position range")
axes.set(xlabel="time [s]", ylabel="position [deg]", title=f"{cell.name}: robot {robot.name}")
axes.legend()
PICTURE.parent.mkdir(parents=True, exist_ok=True)
figure.savefig(PICTURE)
print(f"picture: {PICTURE}")
