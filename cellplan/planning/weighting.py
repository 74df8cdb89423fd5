"""Joint weights: how much each joint is spared, as written in the cell."""

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell


class JointWeights:
    """The diagonal of W along the motion."""

    def __init__(self, cell: Cell) -> None:
        """Take the weights of all robots."""
        self._constant = np.concatenate([robot.weights for robot in cell.robots])

    def at(self, _q: Array) -> Array:
        """Weights at the stacked joint vector, shape (nq,)."""
        return self._constant
