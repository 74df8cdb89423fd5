"""Pairs of bodies that meet in a phase: idle robots whose homes are still to be found are not where they start."""

import numpy as np
from numpy.typing import NDArray

from cellplan.certify.run_pairs import rows_moved_by
from cellplan.model.phase import Phase
from cellplan.planning.modes import homeless
from cellplan.scene.scene import Scene


def present_pairs(scene: Scene, phase: Phase) -> NDArray[np.bool_]:
    """Which pairs of a scene do not depend on a home that is still to be found, shape (pairs,)."""
    is_present = np.ones(len(scene.pairs), dtype=bool)
    for name in homeless(scene.cell, phase):
        is_present[rows_moved_by(scene, name)] = False
    return is_present
