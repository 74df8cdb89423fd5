"""Secondary goals: the joint speeds that would serve them best, before the tasks are given their due."""

from collections.abc import Callable, Sequence

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell

Pull = Callable[[Array], Array]  # from the stacked joint vector to the gradient of what is to grow, shape (nq,)


def goal_pulls(_cell: Cell) -> Sequence[tuple[float, Pull]]:
    """Gain and pull of every secondary goal of a cell."""
    return ()
