"""Contours of a drawing placed on a surface: points within a chord of it, with travel and normal at each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.flat_curves import WIDEST_STEP, Contour, FlatCurve
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.transforms import frame_from_axes, pose_from

FIRST_STEP: Final = 2e-3  # [m] between the first points of a curve on a surface that is not plane
SHORTEST_STEP: Final = 1e-6  # [m] between points of the drawing: what turns within less is an edge of the part
SHORTEST_TURN: Final = 1e-4  # [m] between points of the drawing: what turns within less is a corner
MOST_POINTS: Final = 200_000
AXIS_STEP: Final = np.deg2rad(2.0)  # [rad] between normals of neighbouring points
FLATTEST: Final = np.sin(np.deg2rad(1.0))  # [-] a surface that is seen at a flatter angle stretches the contour
SMOOTH: Final = 1e-6  # [rad] curves that turn by less where they meet run on without a corner
ALONG_X: Final = np.cos(np.deg2rad(0.1))  # [-] of a direction that leaves +x no part along the plane of a drawing
SURFACE: Final = "surface"  # the wall beside a placed contour


class Projected(NamedTuple):
    """Where points come to lie on a surface."""

    points: Array  # in [m], shape (N, 3), expressed in P
    normals: Array  # outward unit normals, shape (N, 3), expressed in P
    is_hit: Flags  # whether the surface is there, shape (N,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground:
    """What contours are placed on.

    Attributes:
        project: Projection of points in P, shape (N, 3), along the z axis of ``X_PD``.
        X_PD: Pose of the drawing in P in [m], shape (4, 4): z points out of the part.
        is_plane: Whether it is plane.
        name: Words for it in messages.
    """

    project: Callable[[Array], Projected]
    X_PD: Array
    is_plane: bool
    name: str


def drawing_pose(direction: Array, height: float, X_FD: Array) -> Array:
    """Pose, shape (4, 4) in [m], of a drawing in P that is seen from a unit direction, shape (3,).

    Args:
        height: Distance in [m] along the direction of the plane of the drawing from the origin of P.
        X_FD: Pose of the drawing in its frame in this plane: the origin is the one of P, x is +x of P along the plane,
            or +y where the drawing is seen along x.
    """
    hint = np.array([0.0, 1.0, 0.0] if abs(direction[0]) > ALONG_X else [1.0, 0.0, 0.0])
    return pose_from(frame_from_axes(direction, hint), height * direction) @ X_FD


@dataclass(slots=True, eq=False)
class _Samples:
    """Points of a curve on a surface."""

    curve: FlatCurve
    t: Array  # parameters, shape (N,)
    flat: Array  # points in the plane of the drawing in [m], shape (N, 2)
    on: Projected  # points on the surface
    is_open: Flags  # whether the side behind each point but the last has to be examined, shape (N - 1,)

    def refined(self, t: Array, flat: Array, on: Projected, is_off: Flags) -> None:
        """Take those points in the middle of open sides that are off the side."""
        behind = np.flatnonzero(self.is_open)[is_off]
        self.t, self.flat = np.insert(self.t, behind + 1, t[is_off]), np.insert(self.flat, behind + 1, flat[is_off], 0)
        self.on = Projected(*(np.insert(a, behind + 1, b[is_off], 0) for a, b in zip(self.on, on, strict=True)))
        places = behind + np.arange(len(behind))
        self.is_open = np.zeros(len(self.t) - 1, dtype=bool)
        self.is_open[np.concatenate([places, places + 1])] = True


def place_contours(contours: Sequence[Contour], ground: Ground, chord: float, source: str) -> list[SeamLine]:
    """Contours on a surface: each as a line with the one wall ``surface``; a corner stands twice.

    Sides between neighbouring points are within ``chord``, in [m], of the contour on the surface.

    Raises:
        InputError: A point misses the surface, which is named with the point of the drawing; or the contour runs over
            an edge of the part, or a surface that is seen too flat.
    """
    curves = [curve for contour in contours for curve in contour.curves]
    parameters = [_first_parameters(curve, chord, ground) for curve in curves]
    samples = [
        _Samples(curve, t, flat, on, np.ones(len(t) - 1, dtype=bool))
        for curve, t, (flat, on) in zip(curves, parameters, _projected(curves, parameters, ground), strict=True)
    ]
    waiting = [it for it in samples if not (ground.is_plane and len(it.t) == 2 and _is_straight(it))]
    while waiting:
        middles = [0.5 * (it.t[:-1] + it.t[1:])[it.is_open] for it in waiting]
        for it, t, (flat, on) in zip(
            waiting, middles, _projected([it.curve for it in waiting], middles, ground), strict=True
        ):
            is_off = _is_off(it, on, chord)
            _refuse_edges(it, is_off, ground)
            it.refined(t, flat, on, is_off)
        waiting = [it for it in waiting if np.any(it.is_open)]
        if sum(len(it.t) for it in samples) > MOST_POINTS:
            raise InputError(
                f"expected at most {MOST_POINTS} points within the chord, got more; allow a larger chord_mm"
            )
    rows = iter(samples)
    return [_line([next(rows) for _ in contour.curves], contour, ground, source) for contour in contours]


def _first_parameters(curve: FlatCurve, chord: float, ground: Ground) -> Array:
    """Parameters of a curve to begin with: on a surface that is not plane they are near one another."""
    t = curve.parameters(chord)
    if ground.is_plane:
        return t
    lengths = np.linalg.norm(np.diff(curve.rates(t)[0], axis=0), axis=1)
    counts = np.maximum(1, np.ceil(lengths / FIRST_STEP)).astype(int)
    inner = [a + np.arange(n) / n * (b - a) for a, b, n in zip(t[:-1], t[1:], counts, strict=True)]
    return np.append(np.concatenate(inner), t[-1])


def _is_straight(samples: _Samples) -> bool:
    """Whether the middle of a curve lies between its ends."""
    middle = samples.curve.rates(np.array([samples.t.mean()]))[0][0]
    return bool(np.allclose(middle, samples.flat.mean(axis=0), rtol=0.0, atol=1e-12))


def _projected(
    curves: Sequence[FlatCurve], parameters: Sequence[Array], ground: Ground
) -> list[tuple[Array, Projected]]:
    """Points of curves in the plane of the drawing, and on the surface."""
    flat = [curve.rates(t)[0] for curve, t in zip(curves, parameters, strict=True)]
    places, (R, p) = np.concatenate(flat), (ground.X_PD[:3, :3], ground.X_PD[:3, 3])
    on = ground.project(places @ R[:, :2].T + p)
    if not np.all(on.is_hit):
        place = places[int(np.argmin(on.is_hit))]
        raise InputError(f"expected an outline on {ground.name}, but it leaves it at {_at(place)} of the drawing")
    facing = on.normals @ R[:, 2]
    if not np.min(facing, initial=1.0) >= FLATTEST:
        k = int(np.argmin(facing))
        angle = np.rad2deg(np.arcsin(np.clip(facing[k], -1.0, 1.0)))
        raise InputError(
            f"expected a surface that faces the projection, but at {_at(places[k])} of the drawing it is seen at "
            f"{angle:.2g} deg only; project from another side"
        )
    edges = np.cumsum([len(points) for points in flat])[:-1]
    return [(a, Projected(*b)) for a, *b in zip(flat, *(np.split(values, edges) for values in on), strict=True)]


def _is_off(samples: _Samples, middle: Projected, chord: float) -> Flags:
    """Whether the middle of each open side is off it, or there is too great a turn between its ends."""
    behind = np.flatnonzero(samples.is_open)
    a, b, m = samples.on.points[behind], samples.on.points[behind + 1], middle.points
    before, after, side = m - a, b - m, b - a
    length = np.linalg.norm(side, axis=1)
    away = np.linalg.norm(np.cross(before, side), axis=1) / np.where(length > 0.0, length, 1.0)
    turn = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), np.sum(before * after, axis=1))
    normals = samples.on.normals[behind], middle.normals, samples.on.normals[behind + 1]
    lean = np.maximum(*(np.linalg.norm(n - o, axis=1) for n, o in pairwise(normals)))
    is_long = np.linalg.norm(samples.flat[behind + 1] - samples.flat[behind], axis=1) > SHORTEST_TURN
    return (away > chord) | (2.0 * lean > AXIS_STEP) | ((turn > WIDEST_STEP) & is_long)


def _refuse_edges(samples: _Samples, is_off: Flags, ground: Ground) -> None:
    """Refuse a side that is off the contour however short it is."""
    behind = np.flatnonzero(samples.is_open)[is_off]
    short = behind[np.linalg.norm(samples.flat[behind + 1] - samples.flat[behind], axis=1) < SHORTEST_STEP]
    if len(short):
        raise InputError(
            f"expected an outline within a smooth face, but at {_at(samples.flat[short[0]])} of the drawing it runs "
            f"over an edge of {ground.name}"
        )


def _line(samples: Sequence[_Samples], contour: Contour, ground: Ground, source: str) -> SeamLine:
    """The line of a contour."""
    R, rows = ground.X_PD[:3, :3], list[tuple[Array, Array, Array]]()
    for it in samples:
        t = it.curve.at(it.t)[1] @ R[:, :2].T
        n = it.on.normals
        t = t - (np.sum(t * n, axis=1) / (n @ R[:, 2]))[:, None] * R[:, 2]
        rows.append((it.on.points.copy(), t / np.linalg.norm(t, axis=1, keepdims=True), n))
    if contour.is_closed:
        rows[-1][0][-1] = rows[0][0][0]
    parts = [rows[0]]
    for before, (points, travel, normals) in pairwise(rows):
        points[0] = before[0][-1]
        first = 1 if np.linalg.norm(travel[0] - before[1][-1]) < SMOOTH else 0
        parts.append((points[first:], travel[first:], normals[first:]))
    points, travel, normals = (np.concatenate(values) for values in zip(*parts, strict=True))
    behind = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return SeamLine(
        source=source,
        points=points,
        tangents=travel,
        behind=behind,
        walls={SURFACE: normals},
        is_closed=contour.is_closed,
    )


def _at(place: Array) -> str:
    """A point of the drawing in words."""
    x, y = 1e3 * place
    return f"x {x:.3f}, y {y:.3f} mm"
