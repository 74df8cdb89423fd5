"""How deep points of one solid's surface lie inside another: the measure of overlap where a mesh is not convex.

A point at depth d is at least d away from the outside, so that the way out is never shorter than this depth. It may be
longer: two crossing rods are as deep in each other as their radii say, whatever their lengths.
"""

from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses, CollisionBody, prepare
from cellplan.collision.engine import Engine
from cellplan.geometry.mesh.rays import ray_hits
from cellplan.geometry.mesh.tessellation import halved, tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere
from cellplan.geometry.transforms import Array

DEPTH_TOL: Final = 5e-4  # [m] points that may be deeper than the deepest known one by less are not sought
MAX_POINTS: Final = 4000  # [-] points of one surface that are measured; with more, the most promising ones are
ROUND_SIDE_COUNT: Final = 96  # [-] sides of the surface of a sphere or capsule: within 0.1 % of the radius
POINT_RADIUS: Final = 1e-9  # [m] radius of the ball that stands for a point
RAYS: Final = np.array([[0.8, 0.36, 0.48], [-0.48, 0.8, 0.36], [0.36, 0.48, -0.8]])  # unit, along no usual edge


def deepest_point(guest: CollisionBody, host: CollisionBody, R_HG: Array, p_HG: Array) -> float:
    """Greatest depth of a point of the guest's surface inside the host in [m], zero where none is inside.

    The depth changes no faster than the point moves, so a triangle holds nothing deeper than its centre by more than
    its radius. Triangles that may be deeper than the deepest known point are cut in two, the most promising first,
    until none is left or ``MAX_POINTS`` were measured.

    Args:
        guest: The solid whose surface is measured.
        host: The solid it is in; a mesh that is not closed has no inside.
        R_HG: Rotation of the guest in the host, shape (3, 3).
        p_HG: Its position in [m], shape (3,).
    """
    if isinstance(host.shape, Mesh) and not host.shape.is_closed:
        return 0.0
    surface, probe = _surface(guest), Engine((host, prepare("point", Sphere(POINT_RADIUS))))
    open_ = surface.vertices[surface.faces] @ R_HG.T + p_HG
    best, measured = 0.0, 0
    while len(open_) and measured < MAX_POINTS:
        centres, radii = _balls(open_)
        reach = host.radius - np.linalg.norm(centres - host.centre, axis=1) + radii  # no point is deeper than that
        promising = np.flatnonzero(reach > best + DEPTH_TOL)
        promising = promising[np.argsort(-reach[promising], kind="stable")][: MAX_POINTS - measured]
        open_, centres, radii = open_[promising], centres[promising], radii[promising]
        measured += len(open_)
        depths = _depths(probe, centres, worth=best + DEPTH_TOL - radii)
        best = max(best, float(depths.max(initial=0.0)))
        open_ = halved(open_[depths + radii > best + DEPTH_TOL])
    return best


def _surface(body: CollisionBody) -> Mesh:
    """The surface of a solid as triangles."""
    return tessellate(body.shape, ROUND_SIDE_COUNT) if isinstance(body.shape, Capsule | Sphere) else body.core


def _balls(triangles: Array) -> tuple[Array, Array]:
    """Centres, shape (K, 3), and radii, shape (K,), of balls that hold triangles of shape (K, 3, 3)."""
    centres: Array = triangles.mean(axis=1)
    radii: Array = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    return centres, radii


def _depths(probe: Engine, points: Array, *, worth: Array) -> Array:
    """Depth of points in a solid in [m], shape (N,): exact inside, zero or less outside, changing evenly.

    Args:
        probe: The solid, and a point.
        points: Shape (N, 3), in the frame of the solid in [m].
        worth: Of points nearer to the surface than that in [m], shape (N,), their side is not determined.
    """
    match probe.bodies[0].shape:
        case Box(size):
            depths: Array = (0.5 * np.asarray(size) - np.abs(points)).min(axis=1)
        case Cylinder(radius, length):
            across = radius - np.hypot(points[:, 0], points[:, 1])
            depths = np.minimum(across, 0.5 * length - np.abs(points[:, 2]))
        case Capsule(radius, length):
            beyond = np.maximum(np.abs(points[:, 2]) - 0.5 * length, 0.0)
            depths = radius - np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + beyond**2)
        case Sphere(radius):
            depths = radius - np.linalg.norm(points, axis=1)
        case Mesh() as mesh:
            depths = _depths_in_mesh(probe, mesh, points, worth=worth)
    return depths


def _depths_in_mesh(probe: Engine, mesh: Mesh, points: Array, *, worth: Array) -> Array:
    """Distance of points from a closed mesh in [m], negative outside."""
    R = np.broadcast_to(np.eye(3), (2, len(points), 3, 3))
    p = np.stack([np.zeros_like(points), points])
    poses = BodyPoses(np.ascontiguousarray(R), p)
    depths = np.array([probe.surface_distance(0, 1, poses, sample=k) for k in range(len(points))])
    is_relevant = depths > worth
    votes = np.zeros(np.count_nonzero(is_relevant))
    corner = mesh.vertices[mesh.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    for ray in RAYS if len(votes) else ():
        hits = ray_hits(mesh, points[is_relevant], ray)
        votes += hits.is_hit & (normals[hits.faces] @ ray > 0.0)  # the first triangle is seen from within
    depths[is_relevant] = np.where(votes >= 2.0, depths[is_relevant], -depths[is_relevant])
    depths[~is_relevant] = np.minimum(depths[~is_relevant], 0.0)
    return depths
