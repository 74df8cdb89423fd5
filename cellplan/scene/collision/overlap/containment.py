"""Whether one body lies wholly inside another without touching its surface; the engine would call that free."""

import numpy as np

from cellplan.geometry.mesh.topology import winding_numbers
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.engine import Engine


def is_inside(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> bool:
    """Say whether a piece of one body lies inside the mesh of the other at a sample, either way round."""
    for inner, outer in (pair, pair[::-1]):
        host, guest = engine.bodies[outer], engine.bodies[inner]
        if not (isinstance(host.shape, Mesh) and (host.shape.is_closed or host.shape.is_leaky)):
            continue  # the engine knows the whole body, or there is no inside
        in_world = guest.witnesses @ poses.R[inner, sample].T + poses.p[inner, sample]
        if _any_within(host, (in_world - poses.p[outer, sample]) @ poses.R[outer, sample]):
            return True
    return False


def _any_within(host: CollisionBody, points: Array) -> bool:
    """Say whether any of some points, shape (C, 3) in the host's frame, is wound round by its surface, either way."""
    mesh = host.core
    near = np.linalg.norm(points - host.centre, axis=1) <= host.radius
    if not np.any(near):
        return False
    return bool(np.any(np.abs(winding_numbers(mesh.vertices[mesh.faces], points[near])) > 0.5))
