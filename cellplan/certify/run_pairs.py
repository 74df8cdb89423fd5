"""The scene of one run: what is asked of a pair depends on who works, and some questions concern a few pairs only."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from cellplan.model.idle import idle_robots
from cellplan.model.robot import BASE
from cellplan.scene.bodies import Kind, is_ground
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene


def scene_of_run(scene: Scene, tasks: Collection[str]) -> Scene:
    """The scene while some tasks are worked on: the tool of an idle robot keeps away from the part like anything else.

    Args:
        scene: The scene of the cell, in which all tools are at work.
        tasks: Names of the tasks that are worked on.
    """
    idle = idle_robots(scene.cell, tasks)
    pairs = list(scene.pairs)
    watched, judged = _watched(scene), set[tuple[str, ...]]()
    for row, pair in enumerate(pairs):
        tool = _tool_at_work(scene, pair)
        if tool is not None and scene.bodies[tool].robot in idle:
            pairs[row] = replace(pair, rule=Rule.CLEARANCE, reason="")
            watched[row] = (tool, pair.second if tool == pair.first else pair.first)
            judged.add(scene.names(pair))
    left_out = tuple(each for each in scene.left_out if each.bodies not in judged)
    return replace(_with_pairs(scene, pairs, watched), left_out=left_out)


def scene_of_rows(scene: Scene, rows: Sequence[int]) -> Scene:
    """The scene in which only some pairs are watched, in the order given."""
    watched = _watched(scene)
    kept = {place: watched[row] for place, row in enumerate(rows) if row in watched}
    return _with_pairs(scene, [scene.pairs[row] for row in rows], kept)


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
    return next(end for end in (pair.first, pair.second) if scene.bodies[end].kind is Kind.TOOL)


def _watched(scene: Scene) -> dict[int, tuple[int, int]]:
    """The engine's bodies of each pair of solids that the engine watches, by the pair."""
    ends = scene.solid_pairs.tolist()
    return {row: (first, second) for row, (first, second) in zip(scene.solid_rows.tolist(), ends, strict=True)}


def _with_pairs(scene: Scene, pairs: Sequence[ScenePair], watched: dict[int, tuple[int, int]]) -> Scene:
    """The scene with other pairs; its bodies and its engine stay."""
    rows = sorted(watched)
    ground = [row for row, pair in enumerate(pairs) if is_ground(scene.bodies[pair.second])]
    return replace(
        scene,
        pairs=tuple(pairs),
        solid_rows=np.array(rows, dtype=np.intp),
        solid_pairs=np.array([watched[row] for row in rows], dtype=np.intp).reshape(-1, 2),
        ground_rows=np.array(ground, dtype=np.intp),
    )
