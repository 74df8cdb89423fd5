"""The floor of a picture: a grid, and shadows straight below everything."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import support_point
from cellplan.report.still.camera import Camera
from cellplan.report.still.picture import StillPicture

GRID: Final = 0.5  # [m] between two lines; more for large cells
MOST_LINES: Final = 24  # [-] each way
BORDER: Final = 0.25  # [m] round the cell
ROUND: Final = 2.0 * np.pi * (np.arange(16) + 0.5) / 16
AROUND: Final = np.stack([np.cos(ROUND), np.sin(ROUND), np.zeros(16)], axis=1)


def floor_paths(camera: Camera, points: Array, height: float) -> str:
    """Path of the grid below points in the world, shape (N, 3)."""
    low, high = points[:, :2].min(axis=0) - BORDER, points[:, :2].max(axis=0) + BORDER
    step = GRID
    while float((high - low).max()) / step > MOST_LINES:
        step *= 2.0
    first, last = (np.round(np.floor(low / step + 1e-6)), np.round(np.ceil(high / step - 1e-6)))
    ends = []
    for axis in (0, 1):
        for number in np.arange(first[axis], last[axis] + 1):
            line = np.full((2, 3), height)
            line[:, axis] = step * number
            line[:, 1 - axis] = step * first[1 - axis], step * last[1 - axis]
            ends.append(line)
    seen = np.rint(camera.project(np.array(ends))[..., :2]).astype(np.int64).tolist()
    return "".join(f"M{a} {b}L{c} {d}" for (a, b), (c, d) in seen)


def shadow_path(camera: Camera, picture: StillPicture) -> str:
    """Path of the shadows of all solids that are above the floor, from light straight above."""
    parts = []
    for solid in picture.solids:
        R, p = solid.X_WS[:3, :3], solid.X_WS[:3, 3]
        outline = np.array([R @ support_point(solid.shape, R.T @ n) + p for n in AROUND])
        outline[:, 2] = picture.floor
        seen = np.rint(camera.project(outline)[:, :2]).astype(np.int64)
        points = seen[np.any(seen != np.roll(seen, 1, axis=0), axis=1)].tolist()
        if len(points) > 2:
            parts.append("M" + "L".join(f"{x} {y}" for x, y in points) + "z")
    return "".join(parts)
