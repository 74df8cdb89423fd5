"""Grippers of a URDF: the opening is the travel of the fingers, and what has no such opening is refused."""

from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import FINGERS, FOLLOWS, HAND_ARM, LIMIT, boxed, finger, joint, refusal, write_urdf

from cellplan.files.robots.urdf.gripper import GripperState
from cellplan.files.robots.urdf.load import UrdfOptions, read_urdf
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import RobotModel

TURNING = '<origin xyz="0 0 0.06"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" velocity="1"/>'
LEFT, RIGHT = FINGERS


def gripping(**state) -> UrdfOptions:
    return UrdfOptions(gripper=GripperState(**state))


def gap(model: RobotModel) -> float:
    """Distance of the two finger bodies, which are 20 mm thick, across the palm."""
    middle: dict[str, Array] = {body.name: body.X_BS[:3, 3] for body in model.bodies}
    return float(np.linalg.norm(middle["left_finger"] - middle["right_finger"])) - 0.02


@pytest.mark.parametrize("opening", [0.0, 0.03, 0.08])
def test_the_opening_is_the_gap_between_fingers_that_meet_when_closed(tmp_path: Path, opening: float) -> None:
    model = read_urdf(write_urdf(tmp_path, *HAND_ARM, *FINGERS), gripping(opening=opening))

    assert gap(model) == pytest.approx(opening, abs=1e-12)
    assert model.joint_names == ("lift", "turn", "roll")
    assert {body.link for body in model.bodies if body.link_name in {"palm", "left_finger", "right_finger"}} == {2}


@pytest.mark.parametrize(
    "fingers",
    [
        (finger("left", sign=1), finger("right", sign=1, low=-0.04, high=0.0)),
        (finger("left", sign=1), finger("right", sign=1, low=-0.04, high=0.0, more=FOLLOWS.format(ratio=-1))),
        (finger("left", sign=1, high=0.06), finger("right", sign=-1, more=FOLLOWS.format(ratio=0.5))),
        (finger("left", sign=-1, low=-0.04, high=0.0), finger("right", sign=-1, more=FOLLOWS.format(ratio=-1))),
    ],
    ids=["two joints", "mirrored", "half as far", "backward"],
)
def test_the_gap_is_the_opening_however_the_file_drives_the_fingers(tmp_path: Path, fingers: tuple[str, ...]) -> None:
    names = () if "mimic" in fingers[1] else ("left", "right")
    path = write_urdf(tmp_path, *HAND_ARM, *fingers)

    assert gap(read_urdf(path, gripping(joints=names, opening=0.05))) == pytest.approx(0.05, abs=1e-12)


def test_an_opening_is_a_lock_at_the_positions_that_follow(tmp_path: Path) -> None:
    path = write_urdf(tmp_path, *HAND_ARM, *FINGERS)

    opened, locked = read_urdf(path, gripping(opening=0.03)), read_urdf(path, UrdfOptions(locked={"left": 0.015}))

    for one, other in zip(opened.bodies, locked.bodies, strict=True):
        assert np.array_equal(one.X_BS, other.X_BS)


def test_one_finger_opens_by_its_own_travel(tmp_path: Path) -> None:
    path = write_urdf(tmp_path, *HAND_ARM, LEFT)

    closed, opened = (read_urdf(path, gripping(opening=opening)).bodies[-1].X_BS[:3, 3] for opening in (0.0, 0.04))

    assert opened - closed == pytest.approx([0.0, 0.04, 0.0], abs=1e-12)
    assert "from 0 to 40, the travel of 'left', got 41" in refusal(path, gripping(opening=0.041))


def test_turning_fingers_have_an_angle(tmp_path: Path) -> None:
    path = write_urdf(tmp_path, *HAND_ARM, finger("left", sign=1, kind="revolute"))

    closed, turned = (read_urdf(path, gripping(angle=angle)).bodies[-1].X_BS[:3, :3] for angle in (0.0, 0.04))

    assert np.arccos(0.5 * (np.trace(closed.T @ turned) - 1.0)) == pytest.approx(0.04)
    assert refusal(path, gripping(opening=0.01)) == (
        "arm.urdf:10: joint 'left': turns, so the opening of the gripper is not proportional to its position: "
        "state angle_deg from 0 to 2.29183"
    )
    allowed = "expected gripper.angle_deg within 0 deg to 2.29183 deg, got 2.86479 deg"
    assert refusal(path, gripping(angle=0.05)) == f"arm.urdf:10: joint 'left': {allowed}"


NO_OPENING = "so an opening says nothing: state the positions of the joints under `locked`"
BEYOND = "gripper.joints: expected the joints that open it, as those beyond the flange 'flange' that move are"


@pytest.mark.parametrize(
    ("fingers", "state", "text"),
    [
        (
            FINGERS,
            {"opening": 0.09},
            ":10: joint 'left': expected gripper.opening_mm from 0 to 80, the travel of 'left' and 'right', got 90",
        ),
        (FINGERS, {"angle": 0.1}, ":10: joint 'left': slides: expected gripper.opening_mm, got angle_deg"),
        (
            FINGERS,
            {"joints": ("right",), "opening": 0.01},
            ":11: joint 'right': follows 'left': name that one under gripper.joints",
        ),
        (
            FINGERS,
            {"joints": ("lefd",), "opening": 0.01},
            ": gripper.joints: unknown joint 'lefd', did you mean 'left'?",
        ),
        (
            FINGERS,
            {"joints": ("turn",), "opening": 0.01},
            ":5: joint 'turn': is named under gripper.joints, but does not move beyond the flange 'flange': "
            "expected one of left",
        ),
        ((LEFT, finger("right", sign=-1)), {"opening": 0.01}, f": {BEYOND}: left, right"),
        ((), {"opening": 0.01}, ": gripper: expected a joint beyond the flange 'flange' that moves, got none"),
        (
            (LEFT, finger("right", sign=1, more=FOLLOWS.format(ratio=1))),
            {"opening": 0.01},
            f":10: joint 'left': does not move against 'right', {NO_OPENING}",
        ),
        (
            (finger("left", sign=-1), finger("right", sign=1, more=FOLLOWS.format(ratio=1))),
            {"opening": 0.01},
            ":10: joint 'left': closes as it leaves the end of its range nearest to zero: "
            "state the positions of the joints under `locked`",
        ),
    ],
)
def test_what_is_no_opening_is_refused_in_one_line(tmp_path: Path, fingers, state, text: str) -> None:
    assert refusal(write_urdf(tmp_path, *HAND_ARM, *fingers), gripping(**state)) == f"arm.urdf{text}"


def test_a_joint_is_held_by_one_key(tmp_path: Path) -> None:
    path = write_urdf(tmp_path, *HAND_ARM, *FINGERS)
    named, unnamed = (
        UrdfOptions(locked={"left": 0.01, "turn": 0.0}, gripper=GripperState(joints=joints, opening=0.02))
        for joints in (("left",), ())
    )

    said = refusal(path, named)

    assert said == "arm.urdf:10: joint 'left': is held by `gripper` and by `locked`: remove it from one of them"
    assert refusal(path, unnamed) == (
        "arm.urdf: gripper: expected a joint beyond the flange 'flange' that moves, got none but left, held by "
        "`locked`: remove from there what opens the gripper"
    )


def test_a_finger_that_follows_bounds_the_opening_by_its_own_limits(tmp_path: Path) -> None:
    short = finger("right", sign=-1, high=0.01, more=FOLLOWS.format(ratio=0.5))
    late = finger("right", sign=-1, low=0.01, more=FOLLOWS.format(ratio=1))

    path = write_urdf(tmp_path, *HAND_ARM, LEFT, short)
    assert gap(read_urdf(path, gripping(opening=0.03))) == pytest.approx(0.03, abs=1e-12)
    assert "from 0 to 30, the travel of 'left' and 'right', got 31" in refusal(path, gripping(opening=0.031))
    assert refusal(write_urdf(tmp_path, *HAND_ARM, LEFT, late), gripping(opening=0.03)) == (
        "arm.urdf:11: joint 'right': follows 'left' to 0 mm where the gripper is closed, beyond its own limits of "
        "10 mm to 40 mm: state the position of 'left' under `locked`"
    )


def test_the_other_joints_off_the_chain_are_locked_beside_the_gripper(tmp_path: Path) -> None:
    head = joint("pan", "base", "head", LIMIT) + boxed("head", "0.1 0.1 0.1", "0 0 0.3")
    path = write_urdf(tmp_path, *HAND_ARM, *FINGERS, head)

    model = read_urdf(path, UrdfOptions(locks_others=True, gripper=GripperState(opening=0.03)))

    assert gap(model) == pytest.approx(0.03, abs=1e-12)
    assert model.joint_names == ("lift", "turn", "roll")
    assert refusal(path, gripping(opening=0.03)).startswith("arm.urdf:12: joint 'pan': moves, but is not between")
