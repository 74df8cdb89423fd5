"""Runs of contours: points before and behind a contour on which the tool comes to its feed and to rest."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.extension import Tail
from cellplan.geometry.curves.flat_curves import WIDEST_STEP
from cellplan.model.settings.runs import RunsEntry

LIFT_SIDES: Final = 48  # straight sides of a run that is lifted


def with_run_points(
    points: Array, axes: Array, tangents: Array, *, runs: RunsEntry, chord: float
) -> tuple[Array, Array, Flags]:
    """A contour with its runs, and which of its sides they are.

    Args:
        points: Tool tips along it in [m], shape (N, 3), expressed in P.
        axes: Unit tool axes into the part, shape (N, 3), which stay on the runs as they are at the ends.
        tangents: Unit directions of travel at both ends, shape (2, 3).
        runs: What is stated of its runs.
        chord: Largest distance in [m] of an arc from its straight sides.

    Returns:
        Points and axes, shape (M, 3) each, and whether each side is one of a run, shape (M - 1,).
    """
    first, last = runs.has_runs
    before = _run((points[0], tangents[0], axes[0]), runs, sign=-1.0, chord=chord)[::-1] if first else points[:0]
    behind = _run((points[-1], tangents[1], axes[-1]), runs, sign=1.0, chord=chord) if last else points[:0]
    is_run = np.repeat([True, False, True], [len(before), len(points) - 1, len(behind)])
    held = np.concatenate([np.tile(axes[0], (len(before), 1)), axes, np.tile(axes[-1], (len(behind), 1))])
    return np.concatenate([before, points, behind]), held, is_run


def _run(end: tuple[Array, Array, Array], runs: RunsEntry, *, sign: float, chord: float) -> Array:
    """Points of a run from the end of the work on, without it; ``end`` has tip, tangent and tool axis there."""
    p, along, axis = end
    across = np.sign(runs.arc) * np.cross(along, axis)
    tail = Tail(
        p=p,
        dp=along,
        side=across / max(float(np.linalg.norm(across)), np.finfo(float).tiny),
        normal=-axis,
        straight=runs.straights[0 if sign < 0.0 else 1],
        arc=abs(runs.arc),
        lift=runs.lift_mm.si,
        sign=sign,
    )
    arc = 0.5 * np.pi * tail.arc
    widest = min(WIDEST_STEP, 2.0 * float(np.arccos(1.0 - min(1.0, chord / tail.arc)))) if arc else np.inf
    places = np.union1d(np.linspace(0.0, arc, 1 + int(np.ceil(0.5 * np.pi / widest))), [tail.length])
    if tail.lift:
        places = np.union1d(places, np.linspace(0.0, tail.length, 1 + LIFT_SIDES))
    return tail.evaluate(sign * places[1:])[0]
