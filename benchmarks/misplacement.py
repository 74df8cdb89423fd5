"""Layouts with all bases off their places: ``python benchmarks/misplacement.py --trials 4 -o misplaced``.

The failing reference cell with rods as tools and a column below every base, no limits of acceleration, margins of
15 deg and 10 mm of clearance, bases anywhere on the floor and up to 600 mm high, tools of 100 to 250 mm tilted up to
60 deg: the shortest cycle without and with every base off by 10 mm along each axis and by 1 deg about the vertical,
from equally many trials of one seed, and how many of the sampled displacements passed every check in the one cycle.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Final

from cellplan import LayoutRequest, Stop, search_layout

CELL: Final = Path(__file__).resolve().parent.parent / "cells" / "find_a_layout.yaml"
AMOUNTS: Final = (10.0, 1.0)  # [mm], [deg]
BASE: Final = {"x_mm": [-1500, 4500], "y_mm": [-3000, 3500], "z_mm": [0, 600], "yaw_deg": [-180, 180]}
TOOL: Final = {"length_mm": [100, 250], "tilt_deg": [0, 60], "roll_deg": [-180, 180]}
BOUNDS: Final = tuple(
    f"layout.vary.{robot}.{key}={json.dumps(bounds)}"
    for robot in ("kuka", "abb", "staubli")
    for key, bounds in (("base", BASE), ("tool", TOOL))
)


def main() -> None:
    """Search twice and print both."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--trials", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("outputs/misplacement"))
    options = parser.parse_args()
    cycles = []
    for name, amounts in (("in-place", None), ("misplaced", AMOUNTS)):
        request = LayoutRequest(
            cell=CELL,
            clearance=10.0,
            margin=15.0,
            misplacement=amounts,
            settings=("acceleration={unlimited: measured without}", *BOUNDS),
            seed=options.seed,
        )
        begin = time.process_time()
        stop, folder = Stop(trials=options.trials), options.output / name
        record = search_layout(request, folder, stop=stop, workers=options.workers).record
        seconds = time.process_time() - begin
        best = record["best"]
        print(f"{name}: {record['status']}, {seconds:.0f} s of this processor beside those of the workers", flush=True)
        if best is None:
            print("  " + "; ".join(entry["reason"] for entry in record["top"] if entry["reason"]))
            continue
        cycles.append(best["cycle_s"])
        print(f"  cycle {best['cycle_s']:.4f} s, margin {best['margin_deg']:.2f} deg")
        if (result := record["misplacement"]) is not None:
            for group in ("seeded", "by_derivatives", "ends"):
                print(f"  {group}: {result[f'{group}_kept']} of {result[group]} passed every check")  # type: ignore[literal-required]
            longer = 100.0 * (result["cycle_s"] / result["nominal_cycle_s"] - 1.0)
            print(f"  {longer:.1f} % longer than this layout in place by the search, {result['nominal_cycle_s']:.4f} s")
    if len(cycles) == 2:
        print(f"one cycle for all corners is {100.0 * (cycles[1] / cycles[0] - 1.0):.1f} % longer")


if __name__ == "__main__":
    main()
