"""Configurations that were found, rounded to what is written of them."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.io.cell.write import as_written
from cellplan.model.cell import Robot

DECIMALS: Final = 12  # of a degree or a metre, as in the tables: below the noise of the arithmetic


def rounded(robot: Robot, q: Array) -> Array:
    """A configuration with few decimals of a degree or millimetre, as the resolved cell file gives it back."""
    turns = [joint.is_revolute for joint in robot.model.joints]
    few = np.where(turns, np.deg2rad(np.round(np.rad2deg(q), DECIMALS)), np.round(q, DECIMALS))
    return as_written(robot.model, np.clip(few, robot.model.lower, robot.model.upper))
