"""How deep points of one solid's surface lie inside another: the measure of overlap where a mesh is not convex.

A point at depth d is at least d away from the outside, so that the way out is never shorter than this depth. It may be
longer: two crossing rods are as deep in each other as their radii say, whatever their lengths.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.mesh.counts import ray_winding
from cellplan.geometry.mesh.rays import along_curve, ray_hits
from cellplan.geometry.mesh.tessellation import halved, tessellate
from cellplan.geometry.mesh.touching import has_several_solids, outer_surface
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody, fine_segments, prepare
from cellplan.scene.collision.engine import Engine, nearest_triangle

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


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Some patches of a surface; one is known by its place in its level of the tree, or as a single triangle."""

    level: int  # level of the tree, the same for all; that of single triangles is the number of levels
    place: Indices  # place of each in that level, shape (K,); of single triangles it has no meaning
    triangles: Array  # their corners in [m], shape (K, 3, 3); none above the level of single triangles
    centres: Array  # A point of the surface in each in [m], shape (K, 3)
    radii: Array  # radius of a ball round it that holds the patch in [m], shape (K,)

    def some(self, which: Indices) -> "Patches":
        """Some of them."""
        triangles = self.triangles[which] if len(self.triangles) else self.triangles
        return Patches(self.level, self.place[which], triangles, self.centres[which], self.radii[which])

    def __len__(self) -> int:
        """How many there are."""
        return len(self.place)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceTree:
    """Binary tree of patches over triangles that are sorted along a space-filling curve."""

    count: int  # number of triangles F
    triangles: Array  # the sorted triangles in [m], the last one repeated until there are 2^D, shape (2^D, 3, 3)
    centres: tuple[Array, ...]  # a point of the surface in each patch of each level above them, shapes (2^level, 3)
    radii: tuple[Array, ...]  # radii of the balls round them in [m], shapes (2^level,)

    @classmethod
    def over(cls, triangles: Array) -> "SurfaceTree":
        """Build the tree over triangles in [m], shape (F, 3, 3)."""
        middles = triangles.mean(axis=1)
        count = len(triangles)
        depth = int(np.ceil(np.log2(count)))
        order = np.pad(along_curve(middles), (0, 2**depth - count), mode="edge")
        triangles, middles = triangles[order], middles[order]
        centres, radii = [], []
        for level in range(depth):
            centroids, corners = middles.reshape(2**level, -1, 3), triangles.reshape(2**level, -1, 3)
            box = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
            nearest = np.argmin(np.linalg.norm(centroids - box[:, None], axis=2), axis=1)
            centres.append(centroids[np.arange(2**level), nearest])
            radii.append(np.linalg.norm(corners - centres[-1][:, None], axis=2).max(axis=1))
        return cls(count, triangles, tuple(centres), tuple(radii))

    def root(self) -> Patches:
        """The whole surface as one patch."""
        return self._at(0, np.zeros(1, dtype=np.intp))

    def parts(self, patches: Patches) -> tuple[Patches, Indices]:
        """Both halves of each patch, and the place of the patch that each of them is a half of, shape (K,)."""
        whole = np.tile(np.arange(len(patches)), 2)
        if patches.level == len(self.centres):
            return _singles(patches.level, halved(patches.triangles)), whole
        place, level = np.concatenate([2 * patches.place, 2 * patches.place + 1]), patches.level + 1
        is_there = place * (len(self.triangles) >> level) < self.count  # all others hold repeated triangles only
        return self._at(level, place[is_there]), whole[is_there]

    def _at(self, level: int, place: Indices) -> Patches:
        """Patches of a level."""
        if level < len(self.centres):
            return Patches(level, place, np.zeros((0, 3, 3)), self.centres[level][place], self.radii[level][place])
        return _singles(level, self.triangles[place])


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

    Points are in the frame of the solid in [m], shape (N, 3). Of those nearer to the surface than ``worth`` in [m],
    shape (N,), the side is not determined. ``sides`` is 1 for points known to be outside, -1 inside, else 0, shape
    (N,).
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
    return np.where(is_relevant, -sides * depths, 0.0)


def _is_within(mesh: Mesh, points: Array) -> Flags:
    """Whether points are inside a closed mesh, shape (N,): two of three rays say so, or how often solids wind round."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    if has_several_solids(mesh):
        return ray_winding(mesh.vertices[mesh.faces], points) > 0
    normals = _normals(mesh.vertices[mesh.faces])
    rays = np.repeat(RAYS, len(points), axis=0)
    hits = ray_hits(mesh, np.tile(points, (len(RAYS), 1)), rays)
    leaves = np.einsum("ij,ij->i", normals[hits.faces], rays) > 0.0  # the first triangle is seen from within
    return (hits.is_hit & leaves).reshape(len(RAYS), -1).sum(axis=0) >= 2


def _normals(corner: Array) -> Array:
    """Unit normals of triangles with these corners, shape (N, 3, 3); zero of those without an area."""
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), 0.0)


def _singles(level: int, triangles: Array) -> Patches:
    """Single triangles as patches."""
    centres = triangles.mean(axis=1)
    radii = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    return Patches(level, np.arange(len(triangles)), triangles, centres, radii)
