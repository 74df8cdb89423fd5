"""Keys of a cell about grippers and SRDFs: what they become, what is refused, and that changes of the file count."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from builders.urdf_texts import FINGERS, HAND_ARM, finger, write_urdf

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell, written_document
from cellplan.model.cell.cell import Cell

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
MODEL = "    model: kuka_kr6\n    start_deg: [0, -93, 108, 0, -15, 0]\n"
ARM = "    model: arm.urdf\n    gripper: {opening_mm: 40}\n    srdf: arm.srdf\n    start: ready\n    home: folded\n"
GRASP = "{robot: holder, at: {xyz_mm: [-250, 0, 0]}}"
SRDF = """<robot name="rig">
<disable_collisions link1="base" link2="arm" reason="Never"/>
<disable_collisions link1="palm" link2="ghost" reason="Never"/>
<group_state name="ready" group="arm">
<joint name="lift" value="0.1"/><joint name="turn" value="2"/><joint name="roll" value="-1"/></group_state>
<group_state name="folded" group="arm">
<joint name="lift" value="0.3"/><joint name="turn" value="0.7"/><joint name="roll" value="0"/></group_state>
</robot>
"""


@pytest.fixture(autouse=True)
def files(tmp_path: Path) -> None:
    write_urdf(tmp_path, *HAND_ARM, *FINGERS)
    (tmp_path / "arm.srdf").write_text(SRDF, encoding="utf-8")


def test_named_configurations_are_read_to_the_last_bit_at_a_limit_too(load: Load) -> None:
    robot = load((MODEL, ARM)).robot("holder")

    assert robot.start == pytest.approx([0.1, 2.0, -1.0], abs=1e-15)
    assert robot.home == pytest.approx([0.3, 0.7, 0.0], abs=1e-15)
    assert robot.start is not None
    assert np.all((robot.model.lower <= robot.start) & (robot.start <= robot.model.upper))


def test_pairs_and_digest_come_with_the_cell(load: Load, tmp_path: Path) -> None:
    cell = load((MODEL, ARM))

    assert cell.robot("holder").model.disabled == (("base", "arm", "disabled in arm.srdf as 'Never'"),)
    remark = "arm.srdf: disabled pairs (1) name links that 'rig' does not have: ghost"
    assert cell.remarks == (("robots.holder.srdf", remark),)
    (tmp_path / "arm.srdf").write_text(SRDF.replace('"arm" reason', '"palm" reason'), encoding="utf-8")
    assert cell.inputs["arm.srdf"] != load((MODEL, ARM)).inputs["arm.srdf"]


def test_the_written_cell_reads_back_to_the_same(load: Load, tmp_path: Path) -> None:
    cell = load((MODEL, ARM), (GRASP, GRASP[:-1] + ", depth_mm: 3, grip_bodies: [left_finger, holder/right_finger]}"))

    (tmp_path / "again.yaml").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell(tmp_path / "again.yaml")

    assert written_document(again) == written_document(cell)
    assert again.part.held_by[0].bodies == ("holder/left_finger", "holder/right_finger")
    assert again.robot("holder").gripper == ("palm", "left_finger", "right_finger")
    assert np.array_equal(again.robot("holder").start, cell.robot("holder").start)


def test_values_set_from_python_may_name_a_configuration(load: Load) -> None:
    cell = load((MODEL, ARM)).with_values({"robots.holder.start": "folded"})

    assert cell.robot("holder").start == pytest.approx([0.3, 0.7, 0.0], abs=1e-15)


def test_a_gripper_is_open_as_far_as_the_cell_says(load: Load) -> None:
    model = load((MODEL, ARM)).robot("holder").model

    places = {body.name: body.X_BS[:3, 3] for body in model.bodies}
    assert np.linalg.norm(places["left_finger"] - places["right_finger"]) == pytest.approx(0.04 + 0.02)


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        (
            "start: ready",
            "start: redy",
            "c:8: robots.holder.start: expected a configuration of arm.srdf (ready, folded), got 'redy', did you mean "
            "'ready'?",
        ),
        (
            "    srdf: arm.srdf\n",
            "",
            "c:7: robots.holder.start: expected auto, the name of a configuration in the SRDF, or a mapping with one "
            "key per joint (a1_deg, rail_mm), got 'ready' without the key srdf",
        ),
        (
            "srdf: arm.srdf",
            "srdf: ../arm.srdf",
            "c:7: robots.holder.srdf: expected a path below the folder of the cell file, got '../arm.srdf'; allow "
            "other folders with --allow-dir",
        ),
        (
            "srdf: arm.srdf",
            "srdf: other.srdf",
            "c:7: robots.holder.srdf: expected an existing file, got 'other.srdf'",
        ),
        (
            "{opening_mm: 40}",
            "{opening_mm: 81}",
            "arm.urdf:10: joint 'left': expected gripper.opening_mm from 0 to 80, the travel of 'left' and 'right', "
            "got 81",
        ),
        (
            "{opening_mm: 40}",
            "{opening_mm: 40, angle_deg: 1}",
            "c:6: robots.holder.gripper.angle_deg: expected either opening_mm or angle_deg, got both",
        ),
        (
            "{opening_mm: 40}",
            "{opening_mm: 40, bodies: [arm]}",
            "c:6: robots.holder.gripper.bodies[0]: expected a link body that is rigid with the flange (palm, "
            "left_finger, right_finger), got 'arm'",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused(refuse: Refuse, old: str, new: str, finding: str) -> None:
    assert ARM.count(old) == 1

    assert finding in refuse((MODEL, ARM.replace(old, new)))


@pytest.mark.parametrize(
    ("words", "index", "got"),
    [
        ("[left_finger, arm]", 1, "'arm'"),
        ("[worker/tool]", 0, "'worker/tool'"),
        ("[left_fingr]", 0, "'left_fingr', did you mean 'left_finger'?"),
    ],
)
def test_only_what_is_rigid_with_the_flange_can_grip(refuse: Refuse, words: str, index: int, got: str) -> None:
    findings = refuse((MODEL, ARM), (GRASP, f"{GRASP[:-1]}, grip_bodies: {words}}}"))

    assert findings == [
        f"c:18: part.held_by[0].grip_bodies[{index}]: expected a body of 'holder' that is rigid with its flange (palm, "
        f"left_finger, right_finger), got {got}"
    ]


def test_keys_of_a_urdf_are_refused_for_a_table(refuse: Refuse) -> None:
    keys = MODEL + "    srdf: arm.srdf\n    gripper: {opening_mm: 1}\n"

    assert refuse((MODEL, keys)) == [
        "c:7: robots.holder.srdf: unexpected key, it applies to a URDF only",
        "c:8: robots.holder.gripper: unexpected key, it applies to a URDF only",
    ]


def test_a_link_with_an_open_mesh_does_not_work_as_a_tool(load: Load, refuse: Refuse, tmp_path: Path) -> None:
    box = trimesh.creation.box((0.02, 0.02, 0.04))
    trimesh.Trimesh(box.vertices, box.faces[1:], process=False).export(tmp_path / "a.stl")
    torn = finger("left", sign=1).replace('<box size="0.02 0.02 0.04"/>', '<mesh filename="a.stl"/>')
    write_urdf(tmp_path, *HAND_ARM, torn, FINGERS[1])

    assert load((MODEL, ARM)).robot("holder").gripper == ("palm", "right_finger")
    assert refuse((MODEL, ARM.replace("mm: 40", "mm: 40, bodies: [left_finger]"))) == [
        "c:6: robots.holder.gripper.bodies[0]: expected closed meshes, got open edges of 'left_finger': its depth in "
        "the part cannot be judged"
    ]


def test_a_configuration_of_an_srdf_leaves_the_rail_of_the_cell_at_zero_or_the_nearest_limit(load: Load) -> None:
    rail = "    mount: {{rail: {{axis: +y, lower_mm: {}, upper_mm: 900, velocity_mm_s: 500}}}}\n"

    for lower, position in ((-100, 0.0), (200, 0.2)):
        robot = load((MODEL, ARM + rail.format(lower))).robot("holder")
        assert robot.model.joint_names == ("rail", "lift", "turn", "roll")
        assert robot.start == pytest.approx([position, 0.1, 2.0, -1.0], abs=1e-15)
        assert robot.home == pytest.approx([position, 0.3, 0.7, 0.0], abs=1e-15)


def test_limits_of_a_rail_below_a_urdf_are_refused_with_the_key_that_has_them(refuse: Refuse) -> None:
    rail = "    mount: {rail: {axis: +y, lower_mm: -100, upper_mm: 900, velocity_mm_s: 500}}\n"

    assert refuse((MODEL, ARM + rail + "    limits: {rail: {upper_mm: 100}}\n")) == [
        "c:11: robots.holder.limits.rail: unexpected key, the limits of 'rail' are those of mount.rail: "
        "change them there"
    ]
