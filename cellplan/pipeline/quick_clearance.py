"""Clearance of the motions of a search: without curves, and in another process while this one checks all else."""

from collections.abc import Callable

import numpy as np

from cellplan.checks.verify import Clearance, run_clearance
from cellplan.geometry.arrays import Array
from cellplan.model.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.scene.scene import Scene

Begin = Callable[..., Callable[[], Clearance]]


class QuickClearance:
    """Works out the clearance of runs as ``solve`` does, but for the curves that only the page of a run shows."""

    def __init__(self, begin: Begin | None = None) -> None:
        """Prepare.

        Args:
            begin: Begins a function with its arguments in another process and returns what waits for its value; None
                where all is done here.
        """
        self._begin = begin
        self._begun: list[tuple[Schedule, Array, Callable[[], Clearance]]] = []

    def begin(self, scene: Scene, schedule: Schedule, q: Array) -> None:
        """Begin with a run whose rows are known; arguments as those of ``run_clearance``."""
        if self._begin is not None:
            self._begun.append((schedule, q, self._begin(without_curves, scene, schedule, q)))

    def of(self, scene: Scene, schedule: Schedule, q: Array, progress: Progress) -> Clearance:
        """The clearance of a run: what was begun with its schedule and rows, or worked out now."""
        for known, rows, result in self._begun:
            if known is schedule and np.array_equal(rows, q):
                return result()
        return without_curves(scene, schedule, q, progress)


def without_curves(scene: Scene, schedule: Schedule, q: Array, progress: Progress = silent) -> Clearance:
    """See ``run_clearance``."""
    return run_clearance(scene, schedule, q, with_curves=False, progress=progress)
