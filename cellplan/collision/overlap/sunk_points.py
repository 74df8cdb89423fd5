"""How deep points of one solid's surface lie inside another: the measure of overlap where a mesh is not convex.

A point at depth d is at least d away from the outside, so that the way out is never shorter than this depth. It may be
longer: two crossing rods are as deep in each other as their radii say, whatever their lengths.
"""

from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses, CollisionBody, fine_segments, prepare
from cellplan.collision.engine import Engine, nearest_triangle
from cellplan.collision.overlap.surface_tree import SurfaceTree
from cellplan.geometry.arrays import Flags
from cellplan.geometry.mesh.counts import ray_winding
from cellplan.geometry.mesh.rays import ray_hits
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.touching import has_several_solids, outer_surface
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere
from cellplan.geometry.transforms import Array

SUNK_TOL: Final = 5e-4  # [m] points that may be deeper than the deepest known one by less are not sought
MAX_POINTS: Final = 4000  # [-] points of one surface that are measured; with more, the most promising ones are
ROUND_SIDE_COUNT: Final = 96  # [-] sides of a sphere or capsule at most: it is within 0.1 % of the radius, or 0.03 mm
CACHE_SIZE: Final = 64  # [-] solids whose surface, or tree of triangles, is kept
STRAIGHT: Final = 1.0 - 1e-9  # [-] cosine from which on a way from a triangle is along its normal: that says its side
POINT_RADIUS: Final = 1e-9  # [m] radius of the ball that stands for a point
RAYS: Final = np.array([[0.8, 0.36, 0.48], [-0.48, 0.8, 0.36], [0.36, 0.48, -0.8]])  # unit, along no usual edge


def deepest_point(
    guest: CollisionBody, host: CollisionBody, R_HG: Array, p_HG: Array, *, tolerance: float = SUNK_TOL
) -> float:
    """Greatest depth of a point of the guest's surface inside the host in [m], zero where none is inside.

    The depth changes no faster than the point moves, so a patch of the surface holds nothing deeper than one of its
    points by more than the radius of the ball round that point that holds the patch. Patches that may be deeper than
    the deepest known point are cut in two, the most promising first, until none is left or ``MAX_POINTS`` were
    measured.

    Args:
        guest: The solid whose surface is measured.
        host: The solid it is in; a mesh that is not closed has no inside.
        R_HG: Rotation of the guest in the host, shape (3, 3).
        p_HG: Its position in [m], shape (3,).
        tolerance: By how much in [m] a point may be deeper than what is returned, unless ``MAX_POINTS`` were measured.
    """
    if isinstance(host.shape, Mesh) and not host.shape.is_closed:
        return 0.0
    tree, probe = _tree(guest), _probe(host)
    open_, best, measured = tree.root(), 0.0, 0
    sides = np.zeros(1)
    while len(open_) and measured < MAX_POINTS:
        points = open_.centres @ R_HG.T + p_HG
        reach = host.radius - np.linalg.norm(points - host.centre, axis=1) + open_.radii  # no point is deeper than that
        promising = np.flatnonzero(reach > best + tolerance)
        promising = promising[np.argsort(-reach[promising], kind="stable")][: MAX_POINTS - measured]
        open_, points = open_.some(promising), points[promising]
        measured += len(open_)
        depths = _depths(probe, points, worth=best + tolerance - open_.radii, sides=sides[promising])
        best = max(best, float(depths.max(initial=0.0)))
        left = np.flatnonzero(depths + open_.radii > best + tolerance)
        wholes, depths = open_.some(left), depths[left]
        open_, whole = tree.parts(wholes)
        apart = np.linalg.norm(open_.centres - wholes.centres[whole], axis=1)
        sides = np.where(apart < np.abs(depths[whole]), -np.sign(depths[whole]), 0.0)  # no surface is between the two
    return best


@lru_cache(maxsize=CACHE_SIZE)
def _tree(body: CollisionBody) -> SurfaceTree:
    """The surface of a solid as patches."""
    surface = body.core
    if isinstance(body.shape, Capsule | Sphere):
        surface = tessellate(body.shape, min(ROUND_SIDE_COUNT, fine_segments(body.shape.radius)))
    return SurfaceTree.over(surface.vertices[surface.faces])


@lru_cache(maxsize=CACHE_SIZE)
def _probe(body: CollisionBody) -> Engine:
    """A solid and a point."""
    if isinstance(body.shape, Mesh):
        body = prepare(body.name, outer_surface(body.shape))  # points between solids that touch are not near a surface
    return Engine((body, prepare("point", Sphere(POINT_RADIUS))))


def _depths(probe: Engine, points: Array, *, worth: Array, sides: Array) -> Array:
    """Depth of points in a solid in [m], shape (N,): exact inside, zero or less outside, changing evenly.

    Args:
        probe: The solid, and a point.
        points: Shape (N, 3), in the frame of the solid in [m].
        worth: Of points nearer to the surface than that in [m], shape (N,), their side is not determined.
        sides: Points that are known to be outside, 1, or inside, -1, of all others 0, shape (N,).
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
            depths = _depths_in_mesh(probe, mesh, points, worth=worth, sides=sides)
    return depths


def _depths_in_mesh(probe: Engine, mesh: Mesh, points: Array, *, worth: Array, sides: Array) -> Array:
    """Distance of points from a closed mesh in [m], negative outside."""
    R = np.broadcast_to(np.eye(3), (2, len(points), 3, 3))
    poses = BodyPoses(np.ascontiguousarray(R), np.stack([np.zeros_like(points), points]))
    nearest = [nearest_triangle(probe, 0, 1, poses, sample=k) for k in range(len(points))]
    faces, gaps = np.array([face for face, _ in nearest]), np.array([gap for _, gap in nearest])
    depths = np.linalg.norm(gaps, axis=1)
    is_relevant = depths > worth
    height = np.einsum("ij,ij->i", _normals(mesh.vertices[mesh.faces[faces]]), gaps)
    if not has_several_solids(mesh):  # the nearest face of one solid may be inside another
        sides = np.where((sides == 0.0) & (np.abs(height) >= STRAIGHT * depths), np.sign(height), sides)
    undecided = np.flatnonzero(is_relevant & (sides == 0.0))
    sides[undecided] = np.where(_is_within(mesh, points[undecided]), -1.0, 1.0)
    inside_depths: Array = np.where(is_relevant, -sides * depths, 0.0)
    return inside_depths


def _is_within(mesh: Mesh, points: Array) -> Flags:
    """Whether points are inside a closed mesh, shape (N,): two of three rays say so, or how often solids wind round."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    if has_several_solids(mesh):
        within: Flags = ray_winding(mesh.vertices[mesh.faces], points) > 0
        return within
    normals = _normals(mesh.vertices[mesh.faces])
    rays = np.repeat(RAYS, len(points), axis=0)
    hits = ray_hits(mesh, np.tile(points, (len(RAYS), 1)), rays)
    leaves = np.einsum("ij,ij->i", normals[hits.faces], rays) > 0.0  # the first triangle is seen from within
    inside: Flags = (hits.is_hit & leaves).reshape(len(RAYS), -1).sum(axis=0) >= 2
    return inside


def _normals(corner: Array) -> Array:
    """Unit normals of triangles with these corners, shape (N, 3, 3); zero of those without an area."""
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), 0.0)
