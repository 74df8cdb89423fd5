"""The smallest distance over many pairs at each of a few samples: the curve of clearance over time."""

from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.engine import Engine
from cellplan.collision.measure import TIGHT, measure
from cellplan.collision.relative import RelativeMotion
from cellplan.collision.sweep import Flags, Pair
from cellplan.geometry.transforms import Array

CURVE_ROOM: Final = 1e-4  # [m] a point of the curve may lie below the truth by this


def nearest_at_each(engine: Engine, pairs: list[Pair], poses: BodyPoses, *, lower: Array, touching: Flags) -> Array:
    """Smallest distance at each sample in [m], never above the truth and within 0.2 mm of it, shape (n,).

    Args:
        engine: The bodies.
        pairs: Which of them; at least one.
        poses: Where they are.
        lower: Proved lower bounds in [m], shape (P, n); raised in place.
        touching: Where they touch, shape (P, n): the curve is zero there.
    """
    upper = np.where(touching, 0.0, np.inf)
    motions: dict[int, RelativeMotion] = {}
    everywhere = np.arange(lower.shape[1])
    for sample in everywhere:
        while True:
            row = int(np.argmin(lower[:, sample]))
            if lower[row, sample] >= upper[:, sample].min() - CURVE_ROOM:
                break
            if row not in motions:
                motions[row] = RelativeMotion(engine, pairs[row], poses)
            reading = measure(engine, pairs[row], poses, sample=int(sample))
            lower[row, sample] = max(lower[row, sample], reading.bound)
            travelled = motions[row].travel(int(sample), everywhere)
            upper[row] = np.minimum(upper[row], reading.bound + 2.0 * TIGHT + travelled)
            upper[row, sample] = min(upper[row, sample], lower[row, sample])
            motions[row].carry(reading, int(sample), others=everywhere, lower=lower[row])
    return np.asarray(np.maximum(lower.min(axis=0), 0.0))
