"""Which places of a base bring two bodies too near each other: the motions of many places asked together."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.certify.depths import mounted_depths
from cellplan.geometry.arrays import Array, Indices
from cellplan.scene.scene import Scene, stands_by_link

KEYS: Final = (3, 9, 33)  # [-] nodes at which distances are asked, more and more while nothing is too near
AT_ONCE: Final = 128  # [-] configurations placed together: about 10 MB


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceContact:
    """Two bodies that are too near."""

    pair: tuple[str, str]  # their names
    distance: float  # their distance in [m], negative where they overlap by so much
    node: int  # node of the motion at which it is so


def contacts(scene: Scene, robot: str, X_WB: Array, q: Array, *, standing: bool = True) -> list[PlaceContact | None]:
    """The worst contact of each motion at the first nodes that show one; None for a motion without any.

    Args:
        X_WB: Its base for each motion, shape (K, 4, 4).
        q: The motions, shape (K, N, nq).
    """
    if stands_by_link(scene.cell, robot) and len(q) > 1:  # its pairs depend on where it stands
        slices = (slice(k, k + 1) for k in range(len(q)))
        return [contacts(scene, robot, X_WB[k], q[k], standing=standing)[0] for k in slices]
    touching: list[PlaceContact | None] = [None] * len(q)
    if not len(q):
        return touching
    placed = scene.moved({robot: X_WB[0]})
    places, seen = np.arange(len(q)), np.zeros(q.shape[1], dtype=bool)
    for count in KEYS:
        nodes = np.unique(np.linspace(0, q.shape[1] - 1, count).round().astype(np.intp))
        nodes = nodes[~seen[nodes]]
        seen[nodes] = True
        step = max(1, AT_ONCE // max(1, len(nodes)))
        for some in (places[begin : begin + step] for begin in range(0, len(places), step)):
            for place, contact in _worst(placed, robot, X_WB[some], q[some][:, nodes]).items():
                touching[some[place]] = PlaceContact(
                    pair=contact.pair, distance=contact.distance, node=int(nodes[contact.node])
                )
        places = np.array([place for place in places.tolist() if touching[place] is None], dtype=np.intp)
    for place in places.tolist() if standing else ():
        touching[place] = _standing(scene.moved({robot: X_WB[place]}), q[place, :1])
    return touching


def _worst(scene: Scene, robot: str, X_WB: Array, q: Array) -> dict[int, PlaceContact]:
    """The worst contact of motions of shape (K, nodes, nq), by motion and node, for those that have one."""
    table, (count, nodes, joints) = scene.near_table, q.shape
    bases = np.array([np.tile(robot.X_WB, (count * nodes, 1, 1)) for robot in scene.cell.robots])
    bases[scene.cell.index(robot)] = np.repeat(X_WB, nodes, axis=0)
    demands = np.zeros(len(scene.pairs))
    demands[table.pairs.rows] = table.pairs.demands
    D = table.forest.displacements(q.reshape(-1, joints), bases)
    near = table.find(scene.engine, D, float(demands.max(initial=0.0)))
    short, motions = near.distances - demands[near.rows], near.samples // nodes
    worst = dict[int, PlaceContact]()
    for query in _worst_pairs(short, motions).tolist():
        pair = scene.names(scene.pairs[near.rows[query]])
        node = int(near.samples[query] % nodes)
        worst[int(motions[query])] = PlaceContact(pair=pair, distance=float(near.distances[query]), node=node)
    return worst


def _worst_pairs(short: Array, motions: Indices) -> Indices:
    """Of each motion the pair that falls short by most, of those that do."""
    below = np.flatnonzero(short < 0.0)
    order = below[np.lexsort((short[below], motions[below]))]
    _, first = np.unique(motions[order], return_index=True)
    return order[first]


def _standing(scene: Scene, q: Array) -> PlaceContact | None:
    """The first pair of which one stands too deep in the other, at a configuration of shape (1, nq)."""
    table = scene.near_table
    D = table.forest.displacements(q, np.array([robot.X_WB for robot in scene.cell.robots]))
    for mounted_depth in mounted_depths(scene, q, table.bodies.poses(D)):
        if mounted_depth.depth > mounted_depth.pair.limit:
            names = (scene.bodies[mounted_depth.pair.first].name, scene.bodies[mounted_depth.pair.second].name)
            return PlaceContact(pair=names, distance=-mounted_depth.depth, node=0)
    return None
