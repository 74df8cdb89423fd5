"""Everything in a scene that is not judged in full, but for two links of one robot's own file."""

from collections.abc import Iterator, Sequence
from typing import Final

from cellplan.model.left_out import LeftOut, LeftOutKind
from cellplan.scene.bodies import Kind, SceneBody
from cellplan.scene.mounting import is_of_own_file
from cellplan.scene.pairs import Excluded, Rule, ScenePair

KIND: Final = {
    Rule.CONTACT: LeftOutKind.CONTACT_ONLY,
    Rule.PROCESS: LeftOutKind.AT_WORK,
    Rule.GRIP: LeftOutKind.GRIP,
}
AMONG_THINGS: Final = "all of them stand still: they are not judged against each other"


def left_out(
    bodies: Sequence[SceneBody], pairs: Sequence[ScenePair], excluded: Sequence[Excluded]
) -> tuple[LeftOut, ...]:
    """What was left out or asked less of, in the order of the bodies; the surroundings among themselves last.

    Args:
        bodies: All solids.
        pairs: Pairs that are watched.
        excluded: Pairs that are not.
    """
    found = sorted([*_relaxed(bodies, pairs), *_excluded(excluded)], key=lambda each: each[:2])
    named = [LeftOut(kind, (bodies[i].name, bodies[j].name), reason) for i, j, kind, reason in found]
    things = tuple(body.name for body in bodies if body.kind is Kind.OBSTACLE)
    return (*named, *([LeftOut(LeftOutKind.ENVIRONMENT, things, AMONG_THINGS)] if len(things) > 1 else []))


def _relaxed(bodies: Sequence[SceneBody], pairs: Sequence[ScenePair]) -> Iterator[tuple[int, int, LeftOutKind, str]]:
    """Watched pairs of which less than the full distance is asked."""
    for pair in pairs:
        if pair.rule is not Rule.CLEARANCE and not is_of_own_file(bodies[pair.first], bodies[pair.second]):
            yield pair.first, pair.second, KIND[pair.rule], pair.reason


def _excluded(excluded: Sequence[Excluded]) -> Iterator[tuple[int, int, LeftOutKind, str]]:
    """Pairs that are not watched, but for those that a robot's own file sets."""
    for pair in excluded:
        if pair.kind is not None:
            yield pair.first, pair.second, pair.kind, pair.reason
