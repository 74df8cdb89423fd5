"""Bodies of a scene as arrays: where on which link they are and what bounds them, so that all are placed at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.scene.bodies import SceneBody
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.hull_supports import HullSupports
from cellplan.scene.kinematics.link_forest import LinkForest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyTable:
    """Bodies of the engine and the links that carry them."""

    links: Indices  # place in the forest of the link that carries each body, shape (B,)
    X_LS: Array  # pose on that link as ``SceneBody.X_BS``, shape (B, 4, 4)
    centres: Array  # centres of the bounding spheres in the bodies' own frames in [m], shape (B, 3)
    radii: Array  # their radii in [m], shape (B,)
    ends: Array  # ends of the bounding lines in the bodies' own frames in [m], shape (B, 2, 3)
    girths: Array  # how far the bodies reach from these lines in [m], shape (B,)
    supports: HullSupports  # farthest points of their hulls

    @classmethod
    def of(cls, forest: LinkForest, carriers: Sequence[SceneBody], bodies: Sequence[CollisionBody]) -> "BodyTable":
        """The arrays of some bodies, each with the body of the scene that it is, or is cut from."""
        return cls(
            links=np.array([forest.place(carrier.robot, carrier.link) for carrier in carriers], dtype=np.intp),
            X_LS=np.array([carrier.X_BS for carrier in carriers]).reshape(-1, 4, 4),
            centres=np.array([body.centre for body in bodies]).reshape(-1, 3),
            radii=np.array([body.radius for body in bodies]),
            ends=np.array([body.ends for body in bodies]).reshape(-1, 2, 3),
            girths=np.array([body.girth for body in bodies]),
            supports=HullSupports(bodies),
        )

    def replaced(self, poses: Mapping[int, Array], bodies: Mapping[int, CollisionBody]) -> "BodyTable":
        """The same with some bodies elsewhere on their links, shape (4, 4) each, and others in place of some."""
        X_LS, centres, radii = self.X_LS, self.centres, self.radii
        ends, girths, supports = self.ends, self.girths, self.supports
        if poses:
            X_LS = X_LS.copy()
            X_LS[list(poses)] = list(poses.values())
        if bodies:
            centres, radii, ends, girths = centres.copy(), radii.copy(), ends.copy(), girths.copy()
            for index, body in bodies.items():
                centres[index] = body.centre
                radii[index] = body.radius
                ends[index] = body.ends
                girths[index] = body.girth
            supports = supports.replaced(bodies)
        return replace(self, X_LS=X_LS, centres=centres, radii=radii, ends=ends, girths=girths, supports=supports)

    def poses(self, D: Array) -> BodyPoses:
        """Poses of all bodies from the displacements of the links, shape (links, K, 4, 4); see ``LinkForest``."""
        R = D[self.links, :, :3, :3]
        moved = R @ self.X_LS[:, None, :3]
        return BodyPoses(np.ascontiguousarray(moved[..., :3]), moved[..., 3] + D[self.links, :, :3, 3])

    def bounds(self, poses: BodyPoses) -> tuple[Array, Array]:
        """Centres of bounding spheres, shape (B, K, 3), ends of bounding lines, (B, K, 2, 3), in the world in [m]."""
        points = np.concatenate([self.centres[:, None], self.ends], axis=1)
        placed = points[:, None] @ np.swapaxes(poses.R, 2, 3) + poses.p[:, :, None]
        return placed[:, :, 0], placed[:, :, 1:]


def placed_points(poses: BodyPoses, bodies: Indices, samples: Indices, points: Array) -> Array:
    """Points in the world, shape (M, 3), of bodies at samples, shape (M,), from those in their own frames in [m]."""
    return (poses.R[bodies, samples] @ points[..., None])[..., 0] + poses.p[bodies, samples]
