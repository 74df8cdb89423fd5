"""Eight arms on a part that a ninth robot carries: ``python benchmarks/eight_arms.py [--arms 8] [--seams 40]``.

The arms stand on a circle round the part, the robot that carries it takes one place of it. Every seam has to be kept
within 0.1 mm. Printed is a row for the program that ``cellplan assign`` certifies: the cycles of model and program, the
lower bound, and processor seconds. Exit status 1 where it fails a check.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml
from assign import TORCH, TORCH_HOLDER, seam

from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft

HALF: Final = (350.0, 250.0, 20.0)  # [mm] half sizes of the plate
RADIUS: Final = 1250.0  # [mm] of the circle on which the robots stand
POSITION: Final = 0.1  # [mm] tolerance of every seam
KINDS: Final = ("top", "edge", "edge", "side")


def generated_cell(arms: int, seams: int, seed: int) -> dict[str, Any]:
    """A cell as the values of its file."""
    rng = np.random.default_rng(seed)
    carrier = {
        "model": "kuka_kr16_2",
        "base": {"xyz_mm": [-1100, 0, 0]},
        "home_deg": [0, -90, 90, 0, 0, 0],
        "start_deg": [0, -90, 90, 0, 0, 0],
    }
    robots: dict[str, Any] = {"carrier": carrier}
    for number in range(arms):
        angle = -180.0 + 360.0 * (number + 1) / (arms + 1)
        x, y = np.round(RADIUS * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))]), 1).tolist()
        robots[f"arm_{number + 1}"] = {
            "model": "kuka_kr6",
            "base": {"xyz_mm": [x, y, 500], "rpy_deg": [0, 0, round(angle - 180.0, 3)]},
            "pedestal": {"cylinder": {"radius_mm": 250}},
            "tool": {"rod": TORCH | {"holder": dict(TORCH_HOLDER)}},
            "start_deg": "auto",
            "home_deg": [0, -40, 60, 0, 60, 0],
        }
    tasks = {
        f"s{number + 1:02d}": seam(KINDS[number % 4], number // 4 % 4, HALF, rng)
        | {"tolerance": {"position_mm": POSITION, "orientation_deg": 0.1}}
        for number in range(seams)
    }
    return {
        "cellplan": 1,
        "name": f"carried-{arms}-{seams}-{seed}",
        "robots": robots,
        "part": {
            "geometry": {"box": {"size_mm": [2 * it for it in HALF]}},
            "held_by": [{"robot": "carrier", "at": {"xyz_mm": [0, 0, -HALF[2]]}}],
        },
        "tasks": tasks,
        "environment": {"floor": {"plane": {"z_mm": 0}}},
        "motion": {"mode": "semi_coordinated", "step_s": 0.02},
        "program": {},
        "assign": {
            "stations": {
                "x_mm": [0, 0, 1],
                "y_mm": [0, 0, 1],
                "z_mm": [1200, 1200, 1],
                "roll_deg": [-60, 60, 30],
                "pitch_deg": [-60, 60, 30],
                "yaw_deg": [-90, 90, 45],
            }
        },
        "checks": {"clearance_mm": 5},
    }


def main() -> int:
    """Assign the cell and print what comes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", type=int, default=8)
    parser.add_argument("--seams", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--effort", type=int, default=2)
    parser.add_argument("--write", type=Path, help="only write the cell to this file")
    options = parser.parse_args()
    cell = generated_cell(options.arms, options.seams, options.seed)
    text = yaml.safe_dump(cell, sort_keys=False)
    if options.write is not None:
        options.write.write_text(text)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cell.yaml"
        file.write_text(text)
        begin = time.process_time()
        result = assign(AssignmentDraft.load(file), effort=options.effort)
        seconds = time.process_time() - begin
    bound = "-" if result.bound is None else f"{result.bound:.2f} s"
    print("| arms, seams | greedy | model | certified | bound | CPU |")
    print("|---|---|---|---|---|---|")
    cycles = f"{result.greedy:.2f} s | {result.model_cycle:.2f} s | {result.cycle:.2f} s | {bound}"
    verdict = "" if result.passed else " FAILED"
    print(f"| {options.arms}, {options.seams} | {cycles} | {seconds:.0f} s |{verdict}")
    return int(not result.passed)


if __name__ == "__main__":
    sys.exit(main())
