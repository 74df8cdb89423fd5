"""Pairs of bodies that are near each other at one configuration, and how their distances change with the joints."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses, checked_poses
from cellplan.collision.nearest_points import NearestPoints, nearest_points, point_above
from cellplan.geometry.arrays import Flags, Indices
from cellplan.geometry.shapes import bounding_box
from cellplan.geometry.transforms import Array
from cellplan.kinematics.pinocchio_model import CombinedModel, LinkState
from cellplan.model.report import ClearanceClass
from cellplan.model.robot import BASE
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

BETWEEN_THINGS: Final = frozenset({ClearanceClass.ENVIRONMENT, ClearanceClass.PART, ClearanceClass.ROBOT_ROBOT})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosestPair:
    """Two bodies that are near each other.

    Attributes:
        row: Index into ``Scene.pairs``.
        distance: In [m]; zero when they touch.
        point_a: Nearest point of the pair's first body in the world, shape (3,), in [m].
        point_b: Nearest point of its second body.
        gradient: Change of the distance per joint, shape (nq,), in [m/rad] or [m/m].
    """

    row: int
    distance: float
    point_a: Array
    point_b: Array
    gradient: Array


class ClosestPairs:
    """What is near what in one scene, configuration by configuration.

    Looked at are pairs that must keep the demanded clearance. Pairs whose distance is a matter of design, and tools at
    work on the part, are left out. Bounding spheres and boxes clear what is far away; only what is left is measured.
    """

    def __init__(self, scene: Scene, *, classes: frozenset[ClearanceClass] = BETWEEN_THINGS) -> None:
        """Choose the pairs and note what carries each body.

        Args:
            scene: The scene.
            classes: Classes of pairs that are looked at; those of one robot with itself only when asked for.
        """
        self._scene, self._model = scene, CombinedModel(scene.cell)
        chosen = np.array([pair.rule is Rule.CLEARANCE and pair.clearance_class in classes for pair in scene.pairs])
        among_solids = chosen[scene.solid_rows] if len(chosen) else np.zeros(0, dtype=bool)
        self._rows: Indices = scene.solid_rows[among_solids]
        self._pairs: Indices = scene.solid_pairs[among_solids]
        self._ground_rows = [int(row) for row in scene.ground_rows if chosen[row]]
        self._over_ground = np.array([scene.pairs[row].first for row in self._ground_rows], dtype=np.intp)
        self._X_ground = np.array([scene.bodies[scene.pairs[row].second].X_BS for row in self._ground_rows])
        self._X_ground = self._X_ground.reshape(-1, 4, 4)
        self._carrier, self._X_LS = self._carriers()
        boxes = [bounding_box(body.shape) for body in scene.engine.bodies[: len(self._X_LS)]]
        self._middles, self._halves = np.array(boxes).reshape(-1, 2, 3).swapaxes(0, 1)

    def at(self, q: Array, *, within: float) -> tuple[ClosestPair, ...]:
        r"""Pairs nearer than a distance, in the order of ``Scene.pairs``.

        With the unit normal ``n`` from the one nearest point to the other, and their velocities at unit speed of joint
        i as points of the links that carry them,

        .. math:: \partial d / \partial q_i = n \cdot (v_{b,i} - v_{a,i})

        Args:
            q: Stacked joint vector, shape (nq,), in [rad] or [m].
            within: Distance in [m] from which on pairs are left out.
        """
        links = self._model.links(q)
        D = np.concatenate([links.D, np.eye(4)[None]])
        poses = checked_poses(list((D[self._carrier] @ self._X_LS)[:, None]))
        found = self._near_solids(poses, within) + self._near_grounds(poses, within)
        near = sorted((each for each in found if each[1].distance < within), key=lambda each: each[0])
        gradients = self._gradients([self._scene.pairs[row] for row, _ in near], [at for _, at in near], links)
        return tuple(
            ClosestPair(row=row, distance=at.distance, point_a=at.first, point_b=at.second, gradient=gradient)
            for (row, at), gradient in zip(near, gradients, strict=True)
        )

    def names(self, pair: ClosestPair) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        return self._scene.names(self._scene.pairs[pair.row])

    def _carriers(self) -> tuple[Indices, Array]:
        """Link that carries each solid, -1 when it never moves, and the solid's pose there or in the world."""
        cell = self._scene.cell
        first_link = {robot.name: self._model.first_link[k] for k, robot in enumerate(cell.robots)}
        carriers, poses = [], []
        for body in self._scene.bodies[: len(self._scene.engine.bodies) - len(self._scene.cut_from)]:
            moves = body.robot is not None and body.link != BASE
            carriers.append(first_link[str(body.robot)] + body.link if moves else -1)
            poses.append(body.X_BS if moves or body.robot is None else cell.robot(body.robot).X_WB @ body.X_BS)
        return np.array(carriers, dtype=np.intp), np.array(poses).reshape(-1, 4, 4)

    def _near_solids(self, poses: BodyPoses, within: float) -> list[tuple[int, NearestPoints]]:
        """Nearest points of the pairs of solids that are not cleared at once."""
        engine = self._scene.engine
        near = np.flatnonzero(self._may_be_near(poses, within))
        return [
            (int(self._rows[k]), nearest_points(engine, (int(a), int(b)), poses, sample=0))
            for k, (a, b) in zip(near, self._pairs[near], strict=True)
        ]

    def _may_be_near(self, poses: BodyPoses, within: float) -> Flags:
        """Which pairs are not proved apart by the sphere of the one and the sphere or the box of the other."""
        a, b = self._pairs.T
        radii = self._scene.engine.radii
        centres = self._centres(poses)
        apart = centres[b] - centres[a]
        near: Flags = np.einsum("ij,ij->i", apart, apart) < (within + radii[a] + radii[b]) ** 2
        for balls, holders in ((a, b), (b, a)):
            k = np.flatnonzero(near)
            ball, box = balls[k], holders[k]
            in_box = np.einsum("ij,ijk->ik", centres[ball] - poses.p[box, 0], poses.R[box, 0]) - self._middles[box]
            outside = np.maximum(np.abs(in_box) - self._halves[box], 0.0)
            near[k] = np.einsum("ij,ij->i", outside, outside) < (within + radii[ball]) ** 2
        return near

    def _near_grounds(self, poses: BodyPoses, within: float) -> list[tuple[int, NearestPoints]]:
        """Lowest points of the solids that their bounding spheres do not clear from a half-space."""
        engine, solids, X_WS = self._scene.engine, self._over_ground, self._X_ground
        height = np.einsum("ij,ij->i", self._centres(poses)[solids] - X_WS[:, :3, 3], X_WS[:, :3, 2])
        return [
            (self._ground_rows[k], point_above(engine, int(solids[k]), poses, X_WS=X_WS[k], sample=0))
            for k in np.flatnonzero(height < within + engine.radii[solids])
        ]

    def _centres(self, poses: BodyPoses) -> Array:
        """Centres of the bounding spheres of all solids in the world, shape (B, 3)."""
        own = self._scene.engine.centres[: len(poses.p), :, None]
        return (poses.R[:, 0] @ own)[..., 0] + poses.p[:, 0]

    def _gradients(self, pairs: list[ScenePair], near: list[NearestPoints], links: LinkState) -> Array:
        """Change of each distance per joint, shape (pairs, nq)."""
        if not pairs:
            return np.zeros((0, self._scene.cell.joint_count))
        n = np.array([at.normal for at in near])
        forth = self._rates(np.array([at.second for at in near]), n, [pair.second for pair in pairs], links=links)
        back = self._rates(np.array([at.first for at in near]), n, [pair.first for pair in pairs], links=links)
        return self._model.along_joints(forth - back)

    def _rates(self, points: Array, n: Array, bodies: list[int], *, links: LinkState) -> Array:
        """Speed along a direction that unit speed of each axis gives a point of a body, shape (points, links)."""
        wrench = np.concatenate([n, np.cross(points, n)], axis=1)  # n . (l + w x p) = n . l + (p x n) . w
        at_rest = np.zeros((1, links.D.shape[0]), dtype=bool)
        carries = np.concatenate([self._model.carries_link, at_rest])
        carrier = [self._carrier[body] if body < len(self._carrier) else -1 for body in bodies]
        return (wrench @ links.screws_W) * carries[carrier]
