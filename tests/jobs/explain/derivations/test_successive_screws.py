"""The walk from the part to a tool: its order, its directions, and where it ends."""

import numpy as np
from builders.random_cells import random_cell

from cellplan.geometry.transforms import inverse
from cellplan.jobs.explain.derivations.successive_screws import displaced_screws, walk_from_part
from cellplan.scene.kinematics.screw_chain import ScrewChain

POSE_TOL = 1e-12  # [m], [-] rounding of a dozen products over a few metres


def test_the_positioner_is_walked_backwards_and_each_of_its_axes_points_the_other_way():
    cell = random_cell(41, operators=1, joints=5)
    steps, _ = walk_from_part(cell, np.zeros(10), "op0")
    grasp, holder = cell.part.held_by[0], cell.robots[0]
    X_PB = inverse(holder.model.X_BF @ holder.tool.X_FT @ inverse(grasp.X_PT))

    assert [step.column for step in steps] == [4, 3, 2, 1, 0, 5, 6, 7, 8, 9]
    for step, joint in zip(steps[:5], reversed(holder.model.joints), strict=True):
        np.testing.assert_allclose(step.s_P, -X_PB[:3, :3] @ joint.axis_B, atol=POSE_TOL)


def test_the_walk_ends_at_the_tool_as_seen_from_the_part():
    cell = random_cell(42, operators=2, with_follower=True)
    q = np.random.default_rng(0).uniform(-3, 3, cell.joint_count)
    X_WT = {r.name: ScrewChain(r).tool_poses(q[None, cell.columns(r.name)])[0] for r in cell.robots}
    X_WP = X_WT["holder"] @ inverse(cell.part.held_by[0].X_PT)
    for operator in ("op0", "op1"):
        steps, X_PT = walk_from_part(cell, q, operator)
        _, D = displaced_screws(steps)
        np.testing.assert_allclose(D @ X_PT, inverse(X_WP) @ X_WT[operator], atol=POSE_TOL)


def test_on_a_fixture_the_walk_begins_at_the_operator():
    cell = random_cell(43, operators=1, joints=5, held=False)
    steps, _ = walk_from_part(cell, np.zeros(10), "op0")
    assert [step.column for step in steps] == [5, 6, 7, 8, 9]
