"""The first layout of the thesis on a base that is too low: the floor is hit, and the report says by what and when."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.transforms import pose
from cellplan.scene.scene import Scene

LOWERED = 0.7  # [m] by which the base of the REIS is too low


@pytest.mark.slow
def test_the_part_and_the_links_that_hit_the_floor_are_named_with_their_instants(cells):
    cell = load_cell(cells / "four_robots_initial.yaml")
    cell = replace(cell, motion=replace(cell.motion, step=0.01), solver=cell.solver.changed(gain_per_s=50.0))
    run = solve(cell).runs[0]
    reis = replace(cell.robot("reis"), X_WB=pose((0.0, 0.0, -LOWERED)) @ cell.robot("reis").X_WB)
    low = Scene.from_cell(replace(cell, robots=(reis, *cell.robots[1:])))

    report, checks = check_clearance(low, run.schedule, run.motion.q)

    contact = next(contact for contact in report.contacts if contact.pair == ("part", "floor"))
    pair = next(pair for pair in low.pairs if low.names(pair) == ("part", "floor"))
    heights = low.ground_heights(pair, low.body_poses(run.motion.q))
    below = run.schedule.times[np.flatnonzero(heights <= 0.0)]
    assert (contact.first_s, contact.last_s) == (below[0], below[-1])
    assert 0.0 < contact.first_s < contact.last_s < 6.0
    messages = [check.message for check in checks if not check.passed]
    assert f"collision: part touches floor from {below[0]:.3f} s to {below[-1]:.3f} s" in messages
    assert "collision: reis/shoulder touches floor from 0.000 s to 6.000 s" in messages
    environment = report.minima["environment"]
    assert (environment.minimum, environment.certified) == (0.0, True)
