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
from cellplan.planning.path.formatting import MM, in_mm, length

SHORTEST: Final = 1e-4  # [m] of a path; a trajectory may turn the tool on the spot
FARTHEST: Final = 10.0  # [m] from the box round the part, of a path on the part
LONGEST_IN_METRES: Final = 3e-3  # [m] a longer path would be more than 3 m if its numbers were metres
AROUND: Final = 0.25  # [-] of the size of the part: so far beside it a path may run
LOOKED_AT: Final = 1025  # points of a path, beside its knots


def refuse_path_in_metres(curve: Curve, *, task: Task, part: Part) -> None:
    """Refuse a path of a few millimetres at the origin of the part that would lie on the part if it were in metres.

    Args:
        curve: The path as it is listed, in P, before it is projected.

    Raises:
        InputError: With its length, asking for the unit.
    """
    first, last = float(curve.knots[0]), float(curve.knots[-1])
    p, _ = curve.evaluate(np.union1d(curve.knots, np.linspace(first, last, LOOKED_AT)), (first, last))
    size = float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())
    if isinstance(task.path, TimedPath) or task.relative_to is not Frame.PART or size > LONGEST_IN_METRES:
        return
    X_SP = inverse(part.X_PS)
    middle, half = bounding_box(part.shape)
    across = np.ones(3) if task.project is None else np.abs(task.project) < np.abs(task.project).max()
    beyond = np.abs(MM * p @ X_SP[:3, :3].T + X_SP[:3, 3] - middle) - half - AROUND * 2.0 * half.max()
    if np.all((beyond <= 0.0) | (across == 0.0)) and MM * size > half.min():
        raise InputError(
            f"{task.where('path')}: expected a path in mm, got one of {length(size)} mm at the origin of the part: is "
            "it in metres? A thousand times as large it lies on the part"
        )


def refuse_unlikely_path(tip: Curve, arc: ArcLength, *, task: Task, part: Part) -> None:
    """Refuse a path that is shorter than anybody works, or far from the part that it is given on.

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
