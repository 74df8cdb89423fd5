"""Straight moves of robots together: whether bodies come too near, judged once for the robots that carry them."""

from collections.abc import Collection
from functools import cached_property
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import scene_of_rows
from cellplan.geometry.arrays import Array
from cellplan.model.robot.robot import BASE
from cellplan.planning.transfer.straight_time import straight_line
from cellplan.scene.scene import Scene

NEARER: Final = 1e-5  # [m] than it may be that a pair is in rows that are not certified: rounding of quick distances
LOOKED_AT: Final = 4  # [rows] between two that are examined before all are certified

Carriers = frozenset[str]  # robots that carry the bodies of a pair
Move = tuple[Carriers, bytes]  # with their configurations at both ends


class StraightMoves:
    """Verdicts on straight moves in a scene.

    All joints share one law, so whether two bodies come too near depends only on where the robots that carry them begin
    and end. A verdict does not depend on those before it.
    """

    def __init__(self, scene: Scene) -> None:
        """Nothing is known of any move."""
        self._scene = scene
        self._apart_in_rows = dict[Move, bool]()  # whether all of its pairs keep their distance there
        self._certified = dict[Move, bool]()
        self._arms: LeverArms | None = None  # of the last moves

    def refusing(self, start: Array, goal: Array, movers: Collection[str]) -> Carriers | None:
        """Robots that carry the bodies of a pair that comes too near in a straight move; None where none does.

        Args:
            start: Stacked joint positions in [rad] or [m], shape (nq,).
            goal: Likewise.
            movers: The robots of which some are named.
        """
        moves, line = self._moves(start, goal), straight_line(start, goal)
        if any(move not in self._apart_in_rows for move in moves):
            near = {self._carriers[row] for row in self._too_near(line[::LOOKED_AT])}
            self._apart_in_rows |= {move: move[0] not in near for move in moves}
        at_fault = [move[0] for move in moves if not self._apart_in_rows[move]]
        if not at_fault:
            self._certify([move for move in moves if move not in self._certified], line)
            at_fault = [move[0] for move in moves if not self._certified[move]]
        named = [names for carriers in at_fault if (names := carriers.intersection(movers))]
        return min(named, key=lambda names: (len(names), sorted(names)), default=None)

    @cached_property
    def _carriers(self) -> list[Carriers]:
        """Robots that carry the bodies of each pair."""
        bodies = self._scene.bodies
        ends = ((bodies[pair.first], bodies[pair.second]) for pair in self._scene.pairs)
        return [frozenset(body.robot for body in pair if body.robot and body.link != BASE) for pair in ends]

    @cached_property
    def _rows(self) -> dict[Carriers, list[int]]:
        """Pairs by the robots that carry them."""
        rows: dict[Carriers, list[int]] = {}
        for row, carriers in enumerate(self._carriers):
            rows.setdefault(carriers, []).append(row)
        return rows

    def _moves(self, start: Array, goal: Array) -> list[Move]:
        """The move as each set of carriers makes it; those that stand are left out."""
        moves, ends = list[Move](), np.array([start, goal])
        for carriers in self._rows:
            at = [ends[:, self._scene.cell.columns(name)] for name in sorted(carriers)]
            if any(np.any(first != second) for first, second in at):
                moves.append((carriers, b"".join(it.tobytes() for it in at)))
        return moves

    def _too_near(self, line: Array) -> list[int]:
        """Pairs that are too near in some rows already, which takes less than a certificate to see."""
        demands = self._demands
        near = self._scene.near(line, float(demands.max(initial=0.0)))
        return np.unique(near.rows[near.distances < demands[near.rows] - NEARER]).tolist()

    @cached_property
    def _demands(self) -> Array:
        return np.array([pair.least_distance for pair in self._scene.pairs])

    def _certify(self, moves: list[Move], line: Array) -> None:
        """Certify moves along a line; as a certificate ends with the first fault, those that have none again."""
        self._arms = LeverArms(self._scene, line) if self._arms is None else self._arms.over(line)
        while moves:
            rows = [row for carriers, _ in moves for row in self._rows[carriers]]
            bound = certify(scene_of_rows(self._scene, rows), line, with_minimum=False, arms=self._arms)
            at_fault = {
                self._carriers[row]
                for row, it in zip(rows, bound.states, strict=True)
                if it.touches or it.unproved or it.distance < it.demand
            }
            is_known = bound.is_met or not at_fault
            self._certified |= {move: bound.is_met for move in moves if is_known or move[0] in at_fault}
            moves = [move for move in moves if move not in self._certified]
