"""Clearance of runs, begun as soon as their rows are known: in another process, while this one checks all else."""

from collections.abc import Callable

import numpy as np

from cellplan.checks.verify import Clearance, run_clearance
from cellplan.geometry.arrays import Array
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.scene.scene import Scene

Begin = Callable[..., Callable[[], Clearance]]


class EarlyClearance:
    """Works out the clearance of runs as ``solve`` does, with or without the curves that only the page of a run shows.

    A clearance that was begun belongs to its schedule and its rows; for any others it is worked out anew.

    Attributes:
        with_curves: Whether it is worked out with these curves.
    """

    def __init__(self, begin: Begin | None = None, *, with_curves: bool = False) -> None:
        """Prepare.

        Args:
            begin: Begins a function with its arguments in another process and returns what waits for its value; None
                where all is done here.
        """
        self.with_curves, self._begin = with_curves, begin
        self._clearance = run_clearance if with_curves else without_curves
        self._begun: list[tuple[Schedule, Array, Callable[[], Clearance]]] = []

    def begin(self, scene: Scene, schedule: Schedule, q: Array) -> None:
        """Begin with a run whose rows are known; arguments as those of ``run_clearance``."""
        if self._begin is not None:
            self._begun.append((schedule, q, self._begin(self._clearance, scene, schedule, q)))

    def of(self, scene: Scene, schedule: Schedule, q: Array, progress: Progress) -> Clearance:
        """The clearance of a run: what was begun with its schedule and rows, or worked out now."""
        for known, rows, result in self._begun:
            if known is schedule and np.array_equal(rows, q):
                return result()
        return self._clearance(scene, schedule, q, progress=progress)


def without_curves(scene: Scene, schedule: Schedule, q: Array, progress: Progress = silent) -> Clearance:
    """See ``run_clearance``."""
    return run_clearance(scene, schedule, q, with_curves=False, progress=progress)
