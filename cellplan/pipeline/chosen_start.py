"""The start of a cell, given or found; where none is found, what stands wrongly is named as well."""

from collections.abc import Mapping

import numpy as np

from cellplan.checks.mounting import check_mounting
from cellplan.errors import StartNotFoundError
from cellplan.model.progress import Progress, silent
from cellplan.model.toolpath import Toolpath
from cellplan.planning.start_search import StartChoice, choose_start
from cellplan.scene.mounting import Mount
from cellplan.scene.scene import Scene


def chosen_start(scene: Scene, toolpaths: Mapping[str, Toolpath], *, progress: Progress = silent) -> StartChoice:
    """Start configuration of the whole cell: see `choose_start`.

    A base that is deep in a floor or a fence often leaves its robot no start at all. What stands does not depend on
    the start, so its depth is known even then.

    Raises:
        StartNotFoundError: No configuration reaches all tasks within limits and without collision.
    """
    try:
        return choose_start(scene, toolpaths, progress=progress)
    except StartNotFoundError as error:
        anywhere = np.zeros((1, scene.cell.joint_count))
        judged = [check for check in check_mounting(scene, anywhere) if check.name == Mount.STANDING]
        faults = [check.message for check in judged if not check.passed]
        if not faults:
            raise
        raise StartNotFoundError(f"{error}; what stands wrongly comes first: {'; '.join(faults)}") from error
