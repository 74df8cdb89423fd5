"""Names that the reader does not know are remarks; what looks like a mistake can be put right by the cell."""

from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import ARM, LIMIT, joint, refused

from cellplan.files.robots.limits import StatedLimits
from cellplan.files.robots.urdf.document.document import read_document
from cellplan.files.robots.urdf.load import UrdfOptions, UrdfRobot, load_urdf

BOX = '<geometry><box size="0.1 0.1 0.1"/></geometry>'


def loaded(folder: Path, *lines: str, options: UrdfOptions | None = None) -> UrdfRobot:
    path = folder / "r.urdf"
    path.write_text("\n".join(['<robot name="rig">', *lines, "</robot>"]), encoding="utf-8")
    return load_urdf(path, options)


def arm(inside: str, kind: str = "revolute") -> tuple[str, ...]:
    return (*ARM[:2], joint("a1", "base", "tip", inside, kind=kind))


@pytest.mark.parametrize(
    ("lines", "remarks"),
    [
        (
            arm('<limit lower="-1" upper="2" velocity="3" effort="1" command_effort="2" powr="1"/>'),
            (
                "r.urdf:4: joint 'a1': attribute 'command_effort' of <limit> is not known and was not read",
                "r.urdf:4: joint 'a1': attribute 'powr' of <limit> is not known and was not read",
                "r.urdf: known, but not used: effort of <limit>",
            ),
        ),
        (
            (f'<link name="base"><collision>{BOX}</collision><collision_checking/></link>', *ARM[1:]),
            ("r.urdf:2: link 'base': element <collision_checking> is not known and was not read",),
        ),
        (
            (
                '<link name="base"><self_collide/></link>',
                '<link name="tip"><self_collide/></link>',
                ARM[2],
                '<link name="end"><self_collide/></link>',
                joint("to", "tip", "end", "", kind="fixed"),
            ),
            ("r.urdf:2: link 'base': element <self_collide> is not known and was not read (and 2 more)",),
        ),
        (
            (*ARM, '<link name="end"/>', joint("to", "tip", "end", '<axes xyz="0 0 1"/><limt/>', kind="fixed")),
            (
                "r.urdf:6: joint 'to': element <axes> is not known and was not read",
                "r.urdf:6: joint 'to': element <limt> is not known and was not read",
            ),
        ),
        (
            (*ARM, '<gazebo><link name="x"/></gazebo>', '<transmission name="t"/>', "<gazebo/>"),
            ("r.urdf: known, but not used: <gazebo>, <transmission>",),
        ),
        (
            (
                f'<link name="base"><inertial/><visual>{BOX}<material/></visual></link>',
                ARM[1],
                joint("a1", "base", "tip", f'{LIMIT}<dynamics damping="1"/><safety_controller k_velocity="3"/>'),
            ),
            ("r.urdf: known, but not used: <inertial>, <material>, <dynamics>, k_velocity of <safety_controller>",),
        ),
    ],
)
def test_unknown_names_are_remarks_one_line_for_each_kind(
    tmp_path: Path, lines: tuple[str, ...], remarks: tuple[str, ...]
) -> None:
    assert loaded(tmp_path, *lines).remarks == remarks


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (arm("<limt/>"), "r.urdf:4: joint 'a1': unknown element <limt>, did you mean 'limit'?"),
        (
            arm('<limit lowr="-1" upper="2" velocity="3"/>'),
            "r.urdf:4: joint 'a1': unknown attribute 'lowr' in <limit>, did you mean 'lower'?",
        ),
        (arm(LIMIT + "<orgin/>"), "r.urdf:4: joint 'a1': unknown element <orgin>, did you mean 'origin'?"),
        (
            arm(LIMIT + '<mimick joint="a2"/>'),
            "r.urdf:4: joint 'a1': unknown element <mimick>, did you mean 'mimic'?",
        ),
        (
            arm(LIMIT + '<origin xyz="0 0 1" rpi="1 0 0"/>'),
            "r.urdf:4: joint 'a1': unknown attribute 'rpi' in <origin>, did you mean 'rpy'?",
        ),
        (
            (f'<link name="base"><visual>{BOX}</visual><colision>{BOX}</colision></link>', *ARM[1:]),
            "r.urdf:2: link 'base': unknown element <colision>, did you mean 'collision'?",
        ),
        (
            (f'<link name="base"><collision>{BOX}</collision><colision>{BOX}</colision></link>', *ARM[1:]),
            "r.urdf:2: link 'base': unknown element <colision>, did you mean 'collision'?",
        ),
        (
            (f'<link name="base"><visul>{BOX}</visul></link>', *ARM[1:]),
            "r.urdf:2: link 'base': unknown element <visul>, did you mean 'visual'?",
        ),
    ],
)
def test_a_name_that_resembles_a_missing_one_is_refused(tmp_path: Path, lines: tuple[str, ...], message: str) -> None:
    assert refused(tmp_path, *lines) == message


@pytest.mark.parametrize(
    ("limit", "stated", "fault", "key"),
    [
        ('lower="-1" upper="1" velocity="1000"', {"velocity": 2.0}, "a velocity limit", "velocity_deg_s: …"),
        ('lower="-1" upper="1" velocity="inf"', {"velocity": 2.0}, "a velocity limit", "velocity_deg_s: …"),
        ('lower="-1e16" upper="1e16" velocity="3"', {"lower": -2.0, "upper": 2.0}, "position limits", "lower_deg: …"),
        ('lower="-inf" upper="inf" velocity="3"', {"lower": -2.0, "upper": 2.0}, "position limits", "lower_deg: …"),
        ('lower="-90" upper="10" velocity="3"', {"lower": -1.5, "upper": 12.0}, "position limits", "upper_deg: …"),
        ('lower="2" upper="-2" velocity="3"', {"lower": -2.0, "upper": 2.0}, "'lower' below 'upper'", "lower_deg: …"),
    ],
)
def test_a_fault_names_a_cure_and_the_cure_works(
    tmp_path: Path, limit: str, stated: dict[str, float], fault: str, key: str
) -> None:
    lines = arm(f"<limit {limit}/>")
    message = refused(tmp_path, *lines)

    robot = loaded(tmp_path, *lines, options=UrdfOptions(limits={"a1": StatedLimits(**stated)}))

    assert message.startswith(f"r.urdf:4: joint 'a1': expected {fault}")
    assert key in message
    assert message.endswith("}}`")
    assert {name: getattr(robot.model.joints[0], name) for name in stated} == stated


def test_zero_and_minus_zero_leave_no_room_until_the_cell_states_limits(tmp_path: Path) -> None:
    lines = arm('<limit lower="0" upper="-0" velocity="3"/>')
    options = UrdfOptions(limits={"a1": StatedLimits(lower=-1.0, upper=1.0)})

    assert 'states lower="0" upper="-0": state limits in the cell' in refused(tmp_path, *lines)
    assert loaded(tmp_path, *lines, options=options).model.joints[0].lower == -1.0


def test_faults_of_joints_that_are_not_driven_do_not_matter(tmp_path: Path) -> None:
    fault = '<limit lower="-1e16" upper="1e16" velocity="1000" effort="inf"/>'
    lines = (
        *ARM,
        '<link name="tool0"/>',
        joint("m", "tip", "tool0", "", kind="fixed"),
        '<link name="f"/>',
        joint("locked", "tip", "f", fault),
        '<link name="g"/>',
        joint("twin", "tip", "g", f'<mimic joint="a1"/>{fault}'),
    )
    model = loaded(tmp_path, *lines, options=UrdfOptions(locked={"locked": 0.5})).model

    assert (model.joints[0].lower, model.joints[0].upper, model.joints[0].velocity) == (-1.0, 2.0, 3.0)
    assert [follower.name for follower in model.followers] == ["twin"]


def test_names_of_real_files_are_taken_over(tmp_path: Path) -> None:
    long = "depth_camera_front_camera_to_camera_parent_link"
    lines = ('<link name="/base"/>', '<link name="iris/imu_link"/>', joint("joint_0.0", "/base", "iris/imu_link"))
    model = loaded(tmp_path, *lines, '<link name="x"/>', joint(long, "iris/imu_link", "x", "", kind="fixed")).model

    assert [link.name for link in model.links] == ["/base", "iris/imu_link", "x"]
    assert model.joint_names == ("joint_0.0",)


def test_infinite_limits_are_read_as_such_and_not_as_numbers(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    text = "\n".join(['<robot name="rig">', *arm('<limit lower="-Infinity" upper="1" velocity="3"/>'), "</robot>"])
    path.write_text(text, encoding="utf-8")
    limit = read_document(path).joints["a1"].limit

    assert (limit.lower, limit.upper) == (None, None)
    assert f"{np.inf:g} rad" in limit.position_fault


def test_a_mesh_without_a_file_name_is_a_remark_and_the_drawing_stands_for_the_link(tmp_path: Path) -> None:
    nameless = '<geometry><mesh filename=" "/></geometry>'
    link = f'<link name="base"><visual>{BOX}</visual><collision>{nameless}</collision></link>'

    robot = loaded(tmp_path, link, *arm(LIMIT)[1:])

    assert robot.remarks == ("r.urdf:2: link 'base': <collision> names no mesh file: it has no body",)
    assert [type(body.shape).__name__ for body in robot.model.bodies if body.link == -1] == ["Box"]
