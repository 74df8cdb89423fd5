"""Parallel projection of the world onto a sheet."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Camera:
    """A parallel projection."""

    axes: Array  # rows right, up and towards the viewer in W, unit vectors, shape (3, 3)
    middle: Array  # what is shown in the middle, along right and up in [m], shape (2,)
    scale: float  # units of the sheet per metre
    place: Array  # where the middle is on the sheet, shape (2,)

    def project(self, points: Array) -> Array:
        """Points in the world in [m], shape (..., 3), as x to the right and y down on the sheet and depth in [m].

        The depth grows towards the viewer.
        """
        seen = points @ self.axes.T
        x = self.place[0] + self.scale * (seen[..., 0] - self.middle[0])
        y = self.place[1] - self.scale * (seen[..., 1] - self.middle[1])
        return np.stack([x, y, seen[..., 2]], axis=-1)


def view_axes(azimuth: float, elevation: float) -> Array:
    """Axes of a camera that stands in a direction from the middle, with the world's z upwards on the sheet.

    Args:
        azimuth: Angle of the direction about the world's z in [rad], 0 along x.
        elevation: Its angle above the horizontal in [rad].
    """
    a, e = azimuth, elevation
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return np.stack([right, np.cross(toward, right), toward])


def framed(axes: Array, points: Array, *, low: Array, high: Array) -> Camera:
    """The camera that shows points in the world, shape (N, 3), as large as a rectangle of the sheet allows.

    Args:
        low: Left upper corner of the rectangle, shape (2,).
        high: Right lower corner, shape (2,).
    """
    seen = points @ axes[:2].T
    least, most = seen.min(axis=0), seen.max(axis=0)
    scale = float(((high - low) / np.maximum(most - least, 1e-3)).min())
    return Camera(axes=axes, middle=0.5 * (least + most), scale=scale, place=0.5 * (low + high))
