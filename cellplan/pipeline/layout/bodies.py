"""Distances of the bodies of layouts, for a layout problem: pairs with what is demanded of each."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell import Cell, Part, Tool
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances, LayoutDistances
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.variables.variables import Variables


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearBodies:
    """Pairs of one layout that are near what is demanded of them, M of them; see ``LayoutDistances``."""

    pairs: Indices
    keys: Indices
    distances: Array
    demands: Array
    is_own: Flags
    rows: Indices
    every: LayoutDistances


class LayoutBodies:
    """The bodies of a cell, wherever a layout puts them."""

    def __init__(self, scene: Scene, variables: Variables) -> None:
        """Find the pairs that layouts keep apart."""
        self._placed = _Placed(variables)
        self._distances = CellDistances.of(scene, self._placed)
        self._highest = max((pair.demand for pair in self._distances.pairs), default=0.0)

    def near(self, x: Array, q: Array, within: float) -> NearBodies:
        """Pairs less than ``within`` in [m] beyond what is demanded of them, at configurations of shape (k, nq)."""
        layout = self._placed.layouts(x[None], q[:1])
        found = self._distances.near(x, layout, q, max(0.0, self._highest) + within)
        rows = np.flatnonzero(found.distances - found.demands < within)
        return NearBodies(
            pairs=found.pairs[rows],
            keys=found.keys[rows],
            distances=found.distances[rows],
            demands=found.demands[rows],
            is_own=found.is_own[rows],
            rows=rows,
            every=found,
        )

    def derivatives(self, near: NearBodies, x: Array, dq: Array) -> Array:
        """Derivatives of their distances, shape (M, n), from those of the joints, shape (k, nq, n)."""
        return self._distances.derivatives(near.every, x, dq)[near.rows]

    def names(self, pair: int) -> tuple[str, str]:
        """Names of the bodies of a pair."""
        return self._distances.pairs[pair].names


class _Placed:
    """Variables as bodies see them: bases, tools and the part where they stand, not where the kernel needs them."""

    def __init__(self, variables: Variables) -> None:
        """Keep the variables."""
        self._variables = variables
        self.cell: Cell = variables.base
        self.given: Array = variables.given

    def layouts(self, x: Array, start: Array) -> Layouts:
        """Layouts, shape (K, n), with start postures, shape (K, nq)."""
        return Layouts.of([self._variables.placed(each) for each in x], start)

    def directions(self, x: Array) -> Directions:
        """What each variable does."""
        found = self._variables.directions(x)
        return Directions(
            base=self._variables.base_twists(x), tool=found.tool, start=found.start, weights=found.weights
        )

    def tools(self, x: Array) -> dict[str, Tool]:
        """Tools of the robots whose tools vary."""
        return self._variables.tools(x)

    def part(self, x: Array) -> Part:
        """The part with its grasps."""
        return self._variables.part(x)
