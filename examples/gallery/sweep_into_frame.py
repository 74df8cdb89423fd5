# %% [markdown]
"""How fast may the job be with a fifth of the joint speeds in reserve?

A sweep over the duration, its trials as a frame, and the shortest one that keeps all limits with the reserve.
"""

# %%
from pathlib import Path

from cellplan import Axis, SweepJob, sweep, to_frame

CELL = Path(__file__).resolve().parent.parent / "plate.yaml"
FOLDER = Path("outputs/examples/gallery/sweep")
RESERVE = 0.8  # [-] largest share of a joint's velocity limit that is to be used

# %%
if __name__ == "__main__":  # the processes of a study import this file
    job = SweepJob(cell=CELL, settings=("motion.step_s=0.01", "tasks.circle.tolerance.position_mm=0.5"))
    record = sweep(job, [Axis("motion.duration_s", (0.4, 0.6, 1.0, 2.0))], FOLDER)

    # %%
    trials = to_frame(record).set_index("motion.duration_s")
    print(trials[["status", "max_velocity_ratio", "min_margin_deg", "min_clearance_mm"]].round(3).to_string())

    # %%
    good = trials[trials["status"].eq("passed") & trials["max_velocity_ratio"].le(RESERVE)]
    print(f"shortest with {1 - RESERVE:.0%} reserve: {good.index.min():g} s")
    print(f"the folder has the same table: {len(to_frame(FOLDER)) == len(trials)}")
