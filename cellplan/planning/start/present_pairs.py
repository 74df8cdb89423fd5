"""Pairs of bodies that meet in a run: idle robots whose homes are still to be found are not where they start."""

import numpy as np
from numpy.typing import NDArray

from cellplan.certify.run_pairs import rows_moved_by
from cellplan.planning.modes import RunPlan, homeless
from cellplan.scene.scene import Scene


def present_pairs(scene: Scene, plan: RunPlan) -> NDArray[np.bool_]:
    """Which pairs of a scene do not wait for the home of an idle robot, shape (pairs,)."""
    is_present = np.ones(len(scene.pairs), dtype=bool)
    for name in homeless(scene.cell, plan):
        is_present[rows_moved_by(scene, name)] = False
    return is_present
