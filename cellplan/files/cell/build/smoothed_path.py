"""Points and tool axes of a file, smoothed within the tube that a cell allows."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.files.schema.path import SmoothEntry
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import chord_lengths, smooth_through
from cellplan.geometry.curves.smoothing import Differences, Tube, smoothest
from cellplan.geometry.transforms import rotation_exp
from cellplan.model.settings.units import si_or_none
from cellplan.model.task.smoothing import Roughness, Smoothing
from cellplan.model.task.task import ProgrammedPath, SampledPath

PROBES: Final = 9  # places of each span at which a curve is held against that of the file
ROUNDS: Final = 6  # with a narrower tube where the curve between points leaves it
MORE: Final = 1.5  # [-] of the depth between points by which that of the points is made less
LEAST_SIDE: Final = 1e-9  # [m] of a path that can be smoothed; a shorter side is refused where the path is drawn


def smoothed(path: SampledPath, entry: SmoothEntry, axis: Array | None) -> SampledPath:
    """A path with smooth points and axes in the tube of an entry; ends and corners with a stop stay.

    Args:
        axis: Unit tool axis of a path whose file gives none, shape (3,); None where nothing is known of it.
    """
    points = np.vstack([path.points, path.points[:1]]) if path.is_closed else path.points
    if len(points) < 3 or np.linalg.norm(np.diff(points, axis=0), axis=1).min() <= LEAST_SIDE:
        return path
    axes = path.tool_axes
    normals = axes if axes is not None or axis is None else np.tile(axis, (len(path.points), 1))
    chain = _Chain(path, chord_lengths(points))
    position, direction = si_or_none(entry.position_mm) or 0.0, si_or_none(entry.direction_deg) or 0.0
    moved, of_points = (path.points, None) if not position else chain.with_points(normals, position, entry.into_mm.si)
    turned, of_axes = (axes, None) if not direction or axes is None else chain.with_axes(axes, direction)
    smoothing = Smoothing(
        listed=path,
        position=position,
        direction=direction,
        into=entry.into_mm.si,
        of_points=of_points,
        of_axes=of_axes,
    )
    rotations = path.rotations
    if rotations is not None and axes is not None and turned is not None:
        rotations = _turns(axes, turned) @ rotations
    return replace(
        path, points=moved, axes=None if path.axes is None else turned, rotations=rotations, smoothing=smoothing
    )


class _Chain:
    """The points of a path, of which some stay."""

    def __init__(self, path: SampledPath, knots: Array) -> None:
        """Store what stays: the start, the end, stops, and rapids."""
        self._path, self._knots = path, knots
        kinks, fixed = np.zeros((2, len(path.points)), dtype=bool)
        fixed[0] = True
        fixed[-1] = not path.is_closed
        if isinstance(path, ProgrammedPath):
            kinks[1:-1] = path.inner_stops
            fixed |= kinks | np.append(path.is_rapid, False) | np.append(False, path.is_rapid)
        self._fixed: Flags = fixed
        self._differences = Differences(knots, kinks=kinks, is_closed=path.is_closed)

    def with_points(self, normals: Array | None, radius: float, into: float) -> tuple[Array, Roughness]:
        """Points within a radius in [m] of those of the file, and within ``into`` along normals, shape (N, 3)."""
        points, within, depth, least = self._path.points, radius, into, 0.0
        for _ in range(ROUNDS):
            tube = Tube.of_positions(normals, len(points), radius=within, into=depth)
            values, bound = smoothest(points, self._differences, tube, fixed=self._fixed)
            least = bound if (within, depth) == (radius, into) else least
            off = self._between(values - points)
            most = float(np.linalg.norm(off, axis=1).max())
            deepest = -np.inf if normals is None else float(np.sum(off * self._between(normals), axis=1).max())
            if most <= radius and deepest <= into:
                break
            within *= min(1.0, radius / most)
            depth = max(depth - MORE * max(0.0, deepest - into), -0.5 * within)
        values = points + min(1.0, radius / most) * (values - points)
        return values, self._roughness(points, values, least)

    def with_axes(self, axes: Array, angle: float) -> tuple[Array, Roughness]:
        """Unit axes within an angle in [rad] of those of the file."""
        within, least = angle, 0.0
        for _ in range(ROUNDS):
            values, bound = smoothest(axes, self._differences, Tube.of_axes(axes, angle=within), fixed=self._fixed)
            values = np.where(self._fixed[:, None], axes, _unit(values))
            least = bound if within == angle else least
            most = float(_angles(_unit(self._between(values)), _unit(self._between(axes))).max())
            if most <= angle:
                break
            within *= angle / most
        return values, self._roughness(axes, values, least)

    def _roughness(self, listed: Array, values: Array, bound: float) -> Roughness:
        of = self._differences.roughness
        return Roughness(given=of(listed), smoothed=of(values), bound=min(bound, of(values)))

    def _between(self, values: Array) -> Array:
        """Values at the points and, where a smooth curve joins them, between them, shape (M, 3)."""
        if isinstance(self._path, ProgrammedPath):
            return values
        values = np.vstack([values, values[:1]]) if self._path.is_closed else values
        breaks = np.zeros(len(values), dtype=bool)
        breaks[[0, -1]] = not self._path.is_closed
        share = np.linspace(0.0, 1.0, PROBES)[:-1]
        u = np.append((self._knots[:-1, None] + share * np.diff(self._knots)[:, None]).ravel(), self._knots[-1])
        curve = smooth_through(self._knots, values, breaks=breaks)
        return curve.evaluate(u, (float(self._knots[0]), float(self._knots[-1])))[0]


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _turns(before: Array, after: Array) -> Array:
    """Rotations of the least angle that turn unit vectors, shape (N, 3), to others, shape (N, 3, 3)."""
    across = np.cross(before, after)
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    return rotation_exp(across * _angles(before, after)[:, None] / np.where(sine > 0.0, sine, 1.0))


def _angles(a: Array, b: Array) -> Array:
    """Angles in [rad] between unit vectors, shape (N,), from their chords."""
    return 2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(a - b, axis=1)))
