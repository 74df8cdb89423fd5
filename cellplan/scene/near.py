"""Near pairs: the watched pairs of a scene that are nearer than a distance, where, and how that changes with joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.nearest_points import point_above
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.line_distances import line_distances
from cellplan.model.robot import BASE
from cellplan.scene.bodies import link_displacements, solid_poses
from cellplan.scene.pairs import Rule

if TYPE_CHECKING:
    from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearPairs:
    """Pairs that come nearer than a distance at some configurations; M of them, ordered by configuration and pair.

    Attributes:
        rows: Their places in ``Scene.pairs``, shape (M,).
        samples: At which configuration, shape (M,).
        distances: Signed distances in [m], negative where the bodies overlap by so much, shape (M,). Of bodies that are
            not convex it is that of their hulls, never more than the true one, where that keeps what is demanded of the
            pair or the surfaces touch; that of their surfaces otherwise.
        normals: Unit directions from the first body to the second in W: the distance grows when the second moves along
            them, shape (M, 3).
        first: Points of the first bodies that are so far from the second ones, in W in [m], shape (M, 3).
        second: Points of the second bodies likewise, shape (M, 3).
        by_joints: Derivatives of the distances by the stacked joints, in [m/rad] or [m/m], shape (M, nq).
    """

    rows: Indices
    samples: Indices
    distances: Array
    normals: Array
    first: Array
    second: Array
    by_joints: Array


def near_pairs(scene: "Scene", q: Array, within: float) -> NearPairs:
    """See ``Scene.near``."""
    D = link_displacements(scene.cell, scene.chains, q)
    poses = solid_poses(scene.bodies, scene.cut_from, D)
    parts = [_solids(scene, poses, within), _grounds(scene, poses, within)]
    rows, samples, distances, normals, first, second = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.lexsort((rows, samples))[distances[np.lexsort((rows, samples))] < within]
    rows, samples, distances = rows[order], samples[order], distances[order]
    normals, first, second = normals[order], first[order], second[order]
    return NearPairs(
        rows=rows,
        samples=samples,
        distances=distances,
        normals=normals,
        first=first,
        second=second,
        by_joints=_by_joints(scene, D, rows, samples, normals=normals, points=second),
    )


Found = tuple[Indices, Indices, Array, Array, Array, Array]  # rows, samples, distances, normals, first, second points


def _solids(scene: "Scene", poses: BodyPoses, within: float) -> Found:
    """Pairs of solids: bounding spheres, then hulls, then the surfaces of bodies that are not convex."""
    engine, ends = scene.engine, scene.solid_pairs
    centres = (poses.R @ engine.centres[:, None, :, None])[..., 0] + poses.p
    a, b = ends.T
    apart, reach = centres[b] - centres[a], engine.radii[a] + engine.radii[b] + within
    places, samples = np.nonzero(np.einsum("pki,pki->pk", apart, apart) < (reach * reach)[:, None])
    lines = np.array([body.ends for body in engine.bodies]).reshape(-1, 2, 3)
    girths = np.array([body.girth for body in engine.bodies])
    at = [(ends[places, side], samples) for side in (0, 1)]
    placed = [(poses.R[where][:, None] @ lines[where[0], :, :, None])[..., 0] + poses.p[where][:, None] for where in at]
    slim = line_distances(*placed) < girths[at[0][0]] + girths[at[1][0]] + within
    places, samples = places[slim], samples[slim]
    near, distances, points = engine.signed.below(engine.bodies, ends[places], poses, samples, within=within)
    places, samples, first, second = places[near], samples[near], points[:, 0].copy(), points[:, 1].copy()
    rows = scene.solid_rows[places]
    pairs = [scene.pairs[row] for row in rows.tolist()]
    demands = np.array([pair.demand if pair.rule is Rule.CLEARANCE else 0.0 for pair in pairs])
    for query in np.flatnonzero((distances <= demands) & ~_are_convex(scene)[ends[places]].all(axis=1)).tolist():
        (i, j), sample = ends[places[query]].tolist(), int(samples[query])
        is_apart = not engine.touch(i, j, poses, sample=sample)
        if is_apart and (nearest := engine.surface_points(i, j, poses, sample=sample)) is not None:
            first[query], second[query] = nearest
            distances[query] = np.linalg.norm(nearest[1] - nearest[0])
    normals = _directions(
        distances, first, second, centres[ends[places, 1], samples] - centres[ends[places, 0], samples]
    )
    return rows, samples, distances, normals, first, second


def _are_convex(scene: "Scene") -> Flags:
    """Which of the engine's bodies are convex, shape (B,)."""
    return np.array([body.is_convex for body in scene.engine.bodies], dtype=bool)


def _directions(distances: Array, first: Array, second: Array, centres: Array) -> Array:
    """Unit directions from the first points to the second ones; between centres where bodies just touch."""
    lengths = np.linalg.norm(second - first, axis=1)
    along = np.where((lengths > 0.0)[:, None], second - first, centres) * np.where(distances < 0.0, -1.0, 1.0)[:, None]
    norms = np.linalg.norm(along, axis=1, keepdims=True)
    return along / np.where(norms > 0.0, norms, 1.0)


def _grounds(scene: "Scene", poses: BodyPoses, within: float) -> Found:
    """Pairs of a solid and a half-space."""
    found = []
    for row in scene.ground_rows.tolist():
        pair, ground = scene.pairs[row], scene.bodies[scene.pairs[row].second]
        centres = poses.R[pair.first] @ scene.engine.centres[pair.first] + poses.p[pair.first]
        up = ground.X_BS[:3, 2]
        lowest = (centres - ground.X_BS[:3, 3]) @ up - scene.engine.radii[pair.first]
        for sample in np.flatnonzero(lowest < within).tolist():
            points = point_above(scene.engine, pair.first, poses, X_WS=ground.X_BS, sample=sample)
            height = float((points.first - ground.X_BS[:3, 3]) @ up)
            found.append((row, sample, height, *-up, *points.first, *points.second))
    table = np.array(found).reshape(-1, 12)
    rows, samples = table[:, 0].astype(np.intp), table[:, 1].astype(np.intp)
    return rows, samples, table[:, 2], table[:, 3:6], table[:, 6:9], table[:, 9:]


def _by_joints(
    scene: "Scene", D: Mapping[str, Array], rows: Indices, samples: Indices, *, normals: Array, points: Array
) -> Array:
    """Derivatives of the distances: the work of a unit force along the normal on every joint, shape (M, nq).

    It is the same at both points, as the normal goes through both.
    """
    wrenches = np.concatenate([normals, np.cross(points, normals)], axis=1)
    ends = np.array([(scene.pairs[row].first, scene.pairs[row].second) for row in rows.tolist()], dtype=np.intp)
    ends = ends.reshape(-1, 2)
    found = np.zeros((len(rows), scene.cell.joint_count))
    for robot in scene.cell.robots:
        columns, model = scene.cell.columns(robot.name), robot.model
        carried = _carried(scene, robot.name)
        moved = carried[ends[:, 1]] - carried[ends[:, 0]]
        concerned = np.flatnonzero(moved.any(axis=1))
        screws = scene.chains[robot.name].axis_screws(D[robot.name])[samples[concerned]]
        work = (screws @ wrenches[concerned, :, None])[..., 0] * moved[concerned]
        drives = [model.drive(axis) for axis in range(len(model.axes))]
        shares = np.zeros((len(drives), len(model.joints)))
        shares[np.arange(len(drives)), [drive.joint for drive in drives]] = [drive.ratio for drive in drives]
        found[concerned, columns] = work @ shares
    return found


def _carried(scene: "Scene", robot: str) -> Array:
    """1 where an axis of a robot carries a body of the scene, shape (bodies, axes)."""
    axes = scene.cell.robot(robot).model.axes
    links = np.zeros((len(axes) + 1, len(axes)))  # of each link, the base last
    for link, axis in enumerate(axes):
        links[link, link] = 1.0
        if axis.parent != BASE:
            links[link] += links[axis.parent]
    places = [body.link if body.robot == robot else BASE for body in scene.bodies]
    return links[places]
