"""SRDFs: disabled pairs become pairs of link bodies, named configurations joint positions, the rest is refused."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import ARM, FINGERS, HAND_ARM, LIMIT, boxed, joint, write_urdf
from builders.xacro_texts import HEAD

from cellplan.errors import InputError
from cellplan.files.robots.urdf.gripper import GripperState
from cellplan.files.robots.urdf.load import UrdfOptions, read_urdf
from cellplan.files.robots.urdf.srdf import Srdf, configuration_of, disabled_bodies, read_srdf
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import RobotModel

READY = (
    '<group_state name="ready" group="arm"><joint name="lift" value="0.25"/><joint name="turn" value="-0.5"/>'
    '<joint name="roll" value="2"/><joint name="left" value="0.01"/></group_state>'
)


@pytest.fixture
def model(tmp_path: Path) -> RobotModel:
    options = UrdfOptions(gripper=GripperState(opening=0.02))
    return read_urdf(write_urdf(tmp_path, *HAND_ARM, *FINGERS), options)


def srdf(folder: Path, *lines: str) -> Srdf:
    """An SRDF whose elements stand in lines 2, 3, …"""
    path = folder / "arm.srdf"
    path.write_text("\n".join(['<robot name="rig">', *lines, "</robot>"]), encoding="utf-8")
    return read_srdf(path)


def off(first: str, second: str, reason: str = ' reason="Never"') -> str:
    return f'<disable_collisions link1="{first}" link2="{second}"{reason}/>'


def test_a_pair_of_links_stands_for_all_their_bodies(tmp_path: Path) -> None:
    two = boxed("base", "0.2 0.2 0.2").replace("</link>", "") + boxed("x", "1 1 1").split(">", 1)[1]
    robot = read_urdf(write_urdf(tmp_path, two, boxed("tip", "0.1 0.1 0.1"), joint("a1", "base", "tip", LIMIT)))

    disabled = disabled_bodies(srdf(tmp_path, off("tip", "base"), off("base", "base"), off("tip", "ghost")), robot)

    reason = "disabled in arm.srdf as 'Never'"
    assert disabled == (("tip", "base", reason), ("tip", "base_2", reason))


def test_a_pair_without_a_reason_says_so(tmp_path: Path, model: RobotModel) -> None:
    ((*_, reason),) = disabled_bodies(srdf(tmp_path, off("base", "arm", "")), model)

    assert reason == "disabled in arm.srdf without a reason"


def test_the_srdf_of_another_robot_is_refused(tmp_path: Path, model: RobotModel) -> None:
    with pytest.raises(
        InputError, match=r"^arm\.srdf: expected the SRDF of 'rig', got one none of whose links it has$"
    ):
        disabled_bodies(srdf(tmp_path, off("hip", "knee")), model)


def test_a_configuration_has_the_joints_of_the_chain_in_their_order(tmp_path: Path, model: RobotModel) -> None:
    file = srdf(tmp_path, READY)

    assert np.array_equal(configuration_of(file, "ready", model), [0.25, -0.5, 2.0])
    assert np.array_equal(configuration_of(file, "arm/ready", model), [0.25, -0.5, 2.0])
    assert configuration_of(file, "readi", model) is None


def test_states_of_other_groups_do_not_count(tmp_path: Path, model: RobotModel) -> None:
    hand = '<group_state name="ready" group="hand"><joint name="left" value="0"/></group_state>'

    file = srdf(tmp_path, hand, READY)

    assert np.array_equal(configuration_of(file, "ready", model), [0.25, -0.5, 2.0])
    assert file.configuration_names == ("hand/ready", "arm/ready")


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            '<joint name="turn" value="-0.5"/>',
            "",
            ":2: group_state 'ready': expected a value of every joint between base and flange, missing: turn",
        ),
        (
            '"-0.5"',
            '"-1.01"',
            ":2: group_state 'ready': joint 'turn': expected a value from -1 to 2 rad, its limits here, got -1.01",
        ),
        (
            '"0.25"',
            '"2.5"',
            ":2: group_state 'ready': joint 'lift': expected a value from -1 to 2 m, its limits here, got 2.5",
        ),
        ('"0.25"', '"nan"', ":2: group_state 'ready': joint 'lift': expected a finite number in 'value', got 'nan'"),
        ('"0.25"', '"0 1"', ":2: group_state 'ready': joint 'lift': expected a finite number in 'value', got '0 1'"),
        ('name="turn"', 'name="lift"', ":2: group_state 'ready': expected each joint once, got 'lift' twice"),
        (' name="ready"', "", ":2: group_state: expected <group_state> with the attribute 'name'"),
    ],
)
def test_a_configuration_that_cannot_be_taken_is_refused(
    tmp_path: Path, model: RobotModel, old: str, new: str, text: str
) -> None:
    assert READY.count(old) == 1
    with pytest.raises(InputError) as caught:
        configuration_of(srdf(tmp_path, READY.replace(old, new)), "ready", model)

    assert str(caught.value) == f"arm.srdf{text}"


def test_two_configurations_of_one_name_need_their_groups(tmp_path: Path, model: RobotModel) -> None:
    file = srdf(tmp_path, READY, READY.replace('"arm"', '"all"').replace("-0.5", "0.5"))

    with pytest.raises(InputError) as caught:
        configuration_of(file, "ready", model)

    text = ":3: group_state 'ready': expected one configuration of this name, got arm/ready, all/ready"
    assert str(caught.value) == f"arm.srdf{text}"
    assert np.array_equal(configuration_of(file, "all/ready", model), [0.25, 0.5, 2.0])


def test_limits_of_the_cell_count(tmp_path: Path, model: RobotModel) -> None:
    joints = (replace(model.joints[0], upper=0.2), *model.joints[1:])

    with pytest.raises(InputError, match=r"from -1 to 0\.2 m, its limits here, got 0\.25$"):
        configuration_of(srdf(tmp_path, READY), "ready", replace(model, joints=joints))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<srdf/>", "arm.srdf:1: expected an SRDF, whose root element is <robot>, got <srdf>"),
        (
            "<robot>\n<xacro:macro/></robot>",
            "arm.srdf:2: expected a plain SRDF, got <xacro:macro>: let its name end in .xacro",
        ),
        (
            '<robot>\n<disable_collisions link1="a"/></robot>',
            "arm.srdf:2: disable_collisions: expected <disable_collisions> with the attribute 'link2'",
        ),
        (
            '<!DOCTYPE r [<!ENTITY a "b">]><robot/>',
            "arm.srdf:1: expected plain XML, got a document type or an entity declaration",
        ),
        ('<robot>\n<link name="a"/></robot>', "arm.srdf:2: expected an SRDF, got a URDF, with <link>"),
        ("<robot>", "arm.srdf:1: expected well-formed XML, got: no element found"),
    ],
)
def test_what_is_no_srdf_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "arm.srdf"
    path.write_text(text, encoding="utf-8")

    with pytest.raises(InputError) as caught:
        read_srdf(path)

    assert str(caught.value) == said


SRDF_MACRO = f"""\
{HEAD}
<xacro:arg name="prefix" default=""/>
<xacro:include filename="$(find arm_moveit)/srdf/macro.xacro"/>
<xacro:arm_srdf prefix="$(arg prefix)"/>
</robot>
"""
MACRO = f"""\
{HEAD}
<xacro:macro name="arm_srdf" params="prefix">
  <group_state name="ready" group="arm"><joint name="${{prefix}}a1" value="${{pi / 6}}"/></group_state>
  <disable_collisions link1="${{prefix}}base" link2="${{prefix}}tip" reason="Adjacent"/>
</xacro:macro>
</robot>
"""


def write_macros(folder: Path) -> None:
    """``arm.srdf.xacro`` and the package that it takes its macro from, as makers ship them."""
    package = folder / "arm_moveit" / "srdf"
    package.mkdir(parents=True)
    (package / "macro.xacro").write_text(MACRO, encoding="utf-8")
    (folder / "arm.srdf.xacro").write_text(SRDF_MACRO, encoding="utf-8")


def test_an_srdf_of_macros_says_what_its_text_says(load: Callable[..., Cell], tmp_path: Path) -> None:
    write_macros(tmp_path)
    write_urdf(tmp_path, *ARM)
    keys = "    srdf: arm.srdf.xacro\n    start: ready"

    cell = load(("model: abb_irb1600", "model: arm.urdf"), ("    weights: [1, 1, 1, 1, 1, 1]", keys))

    worker = cell.robot("worker")
    assert np.degrees(worker.start) == pytest.approx([30.0], abs=1e-9)
    assert {"arm.srdf.xacro", "arm_moveit/srdf/macro.xacro"} <= set(cell.inputs)


@pytest.mark.parametrize("model", ["arm.urdf", "arm.urdf.xacro"])
def test_arguments_are_those_of_the_robot_and_of_its_srdf(
    load: Callable[..., Cell], tmp_path: Path, model: str
) -> None:
    """The URDF of macros takes ``length``, its SRDF ``prefix``: both are stated in one place, and no other one."""
    write_macros(tmp_path)
    lines = (ARM[0].replace("base", "l_base"), ARM[1].replace("tip", "l_tip"), joint("l_a1", "l_base", "l_tip"))
    text = "\n".join([HEAD, '<xacro:arg name="length" default="1"/>', *lines, "</robot>"])
    (tmp_path / model).write_text(
        text if model.endswith("xacro") else text.replace('<xacro:arg name="length" default="1"/>', ""),
        encoding="utf-8",
    )
    both = "{prefix: l_, length: 2}" if model.endswith("xacro") else "{prefix: l_}"
    keys = "    srdf: arm.srdf.xacro\n    start: ready\n    xacro_args: "
    new = ("model: abb_irb1600", f"model: {model}")

    cell = load(new, ("    weights: [1, 1, 1, 1, 1, 1]", keys + both))

    assert cell.robot("worker").model.joint_names == ("l_a1",)
    with pytest.raises(InputError, match="xacro_args: unknown argument 'prefx'"):
        load(new, ("    weights: [1, 1, 1, 1, 1, 1]", keys + both.replace("prefix", "prefx")))


def test_an_srdf_of_macros_that_says_nothing_is_a_remark(tmp_path: Path) -> None:
    path = tmp_path / "macro.srdf.xacro"
    path.write_text(MACRO, encoding="utf-8")
    assert read_srdf(path).remarks == (
        "macro.srdf.xacro: has no pairs and no configurations: is it a file of macros for others?",
    )
