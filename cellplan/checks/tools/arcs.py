"""Arcs at the same time: how near the tips of two tools on their paths come to each other."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check
from cellplan.model.units import MM
from cellplan.scene.kinematics.screw_chain import Chains


def check_arcs(cell: Cell, schedule: Schedule, chains: Chains, q: RobotRows) -> Iterator[Check]:
    """Whether the tips of tools that are on their paths at once keep the distance that the program demands."""
    least, times = cell.program.arcs_apart_mm, schedule.times
    for pair in combinations(schedule.tasks, 2) if least is not None else ():
        on = [(times >= it.task.start) & (times <= it.end + it.task.off_delay) for it in pair]
        rows = np.flatnonzero(on[0] & on[1])
        if least is None or not len(rows):
            continue
        tips = [chains[it.task.robot].tool_poses(q[it.task.robot][rows])[:, :3, 3] for it in pair]
        gaps = np.linalg.norm(tips[1] - tips[0], axis=1)
        worst = int(np.argmin(gaps))
        value, at_s = MM * float(gaps[worst]), float(times[rows[worst]])
        first, second = (it.task.name for it in pair)
        both, passed, limit = f"{first}, {second}", value >= least, float(least)
        message = (
            f"tips of tasks '{first}' and '{second}' on their paths: {value:.4g} mm apart at {at_s:.3f} s, at least "
            f"{least:g} mm are demanded"
        )
        yield Check("arc_distance", both, passed, message, value=value, limit=limit, unit="mm", at_s=at_s)
