"""Distances of line segments, many pairs at once."""

import numpy as np

from cellplan.geometry.arrays import Array


def line_gaps(first: Array, second: Array) -> Array:
    """From the nearest point of each first segment, shape (M, 2, 3), to that of the second, in [m], shape (M, 3).

    The nearest points of two lines, or, where one of these lies beyond an end, of that end and the other segment.
    """
    p, q = first[:, 0], second[:, 0]
    u, v, w = first[:, 1] - p, second[:, 1] - q, q - p
    uu, vv, uv, uw, vw = (np.einsum("mi,mi->m", x, y) for x, y in ((u, u), (v, v), (u, v), (u, w), (v, w)))
    determinant = uu * vv - uv * uv
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.clip(np.nan_to_num((uw * vv - vw * uv) / determinant), 0.0, 1.0)
        t = np.clip(np.nan_to_num((s * uv - vw) / vv), 0.0, 1.0)
        s = np.clip(np.nan_to_num((t * uv + uw) / uu), 0.0, 1.0)
    return w + t[:, None] * v - s[:, None] * u
