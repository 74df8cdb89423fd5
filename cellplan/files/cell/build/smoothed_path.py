"""Points and tool axes of a file, smoothed within the tube that a cell allows."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.files.schema.path import WIDEST_SMOOTHED_DEG, SmoothEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import chord_lengths
from cellplan.geometry.curves.smoothed_chain import Chain, SmoothedValues, angles_between
from cellplan.geometry.transforms import rotation_exp
from cellplan.model.settings.entry import FARTHEST_MM
from cellplan.model.settings.units import si_or_none
from cellplan.model.task.smoothing import Roughness, Smoothing
from cellplan.model.task.task import ProgrammedPath, SampledPath

GAINED: Final = 0.95  # [-] of the roughness of a file: a tube in which more is left gains nothing
WORTH: Final = 0.8  # [-] of it: a wider tube that leaves no more is proposed
TRIED: Final = 4  # tubes, each four times as wide as the one before, to see what a wider one gains
BEYOND: Final = 10.0  # [-] of a tolerance: no tube that is tried is wider
LEAST_SIDE: Final = 1e-9  # [m] of a path that can be smoothed; a shorter side is refused where the path is drawn


def smoothed(path: SampledPath, entry: SmoothEntry, axis: Array | None) -> SampledPath:
    """A path with smooth points and axes in the tube of an entry; ends and corners with a stop stay.

    Args:
        axis: Unit tool axis of a path whose file gives none, shape (3,); None where nothing is known of it.
    """
    points = np.vstack([path.points, path.points[:1]]) if path.is_closed else path.points
    if len(points) < 3 or np.linalg.norm(np.diff(points, axis=0), axis=1).min() <= LEAST_SIDE:
        return path
    axes, chain = path.tool_axes, _chain(path, chord_lengths(points))
    normals = axes if axes is not None or axis is None else np.tile(axis, (len(path.points), 1))
    position, direction = si_or_none(entry.position_mm) or 0.0, si_or_none(entry.direction_deg) or 0.0
    into = entry.into_mm.si
    moved = chain.with_points(path.points, normals, radius=position, into=into) if position else None
    turned = chain.with_axes(axes, angle=direction) if direction and axes is not None else None
    smoothing = Smoothing(
        listed=path,
        position=position,
        direction=direction,
        into=into,
        of_points=_roughness(moved),
        of_axes=_roughness(turned),
    )
    if moved is not None:
        path = replace(path, points=moved.values)
    if turned is not None and path.rotations is not None and axes is not None:
        path = replace(path, rotations=_turns(axes, turned.values) @ path.rotations)
    elif turned is not None:
        path = replace(path, axes=turned.values)
    return replace(path, smoothing=smoothing)


def narrow_tubes(path: SampledPath, task: TaskEntry, axis: Array | None) -> Iterator[tuple[str, str]]:
    """Keys of ``path.smooth`` whose tube gains nothing on a path that was smoothed, and what a wider one leaves."""
    entry, allowed = task.path.smooth, task.tolerance.filled
    keys = (
        ("position_mm", "of_points", "mm", min(BEYOND * allowed.position_mm, FARTHEST_MM)),
        ("direction_deg", "of_axes", "deg", min(BEYOND * allowed.orientation_deg, WIDEST_SMOOTHED_DEG)),
    )
    for key, field, unit, most in keys:
        tube, left = getattr(entry, key), _share(path, field)
        if entry is None or left is None or left <= GAINED:
            continue
        others = {"into_mm": entry.into_mm} if key == "position_mm" else {}
        for wider in (min(tube * 4.0**k, most) for k in range(1, TRIED + 1)):
            tried = smoothed(path.listed, SmoothEntry.model_validate({key: wider, **others}), axis)
            with_wider = _share(tried, field) or 0.0
            if with_wider <= WORTH or wider == most:
                break
        cure = f"one of {wider:g} {unit} leaves {100.0 * with_wider:.0f} %" + (
            "; leave it out" if with_wider > WORTH else ""
        )
        text = (
            f"a tube of {tube:g} {unit} gains nothing: {100.0 * left:.1f} % of the roughness of {path.source} is left"
        )
        yield key, f"{text}; {cure}"


def _share(path: SampledPath, field: str) -> float | None:
    """The roughness that is left of the given one; None where there was none, or nothing is smoothed."""
    roughness: Roughness | None = None if path.smoothing is None else getattr(path.smoothing, field)
    return None if roughness is None or not roughness.given else roughness.smoothed / roughness.given


def _chain(path: SampledPath, knots: Array) -> Chain:
    """The points of a path, of which the start, the end, stops, and rapids stay."""
    kinks, fixed = np.zeros((2, len(path.points)), dtype=bool)
    fixed[0] = True
    fixed[-1] = not path.is_closed
    if isinstance(path, ProgrammedPath):
        kinks[1:-1] = path.inner_stops
        fixed |= kinks | np.append(path.is_rapid, False) | np.append(False, path.is_rapid)
    is_curved = not isinstance(path, ProgrammedPath)
    return Chain(knots=knots, kinks=kinks, fixed=fixed, is_closed=path.is_closed, is_curved=is_curved)


def _roughness(smoothed: SmoothedValues | None) -> Roughness | None:
    """How rough points or axes were and are; None where they stay."""
    if smoothed is None:
        return None
    return Roughness(given=smoothed.given, smoothed=smoothed.smoothed, bound=smoothed.bound)


def _turns(before: Array, after: Array) -> Array:
    """Rotations of the least angle that turn unit vectors, shape (N, 3), to others, shape (N, 3, 3)."""
    across = np.cross(before, after)
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    return rotation_exp(across * angles_between(before, after)[:, None] / np.where(sine > 0.0, sine, 1.0))
