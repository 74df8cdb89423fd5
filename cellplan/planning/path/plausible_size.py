"""Paths of an unlikely size or place: errors of the unit, reported before anything is planned."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.arc_length import ArcLength
from cellplan.geometry.curves.curve import Curve
from cellplan.geometry.shapes import bounding_box
from cellplan.geometry.transforms import inverse
from cellplan.model.cell import Part
from cellplan.model.task import Frame, Task, TimedPath
from cellplan.planning.path.formatting import in_mm, length

SHORTEST: Final = 1e-4  # [m] of a path; a trajectory may turn the tool on the spot
FARTHEST: Final = 10.0  # [m] from the box round the part, of a path on the part
LOOKED_AT: Final = 1025  # points of a path, beside its knots


def refuse_unlikely_path(tip: Curve, arc: ArcLength, *, task: Task, part: Part) -> None:
    """Refuse a path that is shorter than anybody works, or far from the part that it is given on.

    Args:
        tip: The tool tip in P.
        arc: Its length.
        task: The task.
        part: The part.

    Raises:
        InputError: With the length, or the farthest point and its distance from the part.
    """
    if not isinstance(task.path, TimedPath) and arc.total < SHORTEST:
        raise InputError(
            f"{task.where('path')}: expected a path of at least {length(SHORTEST)} mm, got {length(arc.total)} mm; "
            "is the unit right?"
        )
    if task.relative_to is not Frame.PART:
        return
    first, last = float(arc.edges[0]), float(arc.edges[-1])
    p_PT, _ = tip.evaluate(np.union1d(arc.edges, np.linspace(first, last, LOOKED_AT)), (first, last))
    X_SP = inverse(part.X_PS)
    middle, half = bounding_box(part.shape)
    beyond = np.maximum(np.abs(p_PT @ X_SP[:3, :3].T + X_SP[:3, 3] - middle) - half, 0.0)
    away = np.linalg.norm(beyond, axis=1)
    k = int(np.argmax(away))
    if not away[k] <= FARTHEST:
        raise InputError(
            f"{task.where('path')}: expected a path within {FARTHEST:g} m of the part, got the point {in_mm(p_PT[k])}, "
            f"{away[k]:.3g} m from it; is the unit right?"
        )
