"""A mimic joint that carries the flange: a hand that a linkage keeps level, and joints behind it."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from builders.urdf_texts import joint, refused, write_urdf

from cellplan.errors import InputError
from cellplan.files.cell.robot_file import describe_robot
from cellplan.files.robots.limits import StatedLimits
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot, Tool
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

H = 1e-6  # [rad] or [m] of central differences
WIDE = '<limit lower="-2" upper="2" velocity="2" effort="1"/>'
LIMITS = '<limit lower="-1" upper="1" velocity="3" acceleration="5" jerk="40" effort="1"/>'
Y = '<axis xyz="0 1 0"/>'


def turns(name: str, parent: str, child: str, xyz: str, inside: str = WIDE, axis: str = Y) -> str:
    return f'<link name="{child}"/>' + joint(name, parent, child, f'<origin xyz="{xyz}" rpy="0.1 0 0"/>{axis}{inside}')


def follows(leader: str, ratio: float, offset: float = 0.0, limits: str = WIDE) -> str:
    return f'<mimic joint="{leader}" multiplier="{ratio}" offset="{offset}"/>{limits}'


LEVEL = (
    '<link name="base"/>',
    turns("j1", "base", "l1", "0 0 0.2", axis='<axis xyz="0 0 1"/>'),
    turns("j2", "l1", "l2", "0 0 0.25"),
    turns("j3", "l2", "l3", "0 0 0.55"),
    turns("m2", "l3", "l4", "0.6 0 0", follows("j2", -1.0)),
    turns("m3", "l4", "l5", "0 0 0", follows("j3", -0.5, 0.3, LIMITS)),
    turns("j6", "l5", "tool0", "0.1 0 -0.1", axis='<axis xyz="0 0 1"/>'),
)  # two mimic joints in a row, one with an offset, and a joint that they carry
ASIDE = (
    '<link name="base"/>',
    turns("lift", "base", "rod", "0.2 0 0"),
    turns("hinge", "base", "hand", "0 0 0.2", follows("lift", 1.5, -0.2)),
    turns("roll", "hand", "tool0", "0 0 0.4", axis='<axis xyz="0 0 1"/>'),
)  # the joint that leads does not lie on the way to the flange


def placed(model: RobotModel) -> Robot:
    tool = Tool(X_FT=np.eye(4), bodies=())
    return Robot(name="arm", model=model, X_WB=np.eye(4), tool=tool, start=None, weights=np.ones(len(model.joints)))


def by_pinocchio(path: Path, driven: Mapping[str, float]) -> Array:
    """Flange pose by another reader, each mimic joint set by hand, shape (4, 4)."""
    model = pin.buildModelFromXML(path.read_text(encoding="utf-8"))
    values = dict(driven)
    for name, leader, ratio, offset in (
        ("m2", "j2", -1.0, 0.0),
        ("m3", "j3", -0.5, 0.3),
        ("hinge", "lift", 1.5, -0.2),
    ):
        if leader in driven:
            values[name] = ratio * driven[leader] + offset
    data, q = model.createData(), pin.neutral(model)
    for name, value in values.items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, q)
    return np.array(data.oMf[model.getFrameId("tool0")].homogeneous)


@pytest.mark.parametrize("lines", [LEVEL, ASIDE], ids=["level", "aside"])
def test_the_flange_moves_as_another_reader_says(tmp_path: Path, lines: tuple[str, ...]) -> None:
    path = write_urdf(tmp_path, *lines)
    model = load_urdf(path).model
    rows = np.random.default_rng(3).uniform(-0.8, 0.8, (10, len(model.joints)))

    ours = ScrewChain(placed(model)).flange_poses(rows)

    theirs = [by_pinocchio(path, dict(zip(model.joint_names, row, strict=True))) for row in rows]
    assert np.abs(ours - theirs).max() < 1e-12  # rounding of a handful of products
    assert np.abs(model.X_BF - by_pinocchio(path, dict.fromkeys(model.joint_names, 0.0))).max() < 1e-12


@pytest.mark.parametrize("lines", [LEVEL, ASIDE], ids=["level", "aside"])
def test_screws_are_the_derivatives_of_the_flange(tmp_path: Path, lines: tuple[str, ...]) -> None:
    model = load_urdf(write_urdf(tmp_path, *lines)).model
    chain, count = ScrewChain(placed(model)), len(model.joints)
    q = np.random.default_rng(4).uniform(-0.8, 0.8, count)
    screws, point = chain.flange_screws(q[None])[0], chain.flange_poses(q[None])[0, :3, 3]

    for column, e in enumerate(np.eye(count)):
        after, before = chain.flange_poses(np.array([q + H * e, q - H * e]))
        speed = (after[:3, 3] - before[:3, 3]) / (2 * H)
        assert np.allclose(screws[:3, column] + np.cross(screws[3:, column], point), speed, atol=1e-8)  # eps / H
        turn = (after[:3, :3] - before[:3, :3]) @ chain.flange_poses(q[None])[0, :3, :3].T / (2 * H)
        assert np.allclose(screws[3:, column], [turn[2, 1], turn[0, 2], turn[1, 0]], atol=1e-8)


def test_a_linkage_keeps_the_hand_level(tmp_path: Path) -> None:
    """Closed form: the hand turns back by what both arms turn, so that its z stays upright."""
    straight = [line.replace('rpy="0.1 0 0"', "") for line in LEVEL]
    straight[5] = turns("m3", "l4", "l5", "0 0 0", follows("j3", -1.0)).replace('rpy="0.1 0 0"', "")
    model = load_urdf(write_urdf(tmp_path, *straight)).model
    rows = np.random.default_rng(5).uniform(-0.8, 0.8, (10, 4))

    poses = ScrewChain(placed(model)).flange_poses(rows)

    assert np.allclose(poses[:, :3, 2], [0.0, 0.0, 1.0], atol=1e-12)
    q1, q2, q3, _ = rows.T
    reach = 0.55 * np.sin(q2) + 0.6 * np.cos(q2 + q3) + 0.1
    height = 0.45 + 0.55 * np.cos(q2) - 0.6 * np.sin(q2 + q3) - 0.1
    expected = np.stack([reach * np.cos(q1), reach * np.sin(q1), height], axis=1)
    assert np.allclose(poses[:, :3, 3], expected, atol=1e-12)


def test_speed_acceleration_jerk_and_range_of_the_follower_count(tmp_path: Path) -> None:
    model = load_urdf(write_urdf(tmp_path, *LEVEL)).model
    assert model.joint_names == ("j1", "j2", "j3", "j6")
    leader = model.joints[2]
    assert (leader.lower, leader.upper) == pytest.approx((-1.4, 2.0))  # -0.5 q + 0.3 within -1 and 1, q within -2 and 2
    assert (leader.velocity, leader.acceleration, leader.jerk) == (2.0, 10.0, 80.0)
    assert model.joints[1].velocity == 2.0


def test_the_leader_aside_is_driven_and_the_hand_stands_still_when_it_is_locked(tmp_path: Path) -> None:
    path = write_urdf(tmp_path, *ASIDE)
    assert load_urdf(path).model.joint_names == ("lift", "roll")
    assert load_urdf(path, UrdfOptions(limits={"lift": StatedLimits(velocity=0.5)})).model.joints[0].velocity == 0.5
    held = load_urdf(path, UrdfOptions(locked={"lift": 0.4})).model
    assert held.joint_names == ("roll",)
    assert held.followers == ()
    assert np.allclose(held.X_BF, by_pinocchio(path, {"lift": 0.4, "roll": 0.0}), atol=1e-12)


def test_the_description_offers_such_a_flange(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_urdf(tmp_path, *ASIDE)
    described = describe_robot("arm.urdf")
    assert (described.flange, described.is_usual, described.locked) == ("tool0", True, {})
    assert [(choice.link, choice.joints) for choice in described.flanges if choice.link == "tool0"] == [
        ("tool0", ("lift", "roll"))
    ]


def test_a_leader_that_follows_itself_is_named(tmp_path: Path) -> None:
    lines = (*LEVEL[:5], turns("m3", "l4", "l5", "0 0 0", follows("m2", -1.0)), LEVEL[6])
    assert refused(tmp_path, *lines).endswith("joint 'm3': mimics 'm2', which mimics 'j2': name the leading joint")


def test_it_works_in_a_cell(load: Callable[..., Cell], tmp_path: Path) -> None:
    write_urdf(tmp_path, *LEVEL)
    cell = load(("model: abb_irb1600", "model: arm.urdf"), ("    weights: [1, 1, 1, 1, 1, 1]", "    start: auto"))
    assert [len(robot.model.joints) for robot in cell.robots if robot.name == "worker"] == [4]
    with pytest.raises(InputError, match="has limits in the cell, but it follows another joint"):
        load(
            ("model: abb_irb1600", "model: arm.urdf"),
            ("    weights: [1, 1, 1, 1, 1, 1]", "    limits: {m3: {velocity_deg_s: 5}}"),
        )
