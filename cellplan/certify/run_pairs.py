"""The scene of one run: the rule of a pair depends on which robots work, and some searches need a few pairs only."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from cellplan.model.idle import idle_robots
from cellplan.model.left_out import LeftOutKind
from cellplan.model.robot import BASE
from cellplan.scene.bodies import Kind, SceneBody
from cellplan.scene.pairs import Excluded, Rule, ScenePair
from cellplan.scene.scene import Scene


def scene_of_run(scene: Scene, tasks: Collection[str]) -> Scene:
    """The scene while some tasks are worked on: the tool of an idle robot keeps away from the part like anything else.

    Args:
        scene: The scene of the cell, in which all tools are at work.
        tasks: Names of the tasks that are worked on.
    """
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


def scene_with_contact(scene: Scene, is_allowed: Callable[[SceneBody, SceneBody], bool], reason: str) -> Scene:
    """The scene while some pairs may touch, as a part and what grips it or what it is put on; they are listed as such.

    Args:
        scene: The scene.
        is_allowed: Whether two bodies may touch.
        reason: Why they may.
    """
    ends = [(scene.bodies[pair.first], scene.bodies[pair.second]) for pair in scene.pairs]
    may_touch = [is_allowed(*both) or is_allowed(*both[::-1]) for both in ends]
    excluded = tuple(
        Excluded(pair.first, pair.second, reason, LeftOutKind.PUT_DOWN)
        for pair, allowed in zip(scene.pairs, may_touch, strict=True)
        if allowed
    )
    kept = [row for row, allowed in enumerate(may_touch) if not allowed]
    return replace(scene_of_rows(scene, kept), excluded=(*scene.excluded, *excluded))


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
