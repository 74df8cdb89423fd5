"""Which of many pairs of bodies touches first in a single configuration."""

import numpy as np

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.distance import APART_TOL, quick_reading
from cellplan.collision.engine import Engine
from cellplan.collision.overlap.containment import is_inside
from cellplan.geometry.arrays import Indices


def first_touching(engine: Engine, pairs: Indices, poses: BodyPoses, *, sample: int) -> int | None:
    """Place of the first of the pairs, shape (P, 2), that touches at one sample, or None."""
    centres = engine.sphere_centres(poses, sample=sample)
    apart = centres[pairs[:, 0]] - centres[pairs[:, 1]]
    reach = engine.radii[pairs[:, 0]] + engine.radii[pairs[:, 1]]
    for place in np.flatnonzero(np.einsum("ij,ij->i", apart, apart) <= (reach + APART_TOL) ** 2):
        pair = (int(pairs[place, 0]), int(pairs[place, 1]))
        reading = quick_reading(engine, pair, poses, sample=sample)
        if reading.touches or (reading.bound <= APART_TOL and is_inside(engine, pair, poses, sample=sample)):
            return int(place)
    return None
