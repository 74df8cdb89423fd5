"""What a flange carries: the tool, and the share of the part of a robot that holds it."""

from typing import Final

import numpy as np

from cellplan.geometry.inertia import centre_and_inertia
from cellplan.geometry.transforms import inverse, transform_points
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.inertia import CarriedMass

GRAVITY: Final = 9.80665  # [m/s^2] standard gravity, downwards along the world's z


def tool_mass(robot: Robot) -> float | None:
    """Mass of the tool in [kg], 0 for a bare flange; None when it is not stated."""
    return 0.0 if robot.tool.mass is None and robot.tool.is_bare else robot.tool.mass


def part_share(cell: Cell, robot: Robot) -> float | None:
    """Share of the part in [kg], which all that hold it carry equally, 0 for the others; None when it is not stated."""
    if all(grasp.robot != robot.name for grasp in cell.part.held_by):
        return 0.0
    return None if cell.part.mass is None else cell.part.mass / max(1, len(cell.positioners))


def carried_masses(cell: Cell, robot: Robot) -> list[CarriedMass]:
    """The tool and the share of the part, as far as their masses are stated.

    A tool weighs at its stated centre, else at its tip, and its inertia about that is not known and not counted; the
    part weighs at its stated centre, else at that of its shape with uniform density, which also gives its inertia.
    """
    masses, tool, part = [], robot.tool, cell.part
    if mass := tool_mass(robot):
        centre_F = tool.X_FT[:3, 3] if tool.centre is None else tool.centre
        masses.append(CarriedMass(mass=mass, centre_F=centre_F, inertia_F=np.zeros((3, 3))))
    grasp = next((grasp for grasp in part.held_by if grasp.robot == robot.name), None)
    share = part_share(cell, robot)
    if share and grasp is not None:
        X_FS = tool.X_FT @ inverse(grasp.X_PT) @ part.X_PS
        centre_S, inertia_S = centre_and_inertia(part.shape)
        p_FC = transform_points(X_FS, centre_S[None])[0]
        if part.centre is not None:
            p_FC = transform_points(X_FS @ inverse(part.X_PS), part.centre[None])[0]
        R = X_FS[:3, :3]
        masses.append(CarriedMass(mass=share, centre_F=p_FC, inertia_F=share * R @ inertia_S @ R.T))
    return masses
