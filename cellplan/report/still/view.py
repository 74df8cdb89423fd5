"""The direction from which a picture is taken: what matters is in sight and not foreshortened."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.shapes import bounding_box
from cellplan.report.still.camera import view_axes
from cellplan.report.still.picture import ShownSolid, StillPicture

AZIMUTHS: Final = np.radians(np.arange(-50.0, 310.0, 15.0))  # the first ones are preferred among equals
ELEVATIONS: Final = np.radians((28.0, 16.0, 42.0, 60.0, 90.0))
IN_SIGHT: Final = 2.0  # weight of the share of points that nothing hides
ROBOTS_IN_SIGHT: Final = 1.0  # weight of the share of the robots that the surroundings do not hide
UNSHORTENED: Final = 1.5  # weight of the length of the connection on the sheet by its true length
ENOUGH: Final = 0.94  # [-] of that: more is not better
WIDE: Final = 0.25  # weight of how much of the sheet the cell fills
USUAL: Final = (0.20, 0.12, 0.14, 0.0, -0.3)  # for each of the elevations
BETWEEN: Final = (0.15, 0.5, 0.85)  # places along the connection that are to be seen
BODY: Final = 0.3  # [m] by which solids stick out beyond their middles, about
PARALLEL: Final = 1e-12  # [-] component of a direction that lies in the face of a box
STEP: Final = 1e-6  # [-] scores that differ by less are equal


def best_axes(picture: StillPicture, aspect: float) -> Array:
    """Axes of the camera for a picture, shape (3, 3)."""
    choices = [(view_axes(a, e), usual) for e, usual in zip(ELEVATIONS, USUAL, strict=True) for a in AZIMUTHS]
    axes = np.array([axes_tried for axes_tried, _ in choices])
    scores = np.array([usual for _, usual in choices]) + WIDE * _filled(picture, axes, aspect)
    scores += ROBOTS_IN_SIGHT * _robots_in_sight(picture, axes[:, 2])
    if len(picture.mark):
        scores += IN_SIGHT * _in_sight(picture, axes[:, 2])
    if len(picture.mark) == 2:
        line = picture.mark[1] - picture.mark[0]
        length = float(np.linalg.norm(line))
        seen = np.linalg.norm(axes[:, :2] @ line, axis=1) / max(length, 1e-9)
        scores += UNSHORTENED * np.minimum(seen, ENOUGH)
    return axes[int(np.argmax(np.round(scores / STEP)))]


def _in_sight(picture: StillPicture, toward: Array) -> Array:
    """Share of what matters that no box round a solid hides, for directions to the viewer of shape (D, 3)."""
    sights = list(_sights(picture))
    points = np.array([point for point, _ in sights])
    hidden = np.zeros((len(toward), len(points)), dtype=bool)
    for solid in picture.solids:
        hidden |= _hides(solid, points, toward) & np.array([solid.name not in marked for _, marked in sights])
    return 1.0 - hidden.mean(axis=1)


def _robots_in_sight(picture: StillPicture, toward: Array) -> Array:
    """Share of what robots move that the surroundings do not hide, for directions to the viewer of shape (D, 3)."""
    points = np.array([solid.X_WS[:3, 3] for solid in picture.solids if solid.robot is not None]).reshape(-1, 3)
    hidden = np.zeros((len(toward), len(points)), dtype=bool)
    for solid in picture.solids:
        if solid.robot is None:
            hidden |= _hides(solid, points, toward)
    return 1.0 - hidden.mean(axis=1) if len(points) else np.ones(len(toward))


def _hides(solid: ShownSolid, points: Array, toward: Array) -> Flags:
    """Whether the box round a solid lies before points, shape (P, 3), seen from directions, shape (D, 3)."""
    middle, half = bounding_box(solid.shape)
    R, p = solid.X_WS[:3, :3], solid.X_WS[:3, 3]
    start = (points - p) @ R - middle  # in the frame of the solid
    step = (toward @ R)[:, None]
    step = np.where(np.abs(step) < PARALLEL, PARALLEL, step)
    first, second = (-half - start) / step, (half - start) / step
    enters = np.minimum(first, second).max(axis=-1)
    return np.maximum(first, second).min(axis=-1) > np.maximum(enters, 0.0)


def _sights(picture: StillPicture) -> Iterator[tuple[Array, tuple[str, ...]]]:
    """Points that are to be seen, with the names of the solids that they lie in."""
    marked = tuple(picture.marked)
    if len(picture.mark) == 2:
        for share in BETWEEN:
            yield picture.mark[0] + share * (picture.mark[1] - picture.mark[0]), ()
    else:
        yield picture.mark[0], marked
        yield picture.mark[0], marked
    for solid in picture.solids:
        if solid.name in marked:
            yield solid.X_WS[:3, 3], (solid.name,)


def _filled(picture: StillPicture, axes: Array, aspect: float) -> Array:
    """How much of the sheet middles of solids and lines fill, from 0 in the worst direction to 1 in the best."""
    middles = np.array([solid.X_WS[:3, 3] for solid in picture.solids]).reshape(-1, 3)
    points = np.concatenate([middles, *(line.points for line in picture.lines), picture.mark])
    if not len(points):
        return np.zeros(len(axes))
    size = np.ptp(points @ np.swapaxes(axes[:, :2], -1, -2), axis=1) + BODY
    filled = size.prod(axis=1) / np.maximum(size[:, 0], aspect * size[:, 1]) ** 2
    return (filled - filled.min()) / max(float(np.ptp(filled)), PARALLEL)
