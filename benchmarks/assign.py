"""Assignments of generated cells: ``python benchmarks/assign.py --cells 8:2:1 12:3:3 20:3:0``.

Each cell, SEAMS:ARMS:SEED, is a plate on a table that tilts and turns, with seams on its top, along its edges and on
its sides, and arms round it. Printed are the cycles of the greedy schedule, of the model and of the certified
program, the lower bound, and processor seconds. Exit status 1 where a program fails a check.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft

HALF: Final = (450.0, 300.0, 40.0)  # [mm] half sizes of the plate
EDGE: Final = 20.0  # [mm] that seams stay away from corners
LENGTHS: Final = (60.0, 80.0, 100.0, 120.0, 140.0, 160.0)  # [mm]
BASES: Final = {
    "west": [-1350, 0, 0],
    "east": [1350, 0, 180],
    "north": [0, 1350, -90],
    "south": [0, -1450, 90],
}  # x and y in [mm], yaw in [deg]
TORCH: Final = {
    "length_mm": 260,
    "tilt_deg": 40,
    "roll_deg": 180,
    "radius_mm": 10,
    "stick_out_mm": 12,
}
TORCH_HOLDER: Final = {"radius_mm": 35, "length_mm": 60}
KINDS: Final = ("top", "top", "edge", "side")


def seam(kind: str, side: int, rng: np.random.Generator) -> dict[str, Any]:
    """One seam: on the top, along an upper edge at 45 deg, or on a side."""
    length, along = float(rng.choice(LENGTHS)), side % 2
    low, high = -HALF[along] + EDGE, HALF[along] - EDGE - length
    begin = float(np.round(rng.uniform(low, high), 1))
    across = 1 - along
    sign = 1.0 if side < 2 else -1.0
    if kind == "top":
        place = float(np.round(rng.uniform(-HALF[across] + EDGE, HALF[across] - EDGE), 1))
        height, axis = HALF[2], [0.0, 0.0, -1.0]
    else:
        place, height, axis = sign * HALF[across], HALF[2] if kind == "edge" else 0.0, [0.0, 0.0, 0.0]
        axis[across], axis[2] = -sign, -1.0 if kind == "edge" else 0.0
    points = []
    for at in (begin, begin + length):
        point = [0.0, 0.0, height]
        point[along], point[across] = at, place
        points.append(point)
    return {
        "robot": "any",
        "path": {"polyline": {"points_mm": points}},
        "tool_axis": axis,
        "tool_x": "+x" if along == 0 else "+y",
        "torch": {"within_deg": 50},
        "approach_mm": 80,
        "retract_mm": 80,
        "approach_s": 0.6,
        "retract_s": 0.6,
        "process": {"feed_mm_s": 20, "on_delay_s": 0.2, "off_delay_s": 0.2, "ramp_s": 0.1},
        "tolerance": {"position_mm": 0.2, "orientation_deg": 0.1},
    }


def generated_cell(seams: int, arms: int, seed: int) -> dict[str, Any]:
    """A cell as the values of its file."""
    rng = np.random.default_rng(seed)
    robots: dict[str, Any] = {
        "table": {"model": "motopos_d500", "base": {"xyz_mm": [0, 0, 450]}, "start_deg": [0, 0]},
    }
    for name, (x, y, yaw) in list(BASES.items())[:arms]:
        robots[name] = {
            "model": "kuka_kr6",
            "base": {"xyz_mm": [x, y, 500], "rpy_deg": [0, 0, yaw]},
            "pedestal": {"cylinder": {"radius_mm": 250}},
            "tool": {"rod": TORCH | {"holder": dict(TORCH_HOLDER)}},
            "start_deg": "auto",
            "home_deg": [0, -40, 60, 0, 60, 0],
        }
    kinds = [KINDS[place % len(KINDS)] for place in range(seams)]
    order = rng.permutation(seams).tolist()
    return {
        "cellplan": 1,
        "name": f"plate-{seams}-{arms}-{seed}",
        "robots": robots,
        "part": {
            "geometry": {"box": {"size_mm": [2 * half for half in HALF]}},
            "held_by": [{"robot": "table", "at": {"xyz_mm": [0, 0, -60]}}],
        },
        "tasks": {f"s{number + 1:02d}": seam(kinds[place], number % 4, rng) for number, place in enumerate(order)},
        "environment": {
            "floor": {"plane": {"z_mm": 0}},
            "plinth": {"box": {"size_mm": [520, 900, 448]}, "at": {"xyz_mm": [0, 0, 224]}},
        },
        "motion": {"mode": "semi_coordinated", "step_s": 0.02},
        "program": {},
        "assign": {
            "stations": {"tilt_deg": [-90, 90, 15], "turn_deg": [-180, 150, 30]},
        },
        "checks": {"clearance_mm": 5},
    }


def main() -> int:
    """Assign the cells and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--cells", nargs="+", default=["8:2:1", "12:3:1", "12:4:2", "20:3:0"], metavar="SEAMS:ARMS:SEED"
    )
    parser.add_argument("--effort", type=int, default=2)
    options = parser.parse_args()
    print("| seams, arms, seed | greedy | model | certified | bound | above it | CPU |\n|---|---|---|---|---|---|---|")
    status = 0
    for text in options.cells:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cell.yaml"
            file.write_text(yaml.safe_dump(generated_cell(*map(int, text.split(":"))), sort_keys=False))
            begin = time.process_time()
            result = assign(AssignmentDraft.load(file), effort=options.effort)
            seconds = time.process_time() - begin
        bound = result.bound or 0.0
        cycles = f"{result.greedy:.2f} s | {result.model_cycle:.2f} s | {result.cycle:.2f} s | {bound:.2f} s"
        verdict = f"{100 * (result.cycle / bound - 1):.1f} %" if bound else "-"
        print(f"| {text} | {cycles} | {verdict} | {seconds:.0f} s |{'' if result.passed else ' FAILED'}", flush=True)
        status |= not result.passed
    return int(status)


if __name__ == "__main__":
    sys.exit(main())
