"""Assignments of generated cells: ``python benchmarks/assign.py --cells 8:2:1 12:3:3 8:2:0:arm``; ``--all`` has 60.

Each cell, SEAMS:ARMS:SEED[:KIND], is a plate with seams on its top, along its edges and, where it can be turned, on its
sides, and arms round it. KIND says who brings it to them: a table that tilts and turns, an arm or a rail; or it is
fixed. Printed are the cycles of the greedy schedule, of the model and of the certified
program, the lower bound, and processor seconds. Exit status 1 where a program fails a check.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from cellplan.cache import without_cache
from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft

HALF: Final = (450.0, 300.0, 40.0)  # [mm] half sizes of the plate
HALF_LEVEL: Final = (300.0, 250.0, 40.0)  # [mm] likewise where it stays level
HALF_CARRIED: Final = (200.0, 150.0, 20.0)  # [mm] likewise where an arm carries it
LONGEST_CARRIED: Final = 100.0  # [mm] seams on that one
EDGE: Final = 20.0  # [mm] that seams stay away from corners
LENGTHS: Final = (60.0, 80.0, 100.0, 120.0, 140.0, 160.0)  # [mm]
BASES: Final = {
    "west": [-1350, 0, 0],
    "east": [1350, 0, 180],
    "north": [0, 1350, -90],
    "south": [0, -1450, 90],
}  # x and y in [mm], yaw in [deg]
NORTH_OF_RAIL: Final = [1350, 1150, 180]  # likewise of the arm in the north of a rail, which ends where it would stand
NEARER: Final = {"table": 1.0, "arm": 0.85, "rail": 0.78, "fixed": 0.78}  # [-] share of these distances
TORCH: Final = {
    "length_mm": 260,
    "tilt_deg": 40,
    "roll_deg": 180,
    "radius_mm": 10,
    "stick_out_mm": 12,
}
TORCH_HOLDER: Final = {"radius_mm": 35, "length_mm": 60}
KINDS: Final = ("top", "top", "edge", "side")
PLINTHS: Final = {"table": [520, 900, 448], "rail": [500, 2480, 598], "fixed": [500, 400, 1009]}  # [mm] sizes
HOLDERS: Final = ("table", "arm", "rail", "fixed")
ALL: Final = [
    f"{seams}:{arms}:{seed}:{kind}"
    for kind in HOLDERS
    for seams, arms in ((8, 2), (12, 2), (12, 3), (20, 3), (40, 4 if kind == "table" else 3))
    for seed in range(3)
]


def seam(kind: str, side: int, half: Sequence[float], rng: np.random.Generator) -> dict[str, Any]:
    """One seam: on the top of a plate of half sizes in [mm], along an upper edge at 45 deg, or on a side."""
    along = side % 2
    length = min(float(rng.choice(LENGTHS)), LONGEST_CARRIED if half is HALF_CARRIED else np.inf)
    low, high = -half[along] + EDGE, half[along] - EDGE - length
    begin = float(np.round(rng.uniform(low, high), 1))
    across = 1 - along
    sign = 1.0 if side < 2 else -1.0
    if kind == "top":
        place = float(np.round(rng.uniform(-half[across] + EDGE, half[across] - EDGE), 1))
        height, axis = half[2], [0.0, 0.0, -1.0]
    else:
        place, height, axis = sign * half[across], half[2] if kind == "edge" else 0.0, [0.0, 0.0, 0.0]
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


def carriage(kind: str) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Who brings the plate to the arms: the robot, if any, the plate's place, and the poses that are compared."""
    if kind == "table":
        table = {"model": "motopos_d500", "base": {"xyz_mm": [0, 0, 450]}, "start_deg": [0, 0]}
        held = {"held_by": [{"robot": "table", "at": {"xyz_mm": [0, 0, -60]}}]}
        return {"table": table}, held, {"tilt_deg": [-90, 90, 15], "turn_deg": [-180, 150, 30]}
    if kind == "arm":
        arm = {"model": "kuka_kr16_2", "base": {"xyz_mm": [-1100, 0, 0]}, "home_deg": [0, -90, 90, 0, 0, 0]}
        held = {"held_by": [{"robot": "arm", "at": {"xyz_mm": [0, 0, -HALF_CARRIED[2]]}}]}
        poses = {"x_mm": [0, 0, 1], "y_mm": [0, 0, 1], "z_mm": [1200, 1200, 1]}
        return (
            {"arm": arm | {"start_deg": [0, -90, 90, 0, 0, 0]}},
            held,
            poses
            | {
                "roll_deg": [-60, 60, 30],
                "pitch_deg": [-60, 60, 30],
                "yaw_deg": [-90, 90, 45],
            },
        )
    if kind == "rail":
        rail = {
            "model": "rail_kl100_2",
            "base": {"xyz_mm": [0, 0, 600], "rpy_deg": [0, 0, 90]},
            "start": {"rail_mm": 0},
        }
        held = {"held_by": [{"robot": "rail", "at": {"xyz_mm": [0, 0, -HALF_LEVEL[2] - 1]}}]}
        return {"rail": rail}, held, {"rail_mm": [-400, 400, 100]}
    return {}, {"at": {"xyz_mm": [0, 0, 1050]}}, {}


def generated_cell(seams: int, arms: int, seed: int, kind: str = "table") -> dict[str, Any]:
    """A cell as the values of its file."""
    rng = np.random.default_rng(seed)
    robots, held, stations = carriage(kind)
    names = [name for name in BASES if (kind, name) != ("arm", "west")]
    for name in names[:arms]:
        x, y, yaw = NORTH_OF_RAIL if (kind, name) == ("rail", "north") else BASES[name]
        robots[name] = {
            "model": "kuka_kr6",
            "base": {"xyz_mm": [NEARER[kind] * x, NEARER[kind] * y, 500], "rpy_deg": [0, 0, yaw]},
            "pedestal": {"cylinder": {"radius_mm": 250}},
            "tool": {"rod": TORCH | {"holder": dict(TORCH_HOLDER)}},
            "start_deg": "auto",
            "home_deg": [0, -40, 60, 0, 60, 0],
        }
    half = {"table": HALF, "arm": HALF_CARRIED}.get(kind, HALF_LEVEL)
    is_level = kind in ("rail", "fixed")
    kinds = [KINDS[place % (3 if is_level else len(KINDS))] for place in range(seams)]
    order = rng.permutation(seams).tolist()
    size = PLINTHS.get(kind)
    plinth = {"plinth": {"box": {"size_mm": size}, "at": {"xyz_mm": [0, 0, size[2] / 2]}}} if size else {}
    return {
        "cellplan": 1,
        "name": f"plate-{seams}-{arms}-{seed}-{kind}",
        "robots": robots,
        "part": {"geometry": {"box": {"size_mm": [2 * it for it in half]}}} | held,
        "tasks": {
            f"s{number + 1:02d}": seam(kinds[place], (2 * number + 1 if is_level else number) % 4, half, rng)
            for number, place in enumerate(order)
        },
        "environment": {"floor": {"plane": {"z_mm": 0}}} | plinth,
        "motion": {"mode": "simultaneous" if kind == "fixed" else "semi_coordinated", "step_s": 0.02},
        "program": {},
        "assign": {"stations": stations} if stations else {},
        "checks": {"clearance_mm": 5},
    }


def main() -> int:
    """Assign the cells and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--cells", nargs="+", default=["8:2:1", "12:3:1", "12:4:2", "20:3:0"], metavar="SEAMS:ARMS:SEED[:KIND]"
    )
    parser.add_argument("--all", action="store_true", help="all 60 cells")
    parser.add_argument("--effort", type=int, default=2)
    options = parser.parse_args()
    print("| seams, arms, seed, kind | greedy | model | certified | bound | above it | CPU |")
    print("|---|---|---|---|---|---|---|")
    status = 0
    for text in ALL if options.all else options.cells:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "cell.yaml"
            seams, arms, seed, *kind = text.split(":")
            file.write_text(yaml.safe_dump(generated_cell(int(seams), int(arms), int(seed), *kind), sort_keys=False))
            begin = time.process_time()
            with without_cache():
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
