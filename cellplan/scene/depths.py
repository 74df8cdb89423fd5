"""How deep bodies that hold, carry or stand on each other reach into each other in the course of a motion."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.collision.depth import ground_depth, overlap_depth
from cellplan.geometry.transforms import Array
from cellplan.scene.bodies import is_ground
from cellplan.scene.mounting import MountedPair
from cellplan.scene.scene import Scene

MOST_ROWS: Final = (
    61  # [-] configurations of a motion at which two solids that move are measured: each takes about 1 ms
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundDepth:
    """Depth of one pair.

    Attributes:
        pair: The pair.
        depth: Greatest depth in [m]; zero where the two do not overlap.
        row: The configuration of the motion at which it is greatest.
    """

    pair: MountedPair
    depth: float
    row: int


def mounted_depths(scene: Scene, q: Array) -> tuple[FoundDepth, ...]:
    """Depths of all pairs that are judged by it.

    Pairs that do not move against each other are measured once. For a further holder that grips in all components this
    holds as far as its grasp is closed, which is a check of its own. Of pairs that do move, a half-space is measured at
    every configuration, two solids at up to ``MOST_ROWS`` of them, the first and the last among them.

    Args:
        scene: The scene.
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
    """
    return tuple(_found(scene, pair, q) for pair in scene.mounted)


def _found(scene: Scene, pair: MountedPair, q: Array) -> FoundDepth:
    """Greatest depth of one pair."""
    ends, ground = (pair.first, pair.second), scene.bodies[pair.second]
    if is_ground(ground):
        rows = np.arange(len(q) if pair.moves else 1)
        poses = scene.pair_poses((pair.first, pair.first), q[rows])
        depths = ground_depth(scene.engine.bodies[pair.first], poses, pair.first, X_WS=ground.X_BS)
    else:
        count = min(MOST_ROWS, len(q)) if pair.moves else 1
        rows = np.unique(np.linspace(0, len(q) - 1, count).round().astype(np.intp))
        poses = scene.pair_poses(ends, q[rows])
        depths = np.array([overlap_depth(scene.engine, ends, poses, sample=k) for k in range(len(rows))])
    deepest = int(np.argmax(depths))
    return FoundDepth(pair=pair, depth=float(depths[deepest]), row=int(rows[deepest]))
