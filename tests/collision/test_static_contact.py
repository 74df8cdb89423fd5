"""The first of many pairs that touches in a single configuration."""

import numpy as np
from builders.moving_cells import cell_with_bodies, program

from cellplan.collision.distance import measure
from cellplan.collision.overlap.containment import is_inside
from cellplan.collision.static_contact import first_touching
from cellplan.scene.scene import Scene


def test_first_touching_is_none_or_a_pair_that_touches() -> None:
    answers = set()
    for seed in range(8):
        scene = Scene.from_cell(cell_with_bodies(seed))
        poses = scene.body_poses(program(scene.cell, seed, samples=6, stride=0.5))
        pairs = scene.solid_pairs[np.random.default_rng(seed).permutation(len(scene.solid_pairs))[: 4 + 6 * seed]]
        for k in range(6):
            touching = [
                measure(scene.engine, (int(a), int(b)), poses, sample=k).touches
                or is_inside(scene.engine, (int(a), int(b)), poses, sample=k)
                for a, b in pairs
            ]

            place = first_touching(scene.engine, pairs, poses, sample=k)

            assert place == (touching.index(True) if any(touching) else None)
            answers.add(place is None)
    assert answers == {True, False}
