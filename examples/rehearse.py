"""Rehearse a program on a real cell: state its errors, execute, correct from measurements, compare before and after."""

from pathlib import Path

import numpy as np

from cellplan import load_cell, load_errors, rehearse

CELL = Path(__file__).resolve().parent / "plate.yaml"
ERRORS = Path("outputs/examples/errors.yaml")

ERRORS.parent.mkdir(parents=True, exist_ok=True)
ERRORS.write_text("""\
cellplan_errors: 1
robots:
  left: {joint_offsets_deg: {B: 0.05}}
  right: {base: {xyz_mm: [0.5, -0.3, 0]}}
""")

cell = load_cell(CELL)
rehearsal = rehearse(cell, load_errors(ERRORS, cell), feedback=True)

(trial,) = rehearsal.runs[0].trials
for name, accuracy in [("as planned", trial.before), ("corrected", trial.final)]:
    largest = max(np.linalg.norm(task.position_error, axis=1).max() for task in accuracy)
    print(f"{name}: largest position error of the real tool on the real part {1e3 * largest:.4f} mm")
