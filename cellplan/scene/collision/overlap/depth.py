r"""Depth of two overlapping solids: how far one must be moved, in the best direction, until they are apart.

For convex solids A and B it is the distance of the origin from the surface of the Minkowski difference,

.. math:: d = \min_{|n| = 1} f(n), \qquad f(n) = \max_{x \in A} n \cdot x - \min_{y \in B} n \cdot y

Every direction proves an upper bound. A support point v of the difference gives a lower bound over a triangle of
directions with the corners :math:`n_j`: a unit vector in it is their combination with positive factors of sum one or
more, so that :math:`f \ge \min_j v \cdot n_j` where that is positive. Triangles that cannot hold the smallest f are
dropped, the others cut in four. What is returned is the upper bound: never less than the true depth.
"""

from typing import Final

import numpy as np

from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.overlap.sunk_points import SUNK_TOL, deepest_point
from cellplan.scene.collision.separation import heights

DEPTH_TOL: Final = 1e-5  # [m] the bound is above the true depth by no more than this …
DEPTH_FRACTION: Final = 1e-3  # [-] … and this share of it
MAX_DIRECTIONS: Final = 60_000  # [-] triangles of directions cut at once; beyond it the bound stays as it is
MAX_LEVELS: Final = 40  # [-] times that triangles are cut, at most: by then they are smaller than rounding
WORK: Final = 2_000_000  # [-] products of a direction and a vertex worked out at once: 16 MB


def overlap_depth(
    engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int, tolerance: float = SUNK_TOL
) -> float:
    """Depth of two solids at a sample in [m]; zero where they do not overlap.

    Exact to 0.01 mm and 0.1 %, and never less than the truth, for convex solids. Where one is a mesh that is not
    convex, it is the depth of the deepest point of the surface of one inside the other (see ``sunk_points``), which is
    never more than the way out, and less than that depth by no more than the tolerance in [m]. Of two open meshes that
    touch, the depth of their convex hulls is taken.
    """
    first, second = pair
    if _are_far(engine, pair, poses, sample=sample):
        return 0.0
    a, b = engine.bodies[first], engine.bodies[second]
    R_A = poses.R[first, sample]
    R_AB = R_A.T @ poses.R[second, sample]
    p_AB = R_A.T @ (poses.p[second, sample] - poses.p[first, sample])
    depth = convex_depth(a.hull, b.hull, R_AB, p_AB)
    if depth == 0.0 or (a.is_convex and b.is_convex):
        return depth
    if not (engine.touch(first, second, poses, sample=sample) or is_inside(engine, pair, poses, sample=sample)):
        return 0.0
    if not (_is_solid(a) or _is_solid(b)):
        return depth
    of_second = deepest_point(b, a, R_AB, p_AB, tolerance=tolerance)
    of_first = deepest_point(a, b, R_AB.T, -R_AB.T @ p_AB, tolerance=tolerance)
    return min(depth, max(of_first, of_second))


def ground_depth(body: CollisionBody, poses: BodyPoses, index: int, *, X_WS: Array) -> Array:
    """How deep solid ``index`` of some poses reaches below a half-space at each sample in [m], shape (N,); exact."""
    return np.maximum(0.0, body.looseness - heights(body.hull, poses.R[index], poses.p[index], X_WS=X_WS))


def convex_depth(first: Solid, second: Solid, R_AB: Array, p_AB: Array) -> float:
    """Depth of convex solids A and B in [m], never less than the truth; zero where they do not overlap.

    B has the rotation ``R_AB``, shape (3, 3), and the position ``p_AB`` in [m], shape (3,), in A.
    """
    n = _octants()
    v = _difference(first, second, R_AB, p_AB, n)
    best = float(np.einsum("kij,kij->ki", v, n).min())
    for _ in range(MAX_LEVELS):
        if best <= 0.0:
            return 0.0
        low = np.einsum("kic,kjc->kij", v, n).min(axis=2).max(axis=1)
        is_open = low < best - DEPTH_TOL - DEPTH_FRACTION * best
        if not is_open.any() or np.count_nonzero(is_open) > MAX_DIRECTIONS:
            break
        n, v = n[is_open], v[is_open]
        middle = n + np.roll(n, -1, axis=1)
        middle /= np.linalg.norm(middle, axis=2, keepdims=True)
        v_middle = _difference(first, second, R_AB, p_AB, middle)
        best = min(best, float(np.einsum("kij,kij->ki", v_middle, middle).min()))
        n, v = _quartered(n, middle), _quartered(v, v_middle)
    return best


def support_points(shape: Solid, n: Array) -> Array:
    """A point of the shape that is farthest along each direction, shape (N, 3), in the shape's frame."""
    points: Array
    match shape:
        case Box(size):
            points = np.where(n >= 0.0, 0.5, -0.5) * np.asarray(size)
        case Cylinder(radius, length):
            across = np.hypot(n[:, 0], n[:, 1])
            points = np.empty_like(n)
            points[:, :2] = radius * n[:, :2] / np.where(across > 0.0, across, 1.0)[:, None]
            points[:, 2] = np.where(n[:, 2] >= 0.0, 0.5, -0.5) * length
        case Capsule(radius, length):
            points = radius * n
            points[:, 2] += np.where(n[:, 2] >= 0.0, 0.5, -0.5) * length
        case Sphere(radius):
            points = radius * n
        case Mesh(vertices):
            step = max(1, WORK // len(vertices))
            chosen = [np.argmax(n[k : k + step] @ vertices.T, axis=1) for k in range(0, len(n), step)]
            points = vertices[np.concatenate(chosen)]
    return points


def _are_far(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> bool:
    """Whether the bounding spheres of two bodies do not meet."""
    first, second = pair
    ends = [poses.R[index, sample] @ engine.centres[index] + poses.p[index, sample] for index in pair]
    return bool(np.linalg.norm(ends[1] - ends[0]) > engine.radii[first] + engine.radii[second])


def _is_solid(body: CollisionBody) -> bool:
    """Whether a body has an inside: all but open meshes have."""
    return not isinstance(body.shape, Mesh) or body.shape.is_closed


def _octants() -> Array:
    """Eight triangles of directions that cover the sphere, shape (8, 3, 3); their corners are the axes."""
    signs = np.array([(x, y, z) for x in (1.0, -1.0) for y in (1.0, -1.0) for z in (1.0, -1.0)])
    return signs[:, :, None] * np.eye(3)


def _difference(first: Solid, second: Solid, R_AB: Array, p_AB: Array, n: Array) -> Array:
    """Support points of the Minkowski difference for directions of shape (K, 3, 3), in A, same shape."""
    flat = n.reshape(-1, 3)
    points = support_points(first, flat) - (support_points(second, -flat @ R_AB) @ R_AB.T + p_AB)
    return points.reshape(n.shape)


def _quartered(corners: Array, middles: Array) -> Array:
    """Each triangle cut in four at the middles of its sides; ``middles[:, i]`` follows ``corners[:, i]``."""
    a, b, c = (corners[:, k] for k in range(3))
    ab, bc, ca = (middles[:, k] for k in range(3))
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.stack(part, axis=1) for part in parts])
