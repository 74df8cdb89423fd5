"""Perturbed cell: the real cell, with its errors in bases, joint axes, tools and grasps."""

from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from cellplan.geometry.transforms import Array, inverse, pose, pose_from, transform_points
from cellplan.model.cell.cell import Cell, Grasp, Robot
from cellplan.model.cell.cell_errors import SHORTEST_LINK, CellErrors, Draw, RobotDraw, link_vector, sample
from cellplan.model.robot.robot import FollowerJoint, Joint, RobotModel
from cellplan.model.settings.cell_errors import PoseErrorEntry, RobotErrorsEntry
from cellplan.model.settings.units import Mm
from cellplan.scene.kinematics.screw_chain import screw_displacement

Axis = TypeVar("Axis", Joint, FollowerJoint)

EXACT: Final = Mm(0.0)
CELL_STREAM: Final = 0  # stream of random numbers of the cells; the measurements have another


def draw_errors(cell: Cell, errors: CellErrors, trial: int) -> Draw:
    """Draw one real cell, that of a trial from 0 on.

    The numbers are taken in the order of the cell (robot after robot: joint offsets, link lengths, base, tool; then
    the grasps), whatever the order of the file, and each trial has a stream of its own.
    """
    rng = np.random.default_rng([errors.seed, trial, CELL_STREAM])
    robots = {
        robot.name: _draw_robot(robot, errors.robots.get(robot.name, RobotErrorsEntry()), rng) for robot in cell.robots
    }
    grasps = {
        grasp.robot: _draw_pose(errors.grasps.get(grasp.robot, PoseErrorEntry()), rng) for grasp in cell.part.held_by
    }
    return Draw(robots=robots, X_grasps=grasps)


def perturbed_cell(cell: Cell, draw: Draw) -> Cell:
    r"""The cell as it really stands; joint positions commanded mean the same as in the written one.

    With the pose ``E`` of each real frame seen from the written one

    .. math:: X_{WB}' = X_{WB} E_B, \quad X_{FT}' = X_{FT} E_T, \quad X_{PT}' = E_P^{-1} X_{PT}

    (the real part sits at ``E_P`` in the place of the written one). No errors give the same cell.
    """
    robots = tuple(_perturbed_robot(robot, draw.robots[robot.name]) for robot in cell.robots)
    held_by = tuple(
        Grasp(robot=grasp.robot, X_PT=inverse(draw.X_grasps[grasp.robot]) @ grasp.X_PT) for grasp in cell.part.held_by
    )
    return replace(cell, robots=robots, part=replace(cell.part, held_by=held_by))


def _draw_robot(robot: Robot, errors: RobotErrorsEntry, rng: np.random.Generator) -> RobotDraw:
    """Errors of one robot, in the order of its joints."""
    names = robot.model.joint_names
    return RobotDraw(
        joint_offsets=np.array([sample(errors.joint_offsets.get(name, EXACT), rng) for name in names]),
        link_lengths=np.array([sample(errors.link_lengths_mm.get(name, EXACT), rng) for name in names]),
        X_base=_draw_pose(errors.base, rng),
        X_tool=_draw_pose(errors.tool, rng),
    )


def _draw_pose(amounts: PoseErrorEntry, rng: np.random.Generator) -> Array:
    return pose([sample(amount, rng) for amount in amounts.xyz_mm], [sample(amount, rng) for amount in amounts.rpy_deg])


def _perturbed_robot(robot: Robot, draw: RobotDraw) -> Robot:
    """The robot with other links, joint zeros, base and tool tip; what is mounted on a link goes with it."""
    body_count = len(robot.model.bodies)
    whole = replace(robot.model, bodies=(*robot.model.bodies, *robot.attachments))
    moved = _with_offsets(_with_link_lengths(whole, draw.link_lengths), draw.joint_offsets)
    model, attachments = replace(moved, bodies=moved.bodies[:body_count]), moved.bodies[body_count:]
    tool = replace(robot.tool, X_FT=robot.tool.X_FT @ draw.X_tool)
    return replace(robot, model=model, X_WB=robot.X_WB @ draw.X_base, tool=tool, attachments=attachments)


def _with_link_lengths(model: RobotModel, lengths: Array) -> RobotModel:
    """Each joint, with all that it carries, moved along the link before it at the reference configuration."""
    axes: list[Joint | FollowerJoint] = [*model.joints, *model.followers]
    shifts = np.zeros((len(axes) + 1, 3))  # of each link; the base comes first
    for index in model.carried_order:
        axis = axes[index]
        shifts[index + 1] = shifts[axis.parent + 1]
        if index < len(lengths) and lengths[index] != 0.0:
            along = link_vector(model, index)
            distance = float(np.linalg.norm(along))
            if distance < SHORTEST_LINK:
                raise ValueError(f"robot '{model.name}': the link before joint '{axis.name}' has no length")
            shifts[index + 1] += lengths[index] / distance * along
    return _displaced(model, pose_from(np.broadcast_to(np.eye(3), (len(shifts), 3, 3)), shifts), by_moved=True)


def _with_offsets(model: RobotModel, offsets: Array) -> RobotModel:
    r"""A model whose reference configuration is the one that the offsets lead to.

    ``A_i(q_i + d_i) = A_i(q_i) A_i(d_i)``, so the chain of ([Ribeiro2010]_ Eq. B.73) with offsets is the chain of axes
    displaced by the offsets of the joints before them, ending in a flange displaced by all. A follower turns by its
    ratio of its leader's offset.
    """
    D = np.empty((len(model.axes) + 1, 4, 4))
    D[0] = np.eye(4)
    for index in model.carried_order:
        axis = model.axes[index]
        drive = model.drive(index)
        offset = drive.ratio * offsets[drive.joint]
        D[index + 1] = D[axis.parent + 1] @ screw_displacement(axis, np.array([offset]))[0]
    return _displaced(model, D, by_moved=False)


def _displaced(model: RobotModel, D: Array, *, by_moved: bool) -> RobotModel:
    """The model after displacements of its links at the reference configuration, expressed in B, the base first.

    They have the shape (links + 1, 4, 4). A joint's axis goes with the link that it moves, or else with the one that
    carries it.
    """
    n = len(model.joints)
    joints = tuple(_moved(joint, D[k + 1 if by_moved else joint.parent + 1]) for k, joint in enumerate(model.joints))
    followers = tuple(
        _moved(axis, D[n + k + 1 if by_moved else axis.parent + 1]) for k, axis in enumerate(model.followers)
    )
    bodies = tuple(replace(body, X_BS=D[body.link + 1] @ body.X_BS) for body in model.bodies)
    inertias = None if model.inertias is None else tuple(it.displaced(D[it.link + 1]) for it in model.inertias)
    X_BF = D[model.flange_link + 1] @ model.X_BF
    return replace(model, joints=joints, followers=followers, X_BF=X_BF, bodies=bodies, inertias=inertias)


def _moved(axis: Axis, D: Array) -> Axis:
    """An axis after a displacement, shape (4, 4)."""
    direction = D[:3, :3] @ axis.axis_B
    point = transform_points(D, axis.point_B[None])[0]
    return replace(axis, axis_B=direction / np.linalg.norm(direction), point_B=point)
