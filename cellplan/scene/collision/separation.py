r"""Proof that two convex solids are apart: a direction in which everything of one lies before everything of the other.

.. math:: LB(n) = \min_{x \in B} n \cdot x - \max_{x \in A} n \cdot x = -h_B(-n) - h_A(n)

holds for every unit direction, however it was proposed, and equals the distance for the right one.
"""

import numpy as np

from cellplan.geometry.shapes import Mesh, Solid, support
from cellplan.geometry.transforms import Array, rotated_back

SUPPORT_CHUNK = 500_000  # [-] products of a direction and a vertex worked out at once: 4 MB


def separation(
    first: Solid, second: Solid, n: Array, *, X_first: tuple[Array, Array], X_second: tuple[Array, Array]
) -> float:
    """Distance in [m] that a direction proves between two convex solids; negative when it proves nothing.

    The direction leads from the first to the second in the world, shape (3,), of any length; both solids have a
    rotation and a position in the world.
    """
    length = float(np.linalg.norm(n))
    if not length > 0.0:
        return -np.inf
    n = n / length
    (R_A, p_A), (R_B, p_B) = X_first, X_second
    return float(n @ (p_B - p_A) - support(first, n @ R_A) - support(second, -n @ R_B))


def supports(shape: Solid, directions: Array) -> Array:
    """Support function of a convex solid for many directions, shape (N, 3), without a large array in between."""
    if not isinstance(shape, Mesh):
        return support(shape, directions)
    step = max(1, SUPPORT_CHUNK // len(shape.vertices))
    reach = np.empty(len(directions))
    for first in range(0, len(directions), step):
        reach[first : first + step] = support(shape, directions[first : first + step])
    return reach


def heights(shape: Solid, R: Array, p: Array, *, X_WS: Array) -> Array:
    """Distance of a solid above a half-space at each sample in [m], exact; zero or less where they touch.

    The solid, or its hull, has rotations, shape (N, 3, 3), and positions in the world, shape (N, 3); everything below
    the xy plane of the half-space is solid.
    """
    up = X_WS[:3, 2]
    return p @ up - X_WS[:3, 3] @ up - supports(shape, -rotated_back(R, up))
