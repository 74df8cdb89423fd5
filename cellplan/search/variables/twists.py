"""How poses of a layout move with their components: velocities of a frame per unit of each of them."""

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross, rotation_about
from cellplan.model.cell.rod import Rod

X, Y, Z = np.eye(3)


def pose_twists(rpy: Array) -> Array:
    """Motion of a frame by its components x, y, z, roll, pitch, yaw (about fixed axes): one row each, shape (6, 6).

    Each row has the velocity of the frame's origin and the angular velocity, along the axes that the pose is given in.

    Args:
        rpy: Roll, pitch and yaw in [rad], shape (3,).
    """
    turned = rotation_about(Z, rpy[2])
    twists = np.zeros((6, 6))
    twists[:3, :3] = np.eye(3)
    twists[3, 3:] = turned @ rotation_about(Y, rpy[1]) @ X
    twists[4, 3:] = turned @ Y
    twists[5, 3:] = Z
    return twists


def rod_twists(rod: Rod) -> Array:
    """Motion of a rod by its length, tilt and roll: velocity at the centre of the flange, angular velocity, (3, 6).

    A change of the length moves the tip.
    """
    twists = np.zeros((3, 6))
    twists[0, :3] = rod.X_FT[:3, 2]
    twists[1, 3:] = rotation_about(Z, rod.roll) @ Y
    twists[2, 3:] = Z
    return twists


def carried(twists: Array, X: Array) -> Array:
    """Twists about a frame's origin along its axes, rows of shape (..., 6), as twists about the origin that X has."""
    v, w = twists[..., :3] @ X[:3, :3].T, twists[..., 3:] @ X[:3, :3].T
    return np.concatenate([v - cross(w, np.broadcast_to(X[:3, 3], w.shape)), w], axis=-1)


def at_point(twists: Array, p: Array) -> Array:
    """Twists about an origin, rows of shape (..., 6), as velocities of a point there and angular velocities."""
    v, w = twists[..., :3], twists[..., 3:]
    return np.concatenate([v + cross(w, np.broadcast_to(p, w.shape)), w], axis=-1)


def about_origin(twists: Array, p: Array) -> Array:
    """Velocities of a point and angular velocities, rows of shape (..., 6), as twists about the origin."""
    return at_point(twists, -np.asarray(p))
