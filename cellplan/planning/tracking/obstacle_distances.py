"""Pairs of bodies that are near each other at some configurations, and how their distances change with the joints."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.near import NearPairs, NearTable, WatchedPairs, near_pairs
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

BETWEEN_THINGS: Final = frozenset({ClearanceClass.ENVIRONMENT, ClearanceClass.PART, ClearanceClass.ROBOT_ROBOT})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosestPair:
    """Two bodies that are near each other."""

    row: int  # index into ``Scene.pairs``
    distance: float  # in [m]; negative where their convex hulls overlap by so much, where reports state 0
    point_a: Array  # nearest point of the pair's first body in the world, shape (3,), in [m]
    point_b: Array  # nearest point of its second body
    gradient: Array  # change of the distance per joint, shape (nq,), in [m/rad] or [m/m]


class ClosestPairs:
    """What is near what in one scene, at one configuration or at many together.

    Considered are pairs that must keep the demanded clearance. Pairs whose distance is a matter of design, and tools at
    work on the part, are left out. Bounding spheres and lines clear what is far away; only what is left is measured.
    """

    def __init__(self, scene: Scene, *, classes: frozenset[ClearanceClass] = BETWEEN_THINGS) -> None:
        """Choose the pairs of the classes; those of one robot with itself only when they are among them."""
        self._scene = scene
        chosen = np.array([pair.rule is Rule.CLEARANCE and pair.clearance_class in classes for pair in scene.pairs])
        self._table = _among(scene.near_table, chosen)

    def near(self, q: Array, *, within: float) -> NearPairs:
        r"""Pairs nearer than a distance at many configurations, ordered by configuration and by ``Scene.pairs``.

        With the unit normal ``n`` from the one nearest point to the other, and their velocities at unit speed of joint
        i as points of the links that carry them,

        .. math:: \partial d / \partial q_i = n \cdot (v_{b,i} - v_{a,i})

        Distances are those of convex bodies or of surfaces. Bodies that overlap have those of their hulls, which grow
        with the joints in the same way.

        Args:
            q: Stacked joint vectors, shape (K, nq), in [rad] or [m].
            within: Distance in [m] from which on pairs are left out.
        """
        return near_pairs(self._table, self._scene, q, within)

    def at(self, q: Array, *, within: float) -> tuple[ClosestPair, ...]:
        """Pairs nearer than a distance at one configuration, shape (nq,), in the order of ``Scene.pairs``.

        See ``near``.
        """
        near = self.near(q[None], within=within)
        parts = zip(near.rows.tolist(), near.distances.tolist(), near.first, near.second, near.by_joints, strict=True)
        return tuple(
            ClosestPair(row=row, distance=distance, point_a=first, point_b=second, gradient=gradient)
            for row, distance, first, second, gradient in parts
        )

    def names(self, pair: ClosestPair) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        return self._scene.names(self._scene.pairs[pair.row])


def _among(table: NearTable, chosen: Flags) -> NearTable:
    """The table with some of the pairs of a scene only, flags of shape (len(Scene.pairs),).

    A body that is not convex is its surface at any distance, so that none jumps while bodies approach each other.
    """
    pairs = table.pairs
    indices: Indices = np.flatnonzero(chosen[pairs.rows]) if len(chosen) else np.zeros(0, dtype=np.intp)
    solid, ground = indices[indices < len(pairs.solids)], indices[indices >= len(pairs.solids)] - len(pairs.solids)
    some = WatchedPairs(
        rows=pairs.rows[indices],
        solids=pairs.solids[solid],
        above=pairs.above[ground],
        planes=pairs.planes[ground],
        demands=np.full(len(indices), np.inf),
        once=pairs.once[indices],
    )
    return replace(table, pairs=some)
