"""Places of a base: a grid in the horizontal plane, with the height and the tilt of the base kept."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.transforms import rotation_about
from cellplan.model.units import MM

UP: Final = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """K places of a base, row by row from the smallest y, each row from the smallest x."""

    x: Array  # values of x in [mm], ascending, shape (columns,)
    y: Array  # values of y in [mm], ascending, shape (rows,)
    yaw: Array  # angle of the base about the vertical in [rad], shape (K,)
    X_WB: Array  # bases in the world, shape (K, 4, 4)

    @classmethod
    def of(cls, X_WB: Array, x: Array, y: Array, *, yaw: float | None = None, toward: Array | None = None) -> "Places":
        """Places of a base.

        Args:
            X_WB: The present base, shape (4, 4); its height and tilt are kept.
            x: Values of x in [mm], shape (columns,).
            y: Values of y in [mm], shape (rows,).
            yaw: Angle of all bases about the vertical in [rad]; None for the present one.
            toward: Point in the world in [m] that the x axis of each base is turned to, shape (3,).
        """
        points = np.stack([np.tile(x, len(y)), np.repeat(y, len(x))], axis=1) / MM
        present = float(np.arctan2(X_WB[1, 0], X_WB[0, 0]))
        angles = np.full(len(points), present if yaw is None else yaw)
        if toward is not None:
            angles = np.arctan2(toward[1] - points[:, 1], toward[0] - points[:, 0])
        bases = np.tile(X_WB, (len(points), 1, 1))
        if yaw is not None or toward is not None:
            bases[:, :3, :3] = rotation_about(UP, angles - present) @ X_WB[:3, :3]
        bases[:, :2, 3] = points
        return cls(x=x, y=y, yaw=angles, X_WB=bases)

    def __len__(self) -> int:
        """Number of places."""
        return len(self.X_WB)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return len(self.y), len(self.x)

    def coarse(self, stride: int) -> Indices:
        """Places of every so manieth row and column, shape (C,)."""
        rows, columns = np.meshgrid(*(np.arange(0, count, stride) for count in self.shape), indexing="ij")
        return (rows * self.shape[1] + columns).ravel()

    def neighbours(self, stride: int) -> Indices:
        """Pairs of places that are so many rows or columns, or both, apart, both ways, shape (P, 2)."""
        index = np.arange(len(self)).reshape(self.shape)
        pairs = [np.zeros((0, 2), dtype=np.intp)]
        for down, right in ((0, stride), (stride, 0), (stride, stride), (stride, -stride)):
            if down >= self.shape[0] or abs(right) >= self.shape[1]:
                continue
            first, second = index[: self.shape[0] - down], index[down:]
            if right > 0:
                first, second = first[:, :-right], second[:, right:]
            elif right < 0:
                first, second = first[:, -right:], second[:, :right]
            pairs += [np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ((first, second), (second, first))]
        return np.concatenate(pairs)
