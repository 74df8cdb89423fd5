"""Robots with masses, and the same robots in other engines."""

import numpy as np
import pinocchio as pin

from builders.scene_builders import joint, placed, random_pose
from cellplan.geometry.transforms import Array, pose_from, rotation_exp
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.inertia import LinkInertia
from cellplan.model.robot.robot import BASE, FollowerJoint, JointKind, RobotModel

GRAVITY = 9.80665


def random_inertia(link: int, rng: np.random.Generator) -> LinkInertia:
    """A body of some points."""
    points, masses = rng.uniform(-0.3, 0.3, (6, 3)) + rng.uniform(-0.5, 0.5, 3), rng.uniform(0.2, 2.0, 6)
    centre = masses @ points / masses.sum()
    arms = points - centre
    inertia = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(masses, arms, strict=True))
    return LinkInertia(link=link, mass=float(masses.sum()), centre_B=centre, inertia_B=np.asarray(inertia))


def random_robot(seed: int, *, axes: int = 6, with_follower: bool = False) -> Robot:
    """A chain of turning and sliding axes anywhere, with masses; a follower carries a link of its own."""
    rng = np.random.default_rng(seed)
    directions = [rotation_exp(rng.normal(size=3))[:, 0] for _ in range(axes + 1)]
    points = rng.uniform(-0.6, 0.6, (axes + 1, 3))
    joints = tuple(
        joint(f"j{i}", i - 1, axis=directions[i], point=points[i], slides=bool(i % 4 == 2)) for i in range(axes)
    )
    follower = FollowerJoint(
        name="f",
        kind=JointKind.REVOLUTE,
        parent=1,
        axis_B=directions[axes],
        point_B=points[axes],
        leader=axes - 1,
        ratio=-0.7,
        offset=0.2,
    )
    links = range(BASE, axes + with_follower)
    model = RobotModel(
        name="random",
        source="test",
        joints=joints,
        flange_link=axes - 1,
        X_BF=random_pose(rng, reach=0.5),
        bodies=(),
        followers=(follower,) if with_follower else (),
        inertias=tuple(random_inertia(link, rng) for link in links),
    )
    return placed("a", model, base=random_pose(rng, reach=1.0))


def pinocchio_model(robot: Robot) -> pin.Model:
    """The robot without followers in pinocchio; joint frames are parallel to the base at the reference."""
    model, engine = robot.model, pin.Model()
    engine.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    for index, axis in enumerate(model.joints):
        kind = pin.JointModelRevoluteUnaligned if axis.is_revolute else pin.JointModelPrismaticUnaligned
        R, p = np.eye(3), axis.point_B - model.joints[axis.parent].point_B
        if axis.parent == BASE:
            R, p = robot.X_WB[:3, :3], robot.X_WB[:3, :3] @ axis.point_B + robot.X_WB[:3, 3]
        number = engine.addJoint(axis.parent + 1, kind(axis.axis_B), pin.SE3(R, p), axis.name)
        for mass in (it for it in model.inertias or () if it.link == index):
            inertia = pin.Inertia(mass.mass, mass.centre_B - axis.point_B, mass.inertia_B)
            engine.appendBodyToJoint(number, inertia, pin.SE3.Identity())
    return engine


def mujoco_xml(robot: Robot) -> str:
    """The robot without followers as MJCF: nested bodies parallel to the base at the reference."""
    model = robot.model
    text, ends = [f'<mujoco><option gravity="0 0 {-GRAVITY!r}"/><worldbody>{_body("foot", robot.X_WB)}'], 1
    before = np.zeros(3)
    for index, axis in enumerate(model.joints):
        text.append(_body(axis.name, pose_from(np.eye(3), axis.point_B - before)))
        kind = "hinge" if axis.is_revolute else "slide"
        text.append(f'<joint type="{kind}" axis="{_words(axis.axis_B)}"/>')
        mass = next(it for it in model.inertias or () if it.link == index)
        inertia = mass.inertia_B[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        centre = _words(mass.centre_B - axis.point_B)
        text.append(f'<inertial pos="{centre}" mass="{mass.mass!r}" fullinertia="{_words(inertia)}"/>')
        before, ends = axis.point_B, ends + 1
    return "".join(text) + "</body>" * ends + "</worldbody></mujoco>"


def _body(name: str, X: Array) -> str:
    axes = _words(X[:3, :2].T.ravel())
    return f'<body name="{name}" pos="{_words(X[:3, 3])}" xyaxes="{axes}">'


def _words(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
