"""How far candidates fall short of demanded distances, many bases and configurations in one call."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.scene.bodies import Kind, is_ground
from cellplan.scene.mounting import MountedPair
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene
from cellplan.search.distances.layout_pairs import among, demands_of, layout_pairs

AT_ONCE: Final = 192  # configurations in one call: arrays of all pairs stay small


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shortfalls:
    """By how much S configurations fall short of what is demanded.

    Attributes:
        pair: Names of the two bodies that fall short most, None where all keep their distance.
    """

    worst: Array  # largest shortfall of any pair in [m]; 0 or less where all keep their distance, shape (S,)
    pair: tuple[tuple[str, str] | None, ...]


class Contacts:
    """The pairs of a scene that concern some robots, wherever these stand.

    Columns below bases keep their height and go with them, tools keep their bodies, and pairs that the design of a
    robot keeps near are left out. So the answer is a first one: ``CellDistances`` knows better.
    """

    def __init__(self, scene: Scene, robots: Iterable[str], against: Iterable[str] = ()) -> None:
        """Keep the pairs of which a body goes with one of some robots, the other with any of these or with none.

        Args:
            robots: Names of the robots.
            against: Names of further robots, whose pairs with each other do not count.
        """
        members = set(robots)
        known, anyone = {*members, *against, None}, {body.name: body.robot for body in scene.bodies}
        self._pairs, watched = layout_pairs(scene)
        is_design = [pair.rule is Rule.CONTACT for pair in scene.pairs] + [
            _is_column(scene, pair) for pair in scene.mounted
        ]
        owners = [{anyone[name] for name in pair.names} for pair in self._pairs]
        is_watched = [
            not design and not (pair.within_robot and pair.is_fixed) and known >= owner and bool(members & owner)
            for pair, design, owner in zip(self._pairs, is_design, owners, strict=True)
        ]
        watched = among(watched, np.array(is_watched, dtype=bool))
        watched = replace(
            watched, once=np.zeros(len(watched.rows), dtype=bool)
        )  # every configuration is another layout
        self._table, self._engine = replace(scene.near_table, pairs=watched), scene.engine
        self._demands = demands_of(self._pairs)

    def shortfalls(self, X_WB: Array, q: Array) -> Shortfalls:
        """By how much configurations fall short.

        Args:
            X_WB: Bases of all robots, shape (S, robots, 4, 4).
            q: Stacked joint positions in [rad] or [m], shape (S, nq).
        """
        worst, pair = np.full(len(q), -np.inf), list[tuple[str, str] | None]()
        for first in range(0, len(q), AT_ONCE):
            group = slice(first, first + AT_ONCE)
            worst[group], names = self._of_group(X_WB[group], q[group])
            pair += names
        return Shortfalls(worst=worst, pair=tuple(pair))

    def _of_group(self, X_WB: Array, q: Array) -> tuple[Array, list[tuple[str, str] | None]]:
        """The same of a few configurations."""
        worst, names = np.full(len(q), -np.inf), list[tuple[str, str] | None]([None] * len(q))
        rows = self._table.pairs.rows
        if not len(rows):
            return worst, names
        D = self._table.forest.displacements(q, np.swapaxes(X_WB, 0, 1))
        nearby = self._table.find(self._engine, D, float(self._demands[rows].max()))
        short = self._demands[nearby.rows] - nearby.distances
        for place in np.argsort(short, kind="stable").tolist():
            sample = int(nearby.samples[place])
            worst[sample] = short[place]
            names[sample] = self._pairs[nearby.rows[place]].names if short[place] > 0.0 else None
        return worst, names


def _is_column(scene: Scene, pair: MountedPair) -> bool:
    """Whether a pair is a column and the ground that it stands on: its height follows from that."""
    return scene.bodies[pair.first].kind is Kind.PEDESTAL and is_ground(scene.bodies[pair.second])
