"""The certified lower bound of each class over time: raised until it is near the true distance, block by block."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.pair_search import SolidSearch
from cellplan.collision.continuous.motion_bound import Pair
from cellplan.collision.distance import TIGHT_TOL
from cellplan.collision.engine import Engine
from cellplan.geometry.arrays import Array, Indices

CURVE_FRACTION: Final = 0.05  # [-] of the distance in the middle of its block: a bound this far below is drawn as it is
CURVE_TOL: Final = 1e-3  # [m] likewise by this length


class CurveRefiner:
    """One class over a stretch of blocks."""

    def __init__(self, engine: Engine, motion: StraightMotion, edges: Indices) -> None:
        """Store the stretch.

        Args:
            edges: Samples at which the blocks begin and end, from 0 to the last, shape (K + 1,).
        """
        self._engine, self._motion, self._edges = engine, motion, edges
        self._middles = (edges[1:] + edges[:-1]) // 2

    def raise_bounds(self, low: Array, pairs: Sequence[Pair | None]) -> None:
        """Measure the pair with the lowest bound of a block in its middle until that is near what was measured.

        Args:
            low: Certified lower bounds by pair and block in [m], shape (P, K); raised in place.
            pairs: The engine's bodies of each pair; None for those that need no measuring.
        """
        ceiling = np.full(low.shape[1], np.inf)  # [m] distance that is known to be reached in each block
        searches: dict[int, SolidSearch] = {}
        for block in range(low.shape[1]):
            measured: set[int] = set()
            while True:
                row = int(np.argmin(low[:, block]))
                pair = pairs[row]
                is_near = low[row, block] >= (1.0 - CURVE_FRACTION) * ceiling[block] - CURVE_TOL
                if is_near or pair is None or row in measured or low[row, block] == 0.0:
                    break
                measured.add(row)
                search = searches.get(row)
                if search is None:
                    search = searches[row] = SolidSearch(self._engine, pair, self._motion)
                self._measure(search, block, ceiling)
                bounds = np.minimum.reduceat(search.low, self._edges[:-1])
                np.maximum(low[row], bounds, out=low[row])

    def _measure(self, search: SolidSearch, block: int, ceiling: Array) -> None:
        """Measure in the middle of a block; what is reached there is nearly reached in the blocks around."""
        sample = int(self._middles[block])
        reading = search.read(sample, float(ceiling[block]))
        if reading.is_exact:
            moved = np.minimum(*search.relative.displacement(sample, self._middles))
            np.minimum(ceiling, reading.bound + 2.0 * TIGHT_TOL + moved, out=ceiling)
