"""Cooperation Jacobian by successive screw displacements: a walk from the part through the world frame to each tool."""

from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.transforms import Array, inverse, skew
from cellplan.jobs.explain.derivations.serial_chain import (
    axis_positions,
    chain_to_flange,
    checked_configuration,
    displacement,
    part_holder,
)
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.task.task import Frame


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScrewStep:
    """One axis on the walk, at the reference configuration, expressed in P, or in W for a task in the world."""

    s_P: Array  # unit direction, shape (3,): against the table's direction where the axis is passed from tip to base
    s0_P: Array  # A point on the axis in [m], shape (3,)
    is_revolute: bool  # whether it turns
    column: int  # place of the driving joint in the stacked joint vector
    share: float  # speed of the axis per speed of that joint
    position: float  # where the axis stands, in [rad] or [m]


def walk_from_part(cell: Cell, q: Array, operator: str) -> tuple[list[ScrewStep], Array]:
    """Axes met on the way from the part to an operator's tool, and that tool at the reference configuration, in P.

    The positioner is walked from the part back to its base, so its last axis comes first and each of its axes points
    the other way; then the operator is walked from its base to its tool.
    """
    holder = part_holder(cell)
    steps: list[ScrewStep] = []
    if holder is None:
        X_PW = inverse(cell.part.X_CP)
    else:
        robot, X_FP = holder
        X_PB = inverse(robot.model.X_BF @ X_FP)
        steps += [replace(step, s_P=-step.s_P) for step in reversed(_steps(cell, robot, q, X_PB=X_PB))]
        X_PW = X_PB @ inverse(robot.X_WB)
    robot = cell.robot(operator)
    X_PB = X_PW @ robot.X_WB
    steps += _steps(cell, robot, q, X_PB=X_PB)
    return steps, X_PB @ robot.model.X_BF @ robot.tool.X_FT


def _walk_from_world(cell: Cell, q: Array, name: str) -> tuple[list[ScrewStep], Array]:
    """Axes met on the way from the world to a robot's tool, and that tool at the reference configuration, in W."""
    robot = cell.robot(name)
    return _steps(cell, robot, q, X_PB=robot.X_WB), robot.X_WB @ robot.model.X_BF @ robot.tool.X_FT


def screw_cooperation_jacobian(cell: Cell, q: Array) -> Array:
    r"""Cooperation Jacobian from screws moved one after another ([Ribeiro2010]_ Eqs. 3.56, 4.25, 4.33).

    .. math:: J_{R1j} = \begin{bmatrix} -S(r) & I \\ I & 0 \end{bmatrix} \begin{bmatrix} {}^1J^p & {}^jJ^p \end{bmatrix}

    Both robots stand there with a plus sign. That is right only because the screws of the positioner are those of a
    walk *from the part*: their direction is opposite to the one in its joint-axis table.

    Args:
        q: Stacked joint vector in [rad] or [m], shape (nq,).

    Returns:
        Twists of the tools relative to the part, linear part first, expressed in P, shape (tasks + further holders, 6,
        nq): the grasps of further holders follow the tasks (4.5). The twist of a task in the world is relative to W and
        expressed in W.

    Raises:
        InputError: The configuration does not fit the cell, or a fixed part has no pose.
    """
    q = checked_configuration(cell, q)
    J = np.zeros((len(cell.relations), 6, cell.joint_count))
    for block, task in zip(J, cell.relations, strict=True):
        is_on_part = task.relative_to is Frame.PART
        steps, X_PT = walk_from_part(cell, q, task.robot) if is_on_part else _walk_from_world(cell, q, task.robot)
        screws, D = displaced_screws(steps)
        r = (D @ X_PT)[:3, 3]
        to_twist = np.zeros((6, 6))
        to_twist[:3, :3], to_twist[:3, 3:], to_twist[3:, :3] = -skew(r), np.eye(3), np.eye(3)
        for step, twist in zip(steps, (to_twist @ screws).T, strict=True):
            block[:, step.column] += step.share * twist
    return J


def displaced_screws(steps: list[ScrewStep]) -> tuple[Array, Array]:
    r"""Screws of the steps at the configuration, and the displacement of what lies behind the last step.

    ``$ = [s; s0 x s]`` for a revolute and ``[0; s]`` for a prismatic axis, angular part first as in the source
    ([Ribeiro2010]_ Eqs. B.15, B.16), each moved by the displacements of the steps before it (B.73).

    Returns:
        Screws, shape (6, steps), expressed in P, or in W for a task in the world, about its origin; displacement, shape
        (4, 4).
    """
    screws = np.zeros((6, len(steps)))
    D = np.eye(4)
    for column, step in enumerate(steps):
        s = D[:3, :3] @ step.s_P
        s0 = D[:3, :3] @ step.s0_P + D[:3, 3]
        screws[:, column] = np.concatenate([s, np.cross(s0, s)] if step.is_revolute else [np.zeros(3), s])
        D = D @ displacement(step.s_P, step.s0_P, step.position, is_revolute=step.is_revolute)
    return screws, D


def _steps(cell: Cell, robot: Robot, q: Array, *, X_PB: Array) -> list[ScrewStep]:
    """Axes of one robot from base to flange, brought from B to P, or to W for a task in the world."""
    columns = cell.columns(robot.name)
    chain = chain_to_flange(robot.model)
    return [
        ScrewStep(
            s_P=X_PB[:3, :3] @ axis.axis_B,
            s0_P=X_PB[:3, :3] @ axis.point_B + X_PB[:3, 3],
            is_revolute=axis.is_revolute,
            column=columns.start + drive.joint,
            share=drive.ratio,
            position=position,
        )
        for (axis, drive), position in zip(chain, axis_positions(chain, q[columns]), strict=True)
    ]
