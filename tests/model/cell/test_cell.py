"""Facts of a cell that are derived in one place: places of robots, who carries the part, stacked limits, drives."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import random_cell

from cellplan.geometry.transforms import inverse
from cellplan.model.robot.robot import Drive


def test_a_part_without_holder_and_pose_is_refused() -> None:
    part = random_cell(125, operators=1, held=False).part
    with pytest.raises(ValueError, match=r"^part: expected a holder or a pose in the world, got neither$"):
        replace(part, X_WP=None)


def test_the_part_in_its_carrier() -> None:
    held, fixed = random_cell(1, operators=2), random_cell(1, operators=2, held=False)
    assert held.carrier == held.index(held.part.held_by[0].robot)
    np.testing.assert_array_equal(held.part.X_CP, inverse(held.part.held_by[0].X_PT))
    assert fixed.carrier is None
    assert fixed.part.X_CP is fixed.part.X_WP


def test_places_are_those_of_the_list() -> None:
    cell = random_cell(2, operators=3)
    assert [cell.index(robot.name) for robot in cell.robots] == list(range(len(cell.robots)))


def test_joint_limits_are_stacked_once_and_read_only() -> None:
    cell = random_cell(3, operators=2)
    limits, joints = cell.joint_limits, [joint for robot in cell.robots for joint in robot.model.joints]
    for name in ("lower", "upper", "velocity", "is_revolute"):
        np.testing.assert_array_equal(getattr(limits, name), [getattr(joint, name) for joint in joints])
    known = [np.inf if joint.acceleration is None else joint.acceleration for joint in joints]
    np.testing.assert_array_equal(limits.acceleration, known)
    assert cell.joint_limits is limits
    with pytest.raises(ValueError, match="read-only"):
        limits.lower[0] = 0.0


def test_drives_and_the_links_to_the_flange() -> None:
    model = random_cell(4, operators=1, with_follower=True).robot("op0").model
    for link, axis in enumerate(model.joints):
        assert model.axes[link] is axis
        assert model.drive(link) == Drive(link, 1.0, 0.0)
    for link, follower in enumerate(model.followers, start=len(model.joints)):
        assert model.axes[link] is follower
        assert model.drive(link) == Drive(follower.leader, follower.ratio, follower.offset)
    links = model.links_to_flange
    assert links[-1] == model.flange_link
    assert [model.axes[link].parent for link in links] == [-1, *links[:-1]]
