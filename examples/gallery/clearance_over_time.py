# %% [markdown]
"""How much room do the robots gain with a longer tool?

Two cells, the second with a tool that is 30 mm longer on a base that is 30 mm higher, and their proved clearance over
time in one frame.
"""

# %%
from pathlib import Path

import pandas as pd

from cellplan import load_cell, solve

CELL = Path(__file__).resolve().parent.parent / "plate.yaml"
LONGER = {
    "robots.right.base.z_mm": 530,
    "robots.right.tool.xyz_mm[2]": 70,
    "robots.right.tool.geometry.cylinder.length_mm": 70,
}

# %%
short = load_cell(CELL)
curves = {}
for name, cell in (("short tool", short), ("long tool", short.with_values(LONGER))):
    solution = solve(cell)
    print(solution)
    curves[name] = solution.to_frame().set_index("time_s")["clearance_robot_robot_mm"]

# %%
distances = pd.DataFrame(curves)
print(distances.agg(["min", "mean", "max"]).round(1).to_string())
gained = distances["long tool"].min() - distances["short tool"].min()
print(f"smallest distance of the robots: {gained:+.1f} mm")
