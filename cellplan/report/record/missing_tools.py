"""Tools that a cell leaves out: robots that work with nothing on their flange, and tool tips without a body."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.geometry.shapes import support
from cellplan.geometry.transforms import inverse
from cellplan.model.cell import Cell, Robot

IN_FRONT: Final = 0.005  # [m] by which a link's own body must stick out of the flange to be a tool: a disc does not


def missing_tools(cell: Cell) -> Iterator[tuple[str, str]]:
    """A line for each robot whose tool has no body, with the key of the cell that it is about.

    A robot that only holds the part may do so with its flange, as a turntable does.
    """
    at_work = {task.robot for task in cell.tasks}
    holders = {grasp.robot for grasp in cell.part.held_by}
    for robot in cell.robots:
        if robot.tool.bodies or robot.name not in at_work | holders or _has_tool(robot):
            continue
        if not robot.tool.is_bare:
            text = f"the tool of {robot.name} has no body: state tool.geometry or tool.bodies, so that it is checked"
            yield f"robots.{robot.name}.tool", text
        elif robot.name in at_work:
            text = f"{robot.name} works with its bare flange: state tool: {{xyz_mm, geometry}}, so that it is checked"
            yield f"robots.{robot.name}", text


def _has_tool(robot: Robot) -> bool:
    """Whether the robot's own file has something in front of the flange, such as a gripper."""
    X_FB = inverse(robot.model.X_BF)
    reaches = [
        float(X_FS[2, 3] + support(body.shape, X_FS[:3, :3].T @ np.array([0.0, 0.0, 1.0])))
        for body in robot.model.bodies
        if body.link == robot.model.flange_link
        for X_FS in [X_FB @ body.X_BS]
    ]
    return max(reaches, default=0.0) > IN_FRONT
