"""Areas of the floor that bases and what they stand on keep out of, as tall columns: heights do not count."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.shapes import Box, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import rotation_about
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.layout import KeepOut
from cellplan.model.robot.robot import BASE
from cellplan.scene.bodies import Kind, SceneBody

TALL: Final = 100.0  # [m] of a column: the way out of it is sideways
POINT: Final = 1e-6  # [m] radius of the ball that stands for the origin of a base


def keep_out_bodies(cell: Cell) -> tuple[list[SceneBody], list[SceneBody]]:
    """The areas of a cell as columns, and the origins of all bases."""
    areas = () if cell.layout is None else cell.layout.keep_out
    if not areas:
        return [], []
    origin = SceneBody(
        name="", kind=Kind.LINK, shape=Sphere(POINT), robot=None, link=BASE, X_BS=np.eye(4), accuracy=None
    )
    return [_column(area) for area in areas], [
        replace(origin, name=f"{robot.name}/base", robot=robot.name) for robot in cell.robots
    ]


def in_areas(cell: Cell, p: Array) -> Flags:
    """Which places, shape (B, 3) in [m], lie in an area of a cell from above, shape (B,)."""
    inside = np.zeros(len(p), dtype=bool)
    for area in () if cell.layout is None else cell.layout.keep_out:
        away = (p[:, :2] - area.X_WS[:2, 3]) @ area.X_WS[:2, :2]
        if isinstance(area.shape, Cylinder):
            inside |= np.linalg.norm(away, axis=1) < area.shape.radius
        else:
            inside |= np.all(np.abs(away) < 0.5 * np.array(area.shape.size[:2]), axis=1)
    return inside


def _column(area: KeepOut) -> SceneBody:
    """A tall upright column on the footprint of an area."""
    X_WS = np.eye(4)
    X_WS[:2, 3] = area.X_WS[:2, 3]
    X_WS[:3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), np.arctan2(area.X_WS[1, 0], area.X_WS[0, 0]))
    base = area.shape
    shape: Solid = Cylinder(base.radius, TALL) if isinstance(base, Cylinder) else Box((*base.size[:2], TALL))
    return SceneBody(name=f"keep_out.{area.name}", kind=Kind.OBSTACLE, shape=shape, robot=None, link=BASE, X_BS=X_WS)
