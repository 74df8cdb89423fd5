"""How deep bodies that hold, carry or stand on each other reach into each other in the course of a motion."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.scene.bodies import is_ground
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.overlap.depth import ground_depth, overlap_depth
from cellplan.scene.mounting import MountedPair
from cellplan.scene.scene import Scene

MAX_ROWS: Final = 61  # [-] configurations of a motion at which two solids that move are measured: each takes about 1 ms


@dataclass(frozen=True, slots=True, kw_only=True)
class PairDepth:
    """Depth of one pair."""

    pair: MountedPair
    depth: float  # greatest depth in [m]; zero where the two do not overlap
    row: int  # the configuration of the motion at which it is greatest


def mounted_depths(scene: Scene, q: Array, first: BodyPoses | None = None) -> tuple[PairDepth, ...]:
    """Depths of all pairs that are judged by it.

    Pairs that do not move against each other are measured once. For a further holder that grips in all components this
    holds as far as its grasp is closed, which is a check of its own. Of pairs that do move, a half-space is measured at
    every configuration, two solids at up to ``MAX_ROWS`` of them, the first and the last among them.

    Joint positions are stacked, in [rad] or [m], shape (N, nq). ``first`` has the poses of the engine's bodies at the
    first one, where they are known.
    """
    if first is None:
        first = scene.body_poses(q[:1])
    return tuple(_moving(scene, pair, q) if pair.moves else _at_rest(scene, pair, first) for pair in scene.mounted)


def _at_rest(scene: Scene, pair: MountedPair, poses: BodyPoses) -> PairDepth:
    """Depth of a pair whose bodies do not move against each other."""
    return PairDepth(pair=pair, depth=float(_depths(scene, pair, poses)[0]), row=0)


def _moving(scene: Scene, pair: MountedPair, q: Array) -> PairDepth:
    """Greatest depth of a pair over a motion."""
    has_ground = is_ground(scene.bodies[pair.second])
    count = len(q) if has_ground else min(MAX_ROWS, len(q))
    rows = np.unique(np.linspace(0, len(q) - 1, count).round().astype(np.intp))
    ends = (pair.first, pair.first if has_ground else pair.second)
    depths = _depths(scene, pair, scene.pair_poses(ends, q[rows]))
    deepest = int(np.argmax(depths))
    return PairDepth(pair=pair, depth=float(depths[deepest]), row=int(rows[deepest]))


def _depths(scene: Scene, pair: MountedPair, poses: BodyPoses) -> Array:
    """Depth of a pair at each sample in [m], shape (N,)."""
    ends, ground = (pair.first, pair.second), scene.bodies[pair.second]
    if is_ground(ground):
        return ground_depth(scene.engine.bodies[pair.first], poses, pair.first, X_WS=ground.X_BS)
    return np.array([overlap_depth(scene.engine, ends, poses, sample=k) for k in range(poses.p.shape[1])])
