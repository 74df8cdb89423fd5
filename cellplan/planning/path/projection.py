"""Projection of a path onto the part: in closed form on boxes, cylinders and spheres, by rays on meshes."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.arc_length import measure
from cellplan.geometry.curves.curve import Curve, smooth_through
from cellplan.geometry.curves.surface_patch import Patch, ProjectedCurve, patches_facing
from cellplan.geometry.mesh.load import normals_at, ray_hits
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere, bounding_sphere, support
from cellplan.geometry.transforms import Array, inverse, transform_points
from cellplan.model.cell.cell import Part
from cellplan.model.task.task import Task
from cellplan.planning.path.curve import PathCurve
from cellplan.planning.path.formatting import AXIS_NAMES, direction_name, in_mm, length

SAMPLES: Final = 4096  # points at which a path is checked to see whether it stays on the part
FEWEST_SAMPLES: Final = 4  # of them on each smooth span
FLATTEST: Final = np.sin(np.deg2rad(1.0))  # [-] a surface seen at a flatter angle than 1 deg stretches the path
RAY_STEP: Final = 2.5e-4  # [m] between rays on a mesh: finer than the fillets a tool axis can follow
MOST_RAYS: Final = 20_000  # rays of a path that is not full of stops; the step grows with the length instead
FEWEST_RAYS: Final = 400  # rays of a short path
RAYS_OF_PIECE: Final = 4  # rays between two stops, at least
SHARPEST_EDGE: Final = np.deg2rad(30.0)  # [rad] normals of neighbouring rays that differ by more are an edge
AXIS_ALIGNED: Final = 1e-9  # [-] a direction this near to an axis leaves the other two coordinates alone


def project_path(path: PathCurve, task: Task, part: Part) -> PathCurve:
    """Project a path onto the part from the side its task names; a path without a side stays where it is.

    Raises:
        InputError: A point misses the part, or the path runs over an edge of it.
    """
    if task.project is None:
        return path
    where = task.where("path")
    match part.shape:
        case Mesh():
            return _project_onto_mesh(path, task.project, part, where=where, mesh=part.shape)
        case Capsule():
            raise InputError(f"{where}: expected a box, cylinder, sphere or mesh to project on, got a capsule")
        case Box() | Cylinder() | Sphere():
            patches = patches_facing(part.shape, part.X_PS, task.project)
            return _project_onto_patch(path, task.project, patches, part=part, where=where)


def along(curve: Curve) -> Array:
    """Parameters spread over every smooth span of a curve, ends included."""
    count = max(FEWEST_SAMPLES, SAMPLES // (len(curve.knots) - 1))
    inner = curve.knots[:-1, None] + np.arange(count) / count * np.diff(curve.knots)[:, None]
    return np.append(inner.ravel(), curve.knots[-1])


def points_along(curve: Curve) -> Array:
    """Points of a curve at the parameters of `along`, shape (N, 3)."""
    points, _ = curve.evaluate(along(curve), (float(curve.knots[0]), float(curve.knots[-1])))
    return points


def _project_onto_patch(
    path: PathCurve, direction: Array, patches: tuple[Patch, ...], *, part: Part, where: str
) -> PathCurve:
    """Project a path onto the one patch that holds all of it."""
    points = points_along(path.curve)
    hits = [patch.hits(points, direction) for patch in patches]
    held = np.array([patch.covers(on_patch) for patch, on_patch in zip(patches, hits, strict=True)])
    if not np.all(held.any(axis=0)):
        raise InputError(_missed(where, points[int(np.argmin(held.any(axis=0)))], direction, part=part))
    if not np.any(held.all(axis=1)):
        _refuse_edge(where, _last_before_edge(held, hits))
    chosen = int(np.argmax(held.all(axis=1)))
    _refuse_flat_view(hits[chosen], patches[chosen].normals(hits[chosen]), direction, where=where)
    tip = ProjectedCurve(curve=path.curve, patch=patches[chosen], direction=direction)
    return replace(path, curve=tip, patch=patches[chosen])


def _last_before_edge(held: Array, hits: list[Array]) -> Array:
    """Last point of a path before it leaves the patch that holds its beginning for longest."""
    counts = np.argmin(held, axis=1)
    patch = int(np.argmax(counts))
    return hits[patch][max(int(counts[patch]) - 1, 0)]


def _project_onto_mesh(path: PathCurve, direction: Array, part: Part, *, where: str, mesh: Mesh) -> PathCurve:
    """Project a path onto a mesh: a smooth curve through the hits of close rays, broken at the stops only."""
    u = _ray_parameters(path)
    points, _ = path.curve.evaluate(u, (u[0], u[-1]))
    centre, radius = bounding_sphere(mesh)
    away = (transform_points(part.X_PS, centre[None])[0] - points) @ direction + 2.0 * radius
    X_SP = inverse(part.X_PS)
    rays_S = transform_points(X_SP, points + away[:, None] * direction)
    hits = ray_hits(mesh, rays_S, -X_SP[:3, :3] @ direction)
    if not np.all(hits.is_hit):
        raise InputError(_missed(where, points[int(np.argmin(hits.is_hit))], direction, part=part))
    p = points + (away - hits.distance)[:, None] * direction
    normals = normals_at(mesh, hits.points, hits.faces) @ part.X_PS[:3, :3].T
    _refuse_flat_view(p, normals, direction, where=where)
    _refuse_creases(p, normals, where)
    breaks = np.isin(u, path.stops)
    tip, inward = smooth_through(u, p, breaks=breaks), smooth_through(u, -normals, breaks=breaks)
    return replace(path, curve=tip, inward=inward)


def _ray_parameters(path: PathCurve) -> Array:
    """Parameters of the rays: even between two stops, the stops included."""
    arc = measure(path.curve)
    step = max(min(RAY_STEP, arc.total / FEWEST_RAYS), arc.total / MOST_RAYS)
    stops = path.stops
    lengths = np.diff(arc.behind_knots(stops))
    counts = np.maximum(RAYS_OF_PIECE, np.ceil(lengths / step).astype(int))
    pieces = [
        low + np.arange(count) / count * (high - low)
        for low, high, count in zip(stops[:-1], stops[1:], counts, strict=True)
    ]
    return np.concatenate([*pieces, stops[-1:]])


def _refuse_flat_view(p: Array, normals: Array, direction: Array, *, where: str) -> None:
    """Refuse a path on a surface that is nearly parallel to the projection."""
    facing = normals @ direction
    k = int(np.argmin(facing))
    if not facing[k] >= FLATTEST:
        angle = np.rad2deg(np.arcsin(np.clip(facing[k], -1.0, 1.0)))
        raise InputError(
            f"{where}: expected a surface that faces {direction_name(direction)}, but at {in_mm(p[k])} it is seen at "
            f"{angle:.2g} deg only; make the path smaller or project it from another side"
        )


def _refuse_creases(p: Array, normals: Array, where: str) -> None:
    """Refuse an edge or a step of a mesh between neighbouring rays."""
    cosine = np.sum(normals[:-1] * normals[1:], axis=1)
    chords = np.diff(p, axis=0)
    rise = np.abs(np.sum(chords * (normals[:-1] + normals[1:]), axis=1)) / 2.0
    is_edge = (cosine < np.cos(SHARPEST_EDGE)) | (rise > np.sin(SHARPEST_EDGE) * np.linalg.norm(chords, axis=1))
    if np.any(is_edge):
        _refuse_edge(where, p[int(np.argmax(is_edge))])


def _refuse_edge(where: str, point: Array) -> None:
    """Say where a path runs over an edge."""
    raise InputError(
        f"{where}: expected a path on one smooth side of the part, but it runs over an edge at {in_mm(point)}, where "
        "the tool axis would jump; make the path smaller or move it"
    )


def _missed(where: str, point: Array, direction: Array, *, part: Part) -> str:
    """Say which point misses the part and, for a direction along an axis, where the part lies."""
    message = f"{where}: expected a path over the part, but the point {in_mm(point)} misses it seen from "
    message += direction_name(direction)
    normal = int(np.argmax(np.abs(direction)))
    others = [axis for axis in range(3) if axis != normal]
    if np.linalg.norm(direction[others]) > AXIS_ALIGNED:
        return message
    R, centre = part.X_PS[:3, :3], part.X_PS[:3, 3]
    high = centre + support(part.shape, R)  # row i of R is axis i of P in the frame of the shape
    low = centre - support(part.shape, -R)
    spans = [f"{AXIS_NAMES[i]} {length(low[i])} to {length(high[i])} mm" for i in others]
    return f"{message}; it lies within {' and '.join(spans)}"
