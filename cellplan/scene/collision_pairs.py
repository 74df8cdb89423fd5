"""All pairs of bodies of a cell: which are watched and for what, which are left out, and how deep some may be."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from cellplan.geometry.shapes import HalfSpace, Mesh, Solid
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.report.left_out import LeftOutKind
from cellplan.model.task.task import Frame
from cellplan.scene.bodies import Kind, SceneBody, scene_bodies
from cellplan.scene.collision.bodies import CollisionBody, prepare
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.contact_zone import outside_zone
from cellplan.scene.grips import grip_watch
from cellplan.scene.kinematics.screw_chain import Chains
from cellplan.scene.mounting import MountedPair, grasp_of, mounted_pair, works_like_a_tool
from cellplan.scene.pairs import Excluded, Rule, ScenePair, sort_pairs
from cellplan.scene.permanent_contacts import apply_design


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CollisionPairs:
    """The pairs of a cell."""

    watched: tuple[ScenePair, ...]  # pairs that are watched
    excluded: tuple[Excluded, ...]  # pairs that are not, in the order of their bodies
    mounted: tuple[MountedPair, ...]  # pairs that may touch and of which the depth is judged
    outside: tuple[CollisionBody, ...]  # surfaces of tools and holders outside their zones, after the solids
    cut_from: tuple[int, ...]  # the body that each of these is cut from, by its index

    @classmethod
    def of(cls, cell: Cell, bodies: Sequence[SceneBody], *, engine: Engine, chains: Chains) -> "CollisionPairs":
        """Sort all pairs of bodies, half-spaces last; the engine has those that are none.

        ``InputError`` where an exclusion names no body, or the mounting of a body cannot be meant.
        """
        remaining, excluded = sort_pairs(cell, bodies)
        design = apply_design(cell, bodies, remaining, engine=engine, chains=chains)
        excluded += design.excluded
        zones = _ContactZones(cell, bodies, first_index=len(engine.bodies))
        watched = tuple(zones.watched(pair) for pair in design.watched)
        return cls(
            watched=watched,
            excluded=tuple(sorted(excluded, key=lambda pair: (pair.first, pair.second))),
            mounted=(*_mounted(cell, bodies, excluded, watched), *design.mounted),
            outside=tuple(zones.outside),
            cut_from=tuple(zones.cut_from),
        )


class _ContactZones:
    """Pairs of a tool at work, or of a further holder, and the part: contact is allowed inside a zone only."""

    def __init__(self, cell: Cell, bodies: Sequence[SceneBody], *, first_index: int) -> None:
        """Start without any cut; the first cut body will have ``first_index`` in the engine."""
        self.outside: list[CollisionBody] = []  # what lies outside the zones
        self.cut_from: list[int] = []  # the body that each of these is cut from
        self._cell, self._bodies, self._first_index = cell, bodies, first_index
        self._at_work = {task.robot for task in cell.tasks if task.relative_to is Frame.PART}

    def watched(self, pair: ScenePair) -> ScenePair:
        """The pair with the rule of its zone, if it has one."""
        other, part = sorted((pair.first, pair.second), key=lambda index: self._bodies[index].kind is Kind.PART)
        tool = self._bodies[other]
        is_work = tool.robot in self._at_work and works_like_a_tool(tool, self._cell)
        if self._bodies[part].kind is Kind.PART and is_work:
            return self._at_tip(pair, other, part)
        if (grasp := grasp_of(self._bodies[pair.first], self._bodies[pair.second], self._cell)) is None:
            return pair
        grip = grip_watch(self._cell, tool, grasp)
        solids = (other, part) if grip.is_whole else self._cut(other, part, grip.outside)
        return replace(pair, rule=grip.rule, reason=grip.reason, solids=solids)

    def _at_tip(self, pair: ScenePair, tool: int, part: int) -> ScenePair:
        """A tool at work; a tool body that does not reach into its zone is like any other."""
        outside, is_in_zone = self._outside_zone(self._bodies[tool])
        if not is_in_zone:
            return replace(pair, solids=(tool, part))
        zone = self._cell.checks.contact_zone_mm
        reason = f"at work: may touch within {zone:g} mm of the tool tip; checked for contact outside it"
        return replace(pair, rule=Rule.PROCESS, reason=reason, solids=self._cut(tool, part, outside))

    def _cut(self, body: int, part: int, outside: CollisionBody | None) -> tuple[int, int] | None:
        """Engine indices of what lies outside the zone and of the part; None where nothing does."""
        if outside is None:
            return None
        self.outside.append(outside)
        self.cut_from.append(body)
        return self._first_index + len(self.outside) - 1, part

    def _outside_zone(self, body: SceneBody) -> tuple[CollisionBody | None, bool]:
        """The surface of a tool outside its contact zone, and whether any lies inside; equal tools are cut once."""
        if isinstance(body.shape, HalfSpace):
            return None, False
        outside, is_in_zone = _cut_at_tip(body.shape, _tip(self._cell, body), self._cell.checks.contact_zone_mm.si)
        return (None if outside is None else replace(outside, name=body.name)), is_in_zone


def cut_tools(cell: Cell) -> Iterator[Mesh]:
    """Surfaces of tools at work outside their contact zones, where a zone holds a part of the tool."""
    at_work = {task.robot for task in cell.tasks if task.relative_to is Frame.PART}
    for body in scene_bodies(cell):
        if body.robot in at_work and works_like_a_tool(body, cell) and not isinstance(body.shape, HalfSpace):
            surface, is_in_zone = outside_zone(body.shape, np.array(_tip(cell, body)), cell.checks.contact_zone_mm.si)
            if is_in_zone and surface is not None:
                yield surface


def _tip(cell: Cell, body: SceneBody) -> tuple[float, float, float]:
    """Tip of the tool of a robot in the frame of one of its bodies in [m]."""
    robot = cell.robot(str(body.robot))
    x, y, z = (inverse(body.X_BS) @ robot.model.X_BF @ robot.tool.X_FT)[:3, 3].tolist()
    return x, y, z


@lru_cache(maxsize=64)
def _cut_at_tip(shape: Solid, tip: tuple[float, ...], zone: float) -> tuple[CollisionBody | None, bool]:
    """The surface of a solid outside a zone about a tip in [m], and whether any lies inside."""
    surface, is_in_zone = outside_zone(shape, np.array(tip), zone)
    return (prepare("tool", surface) if is_in_zone and surface is not None else None), is_in_zone


def _mounted(
    cell: Cell, bodies: Sequence[SceneBody], excluded: Sequence[Excluded], watched: Sequence[ScenePair]
) -> list[MountedPair]:
    """Pairs of which the depth is judged: grips and what stands, unless the user left them out."""
    kinds = (LeftOutKind.GRIP, LeftOutKind.STANDING)
    ends = [(pair.first, pair.second) for pair in excluded if pair.kind in kinds]
    ends += [(pair.first, pair.second) for pair in watched if pair.rule in {Rule.GRIP, Rule.CONTACT}]
    pairs = (mounted_pair(bodies[first], bodies[second], (first, second), cell) for first, second in sorted(ends))
    return [pair for pair in pairs if pair is not None]
