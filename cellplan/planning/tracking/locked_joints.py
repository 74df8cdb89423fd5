"""Locked joints: which joints stand still from which time on."""

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell


def locked_since(cell: Cell) -> Array:
    """Time in [s] from which each joint stays where it is, inf for those that do not fail, shape (nq,)."""
    since = np.full(cell.joint_count, np.inf)
    for lock in cell.motion.locked:
        index = cell.columns(lock.robot).start + cell.robot(lock.robot).model.joint_names.index(lock.joint)
        since[index] = min(since[index], lock.since)
    return since
