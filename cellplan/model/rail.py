"""A robot on a rail: a prismatic joint carries all of it."""

from dataclasses import replace

import numpy as np

from cellplan.model.controller import ControllerZero
from cellplan.model.robot import Joint, RobotModel


def on_rail(model: RobotModel, rail: Joint) -> RobotModel:
    """The robot on a rail; its base frame is the one it has while the rail reads zero.

    Args:
        model: The robot with a base that does not move.
        rail: The joint that carries the base, its axis in the base frame.
    """
    return replace(
        model,
        joints=(rail, *(replace(joint, parent=joint.parent + 1) for joint in model.joints)),
        followers=tuple(replace(it, parent=it.parent + 1, leader=it.leader + 1) for it in model.followers),
        bodies=tuple(replace(body, link=body.link + 1) for body in model.bodies),
        links=tuple(replace(link, index=link.index + 1) for link in model.links),
        flange_link=model.flange_link + 1,
        controller=None if model.controller is None else _after_rail(model.controller),
    )


def _after_rail(arm: ControllerZero) -> ControllerZero:
    """The counting of an arm behind a rail, which counts as its joint does."""
    return replace(
        arm,
        zero=np.concatenate([[0.0], arm.zero]),
        sign=np.concatenate([[1.0], arm.sign]),
        coupling=np.pad(arm.coupling, ((1, 0), (1, 0))),
        limits=None if arm.limits is None else np.concatenate([[[-np.inf, np.inf]], arm.limits]),
    )
