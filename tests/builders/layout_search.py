"""A quick layout search: the base of the right arm of the planar pair, one trial."""

import shutil
from pathlib import Path

from builders.study_trials import InThisProcess
from cellplan import LayoutRequest, LayoutResult, Stop, search_layout
from cellplan.search.programs.objective import CycleTiming

CELL = Path(__file__).resolve().parents[2] / "cells" / "planar_pair.yaml"
SETTINGS = ("motion.duration_s=2", "motion.step_s=0.02", "checks.clearance_mm=10")


def searched_pair(folder: Path, *settings: str, timing: CycleTiming = CycleTiming.LAWS) -> LayoutResult:
    """Search a layout of ``given.yaml`` into ``study``, both in a folder, without a process of its own.

    Args:
        folder: The folder.
        settings: Further settings of the cell.
        timing: How the program is timed.
    """
    shutil.copy(CELL, folder / "given.yaml")
    request = LayoutRequest(
        cell=folder / "given.yaml",
        settings=(*SETTINGS, *settings),
        vary=("right.base={x_mm: [1500, 2300], y_mm: [0, 600]}",),
        margin=10.0,
        timing=timing,
    )
    return search_layout(request, folder / "study", stop=Stop(trials=1), workers=InThisProcess())
