"""A robot whose tool looks down and slides up and down over a part whose frame is the world's."""

from dataclasses import replace

import numpy as np

from builders.scene_builders import body, fixed_part, make_cell, placed, slide_model
from cellplan.geometry.shapes import Cylinder, Solid, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Tool
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.task.task import Task

DOWN = (np.pi, 0.0, 0.0)  # z of the tool points against z of the part
PEN = Tool(
    X_FT=pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.0)), bodies=(body("tool", 0, shape=Cylinder(0.003, 0.1), at=(0, 0, 0.05)),)
)
BARE = Tool(X_FT=PEN.X_FT, bodies=())


def tool_over_part(tool: Tool, part: Solid, task: Task) -> Cell:
    model = replace(slide_model(Sphere(0.01), axis=(0.0, 0.0, -1.0)), bodies=())
    robot = placed(task.robot, model, base=pose((0.0, 0.0, 0.1), DOWN), tool=tool)
    return make_cell(robot, part=fixed_part(part, np.eye(4)), tasks=(task,), checks=ChecksEntry())
