"""Projection of points along a direction onto solids: in closed form, or by rays on a mesh."""

from collections.abc import Callable

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.placed_contours import Projected
from cellplan.geometry.curves.surface_patch import Patch, patches_facing
from cellplan.geometry.mesh.load import normals_at, ray_hits
from cellplan.geometry.shapes import Capsule, Mesh, Solid, bounding_sphere
from cellplan.geometry.transforms import inverse, transform_points


def projection_onto(shape: Solid, X_PS: Array, direction: Array) -> Callable[[Array], Projected]:
    """Projection of points in P, shape (N, 3) in [m], onto a solid as it is seen from a unit direction, shape (3,)."""
    if isinstance(shape, Mesh):
        return lambda points: _onto_mesh(shape, X_PS, points, direction)
    if isinstance(shape, Capsule):
        raise TypeError("expected a box, cylinder, sphere or mesh to project on, got a capsule")
    patches = patches_facing(shape, X_PS, direction)
    return lambda points: _onto_patches(patches, points, direction)


def _onto_mesh(mesh: Mesh, X_PS: Array, points: Array, direction: Array) -> Projected:
    """First hits of rays from outside."""
    centre, radius = bounding_sphere(mesh)
    away = (transform_points(X_PS, centre[None])[0] - points) @ direction + 2.0 * radius
    X_SP, R = inverse(X_PS), X_PS[:3, :3]
    hits = ray_hits(mesh, transform_points(X_SP, points + away[:, None] * direction), -X_SP[:3, :3] @ direction)
    p, normals = np.full(points.shape, np.nan), np.full(points.shape, np.nan)
    hit = hits.is_hit
    p[hit] = points[hit] + (away[hit] - hits.distance[hit])[:, None] * direction
    normals[hit] = normals_at(mesh, hits.points[hit], hits.faces[hit]) @ R.T
    return Projected(p, normals, hit)


def _onto_patches(patches: tuple[Patch, ...], points: Array, direction: Array) -> Projected:
    """Hits of the patch that a line meets within its border."""
    p, normals = np.full(points.shape, np.nan), np.full(points.shape, np.nan)
    is_hit = np.zeros(len(points), dtype=bool)
    for patch in patches:
        hits = patch.hits(points, direction)
        new = patch.covers(hits) & ~is_hit
        p[new], normals[new] = hits[new], patch.normals(hits[new])
        is_hit |= new
    return Projected(p, normals, is_hit)
