"""How near a solid comes to a half-space at every instant of a motion: by arithmetic, without the engine."""

import numpy as np

from cellplan.certify.linear_motion import StraightMotion
from cellplan.collision.continuous.found import Found
from cellplan.collision.continuous.interval_search import PARTS, Search
from cellplan.geometry.transforms import Array
from cellplan.scene.pairs import ScenePair


class GroundSearch(Search):
    """The search for a solid and a half-space.

    The height is the smallest over the points of the solid, each of which stays within M/8 of its chords; so the height
    in a step is no less than the smaller one of its ends less M/8.
    """

    def __init__(
        self, pair: ScenePair, motion: StraightMotion, *, found: Found, begin: float = 0.0, width: float = 1.0
    ) -> None:
        """Work out the heights at all samples.

        Args:
            pair: The solid and the half-space.
            motion: How the solid moves.
            found: Where to write what is found.
            begin: Instant of the first sample.
            width: Length of a step, in samples of the program.
        """
        self._pair, self._motion = pair, motion
        heights = motion.scene.ground_heights(pair, motion.poses)
        self._strays: Array = motion.bend[pair.first] / 8.0
        super().__init__(np.minimum(heights[1:], heights[:-1]) - self._strays, found, begin=begin, width=width)
        self._is_read[:] = True
        self._touches[:] = heights <= 0.0
        for sample in np.flatnonzero(self._touches):
            self._note(int(sample), 0.0, touches=True, is_exact=True)
        lowest = int(np.argmin(np.where(self._touches, np.inf, heights)))
        if not self._touches[lowest]:
            self._note(lowest, float(heights[lowest]), touches=False, is_exact=True)

    def _travel(self, step: int) -> float:
        return float(self._strays[step])

    def _finer(self, step: int) -> Search:
        solid = self._pair.first
        fine = self._motion.finer((solid, solid), step, parts=PARTS)
        return GroundSearch(self._pair, fine, found=self.found, begin=self._instant(step), width=self._width / PARTS)

    def _read(self, sample: int, goal: float) -> None:
        """Nothing: all samples are read from the start."""

    def _finish(self) -> None:
        """Nothing: there is no inside that a height does not tell."""
