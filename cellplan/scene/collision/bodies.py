"""Solids prepared for distance questions: what bounds them, what their surface is, what lies inside them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from cellplan.errors import CellplanError, InputError, OverrunError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import components
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, bounding_capsule, bounding_sphere
from cellplan.geometry.transforms import Array
from cellplan.scene.collision.hull_cache import hull_of

POINT_SIZE: Final = 1e-7  # [m] size given to a point or a line, so that the engine sees a triangle: far below 0.1 mm
SURFACE_TOL: Final = 2e-5  # [m] a tessellated cylinder lies outside the true one by no more than this
CONVEX_TOL: Final = 2e-6  # [m] vertices of a convex mesh may stand out of a triangle's plane: single precision
CONVEX_WORK: Final = 40_000_000  # [-] vertices times triangles up to which convexity is tested: half a second
HULL_TOL: Final = 2e-7  # [-] of its radius by which a vertex may stick out of a mesh's hull (see convex_hull)
RIGID_CHUNK: Final = 20_000  # [-] poses checked at once: about 10 MB
RIGID_TOL: Final = 1e-9  # [-] by which a rotation may fail to be one
FLAT_PADDING: Final = 1e-6  # [m] thickness given to the box round a flat surface


@dataclass(frozen=True, kw_only=True, eq=False)
class CollisionBody:
    """One solid and the simpler shapes that stand for it."""

    name: str  # name in reports
    shape: Solid  # the solid itself
    hull: Solid  # A convex solid that holds it: the solid itself, or the convex hull of its mesh
    looseness: float  # what points of the solid may stick out of the hull in [m], by rounding
    is_convex: bool  # whether ``hull`` is the solid and not only a bound
    inflation: float  # by how much in [m] the solid reaches beyond ``core``
    centre: Array  # centre of a sphere that holds the solid, in its own frame in [m], shape (3,)
    radius: float  # radius of that sphere in [m]
    ends: Array  # ends of a line in [m], shape (2, 3); the solid is within ``girth`` of the line
    girth: float  # in [m]
    witnesses: Array  # one point of each connected piece of the solid, shape (C, 3)

    @cached_property
    def core(self) -> Mesh:
        """A surface; the solid is everything within ``inflation`` of it: a capsule is an inflated line.

        It is made when it is first needed: a search gives bodies other sizes and never asks for it.
        """
        return _core(self.shape)


@dataclass(frozen=True, slots=True, eq=False)
class BodyPoses:
    """Where bodies are at each of n samples; of poses that were checked (``checked_poses``, ``require_rigid``) only."""

    R: Array  # rotations in the world, shape (B, n, 3, 3)
    p: Array  # positions in the world in [m], shape (B, n, 3)


def prepare(name: str, shape: Solid) -> CollisionBody:
    """Make a solid ready for distance questions."""
    hull, is_convex = _hull(shape)
    centre, radius = bounding_sphere(shape)
    ends, girth = bounding_capsule(shape)
    return CollisionBody(
        name=name,
        shape=shape,
        hull=hull,
        looseness=0.0 if is_convex else HULL_TOL * radius,
        is_convex=is_convex,
        inflation=shape.radius if isinstance(shape, Sphere | Capsule) else 0.0,
        centre=centre,
        radius=radius,
        ends=ends,
        girth=girth,
        witnesses=_witnesses(shape),
    )


def checked_poses(poses: Sequence[Array]) -> BodyPoses:
    """Poses of bodies, shape (n, 4, 4) each, refused unless all of them are finite and rigid.

    The engine answers "free" to a pose that is not a number, and takes a scaled rotation for a rotation.
    """
    count = len(poses[0]) if poses else 0
    R, p = np.empty((len(poses), count, 3, 3)), np.empty((len(poses), count, 3))
    for body, X in enumerate(poses):
        R[body], p[body] = X[:, :3, :3], X[:, :3, 3]
    require_rigid(R, p)
    return BodyPoses(R, p)


def require_rigid(R: Array, p: Array) -> None:
    """Refuse poses, shape (B, n, 3, 3) and (B, n, 3), that are not finite or not rigid; see ``checked_poses``.

    A matrix is a rotation when its first two columns are orthonormal and their cross product is the third one.
    """
    step = max(1, RIGID_CHUNK // max(1, R.shape[1]))
    for first in range(0, len(R), step):
        some, at = R[first : first + step], p[first : first + step]
        x, y, z = (tuple(some[..., row, column] for row in range(3)) for column in range(3))
        faults = [_dot(x, x) - 1.0, _dot(y, y) - 1.0, _dot(x, y)]
        faults += [x[j] * y[k] - x[k] * y[j] - z[i] for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
        is_rotation = all(bool(np.all(np.abs(fault) <= RIGID_TOL)) for fault in faults)
        if not is_rotation or not np.all(np.isfinite(at)):
            raise CellplanError("collision: the pose of a body is not finite or not a rigid displacement")


def _dot(a: tuple[Array, ...], b: tuple[Array, ...]) -> Array:
    """Scalar products of vectors given by their components."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _hull(shape: Solid) -> tuple[Solid, bool]:
    """A convex solid that holds the shape, and whether it is the shape."""
    if not isinstance(shape, Mesh) or _is_convex(shape):
        return shape, True
    try:
        return hull_of(shape), False
    except OverrunError:
        raise
    except InputError:  # flat or ill-shaped
        return _box_round(shape), False


def _is_convex(mesh: Mesh) -> bool:
    """Whether a closed mesh has all its vertices behind the plane of each of its triangles, apart from rounding.

    Most collision meshes are convex hulls already. A mesh too large for this test counts as not convex, which costs
    time but no accuracy.
    """
    if not mesh.is_closed or len(mesh.vertices) * len(mesh.faces) > CONVEX_WORK:
        return False
    corner = mesh.vertices[mesh.faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    offset = np.einsum("ij,ij->i", normal, corner[:, 0])
    step = max(1, RIGID_CHUNK * 10 // len(mesh.vertices))
    return all(
        float((mesh.vertices @ normal[k : k + step].T - offset[k : k + step]).max()) <= CONVEX_TOL
        for k in range(0, len(normal), step)
    )


def _box_round(mesh: Mesh) -> Mesh:
    """The box along the axes that holds a mesh, itself as a mesh."""
    low, high = mesh.vertices.min(axis=0) - FLAT_PADDING, mesh.vertices.max(axis=0) + FLAT_PADDING
    x, y, z = (high - low).tolist()
    box = tessellate(Box((x, y, z)))
    return Mesh(vertices=box.vertices + 0.5 * (low + high), faces=box.faces, source=mesh.source, is_closed=True)


def _core(shape: Solid) -> Mesh:
    """A surface; what is left of spheres and capsules when they are shrunk by their radius."""
    match shape:
        case Sphere():
            return _thin_triangle(0.0)
        case Capsule():
            return _thin_triangle(shape.length)
        case Cylinder(radius):
            return tessellate(shape, fine_segments(radius))
        case Box():
            return tessellate(shape)
        case Mesh():
            return shape


def fine_segments(radius: float) -> int:
    """Sides of a prism round a cylinder that keep it within ``SURFACE_TOL`` of the cylinder."""
    return max(8, int(np.ceil(np.pi / np.arccos(radius / (radius + SURFACE_TOL)))))


def _thin_triangle(length: float) -> Mesh:
    """A triangle that holds a line along z as its edge, or a point in the middle of it, and very little else."""
    half = max(0.5 * length, POINT_SIZE)
    vertices = np.array([[0.0, 0.0, -half], [0.0, 0.0, half], [POINT_SIZE, 0.0, 0.0]])
    return Mesh(vertices=vertices, faces=np.array([[0, 1, 2]]), source="line", is_closed=False)


def _witnesses(shape: Solid) -> Array:
    """One point of each connected piece."""
    if not isinstance(shape, Mesh):
        return np.zeros((1, 3))
    edges = np.concatenate([shape.faces[:, :2], shape.faces[:, 1:]])
    piece = components(len(shape.vertices), edges)
    return shape.vertices[np.unique(piece[shape.faces[:, 0]])]
