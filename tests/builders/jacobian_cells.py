"""What tests of the cooperation Jacobian share: the planner's matrix, and robots with axes laid on purpose."""

from dataclasses import replace

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian
from cellplan.planning.tracking.task_constraints import TaskConstraints
from cellplan.scene.kinematics.pinocchio_model import CombinedModel


def planners_jacobian(cell: Cell, q: Array) -> Array:
    """The planner's matrix, from another engine, with every robot moving; shape (tasks + further holders, 6, nq)."""
    model = CombinedModel(cell)
    state = model.state(q)
    names = [robot.name for robot in cell.robots]
    p_WT = state.X_WT[[names.index(relation.robot) for relation in cell.relations], :3, 3]
    constraints = TaskConstraints.of(cell, cell.relations, names)
    signs = constraints.column_signs(model.carries_flange)
    return cooperation_jacobian(state, p_WT, signs, X_WR=constraints.reference_frames(state.X_WP))


def model_of(axes: list[tuple[str, tuple[float, float, float], tuple[float, float, float]]], X_BF: Array) -> RobotModel:
    """A robot from letters R or P, directions (of any length) and points."""
    joints = tuple(
        Joint(
            name=f"j{i}",
            kind=JointKind.REVOLUTE if letter == "R" else JointKind.PRISMATIC,
            parent=i - 1 if i else BASE,
            axis_B=np.array(axis) / np.linalg.norm(axis),
            point_B=np.array(point, dtype=float),
            lower=-3.0,
            upper=3.0,
            velocity=1.0,
        )
        for i, (letter, axis, point) in enumerate(axes)
    )
    return RobotModel(
        name="laid", source="test", joints=joints, flange_link=len(joints) - 1 if joints else BASE, X_BF=X_BF, bodies=()
    )


def with_operator(cell: Cell, model: RobotModel) -> Cell:
    """The cell with another model under its first operator."""
    robots = list(cell.robots)
    robots[1] = replace(robots[1], model=model, weights=np.ones(len(model.joints)))
    return replace(cell, robots=tuple(robots))
