"""Name order: a cell whose robots, tasks, further holders and obstacles stand in the order of their names.

Searches and sums over the joints of all robots depend on the order of these joints, if only in the last digit. What is
searched and resolved in the order of names does not depend on the order in which a file lists them.
"""

from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import Cell


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NameOrder:
    """A cell in the order of names, and the way from its stacked joint vector to that of the file and back."""

    cell: Cell  # the cell in the order of names; the first holder stays the first
    columns: Indices  # place in the joint vector of the file of each joint in the order of names, shape (nq,)

    @classmethod
    def of(cls, cell: Cell) -> "NameOrder":
        """The order of names of a cell."""
        robots = tuple(sorted(cell.robots, key=lambda robot: robot.name))
        held_by = (*cell.part.held_by[:1], *sorted(cell.part.held_by[1:], key=lambda grasp: grasp.robot))
        places = np.arange(cell.joint_count)
        return cls(
            cell=replace(
                cell,
                robots=robots,
                tasks=tuple(sorted(cell.tasks, key=lambda task: task.name)),
                part=replace(cell.part, held_by=held_by),
                obstacles=tuple(sorted(cell.obstacles, key=lambda obstacle: obstacle.name)),
            ),
            columns=np.concatenate([places[cell.columns(robot.name)] for robot in robots]),
        )

    def sorted(self, q: Array) -> Array:
        """Stacked joint vectors of the file, shape (..., nq), in the order of names."""
        return q[..., self.columns]

    def as_listed(self, q: Array) -> Array:
        """Stacked joint vectors in the order of names, shape (..., nq), in the order of the file."""
        listed = np.empty_like(q)
        listed[..., self.columns] = q
        return listed
