"""Stretches of straight lines that run inside a solid: in closed form for simple solids, by crossings for meshes."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.mesh.rays import line_crossings
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere

Ends = tuple[Array, Array]  # [m] where lines enter and leave a convex solid, shape (N,); enter > leave: never


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spans:
    """Stretches of lines inside a solid, shape (K,) each, sorted by line and along it."""

    line: Indices  # which line
    enter: Array  # way from the line's point to where it enters, in [m] along its direction
    leave: Array  # way to where it leaves, in [m]


def line_spans(shape: Solid, points: Array, directions: Array) -> Spans:
    """Where endless lines run inside a solid; solids that overlap within one mesh count as one.

    A line has a point in [m] and a unit direction, shape (N, 3) each, in the frame of the solid.
    """
    match shape:
        case Mesh():
            return _mesh_spans(shape, points, directions)
        case Box(size):
            enter, leave = _between_planes(points, directions, half=0.5 * np.asarray(size))
        case Cylinder(radius, length):
            enter, leave = _cylinder(points, directions, radius=radius, length=length)
        case Sphere(radius):
            enter, leave = _ball(points, directions, radius)
        case Capsule(radius, length):
            enter, leave = _capsule(points, directions, radius=radius, length=length)
    line = np.flatnonzero(enter < leave)
    return Spans(line=line, enter=enter[line], leave=leave[line])


def _between_planes(points: Array, directions: Array, *, half: Array) -> Ends:
    """Lines between pairs of planes at ``-half`` and ``half`` along each axis, shape (N, k) and (k,)."""
    runs_along = directions == 0.0
    slope = np.where(runs_along, 1.0, directions)
    a, b = (-half - points) / slope, (half - points) / slope
    is_between = np.abs(points) < half
    enter = np.where(runs_along, np.where(is_between, -np.inf, np.inf), np.minimum(a, b))
    leave = np.where(runs_along, np.where(is_between, np.inf, -np.inf), np.maximum(a, b))
    return enter.max(axis=1), leave.min(axis=1)


def _round(offset: Array, across: Array, radius: float) -> Ends:
    """Lines within a circle or ball round the origin, by their points and directions across its axis, shape (N, k)."""
    square = np.sum(across * across, axis=1)
    runs_along = square == 0.0
    safe = np.where(runs_along, 1.0, square)
    middle = -np.sum(offset * across, axis=1) / safe
    nearest = offset + middle[:, None] * across
    squared_half = radius**2 - np.sum(nearest * nearest, axis=1)
    half = np.sqrt(np.maximum(squared_half, 0.0) / safe)
    half = np.where(runs_along, np.inf, half)
    met = squared_half > 0.0
    return np.where(met, middle - half, np.inf), np.where(met, middle + half, -np.inf)


def _ball(points: Array, directions: Array, radius: float) -> Ends:
    """Lines within a ball round the origin."""
    return _round(points, directions, radius)


def _cylinder(points: Array, directions: Array, *, radius: float, length: float) -> Ends:
    """Lines within a cylinder along z."""
    enter_wall, leave_wall = _round(points[:, :2], directions[:, :2], radius)
    enter_ends, leave_ends = _between_planes(points[:, 2:], directions[:, 2:], half=np.array([0.5 * length]))
    return np.maximum(enter_wall, enter_ends), np.minimum(leave_wall, leave_ends)


def _capsule(points: Array, directions: Array, *, radius: float, length: float) -> Ends:
    """Lines within a capsule along z: it is convex, so its pieces' stretches join to one."""
    end = np.array([0.0, 0.0, 0.5 * length])
    pieces = [
        _ball(points - end, directions, radius),
        _ball(points + end, directions, radius),
        _cylinder(points, directions, radius=radius, length=length),
    ]
    pieces = [
        (np.where(enter < leave, enter, np.inf), np.where(enter < leave, leave, -np.inf)) for enter, leave in pieces
    ]
    enters, leaves = zip(*pieces, strict=True)
    return np.min(enters, axis=0), np.max(leaves, axis=0)


def _mesh_spans(mesh: Mesh, points: Array, directions: Array) -> Spans:
    """Crossings joined in pairs: the first of several entries in a row and the last of several exits count."""
    crossings = line_crossings(mesh, points, directions)
    line, distance, entering = crossings.line, crossings.distance, crossings.is_entering
    follows = np.append(False, line[1:] == line[:-1]) if len(line) else np.zeros(0, dtype=bool)
    after_exit = np.append(True, ~entering[:-1])[: len(line)]
    before_entry = np.append(entering[1:], True)[: len(line)]
    is_last = np.append(~follows[1:], True)[: len(line)]
    enters = entering & (~follows | after_exit)
    leaves = ~entering & (is_last | before_entry)
    switches = np.flatnonzero(enters | leaves)
    opens, closes = switches[:-1], switches[1:]
    paired = enters[opens] & leaves[closes] & (line[opens] == line[closes])
    opens, closes = opens[paired], closes[paired]
    return Spans(line=line[opens].astype(np.intp), enter=distance[opens], leave=distance[closes])
