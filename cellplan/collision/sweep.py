"""Which pairs of bodies touch at which samples: an answer for every sample, most of them without asking the engine.

Bounding spheres clear nearly all of it. What is left of each pair is worked through by bisection: one distance in the
middle clears its neighbours as far as the bodies cannot have met meanwhile (``relative``), and so on. A sample counts
as free only by a proved distance or by the engine's own "no".
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.engine import Engine
from cellplan.collision.inside import is_inside
from cellplan.collision.measure import SURELY_APART, Reading, look, sharpen
from cellplan.collision.relative import RelativeMotion
from cellplan.geometry.transforms import Array

WORTH_A_DISTANCE: Final = 16  # [-] samples left open from which on an exact distance pays against asking each of them

Pair = tuple[int, int]
PairIndices = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """All pairs over all samples.

    Attributes:
        lower: Proved lower bound of each distance in [m], shape (P, n); zero where the bodies touch.
        touching: Whether the bodies touch, shape (P, n).
    """

    lower: Array
    touching: Flags


def sweep(engine: Engine, pairs: list[Pair], poses: BodyPoses) -> Sweep:
    """Settle for every pair and every sample whether the bodies touch."""
    lower = sphere_bounds(engine, pairs, poses)
    touching = np.zeros(lower.shape, dtype=bool)
    for row, pair in enumerate(pairs):
        if np.any(lower[row] <= SURELY_APART):
            enclosable = lower[row] <= SURELY_APART
            _settle(engine, pair, poses, lower=lower[row], touching=touching[row])
            _enclose(engine, pair, poses, touching=touching[row], enclosable=enclosable)
            lower[row] = np.where(touching[row], 0.0, np.maximum(lower[row], 0.0))
    return Sweep(lower, touching)


def first_touching(engine: Engine, pairs: PairIndices, poses: BodyPoses, *, sample: int) -> int | None:
    """Place of the first of the pairs, shape (P, 2), that touches at one sample, or None."""
    centres = engine.sphere_centres(poses, sample=sample)
    apart = centres[pairs[:, 0]] - centres[pairs[:, 1]]
    reach = engine.radii[pairs[:, 0]] + engine.radii[pairs[:, 1]]
    for place in np.flatnonzero(np.einsum("ij,ij->i", apart, apart) <= (reach + SURELY_APART) ** 2):
        pair = (int(pairs[place, 0]), int(pairs[place, 1]))
        reading = look(engine, pair, poses, sample=sample)
        if reading.touches or (reading.bound <= SURELY_APART and is_inside(engine, pair, poses, sample=sample)):
            return int(place)
    return None


def sphere_bounds(engine: Engine, pairs: list[Pair], poses: BodyPoses) -> Array:
    """Distance of the bounding spheres of each pair at each sample in [m], shape (P, n); may be negative."""
    centres = {i: poses.R[i] @ engine.bodies[i].centre + poses.p[i] for i in {body for pair in pairs for body in pair}}
    lower = np.empty((len(pairs), poses.p.shape[1]))
    for row, (a, b) in enumerate(pairs):
        apart = centres[b] - centres[a]
        lower[row] = np.sqrt(np.einsum("ij,ij->i", apart, apart))
        lower[row] -= engine.bodies[a].radius + engine.bodies[b].radius
    return lower


def _settle(engine: Engine, pair: Pair, poses: BodyPoses, *, lower: Array, touching: Flags) -> None:
    """Work through the open samples of one pair by bisection; fills in ``lower`` and ``touching``, shape (n,)."""
    motion = RelativeMotion(engine, pair, poses)
    settled = lower > SURELY_APART
    stretches = [(0, len(lower))]
    while stretches:
        first, last = stretches.pop()
        left = first + np.flatnonzero(~settled[first:last])
        if not left.size:
            continue
        sample = int(left[left.size // 2])
        reading = _reading(engine, pair, poses, sample=sample, is_worth_it=left.size >= WORTH_A_DISTANCE)
        settled[sample] = True
        touching[sample] = reading.touches
        lower[sample] = max(lower[sample], reading.bound)
        motion.carry(reading, sample, others=left, lower=lower)
        settled[left] |= lower[left] > SURELY_APART
        stretches += [(first, sample), (sample + 1, last)]


def _reading(engine: Engine, pair: Pair, poses: BodyPoses, *, sample: int, is_worth_it: bool) -> Reading:
    """Whether a pair touches at a sample; with a distance beyond what the hulls prove when that clears enough."""
    reading = look(engine, pair, poses, sample=sample)
    if reading.bound > SURELY_APART or reading.touches or not is_worth_it:
        return reading
    return sharpen(engine, pair, poses, sample=sample, reading=reading)


def _enclose(engine: Engine, pair: Pair, poses: BodyPoses, *, touching: Flags, enclosable: Flags) -> None:
    """Mark stretches in which one body lies wholly inside the other: between two touches this cannot change."""
    free = np.flatnonzero(~touching)
    for stretch in np.split(free, np.flatnonzero(np.diff(free) > 1) + 1):
        if stretch.size and enclosable[stretch[0]] and is_inside(engine, pair, poses, sample=int(stretch[0])):
            touching[stretch] = True
