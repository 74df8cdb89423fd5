"""Search the layout of a cell, print what changed, and solve the result."""

from pathlib import Path

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve

CELL = Path(__file__).resolve().parent.parent / "cells" / "planar_pair.yaml"
FOLDER = Path("outputs/examples/layout")

if __name__ == "__main__":  # the processes of the search import this file
    request = LayoutRequest(
        cell=CELL,
        settings=("motion.duration_s=2", "motion.step_s=0.02"),  # quick for an example
        vary=("right.base={x_mm: [1500, 2300], y_mm: [0, 600]}",),
        margin=10.0,
    )
    result = search_layout(request, FOLDER, stop=Stop(trials=1))
    print(f"{result.record['status']} after {result.record['trials']} trial, {result.record['solves']} solved")
    for variable in result.record["variables"]:
        print(f"{variable['name']}: {variable['given']:g} -> {variable['best']:.1f} {variable['unit']}")
    print(f"solved again: passed {solve(load_cell(FOLDER / 'best.yaml')).passed}")
