# %% [markdown]
"""What did the layout search change, and what does it cost?

The variables and candidates of a search as frames; the best layout is solved again.
"""

# %%
from pathlib import Path

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve

CELL = Path(__file__).resolve().parent.parent.parent / "cells" / "planar_pair.yaml"
FOLDER = Path("outputs/examples/gallery/layout")

# %%
if __name__ == "__main__":  # the processes of the search import this file
    request = LayoutRequest(
        cell=CELL,
        settings=("motion.duration_s=2", "motion.step_s=0.02"),  # quick for an example
        vary=("right.base={x_mm: [1500, 2300], y_mm: [0, 600]}",),
        margin=10.0,
    )
    result = search_layout(request, FOLDER, stop=Stop(trials=1))
    print(result)

    # %%
    variables = result.to_frame("variables")
    variables["moved"] = variables["best"] - variables["given"]
    print(variables[["name", "unit", "given", "best", "moved"]].round(1).to_string(index=False))

    # %%
    top = result.to_frame("top")
    print(top[["trial", "status", "cycle_s", "margin_deg", "clearance_mm"]].round(2).to_string(index=False))
    print(f"solved again: passed {solve(load_cell(FOLDER / 'best.yaml')).passed}")
