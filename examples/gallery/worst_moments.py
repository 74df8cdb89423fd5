# %% [markdown]
"""What happens when it is tightest?

The moments of smallest clearance, smallest joint margin and highest joint speed, and what the robots do there.
"""

# %%
from pathlib import Path

from cellplan import load_cell, solve

CELL = Path(__file__).resolve().parent.parent / "plate.yaml"

# %%
solution = solve(load_cell(CELL))
joints, clearance = solution.to_frame("joints"), solution.to_frame("clearance")
tightest = joints.loc[joints["margin"].idxmin()]
fastest = joints.loc[joints["velocity_ratio"].idxmax()]
nearest = clearance.set_index("class").loc["whole"]
moments = {
    f"smallest margin, {tightest['robot']} {tightest['joint']}": tightest["margin_at_s"],
    f"highest speed, {fastest['robot']} {fastest['joint']}": fastest["peak_velocity_at_s"],
    f"smallest clearance, {nearest['first']} - {nearest['second']}": nearest["at_s"],
}

# %%
motion = solution.to_frame().set_index("time_s")
shown = ["circle.process", "circle.feed_mm_s", "clearance_robot_robot_mm"]
for name, at in moments.items():
    row = motion.loc[motion.index[motion.index.get_indexer([at], method="nearest")[0]]]
    print(f"{name} at {at:.3f} s: " + ", ".join(f"{column} {row[column]:.4g}" for column in shown))

# %%
checks = solution.to_frame("checks")
limited = checks[checks["limit"].gt(0) & checks["name"].ne("clearance")]
limited = limited.assign(used=limited["value"].abs() / limited["limit"])
print(limited.nlargest(3, "used")[["name", "subject", "used", "at_s"]].round(3).to_string(index=False))
