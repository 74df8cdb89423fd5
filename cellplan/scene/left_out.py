"""Everything in a scene that is not judged in full, but for two links of one robot's own file."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.distance import measure
from cellplan.collision.engine import Engine
from cellplan.collision.separation import heights
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.left_out import LeftOut, LeftOutKind
from cellplan.scene.bodies import Kind, SceneBody, is_ground
from cellplan.scene.mounting import is_of_one_robot
from cellplan.scene.pairs import Excluded, Rule, ScenePair

Entry = tuple[int, int, LeftOutKind, str]  # both bodies, kind and reason

KIND: Final = {
    Rule.CONTACT: LeftOutKind.CONTACT_ONLY,
    Rule.PROCESS: LeftOutKind.AT_WORK,
    Rule.GRIP: LeftOutKind.GRIP,
}
NO_BODY_REASON: Final = "none of its links has a body: contacts of its arm are not checked"
FIXED_REASON: Final = "all of them are fixed: not checked against each other"


def left_out(
    cell: Cell,
    bodies: Sequence[SceneBody],
    pairs: Sequence[ScenePair],
    excluded: Sequence[Excluded],
    *,
    engine: Engine,
) -> tuple[LeftOut, ...]:
    """What was left out, or has a weaker rule than clearance, in the order of the bodies.

    Then come the surroundings among themselves, and robots whose links have no bodies.

    Bodies that never move and keep the demanded clearance are not listed: nothing was excused there.

    Args:
        engine: The solids first, in the order of the bodies.
    """
    standing = _Standing(cell, bodies, engine)
    entries = [*_relaxed(bodies, pairs), *(entry for entry in _excluded(excluded) if not standing.is_clear(*entry[:3]))]
    ordered = sorted(entries, key=lambda entry: entry[:2])
    named = [LeftOut(kind, (bodies[i].name, bodies[j].name), reason) for i, j, kind, reason in ordered]
    things = tuple(body.name for body in bodies if body.kind is Kind.OBSTACLE)
    among = [LeftOut(LeftOutKind.ENVIRONMENT, things, FIXED_REASON)] if len(things) > 1 else []
    with_links = {body.robot for body in bodies if body.kind is Kind.LINK}
    bare = [robot.name for robot in cell.robots if robot.name not in with_links]
    return (*named, *among, *(LeftOut(LeftOutKind.NO_BODY, (name,), NO_BODY_REASON) for name in bare))


class _Standing:
    """Bodies that never move, where they stand."""

    def __init__(self, cell: Cell, bodies: Sequence[SceneBody], engine: Engine) -> None:
        """Place them; the others are placed as if all joints were at zero, and not used."""
        self._bodies, self._engine, self._clearance = bodies, engine, cell.checks.clearance_mm.si
        X = [body.X_BS if body.robot is None else cell.robot(body.robot).X_WB @ body.X_BS for body in bodies]
        placed: Array = np.array(X).reshape(-1, 4, 4)
        self._poses = BodyPoses(placed[:, None, :3, :3], placed[:, None, :3, 3])
        solids = slice(sum(not is_ground(body) for body in bodies))
        self._centres = (placed[solids, :3, :3] @ engine.centres[solids, :, None])[..., 0] + placed[solids, :3, 3]

    def is_clear(self, first: int, second: int, kind: LeftOutKind) -> bool:
        """Whether two bodies are both at rest and keep the demanded clearance."""
        a, b, engine, poses = self._bodies[first], self._bodies[second], self._engine, self._poses
        if kind is not LeftOutKind.STANDING or not (a.is_at_rest and b.is_at_rest):
            return False
        if is_ground(b):
            hull = engine.bodies[first].hull
            return bool(heights(hull, poses.R[first], poses.p[first], X_WS=b.X_BS)[0] >= self._clearance)
        apart = np.linalg.norm(self._centres[second] - self._centres[first])
        if apart >= engine.radii[first] + engine.radii[second] + self._clearance:
            return True
        return measure(engine, (first, second), poses, sample=0).bound >= self._clearance


def _relaxed(bodies: Sequence[SceneBody], pairs: Sequence[ScenePair]) -> Iterator[Entry]:
    """Watched pairs with a weaker rule than clearance."""
    for pair in pairs:
        if pair.rule is not Rule.CLEARANCE and not is_of_one_robot(bodies[pair.first], bodies[pair.second]):
            yield pair.first, pair.second, KIND[pair.rule], pair.reason


def _excluded(excluded: Sequence[Excluded]) -> Iterator[Entry]:
    """Pairs that are not watched, but for those that a robot's own file sets."""
    for pair in excluded:
        if pair.kind is not None:
            yield pair.first, pair.second, pair.kind, pair.reason
