"""Modes by their residuals, and the closed form beside the search from many starts."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import placed, stick

from cellplan.files.robots.joint_table import load_bundled
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import pose
from cellplan.search.assign.problem.table import LONGEST_MOVE, MARGIN, BranchFollower

BASE = pose((0.3, -0.2, 0.5), (0.0, 0.0, 0.7))


def follower_of(model: str) -> BranchFollower:
    return BranchFollower.of(placed("arm", load_bundled(model), base=BASE, tool=stick(0.25, 0.02)))


def lines(follower: BranchFollower, count: int, seed: int) -> Array:
    """Lines of 120 mm across the tool from random configurations in the middle of the range, shape (N, 5, 4, 4)."""
    model, rng = follower.robot.model, np.random.default_rng(seed)
    middle, half = 0.5 * (model.lower + model.upper), 0.5 * (model.upper - model.lower)
    first = follower.chain.tool_poses(middle + 0.5 * half * rng.uniform(-1, 1, (count, len(half))))
    poses = np.repeat(first[:, None], 5, axis=1)
    poses[:, :, :3, 3] += np.linspace(0.0, 0.12, 5)[None, :, None] * first[:, None, :3, 0]
    return poses


@pytest.mark.parametrize("model", ["kuka_kr6", "ur5e"])
def test_modes_follow_their_poses_within_the_limits(model: str) -> None:
    follower = follower_of(model)
    X_WT = lines(follower, 12, 5)

    result = follower.follow(X_WT)

    robot = follower.robot.model
    assert len(result.q) >= 12
    for row, q, margin in zip(result.rows, result.q, result.margins, strict=True):
        assert np.abs(follower.chain.tool_poses(q) - X_WT[row]).max() < 1e-6
        assert np.abs(np.diff(q, axis=0)).max() < LONGEST_MOVE
        assert margin == pytest.approx(np.minimum(q - robot.lower, robot.upper - q).min())
        assert margin >= MARGIN
    assert result.reaches.all()


def test_the_closed_form_misses_no_branch_that_a_search_finds() -> None:
    """The search is as blind to how the arm is built as the closed form is to how the search goes."""
    wristed = follower_of("kuka_kr6")
    X_WT = lines(wristed, 6, 9)

    modes = wristed.follow(X_WT)
    searched = replace(wristed, arm=None).follow(X_WT)

    axis, shoulder = wristed.robot.X_WB[:3, 2], wristed.robot.X_WB[:3, 3]
    for row, q in zip(searched.rows, searched.q, strict=True):
        link = wristed.chain.axis_points(q[:1])[0, 4] - shoulder  # the wrist
        elbow = wristed.chain.axis_points(q[:1])[0, 1] - shoulder  # the shoulder, ahead of the first axis
        is_ahead = np.cross(axis, link) @ np.cross(axis, elbow) > 0.0
        if is_ahead:
            here = modes.q[modes.rows == row]
            assert np.abs(here - q).max(axis=(1, 2)).min() < 1e-5
