"""The three derivations of the cooperation Jacobian on arms as their makers describe them, typed digits and all."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.jacobian_cells import planners_jacobian
from builders.random_cells import random_cell

from cellplan.files.robots.urdf.load import read_urdf
from cellplan.jobs.explain.derivations.davies import davies_cooperation_jacobian
from cellplan.jobs.explain.derivations.denavit_hartenberg import dh_cooperation_jacobian
from cellplan.jobs.explain.derivations.successive_screws import screw_cooperation_jacobian

ROBOTS = ["kuka_kr16_2", "kuka_kr5_arc", "abb_irb1600_8_145", "abb_irb2400_12_155", "staubli_rx160"]
AGREEMENT = 1e-11  # [-] of the largest entry


@pytest.mark.parametrize("name", ROBOTS)
def test_a_real_arm_on_either_side_of_the_part_gives_one_matrix(shared_robots: Path, name: str) -> None:
    model = read_urdf(shared_robots / name / f"{name}.urdf")
    cell = random_cell(7, operators=2)
    arms = [replace(robot, model=model, weights=np.ones(len(model.joints))) for robot in cell.robots[:2]]
    cell = replace(cell, robots=(*arms, cell.robots[2]))
    for seed in range(3):
        q = np.random.default_rng(seed).uniform(-2.0, 2.0, cell.joint_count)
        planned = planners_jacobian(cell, q)
        for derivation in (dh_cooperation_jacobian, screw_cooperation_jacobian, davies_cooperation_jacobian):
            assert np.abs(derivation(cell, q) - planned).max() <= AGREEMENT * np.abs(planned).max()
