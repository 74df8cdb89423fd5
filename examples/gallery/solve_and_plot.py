# %% [markdown]
"""Where does the tool slow down, and how large is its error there?

Solve a cell, take the motion as a frame, and plot feed and tool error over time.
"""

# %%
from pathlib import Path

import matplotlib as mpl

from cellplan import load_cell, solve

mpl.use("Agg")
from matplotlib import pyplot as plt

CELL = Path(__file__).resolve().parent.parent / "plate.yaml"
PICTURE = Path("outputs/examples/gallery/feed.png")

# %%
solution = solve(load_cell(CELL).with_values({"motion.time_law": "quintic", "motion.step_s": 0.01}))
print(solution)

# %%
motion = solution.to_frame()
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(7, 4), layout="constrained")
motion.plot(x="time_s", y="circle.feed_mm_s", ax=above, legend=False, ylabel="feed [mm/s]")
motion.plot(x="time_s", y="circle.position_error_mm", ax=below, legend=False, ylabel="error [mm]", logy=True)
PICTURE.parent.mkdir(parents=True, exist_ok=True)
figure.savefig(PICTURE)
print(f"picture: {PICTURE}")

# %%
slow = motion[motion["circle.process"].eq(1) & motion["circle.feed_mm_s"].lt(0.5 * motion["circle.feed_mm_s"].max())]
share = len(slow) / motion["circle.process"].sum()
print(f"below half of the largest feed in {share:.0%} of the path's time")
