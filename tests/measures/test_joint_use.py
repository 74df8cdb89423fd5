"""Use of joints against what a dense sampling of the lines between the rows says."""

import numpy as np
import pytest
from builders.scene_builders import arm_model, placed

from cellplan.measures.joint_use import joint_uses

PARTS = 64  # of the time between two rows


@pytest.mark.parametrize("seed", range(5))
def test_use_of_joints_is_that_of_lines_that_are_sampled_densely(seed: int) -> None:
    generator, robot = np.random.default_rng(seed), placed("arm", arm_model())
    limits = [(joint.lower, joint.upper) for joint in robot.model.joints]
    times = np.cumsum(generator.uniform(0.01, 0.2, 25))
    q = np.column_stack([generator.uniform(1.1 * lower, 1.1 * upper, 25) for lower, upper in limits])
    dense = np.interp(np.arange(24 * PARTS + 1) / PARTS, np.arange(25), times)

    uses = joint_uses(robot, times, q)

    for use, positions, (lower, upper) in zip(uses, q.T, limits, strict=True):
        line = np.interp(dense, times, positions)
        slope, margin = np.abs(np.diff(line) / np.diff(dense)), np.minimum(line - lower, upper - line)
        assert (use.min, use.max, use.margin) == pytest.approx((line.min(), line.max(), margin.min()), abs=1e-12)
        assert use.margin_at_s == pytest.approx(dense[margin.argmin()], abs=1e-9)
        assert use.peak_velocity == pytest.approx(slope.max(), rel=1e-9)
        assert use.travel == pytest.approx(slope @ np.diff(dense), rel=1e-12)  # integral of the speed
        fastest = dense[slope.argmax()]
        assert times[times < use.peak_velocity_at_s].max() - 1e-9 <= fastest <= use.peak_velocity_at_s
