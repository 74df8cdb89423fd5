"""Near pairs of bodies at some nodes of a motion, as sequential programs ask for them."""

from dataclasses import dataclass

from cellplan.geometry.arrays import Array, Indices
from cellplan.search.distances.cell_distances import CellDistances, LayoutDistances
from cellplan.search.programs.problem import Distances


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairsAtNodes:
    """Near pairs and the nodes that their keys are."""

    near: LayoutDistances  # the pairs
    nodes: Indices  # the nodes, shape (K,)

    @classmethod
    def of(cls, distances: Distances) -> "PairsAtNodes":
        """Those that distances came from.

        Raises:
            TypeError: The distances are not those of ``distances_at``.
        """
        if not isinstance(distances.detail, PairsAtNodes):
            raise TypeError("distance_derivatives: expected distances of this problem")
        return distances.detail


def distances_at(bodies: CellDistances, x: Array, q: Array, nodes: Indices, within: float) -> Distances:
    """Pairs of bodies that are less than a distance beyond what is demanded of any.

    Args:
        x: Variables of the layout, shape (n,).
        q: Joint positions at all nodes in [rad] or [m], shape (N, nq).
        nodes: The nodes that are asked for, shape (K,).
        within: The distance in [m].
    """
    near = bodies.near(x, q[nodes], within + bodies.most_demanded)
    return Distances(
        pairs=near.pairs,
        nodes=nodes[near.keys],
        values=near.distances,
        demands=near.demands,
        within_robot=near.within_robot,
        detail=PairsAtNodes(near=near, nodes=nodes),
    )
