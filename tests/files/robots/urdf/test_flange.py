"""A flange that nobody names has z along the last axis; what points sideways is refused or replaced by line."""

from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import LIMIT, joint, write_urdf

from cellplan.errors import InputError
from cellplan.files.cell.robot_file import describe_robot
from cellplan.files.robots.urdf.load import UrdfOptions, UrdfRobot, load_urdf

FACE = "0.1 0 0"  # the mounting face on the last link, whose axis is x
OUT = "0 1.5707963267948966 0"  # z along x
TURNED = "1.5707963267948966 0 1.5707963267948966"  # z along x too, turned about it by 90 deg
INWARD = "0 -1.5707963267948966 0"  # z against x


def frame(name: str, rpy: str = "0 0 0", xyz: str = FACE, parent: str = "hand") -> tuple[str, str]:
    """A link that is fixed to another one."""
    return (
        f'<link name="{name}"/>',
        joint(f"to_{name}", parent, name, f'<origin xyz="{xyz}" rpy="{rpy}"/>', kind="fixed"),
    )


def arm(*frames: tuple[str, str], kind: str = "revolute") -> list[str]:
    """An arm whose last axis is x of its hand, and frames on that."""
    lines = ['<link name="base"/>', '<link name="arm"/>', '<link name="hand"/>', joint("a1", "base", "arm")]
    lines += [joint("a2", "arm", "hand", f'<axis xyz="-1 0 0"/>{LIMIT}', kind=kind)]
    return [*lines, *(line for frame in frames for line in frame)]


def loaded(folder: Path, *frames: tuple[str, str], flange: str | None = None, kind: str = "revolute") -> UrdfRobot:
    return load_urdf(write_urdf(folder, *arm(*frames, kind=kind)), UrdfOptions(flange=flange))


def refused(folder: Path, *frames: tuple[str, str], kind: str = "revolute") -> str:
    with pytest.raises(InputError) as caught:
        loaded(folder, *frames, kind=kind)
    return str(caught.value)


@pytest.mark.parametrize("sideways", ["flange", "tool0", "ee_link"])
def test_a_link_at_the_same_place_whose_z_points_out_is_taken(tmp_path: Path, sideways: str) -> None:
    """With x out of the face, as REP 199 has it, also where the last link of another name points sideways."""
    mount = frame("mount", OUT)
    frames = (frame(sideways), mount) if sideways != "ee_link" else (mount, frame(sideways, INWARD, "0 0 0", "mount"))
    robot = loaded(tmp_path, *frames)

    assert np.allclose(robot.model.X_BF[:3, 2], [1.0, 0.0, 0.0], atol=1e-12)
    assert np.allclose(robot.model.X_BF[:3, 3], [0.1, 0.0, 0.0], atol=1e-12)
    assert robot.remarks == (f"arm.urdf: flange 'mount' is taken, as z of '{sideways}' is 90 deg off the axis of 'a2'",)


def test_tool0_whose_z_points_out_comes_first(tmp_path: Path) -> None:
    robot = loaded(tmp_path, frame("flange"), frame("mount", TURNED), frame("tool0", OUT))
    assert np.allclose(robot.model.X_BF[:3, 0], [0.0, 0.0, -1.0], atol=1e-12)
    assert robot.remarks == ()


@pytest.mark.parametrize("flange", [None, "tool0"])
def test_a_z_that_points_back_into_the_arm_is_a_remark(tmp_path: Path, flange: str | None) -> None:
    robot = loaded(tmp_path, frame("tool0", INWARD), flange=flange)

    text = "flange 'tool0': its z points back to 'hand', 100 mm behind it: tools would stick into the arm"
    assert robot.remarks == (f"arm.urdf: {text}",)
    assert loaded(tmp_path, frame("tool0", INWARD, "-0.1 0 0")).remarks == ()


def test_a_finger_that_follows_another_is_not_proposed_where_another_link_is_there(tmp_path: Path) -> None:
    lines = arm(frame("hand_frame", OUT))
    for name, more in (("left", ""), ("right", '<mimic joint="to_left" multiplier="-1"/>')):
        lines += [f'<link name="{name}"/>', joint(f"to_{name}", "hand", name, f'<axis xyz="0 0 1"/>{LIMIT}{more}')]
    write_urdf(tmp_path, *lines)

    assert describe_robot(str(tmp_path / "arm.urdf")).flange != "right"


def test_a_turn_about_z_against_the_frame_of_the_controller_is_stated(tmp_path: Path) -> None:
    frames = (frame("tool0", OUT), frame("mount", TURNED))
    (remark,) = loaded(tmp_path, *frames, flange="mount").remarks
    assert remark == "arm.urdf: flange 'mount' is turned by 90 deg about z against 'tool0', the frame of the controller"
    assert loaded(tmp_path, *frames, flange="tool0").remarks == ()


def test_a_named_flange_is_taken_as_it_is_with_a_remark_where_it_points_sideways(tmp_path: Path) -> None:
    robot = loaded(tmp_path, frame("flange"), frame("mount", OUT), flange="flange")
    assert np.allclose(robot.model.X_BF[:3, 2], [0.0, 0.0, 1.0], atol=1e-12)
    assert robot.remarks == ("arm.urdf: flange 'flange': its z is 90 deg off the axis of 'a2'",)


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        ((frame("flange"),), "`flange: hand` (x along that axis) or `flange: flange` (x along that axis)"),
        (
            (frame("flange"), frame("mount", OUT, "0.2 0 0")),
            "`flange: hand` (x along that axis) or `flange: flange` (x along that axis) or `flange: mount` "
            "(z along that axis)",
        ),  # elsewhere
        (
            (frame("flange"), frame("mount", OUT), frame("other", TURNED)),
            "`flange: hand` (x along that axis) or `flange: flange` (x along that axis) or `flange: mount` "
            "(z along that axis) or `flange: other` (z along that axis)",
        ),  # two that differ
        (
            (frame("flange"), frame("mount", INWARD)),
            "`flange: hand` (x along that axis) or `flange: flange` (x along that axis) or `flange: mount` "
            "(z along that axis)",
        ),
        ((frame("flange", "0.5 0.5 0.5"),), "`flange: hand` (x along that axis) or `flange: flange`"),
    ],
)
def test_where_none_is_certain_the_candidates_are_named_with_their_axes(
    tmp_path: Path, frames: tuple[tuple[str, str], ...], said: str
) -> None:
    message = refused(tmp_path, *frames)
    assert message.startswith("arm.urdf: flange: expected the name of the link whose z points out of the flange, as ")
    assert message.endswith(f"deg off the axis of 'a2': write {said}")


def test_nothing_is_guessed_after_a_sliding_joint(tmp_path: Path) -> None:
    message = refused(tmp_path, frame("flange", OUT), kind="prismatic")
    assert message == (
        "arm.urdf: flange: expected the name of the link whose z points out of the flange, as the last joint 'a2' "
        "slides, which says nothing about z of 'flange': write `flange: hand` or `flange: flange`"
    )
    assert loaded(tmp_path, frame("tool0", OUT), kind="prismatic").remarks == ()
    assert loaded(tmp_path, frame("flange", OUT), flange="flange", kind="prismatic").remarks == ()


def test_the_description_proposes_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_urdf(tmp_path, *arm(frame("flange"), frame("mount_flange", OUT)))
    described = describe_robot("arm.urdf")
    assert (described.flange, described.is_usual) == ("mount_flange", True)
    assert "flange: mount_flange\n" in described.cell_lines
    assert {choice.link: choice.note for choice in described.flanges} == {
        "flange": "x along the axis of a2",
        "mount_flange": "",
    }

    write_urdf(tmp_path, *arm(frame("flange"), frame("mount", OUT, "0.2 0 0")))
    described = describe_robot("arm.urdf")
    assert (described.flange, described.is_usual) == ("mount", False)
