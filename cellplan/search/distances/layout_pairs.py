"""Which pairs of bodies a layout search keeps apart: those of the scene, those that stand, and keep-out zones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.scene.bodies import is_ground
from cellplan.scene.near import WatchedPairs
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayoutPair:
    """Two bodies that a layout keeps apart."""

    names: tuple[str, str]  # their names
    ends: tuple[int, int]  # their places in ``Scene.bodies``
    demand: float  # distance in [m] that is demanded; negative where they may reach into each other by so much
    within_robot: bool  # whether both belong to one robot: no layout gives them more room than the robot's design has
    is_fixed: bool  # whether no joint is between them


def layout_pairs(scene: Scene) -> tuple[tuple[LayoutPair, ...], WatchedPairs]:
    """All pairs of a scene, then those of which the depth is judged; and the same as arrays."""
    bodies, table = scene.bodies, scene.near_table
    known, forest = table.pairs, table.forest
    carriers = [forest.carries[forest.place(body.robot, body.link)].tobytes() for body in bodies]  # what moves each

    def pair(first: int, second: int, demand: float) -> LayoutPair:
        a, b = bodies[first], bodies[second]
        return LayoutPair(
            names=(a.name, b.name),
            ends=(first, second),
            demand=demand,
            within_robot=a.robot is not None and a.robot == b.robot,
            is_fixed=carriers[first] == carriers[second],
        )

    watched_pairs = [
        pair(watched.first, watched.second, watched.demand if watched.rule is Rule.CLEARANCE else 0.0)
        for watched in scene.pairs
    ]
    watched_pairs += [pair(mounted.first, mounted.second, -mounted.limit) for mounted in scene.mounted]
    first = len(scene.pairs)
    solids = [(first + k, mounted) for k, mounted in enumerate(scene.mounted) if not is_ground(bodies[mounted.second])]
    grounds = [(first + k, mounted) for k, mounted in enumerate(scene.mounted) if is_ground(bodies[mounted.second])]
    count = len(known.solids)
    rows = [*known.rows[:count], *(row for row, _ in solids), *known.rows[count:], *(row for row, _ in grounds)]
    pairs = WatchedPairs(
        rows=np.array(rows, dtype=np.intp),
        solids=np.concatenate([known.solids, _ends([(solid.first, solid.second) for _, solid in solids])]),
        above=np.array([*known.above, *(ground.first for _, ground in grounds)], dtype=np.intp),
        planes=np.concatenate([known.planes, _poses([bodies[ground.second].X_BS for _, ground in grounds])]),
        demands=np.array([watched_pairs[row].demand for row in rows]),
        once=np.array([watched_pairs[row].is_fixed for row in rows], dtype=bool),
    )
    return tuple(watched_pairs), pairs


def with_areas(
    pairs: Sequence[LayoutPair], watched: WatchedPairs, ends: Sequence[tuple[int, int]], names: Sequence[str]
) -> tuple[tuple[LayoutPair, ...], WatchedPairs]:
    """The pairs, and those of areas and what keeps out of them, by their places among the bodies of the given names."""
    added = [
        LayoutPair(names=(names[a], names[b]), ends=(a, b), demand=0.0, within_robot=False, is_fixed=True)
        for a, b in ends
    ]
    count, first = len(watched.solids), len(pairs)
    return (*pairs, *added), replace(
        watched,
        rows=np.insert(watched.rows, count, np.arange(first, first + len(added))),
        solids=np.concatenate([watched.solids, _ends(ends)]),
        demands=np.insert(watched.demands, count, np.zeros(len(added))),
        once=np.insert(watched.once, count, np.ones(len(added), dtype=bool)),
    )


def demands_of(pairs: Sequence[LayoutPair]) -> Array:
    """Demanded distances in [m], shape (P,)."""
    return np.array([pair.demand for pair in pairs])


def among(pairs: WatchedPairs, is_selected: Flags) -> WatchedPairs:
    """Some of the pairs, by what they are called: ``is_selected`` has an entry for each row."""
    count = len(pairs.solids)
    is_chosen = is_selected[pairs.rows]
    solids, above = is_chosen[:count], is_chosen[count:]
    return replace(
        pairs,
        rows=pairs.rows[is_chosen],
        solids=pairs.solids[solids],
        above=pairs.above[above],
        planes=pairs.planes[above],
        demands=pairs.demands[is_chosen],
        once=pairs.once[is_chosen],
    )


def _ends(ends: Sequence[tuple[int, int]]) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
    """Pairs of bodies, shape (P, 2)."""
    return np.array(ends, dtype=np.intp).reshape(-1, 2)


def _poses(X: Sequence[Array]) -> Array:
    """Poses, shape (P, 4, 4)."""
    return np.array(X).reshape(-1, 4, 4)
