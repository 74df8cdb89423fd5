"""Distance of two bodies at one sample: proved, never above the truth, and within 0.1 mm of it where that is needed."""

from dataclasses import dataclass
from typing import Final

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.engine import Engine
from cellplan.collision.separation import separation
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array

APART_TOL: Final = 1e-9  # [m] a proved distance above this is not rounding
TIGHT_TOL: Final = 2.5e-5  # [m] a proof this near to the proposed distance counts as the distance


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Distance reading of two bodies at one sample.

    Attributes:
        direction: Direction from first to second in the world, shape (3,), that proves ``bound`` on the hulls; None
            where no direction does.
    """

    touches: bool  # whether they touch
    bound: float  # proved distance in [m], never above the truth; zero when they touch or nothing is proved
    is_exact: bool  # whether the truth is above the bound by no more than ``2 TIGHT_TOL``
    direction: Array | None


TOUCHING: Final = Reading(True, 0.0, True, None)


def quick_reading(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> Reading:
    """Cheap reading: whether the bodies touch for certain, and a distance that may be loose."""
    first, second = pair
    a, b = engine.bodies[first], engine.bodies[second]
    is_cheap = not (isinstance(a.shape, Mesh) or isinstance(b.shape, Mesh))
    if is_cheap and engine.touch(first, second, poses, sample=sample):
        return TOUCHING
    proposed, n = engine.proposed_direction(first, second, poses, sample=sample)
    bound = separation(
        a.hull,
        b.hull,
        n,
        X_first=(poses.R[first, sample], poses.p[first, sample]),
        X_second=(poses.R[second, sample], poses.p[second, sample]),
    )
    bound -= a.looseness + b.looseness
    if bound > APART_TOL:
        return Reading(False, bound, a.is_convex and b.is_convex and bound >= proposed - TIGHT_TOL, n)
    if not is_cheap and engine.touch(first, second, poses, sample=sample):
        return TOUCHING
    return Reading(False, 0.0, False, None)


def exact_reading(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int, reading: Reading) -> Reading:
    """Exact reading of two bodies of which a cheap one is at hand."""
    if reading.is_exact:
        return reading
    distance = engine.surface_distance(*pair, poses, sample=sample)
    return Reading(False, max(distance, reading.bound), True, reading.direction if reading.bound > 0.0 else None)


def measure(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> Reading:
    """Exact reading of two bodies."""
    return exact_reading(engine, pair, poses, sample=sample, reading=quick_reading(engine, pair, poses, sample=sample))
