"""Near pairs: the watched pairs of a scene that are nearer than a distance, where, and how that changes with joints."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cellplan.collision.engine import Engine
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse
from cellplan.kinematics.link_forest import LinkForest
from cellplan.model.cell import Cell
from cellplan.scene.bodies import SceneBody
from cellplan.scene.body_table import BodyTable
from cellplan.scene.near_table import NearTable, WatchedPairs, counts_by_hull
from cellplan.scene.pairs import Rule

if TYPE_CHECKING:
    from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearPairs:
    """Pairs that come nearer than a distance at some configurations; M of them, ordered by configuration and pair.

    Attributes:
        distances: Signed distances in [m], negative where the bodies overlap by so much, shape (M,). Of bodies that are
            not convex it is that of their hulls, never more than the true one, where that keeps what is demanded of the
            pair or the surfaces touch; that of their surfaces otherwise. Of a tool that is cut off before its tip it is
            that of its hull.
        normals: Unit directions from the first body to the second in W: the distance grows when the second moves along
            them, shape (M, 3).
    """

    rows: Indices  # their places in ``Scene.pairs``, shape (M,)
    samples: Indices  # at which configuration, shape (M,)
    distances: Array
    normals: Array
    first: Array  # points of the first bodies that are so far from the second ones, in W in [m], shape (M, 3)
    second: Array  # points of the second bodies likewise, shape (M, 3)
    by_joints: Array  # derivatives of the distances by the stacked joints, in [m/rad] or [m/m], shape (M, nq)


def near_pairs(scene: "Scene", q: Array, within: float) -> NearPairs:
    """See ``Scene.near``."""
    return near_pairs_of(scene.near_table, scene, q, within)


def near_pairs_of(table: NearTable, scene: "Scene", q: Array, within: float) -> NearPairs:
    """The same of the pairs of a table."""
    D = table.forest.displacements(q, np.array([robot.X_WB for robot in scene.cell.robots]))
    nearby = table.find(scene.engine, D, within)
    return NearPairs(
        rows=nearby.rows,
        samples=nearby.samples,
        distances=nearby.distances,
        normals=nearby.normals,
        first=nearby.first,
        second=nearby.second,
        by_joints=table.by_joints(D, nearby),
    )


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
