"""The scene of one run: the rule of a pair depends on which robots work, and some searches need a few pairs only."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.idle import idle_robots
from cellplan.model.robot.robot import BASE
from cellplan.scene.bodies import Kind
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

SAME_DISTANCE: Final = 1e-12  # [m] rounding of a distance along a straight move


def scene_of_run(scene: Scene, tasks: Collection[str]) -> Scene:
    """The scene while some tasks are worked on: the tool of an idle robot keeps away from the part like the rest."""
    idle = idle_robots(scene.cell, tasks)
    pairs = list(scene.pairs)
    for row, pair in enumerate(pairs):
        tool = _tool_at_work(scene, pair)
        if tool is not None and scene.bodies[tool].robot in idle:
            part = pair.second if tool == pair.first else pair.first
            pairs[row] = replace(pair, rule=Rule.CLEARANCE, reason="", solids=(tool, part))
    return replace(scene, pairs=tuple(pairs))


def scene_of_rows(scene: Scene, rows: Sequence[int]) -> Scene:
    """The scene in which only some pairs are watched, in the order given."""
    return replace(scene, pairs=tuple(scene.pairs[row] for row in rows))


def with_straight_move(scene: Scene, times: Array, q: Array) -> tuple[Scene, Array, Array]:
    """The scene with the pairs of its straight move, each with the rows between which it is watched.

    Where a pair begins or ends to be watched between two rows, a row is added there: joints move linearly.

    Args:
        times: Times of the rows in [s], shape (N,).
        q: Stacked joint positions in [rad] or [m], shape (N, nq).

    Returns:
        The scene, and the times and positions with the added rows.
    """
    move = scene.straight
    if move is None:
        return scene, times, q
    tips = scene.chains[move.robot].tool_poses(q[:, scene.cell.columns(move.robot)])[:, :3, 3]
    distance, rows = np.linalg.norm(tips - move.p_WT, axis=1), np.arange(len(q), dtype=float)
    added = [rows]
    for edge in sorted({edge for _, *edges in move.pairs for edge in edges}):
        before = np.flatnonzero((distance[:-1] - edge) * (distance[1:] - edge) < 0.0)
        added.append(before + (distance[before] - edge) / (distance[before] - distance[before + 1]))
    at = np.unique(np.concatenate(added))
    distance = np.interp(at, rows, distance)
    pairs = list(scene.pairs)
    for pair, low, high in move.pairs:
        inside = np.flatnonzero((distance >= low - SAME_DISTANCE) & (distance <= high + SAME_DISTANCE))
        if len(inside) > 1:
            pairs.append(replace(pair, samples=(int(inside[0]), int(inside[-1]))))
    fine = np.stack([np.interp(at, rows, column) for column in q.T], axis=1)
    return replace(scene, pairs=tuple(pairs)), np.interp(at, rows, times), fine


def rows_moved_by(scene: Scene, robot: str) -> list[int]:
    """Pairs whose distance depends on the configuration of a robot: one of their bodies is on one of its moving links.

    The part counts as the body of a holder, as it does everywhere in a scene.
    """
    moved = [body.robot == robot and body.link != BASE for body in scene.bodies]
    return [row for row, pair in enumerate(scene.pairs) if moved[pair.first] or moved[pair.second]]


def _tool_at_work(scene: Scene, pair: ScenePair) -> int | None:
    """The tool of a pair of which contact is allowed near the tip, by its index."""
    if pair.rule is not Rule.PROCESS:
        return None
    return next(end for end in (pair.first, pair.second) if scene.bodies[end].kind is not Kind.PART)
