"""Survey: all watched pairs over a stretch of samples, half-spaces by arithmetic and solids by the engine."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.curve import nearest_at_each
from cellplan.collision.nearest import Nearest, find_nearest
from cellplan.collision.sweep import Pair, sphere_bounds, sweep
from cellplan.geometry.transforms import Array
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Survey:
    """What is known of some of the scene's pairs at n samples.

    Attributes:
        scene: The scene.
        rows: Indices into ``Scene.pairs``, ascending, in the order of the arrays below.
        poses: Where the bodies are.
        lower: Proved lower bounds of the distances in [m], shape (P, n); exact for half-spaces; inf where nothing of a
            tool sticks out of its contact zone.
        touching: Whether the bodies touch, shape (P, n).
    """

    scene: Scene
    rows: tuple[int, ...]
    poses: BodyPoses
    lower: Array
    touching: NDArray[np.bool_]

    def solids(self, rows: Sequence[int]) -> tuple[list[int], list[Pair]]:
        """Places in the arrays and engine bodies of those of the given pairs, ascending, that the engine watches."""
        chosen = np.isin(self.scene.solid_rows, rows)
        places = np.searchsorted(self.rows, self.scene.solid_rows[chosen])
        return places.tolist(), [(int(a), int(b)) for a, b in self.scene.solid_pairs[chosen]]


def survey(scene: Scene, rows: Sequence[int], poses: BodyPoses) -> Survey:
    """Settle for some pairs of the scene at which samples they touch."""
    found = _measured_grounds(scene, rows, poses)
    places, pairs = found.solids(rows)
    swept = sweep(scene.engine, pairs, poses)
    found.lower[places], found.touching[places] = swept.lower, swept.touching
    return found


def nearest(found: Survey, rows: Sequence[int], *, best: float) -> Nearest:
    """Smallest distance of the given pairs, none of which touches; ``row`` is an index into ``Scene.pairs``.

    Args:
        found: The survey.
        rows: Indices into ``Scene.pairs``.
        best: A distance in [m] known from elsewhere; farther pairs are of no interest.
    """
    places, pairs = found.solids(rows)
    grounds = np.setdiff1d(np.searchsorted(found.rows, rows), places)
    lowest = Nearest(np.inf, best, -1, -1)
    if grounds.size:
        place, sample = np.unravel_index(np.argmin(found.lower[grounds]), (len(grounds), found.lower.shape[1]))
        height = float(found.lower[grounds[place], sample])
        if height < best:
            lowest = Nearest(height, height, found.rows[grounds[place]], int(sample))
    lower = found.lower[places]
    solid = find_nearest(found.scene.engine, pairs, found.poses, lower=lower, best=lowest.measured)
    found.lower[places] = lower
    proved = min(solid.proved, float(found.lower[grounds].min(initial=np.inf)))
    if solid.row < 0:
        return Nearest(proved, lowest.measured, lowest.row, lowest.sample)
    return Nearest(proved, solid.measured, found.rows[places[solid.row]], solid.sample)


def distance_curve(scene: Scene, rows: Sequence[int], poses: BodyPoses, *, touching: NDArray[np.bool_]) -> Array:
    """Smallest distance of the given pairs at each sample in [m], shape (n,); zero where any of them touches.

    Args:
        scene: The scene.
        rows: Indices into ``Scene.pairs``, at least one.
        poses: Where the bodies are.
        touching: Whether each pair touches, shape (P, n).
    """
    found = _measured_grounds(scene, rows, poses)
    places, pairs = found.solids(rows)
    values: Array = np.where(touching.any(axis=0), 0.0, found.lower.min(axis=0))
    if pairs:
        lower = np.where(touching[places], 0.0, np.maximum(sphere_bounds(scene.engine, pairs, poses), 0.0))
        solid = nearest_at_each(scene.engine, pairs, poses, lower=lower, touching=touching[places])
        values = np.minimum(values, solid)
    return np.maximum(values, 0.0)


def _measured_grounds(scene: Scene, rows: Sequence[int], poses: BodyPoses) -> Survey:
    """A survey in which only the half-spaces are settled."""
    lower = np.full((len(rows), poses.p.shape[1]), np.inf)
    for place in np.flatnonzero(np.isin(rows, scene.ground_rows)).tolist():
        lower[place] = scene.ground_heights(scene.pairs[rows[place]], poses)
    return Survey(scene=scene, rows=tuple(rows), poses=poses, lower=lower, touching=lower <= 0.0)
