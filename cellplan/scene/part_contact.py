"""Contact of a part with what grips it and with what it rests on, while it is picked up or put down in a straight move.

A holder may touch the part with its grip, the part what it rests on, near the place of the part only. Farther away each
such pair is judged like any other; between the two it must not touch, as it cannot have the full distance yet.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.shapes import HalfSpace
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.report.left_out import LeftOutKind
from cellplan.model.settings.program import PartPlaceEntry
from cellplan.model.units import MM
from cellplan.scene.bodies import Kind, SceneBody
from cellplan.scene.collision.bodies import CollisionBody, prepare
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.contact_zone import outside_grip
from cellplan.scene.grips import GRIP_TOL
from cellplan.scene.mounting import Mount, MountedPair, is_rigid_with_flange
from cellplan.scene.pairs import Excluded, Rule, ScenePair, StraightMotion
from cellplan.scene.scene import Scene

OFF_LINE_TOL: Final = 1e-4  # [m] by which the tool of a straight move may be off it: contact ends no sooner


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartContact:
    """A part that is picked up or put down."""

    key: str  # key of the place in the cell file
    place: PartPlaceEntry  # the place
    grasp: Grasp  # how the part is held
    is_lying: bool  # whether the part lies there while the tool comes or leaves; else it comes or leaves with the tool

    def with_contacts(self, scene: Scene) -> Scene:
        """The scene, the part lying at the place or held, in which what may touch at the place does so near it only."""
        rows = [row for row, pair in enumerate(scene.pairs) if self._touch(scene.cell, *_ends(scene, pair))]
        touching = [scene.pairs[row] for row in rows]
        spans, cuts, mounted = list[tuple[ScenePair, float, float]](), list[tuple[int, CollisionBody]](), []
        for pair in touching:
            if pair.is_ground:
                continue  # a straight way off a half-space does not lead through anything of it
            limit = self._limit(scene, pair)
            mounted.append(limit)
            stated = limit.limit if self.place.contact_mm is None else self.place.contact_mm.si
            near = (stated if self.is_lying else max(stated, limit.limit)) + OFF_LINE_TOL
            spans += self._away(pair, near)
            if self.is_lying and (cut := self._cut(scene, pair, limit.limit, len(scene.engine.bodies) + len(cuts))):
                cuts += cut[1]
                spans.append((cut[0], 0.0, near))
        move = StraightMotion(
            robot=self.grasp.robot, p_WT=(self.place.X_WP @ self.grasp.X_PT)[:3, 3], pairs=tuple(spans)
        )
        reason = "the part is taken from it here or put on it: may touch near its place only"
        if self.is_lying:
            reason = f"{self.grasp.robot} grips the part here or lets it go: may touch near the grip only"
        left = tuple(Excluded(pair.first, pair.second, reason, LeftOutKind.PUT_DOWN) for pair in touching)
        return replace(
            scene,
            pairs=tuple(pair for row, pair in enumerate(scene.pairs) if row not in rows),
            excluded=(*scene.excluded, *left),
            mounted=(*scene.mounted, *mounted),
            engine=Engine([*scene.engine.bodies, *(body for _, body in cuts)]) if cuts else scene.engine,
            cut_from=(*scene.cut_from, *(index for index, _ in cuts)),
            straight=move,
        )

    def _touch(self, cell: Cell, part: SceneBody, other: SceneBody) -> bool:
        """Whether two bodies may touch at the place: the part, and what grips it or what it rests on."""
        if part.kind is not Kind.PART:
            return False
        if not self.is_lying:
            return other.kind is Kind.OBSTACLE and other.name in self.place.supports
        is_named = self.grasp.bodies is None or other.name in self.grasp.bodies
        return other.robot == self.grasp.robot and is_named and is_rigid_with_flange(other, cell)

    def _limit(self, scene: Scene, pair: ScenePair) -> MountedPair:
        """How deep the two may be in each other."""
        if not self.is_lying:
            limit, accuracy, mount = scene.cell.checks.standing_depth_mm.si, 0.0, Mount.STANDING
        else:
            links = [body for body in _ends(scene, pair) if body.kind is Kind.LINK]
            accuracy, mount = max((body.accuracy or 0.0 for body in links), default=0.0), Mount.GRIP
            limit = self.grasp.depth + accuracy
        return MountedPair(
            first=pair.first, second=pair.second, mount=mount, limit=limit, accuracy=accuracy, moves=True
        )

    def _away(self, pair: ScenePair, near: float) -> Iterator[tuple[ScenePair, float, float]]:
        """The pair beyond its contact: free of contact until it can have its distance, then with the distance."""
        what = "grip" if self.is_lying else "place of the part"
        where = f"more than {MM * (near - OFF_LINE_TOL):g} mm from the {what} ({self.key}.contact_mm)"
        yield replace(pair, rule=Rule.CONTACT, where=where), near, near + pair.demand
        yield replace(pair, where=where), near + pair.demand, np.inf

    def _cut(
        self, scene: Scene, pair: ScenePair, depth: float, index: int
    ) -> tuple[ScenePair, list[tuple[int, CollisionBody]]] | None:
        """What of a body must not touch the part even at the grip; None where all of it may."""
        holder, part = sorted((pair.first, pair.second), key=lambda index: scene.bodies[index].kind is Kind.PART)
        body, robot = scene.bodies[holder], scene.cell.robot(self.grasp.robot)
        if self.grasp.bodies is not None or isinstance(body.shape, HalfSpace):
            return None
        X_ST = inverse(body.X_BS) @ robot.model.X_BF @ robot.tool.X_FT
        zone = scene.cell.checks.contact_zone_mm.si
        surface, is_in_zone = outside_grip(body.shape, X_ST, radius=zone, layer=depth + GRIP_TOL)
        if surface is None:
            return None
        where = "outside the contact zone of the grip (part.held_by.grip_bodies names what else may grip)"
        watched = replace(pair, rule=Rule.CONTACT, where=where)
        if not is_in_zone:
            return watched, []
        return replace(watched, solids=(index, part)), [(holder, prepare(body.name, surface))]


def _ends(scene: Scene, pair: ScenePair) -> tuple[SceneBody, SceneBody]:
    """The two bodies of a pair, the part first."""
    first, second = scene.bodies[pair.first], scene.bodies[pair.second]
    return (second, first) if second.kind is Kind.PART else (first, second)
