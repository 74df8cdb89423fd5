"""Real robot descriptions come through the URDF reader whole, and move as pinocchio says they move."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yaml

from cellplan.files.robots.urdf.load import load_urdf, read_urdf
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array, pose_from, rotation_about
from cellplan.model.robot.robot import BASE, FollowerJoint, Joint, RobotModel

ROBOTS = [
    *("kuka_kr16_2", "kuka_kr5_arc", "abb_irb1600_8_145", "abb_irb2400_12_155"),
    *("staubli_rx160", "motoman_motopos_d500"),
]
SAME = 1e-9  # [m], [-]: two chains of double products over ten frames


@pytest.fixture(params=ROBOTS)
def urdf(request: pytest.FixtureRequest, shared_robots: Path) -> Path:
    return shared_robots / request.param / f"{request.param}.urdf"


def link_motions(model: RobotModel, q: Array) -> list[Array]:
    """Displacement of each link from the zero posture: successive screw displacements, followers last."""
    positions = [*q, *(follower.ratio * q[follower.leader] + follower.offset for follower in model.followers)]
    axes: list[Joint | FollowerJoint] = [*model.joints, *model.followers]
    motions: list[Array] = []
    for axis, position in zip(axes, positions, strict=True):
        before = np.eye(4) if axis.parent == BASE else motions[axis.parent]
        if axis.is_revolute:
            R = rotation_about(axis.axis_B, position)
            step = pose_from(R, axis.point_B - R @ axis.point_B)
        else:
            step = pose_from(np.eye(3), position * axis.axis_B)
        motions.append(before @ step)
    return motions


def pose_of(link: int, X_B: Array, motions: list[Array]) -> Array:
    return X_B if link == BASE else motions[link] @ X_B


def pinocchio_configuration(model: pin.Model, ours: RobotModel, q: Array) -> Array:
    """Configuration vector by joint name; pinocchio gives a continuous joint its cosine and sine."""
    values = dict(zip(ours.joint_names, q, strict=True))
    values |= {f.name: f.ratio * q[f.leader] + f.offset for f in ours.followers}
    configuration = pin.neutral(model)
    for name, joint in zip(model.names, model.joints, strict=True):
        if name == "universe":
            continue
        wide = [np.cos(values[name]), np.sin(values[name])]
        configuration[joint.idx_q : joint.idx_q + joint.nq] = wide if joint.nq == 2 else values[name]
    return configuration


def configurations(model: RobotModel, count: int = 20) -> Iterator[Array]:
    rng = np.random.default_rng(7)
    for _ in range(count):
        yield rng.uniform(model.lower, model.upper)


def test_the_flange_and_every_body_move_as_pinocchio_says(urdf: Path) -> None:
    ours = read_urdf(urdf)
    theirs = pin.buildModelFromUrdf(str(urdf))
    shapes = pin.buildGeomFromUrdf(theirs, str(urdf), pin.GeometryType.COLLISION, package_dirs=[str(urdf.parent)])
    data, shape_data = theirs.createData(), shapes.createData()
    assert shapes.ngeoms == len(ours.bodies)
    for q in configurations(ours):
        configuration = pinocchio_configuration(theirs, ours, q)
        pin.framesForwardKinematics(theirs, data, configuration)
        pin.updateGeometryPlacements(theirs, data, shapes, shape_data)
        motions = link_motions(ours, q)

        flange = data.oMf[theirs.getFrameId("tool0")].homogeneous
        assert np.abs(pose_of(ours.flange_link, ours.X_BF, motions) - flange).max() < SAME
        for body in ours.bodies:
            placement = shape_data.oMg[shapes.getGeometryId(f"{body.name}_0")].homogeneous
            assert np.abs(pose_of(body.link, body.X_BS, motions) - placement).max() < SAME, body.name


def test_limits_are_those_of_the_file_by_another_reader(urdf: Path) -> None:
    ours = read_urdf(urdf)
    theirs = pin.buildModelFromUrdf(str(urdf))
    for joint in ours.joints:
        place = theirs.joints[theirs.getJointId(joint.name)]
        assert joint.lower == theirs.lowerPositionLimit[place.idx_q]
        assert joint.upper == theirs.upperPositionLimit[place.idx_q]
        assert joint.velocity == theirs.velocityLimit[place.idx_v]


def test_home_tool_positions_are_those_of_the_data_sheets(shared_robots: Path) -> None:
    index = yaml.safe_load((shared_robots / "index.yaml").read_text())["robots"]
    assert sorted(index) == sorted(ROBOTS)
    for name, facts in index.items():
        path = shared_robots / facts["urdf"]
        model = read_urdf(path)
        assert list(model.joint_names) == facts["joints"]
        X_B_base = np.eye(4)
        origin = ET.parse(path).find("joint[@name='base_link-base']/origin")  # noqa: S314 - our own test data
        assert origin is not None
        X_B_base[:3, 3] = [float(word) for word in origin.attrib["xyz"].split()]
        tool = pose_of(model.flange_link, model.X_BF, link_motions(model, np.radians(facts["home_deg"])))
        expected = facts.get("home_tool_mm", [0.0, 0.0, 150.0])  # the turntable's disc stands above its tilt axis
        assert 1e3 * (tool - X_B_base)[:3, 3] == pytest.approx(expected, abs=1e-6), name


def test_nothing_of_a_file_disappears(urdf: Path) -> None:
    root = ET.parse(urdf).getroot()  # noqa: S314 - our own test data
    robot = load_urdf(urdf)

    movable = [joint for joint in root.findall("joint") if joint.attrib["type"] != "fixed"]
    assert len(robot.model.joints) + len(robot.model.followers) == len(movable)
    assert len(robot.model.bodies) == len(root.findall("link/collision"))
    names = [Path(mesh.attrib["filename"]).name for mesh in root.findall("link/collision/geometry/mesh")]
    assert [path.name for path in robot.mesh_files] == names
    for body in robot.model.bodies:
        assert isinstance(body.shape, Mesh)
        size = (urdf.parent / "meshes" / "collision" / body.shape.source).stat().st_size
        assert 0.97 * (size - 84) / 50 <= len(body.shape.faces) <= (size - 84) / 50  # a few have no area


def test_the_levers_of_the_irb_2400_keep_its_parallelogram(shared_robots: Path) -> None:
    model = read_urdf(shared_robots / "abb_irb2400_12_155" / "abb_irb2400_12_155.urdf")
    assert len(model.joints) == 6
    assert {(f.name, f.leader, f.ratio, f.offset) for f in model.followers} == {
        ("joint_lever_a", 2, 1.0, 0.0),
        ("joint_lever_b", 2, -1.0, 0.0),
    }
    lever = {body.name: body for body in model.bodies}
    for q in configurations(model):
        motions = link_motions(model, q)
        upper_arm, lever_b = motions[1], motions[lever["link_lever_b"].link]
        # lever b hangs on the forearm and turns back against it: it stays parallel to the upper arm
        assert np.abs(upper_arm[:3, :3] - lever_b[:3, :3]).max() < SAME
        assert np.abs(motions[2][:3, :3] - motions[lever["link_lever_a"].link][:3, :3]).max() < SAME


def test_the_turntable_tilts_and_turns_about_axes_that_meet(shared_robots: Path) -> None:
    model = read_urdf(shared_robots / "motoman_motopos_d500" / "motoman_motopos_d500.urdf")
    assert model.joint_names == ("joint_1", "joint_2")
    assert [joint.axis_B.tolist() for joint in model.joints] == [[0, -1, 0], [0, 0, -1]]
    assert [joint.point_B.tolist() for joint in model.joints] == [[0, 0, 0.38], [0, 0, 0.38]]
    assert model.flange_link == 1
    assert model.X_BF[:3, 3].tolist() == pytest.approx([0, 0, 0.53], abs=1e-15)
