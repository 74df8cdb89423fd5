"""Near pairs: bodies as arrays, the watched pairs nearer than a distance, where, and how that changes with joints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.line_distances import line_gaps
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell
from cellplan.scene.bodies import SceneBody
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.hull_supports import HullSupports
from cellplan.scene.kinematics.link_forest import WORLD, LinkForest
from cellplan.scene.pairs import Rule

if TYPE_CHECKING:
    from cellplan.scene.scene import Scene

TINY: Final = 1e-12  # [m] lines nearer than that cross
CLEAR_OF_TIP: Final = 1e-3  # [m] by which the hull of a cut tool keeps clear of the tip where it stands for the tool


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WatchedPairs:
    """Pairs of bodies as arrays; P of two solids, then G of a solid and a half-space."""

    rows: Indices  # what each pair is called, shape (P + G,)
    solids: Indices  # bodies of the engine of the first ones, shape (P, 2)
    above: Indices  # solids of the others, shape (G,)
    planes: Array  # poses of their half-spaces in the world, everything below the xy plane is solid, shape (G, 4, 4)
    demands: Array  # distances in [m] that are demanded; down to them the hulls of a pair are enough, shape (P + G,)
    once: Flags  # whether a pair is examined in the first configuration only, shape (P + G,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearPairs:
    """Pairs that come nearer than a distance at some configurations; M of them, ordered by configuration and pair."""

    rows: Indices  # their places in ``Scene.pairs``, or in the pairs of a table of its own, shape (M,)
    samples: Indices  # at which configuration, shape (M,)
    # signed distances in [m], negative where the bodies overlap by so much, shape (M,). Of bodies that are not convex
    # it is that of their hulls, never more than the true one, where that keeps what is demanded of the pair or the
    # surfaces touch; that of their surfaces otherwise. Of a tool that is cut off before its tip it is that of its hull.
    distances: Array
    # unit directions from the first body to the second in W: the distance grows when the second moves along them, shape
    # (M, 3)
    normals: Array
    first: Array  # points of the first bodies that are so far from the second ones, in W in [m], shape (M, 3)
    second: Array  # points of the second bodies likewise, shape (M, 3)
    by_joints: Array  # derivatives of the distances by the stacked joints, in [m/rad] or [m/m], shape (M, nq)
    bodies: Indices  # the bodies by their places in the engine, -1 for a half-space, shape (M, 2)
    D: Array  # displacements of the links, shape (links, K, 4, 4)

    @property
    def wrenches(self) -> Array:
        """Unit forces along the normals with their moments about the world's origin, shape (M, 6)."""
        return _wrenches(self.second, self.normals)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearTable:
    """Links, bodies and pairs."""

    forest: LinkForest
    bodies: BodyTable  # the bodies of the engine
    pairs: WatchedPairs
    is_hull: Flags  # whether the hull of a body is what counts of it, shape (B,)

    def moved(self, poses: Mapping[int, Array], bodies: Mapping[int, CollisionBody]) -> "NearTable":
        """The same with some bodies elsewhere on their links, and others in place of some; see ``BodyTable``."""
        return replace(self, bodies=self.bodies.replaced(poses, bodies))

    def find(self, engine: Engine, D: Array, within: float) -> NearPairs:
        """All pairs nearer than ``within`` in [m], from displacements of the links, shape (links, K, 4, 4)."""
        poses = self.bodies.poses(D)
        centres, lines = self.bodies.bounds(poses)
        parts = [self._solids(engine, poses, (centres, lines), within), self._grounds(poses, centres, within)]
        rows, samples, distances, normals, first, second, bodies = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        order = np.lexsort((rows, samples))
        order = order[distances[order] < within]
        samples, normals, second, bodies = samples[order], normals[order], second[order], bodies[order]
        return NearPairs(
            rows=rows[order],
            samples=samples,
            distances=distances[order],
            normals=normals,
            first=first[order],
            second=second,
            by_joints=self._by_joints(D, samples, bodies, _wrenches(second, normals)),
            bodies=bodies,
            D=D,
        )

    def _by_joints(self, D: Array, samples: Indices, bodies: Indices, forces: Array) -> Array:
        """Derivatives of distances by the stacked joints, from the unit forces along the normals, shape (M, 6).

        They are the work of each force on the axes between its bodies; it acts through both points.
        """
        screws = self.forest.screws(D)
        links = np.where(bodies < 0, WORLD, self.bodies.links[bodies])  # that carry the bodies, (M, 2)
        moved = self.forest.carries[links[:, 1]] - self.forest.carries[links[:, 0]]
        bounds = np.searchsorted(samples, np.arange(screws.shape[1] + 1)).tolist()
        for sample, (first, last) in enumerate(pairwise(bounds)):
            moved[first:last] *= forces[first:last] @ screws[:, sample].T
        return moved @ self.forest.shares

    def _solids(self, engine: Engine, poses: BodyPoses, bounds: tuple[Array, Array], within: float) -> "Parts":
        """Pairs of solids: bounding spheres, bounding lines, hulls, then surfaces where the hull is not what counts."""
        table, ends = self.bodies, self.pairs.solids
        centres, lines = bounds
        places, samples = self._near_spheres(centres, within)
        a, b = ends[places].T
        gaps = line_gaps(lines[a, samples], lines[b, samples])
        apart = np.linalg.norm(gaps, axis=1)
        slim = np.flatnonzero(apart < table.girths[a] + table.girths[b] + within)
        along = gaps[slim] / np.maximum(apart[slim], TINY)[:, None]
        slim = slim[self._proved(poses, (a[slim], b[slim]), samples[slim], along) < within]
        places, samples = places[slim], samples[slim]
        near, distances, points = engine.signed.below(engine.bodies, ends[places], poses, samples, within=within)
        places, samples, first, second = places[near], samples[near], points[:, 0].copy(), points[:, 1].copy()
        bodies = ends[places]
        is_open = (distances <= self.pairs.demands[places]) & ~self.is_hull[bodies].all(axis=1)
        for query in np.flatnonzero(is_open).tolist():
            (i, j), sample = bodies[query].tolist(), int(samples[query])
            is_apart = not engine.touch(i, j, poses, sample=sample)
            if is_apart and (nearest := engine.surface_points(i, j, poses, sample=sample)) is not None:
                first[query], second[query] = nearest
                distances[query] = np.linalg.norm(nearest[1] - nearest[0])
        apart = centres[bodies[:, 1], samples] - centres[bodies[:, 0], samples]
        normals = _directions(distances, first, second, apart)
        return self.pairs.rows[places], samples, distances, normals, first, second, bodies

    def _proved(self, poses: BodyPoses, ends: tuple[Indices, Indices], samples: Indices, n: Array) -> Array:
        """Distances in [m] that directions, shape (M, 3), prove between hulls, shape (M,); see ``separation``."""
        bounds = np.einsum("mi,mi->m", n, poses.p[ends[1], samples] - poses.p[ends[0], samples])
        for bodies, away in zip(ends, (n, -n), strict=True):
            local = (away[:, None] @ poses.R[bodies, samples])[:, 0]
            bounds -= self.bodies.supports.reach(bodies, local)
        return bounds

    def _near_spheres(self, centres: Array, within: float) -> tuple[Indices, Indices]:
        """Pairs of solids whose bounding spheres, centres of shape (B, K, 3), are near enough, and at which samples."""
        radii, (a, b) = self.bodies.radii, self.pairs.solids.T
        squares = np.zeros((len(a), centres.shape[1]))
        for component in np.moveaxis(centres, 2, 0):
            along = np.ascontiguousarray(component)
            apart = along.take(b, axis=0)
            apart -= along.take(a, axis=0)
            apart *= apart
            squares += apart
        reach = radii[a] + radii[b] + within
        is_near = squares < (reach * reach)[:, None]
        is_near[self.pairs.once[: len(a)], 1:] = False
        places, samples = np.nonzero(is_near)
        return places, samples

    def _grounds(self, poses: BodyPoses, centres: Array, within: float) -> "Parts":
        """Pairs of a solid and a half-space."""
        table, above, planes = self.bodies, self.pairs.above, self.pairs.planes
        up, origin = planes[:, :3, 2], planes[:, :3, 3]
        lowest = ((centres[above] - origin[:, None]) @ up[:, :, None])[..., 0] - table.radii[above, None]
        is_near = lowest < within
        is_near[self.pairs.once[len(self.pairs.solids) :], 1:] = False
        places, samples = np.nonzero(is_near)
        bodies, up = above[places], up[places]
        local = (np.swapaxes(poses.R[bodies, samples], 1, 2) @ -up[:, :, None])[..., 0]
        first = placed_points(poses, bodies, samples, table.supports.points(bodies, local))
        heights = np.einsum("mi,mi->m", first - origin[places], up)
        rows = self.pairs.rows[len(self.pairs.solids) :][places]
        ends = np.stack([bodies, np.full(len(bodies), -1)], axis=1)
        return rows, samples, heights, -up, first, first - heights[:, None] * up, ends


Parts = tuple[Indices, Indices, Array, Array, Array, Array, Indices]  # attributes of ``NearPairs``, from rows to bodies


def _wrenches(points: Array, normals: Array) -> Array:
    """Unit forces at points with their moments about the world's origin, shape (M, 6)."""
    (x, y, z), (a, b, c) = points.T, normals.T
    return np.stack([a, b, c, y * c - z * b, z * a - x * c, x * b - y * a], axis=1)


def counts_by_hull(body: CollisionBody, tip: Array | None) -> bool:
    """Whether the hull of a body may stand for it in a search: it is convex, or a tool that is cut off before its tip.

    The surface of such a tool differs from its hull by the hollow that the contact zone leaves at its end. Where the
    hull keeps clear of the tip only what bulges into that hollow is taken for a contact.

    The tip is in the frame of the body in [m], shape (3,); None for a body that is not cut.
    """
    if body.is_convex or tip is None:
        return body.is_convex
    corners = body.core.vertices
    toward = tip - corners.mean(axis=0)
    length = float(np.linalg.norm(toward))
    return length > 0.0 and float(((corners - tip) @ (toward / length)).max()) < -CLEAR_OF_TIP


def _directions(distances: Array, first: Array, second: Array, centres: Array) -> Array:
    """Unit directions from the first points to the second ones; between centres where bodies just touch."""
    lengths = np.linalg.norm(second - first, axis=1)
    along = np.where((lengths > 0.0)[:, None], second - first, centres) * np.where(distances < 0.0, -1.0, 1.0)[:, None]
    norms = np.linalg.norm(along, axis=1, keepdims=True)
    return along / np.where(norms > 0.0, norms, 1.0)


def near_pairs(table: NearTable, scene: "Scene", q: Array, within: float) -> NearPairs:
    """Pairs of a table as ``Scene.near`` has those of a scene."""
    D = table.forest.displacements(q, np.array([robot.X_WB for robot in scene.cell.robots]))
    return table.find(scene.engine, D, within)


def near_table_of(scene: "Scene") -> NearTable:
    """See ``Scene.near_table``, which keeps it."""
    cell, bodies, pairs, engine, cut_from = scene.cell, scene.bodies, scene.pairs, scene.engine, scene.cut_from
    forest = LinkForest(cell.robots)
    solids = bodies[: len(engine.bodies) - len(cut_from)]
    carriers = [*solids, *(solids[index] for index in cut_from)]
    of_solids = [(row, pair) for row, pair in enumerate(pairs) if pair.solids is not None]
    of_grounds = [(row, pair) for row, pair in enumerate(pairs) if pair.is_ground]
    demands = [pair.demand if pair.rule is Rule.CLEARANCE else 0.0 for _, pair in (*of_solids, *of_grounds)]
    return NearTable(
        forest=forest,
        bodies=BodyTable.of(forest, carriers, engine.bodies),
        pairs=WatchedPairs(
            rows=np.array([row for row, _ in (*of_solids, *of_grounds)], dtype=np.intp),
            solids=np.array([pair.solids for _, pair in of_solids], dtype=np.intp).reshape(-1, 2),
            above=np.array([pair.first for _, pair in of_grounds], dtype=np.intp),
            planes=np.array([bodies[pair.second].X_BS for _, pair in of_grounds]).reshape(-1, 4, 4),
            demands=np.array(demands),
            once=np.zeros(len(of_solids) + len(of_grounds), dtype=bool),
        ),
        is_hull=_are_hulls(cell, carriers, engine, len(solids)),
    )


def _are_hulls(cell: Cell, carriers: Sequence[SceneBody], engine: Engine, solids: int) -> Flags:
    """Whether the hull of each body of the engine may stand for it; bodies from ``solids`` on are cut tools."""
    flags = []
    for index, (carrier, body) in enumerate(zip(carriers, engine.bodies, strict=True)):
        tip = None
        if index >= solids and carrier.robot is not None:
            robot = cell.robot(carrier.robot)
            tip = (inverse(carrier.X_BS) @ robot.model.X_BF @ robot.tool.X_FT)[:3, 3]
        flags.append(counts_by_hull(body, tip))
    return np.array(flags, dtype=bool)
