"""Pairs that touch, or come near, in every configuration: a robot's own design, or a mistake in its mounting."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.shapes import Solid
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.left_out import LeftOutKind
from cellplan.model.robot.robot import RobotModel
from cellplan.model.seeds import generator
from cellplan.model.units import MM
from cellplan.scene.bodies import Kind, SceneBody, body_poses, is_ground, part_body
from cellplan.scene.collision.bodies import BodyPoses, prepare
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.separation import heights
from cellplan.scene.kinematics.screw_chain import Chains
from cellplan.scene.mounting import (
    MOUNT_DEPTH,
    Mount,
    MountedPair,
    grasp_of,
    is_of_one_robot,
    keeps_out_of_grip,
    refuse_wrong_mounting,
)
from cellplan.scene.pairs import Excluded, LinkTree, Rule, ScenePair, near_in_chain, stands_on

CONFIGURATION_COUNT: Final = 48  # random ones beside the reference; a pair free in one of ten escapes 0.6 % of trials
CONSTANT_DISTANCE_TOL: Final = 1e-3  # [m] a distance that varies by less is a matter of mounting, not of motion
CONTACT_TOL: Final = 1e-6  # [m] poses are worked out to less than that: what stands on a floor may seem to float
ROUNDING: Final = 1e-9  # [m] by which a distance may seem less than it is demanded to be
FAULT_ORDER: Final = (Kind.PART, Kind.TOOL, Kind.ATTACHMENT, Kind.PEDESTAL, Kind.LINK)  # what is wrongly mounted first
UNLIMITED_RANGE: Final = np.pi  # [rad] or [m] range sampled to either side of zero where a joint has no limit


@dataclass(slots=True)
class Design:
    """What becomes of pairs that are near each other by design or by their mounting."""

    watched: list[ScenePair] = field(default_factory=list)  # pairs that are watched, some of them for contact only
    excluded: list[Excluded] = field(default_factory=list)  # pairs that are not
    mounted: list[MountedPair] = field(default_factory=list)  # those of them of which the depth is judged


def apply_design(
    cell: Cell, bodies: Sequence[SceneBody], pairs: Sequence[ScenePair], *, engine: Engine, chains: Chains
) -> Design:
    """Leave out pairs in permanent contact by a robot's design; forbid only contact where design sets the distance.

    Examined are pairs of one robot at the reference configuration and at random ones within the joint limits:

    - two links of its own file, with at most two joints between them or with a bar of a linkage, that touch in all of
      them: left out; else checked for contact, not for distance;
    - a held part that touches what is rigid with the flange but is not named to grip: an error of the cell;
    - a tool or a held part that touches a link in all of them: an error of the cell, see ``refuse_wrong_mounting``;
    - a tool or a held part against a link, at most two joints away, nearer than the demanded clearance in all of them,
      or at a distance that hardly changes between them: checked for contact.

    Where a flange has no body, tool and part may touch the link before it; how deep is judged. A robot whose foot has
    no body may likewise stand with its first link in the surroundings, if it does so in every configuration. The
    links of each robot that holds the part are examined as if it were the one that carries it.
    """
    sampled = _Sampled(cell, bodies, engine, chains)
    design, faults = Design(), dict[tuple[int, str | None], list[int]]()
    for pair in pairs:
        holder = sampled.further_holder(pair)
        a, b = (sampled.views[holder][index] for index in (pair.first, pair.second))
        if stands_on(pair, bodies, cell=cell):
            is_decided = sampled.always_stands(pair) and _stands(design, cell, pair)
        elif is_of_one_robot(a, b):
            is_decided = near_in_chain(pair, bodies, cell=cell) and _near_links(design, sampled, pair)
        elif a.robot is None or a.robot != b.robot or grasp_of(a, b, cell):
            is_decided = False
        elif _is_behind_flange(a, b, cell):
            is_decided = True
            _mount_behind(design, sampled, pair, holder)
        elif sampled.always_touch(pair, holder):
            is_decided = True
            body, link = sorted((pair.first, pair.second), key=lambda index: FAULT_ORDER.index(bodies[index].kind))
            faults.setdefault((body, holder), []).append(link)
        else:
            is_near = near_in_chain(pair, sampled.views[holder], cell=cell)
            is_decided = is_near and not keeps_out_of_grip(a, b, cell)
            if is_decided:
                design.watched.append(_relaxed(pair, sampled, holder))
        if not is_decided:
            design.watched.append(pair)
    refuse_wrong_mounting(cell, bodies, [(body, links) for (body, _), links in faults.items()])
    return design


class _Sampled:
    """The bodies of a cell in some configurations, as they are and with the part on each further holder.

    Attributes:
        cell: The cell.
        bodies: All solids.
        engine: Those of them that are no half-spaces.
        views: The bodies, by the further holder that carries the part; None for the first one.
    """

    def __init__(self, cell: Cell, bodies: Sequence[SceneBody], engine: Engine, chains: Chains) -> None:
        """Draw the configurations; bodies are placed when they are first needed."""
        self.cell, self.bodies, self.engine = cell, bodies, engine
        self.views = _views(cell, bodies)
        self._chains, self._configurations = chains, _configurations(cell)
        self._poses: dict[str | None, BodyPoses] = {}

    def further_holder(self, pair: ScenePair) -> str | None:
        """The further holder that a pair belongs to, when the pair is one of its bodies and the part."""
        ends = (self.bodies[pair.first], self.bodies[pair.second])
        owner = next((body.robot for body in ends if body.kind is not Kind.PART), None)
        return owner if any(body.kind is Kind.PART for body in ends) and owner in self.views else None

    def poses(self, holder: str | None) -> BodyPoses:
        """Where all bodies are."""
        if holder not in self._poses:
            self._poses[holder] = body_poses(self.views[holder], self._chains, self._configurations)
        return self._poses[holder]

    def always_touch(self, pair: ScenePair, holder: str | None) -> bool:
        """Whether two bodies touch in every configuration."""
        engine, poses, (first, second) = self.engine, self.poses(holder), (pair.first, pair.second)
        return all(
            engine.touch(first, second, poses, sample=k) or is_inside(engine, (first, second), poses, sample=k)
            for k in range(poses.p.shape[1])
        )

    def always_stands(self, pair: ScenePair) -> bool:
        """Whether a link touches a thing in every configuration, apart from rounding."""
        poses, (first, second) = self.poses(None), (pair.first, pair.second)
        if not is_ground(self.bodies[second]):
            readings = (measure(self.engine, (first, second), poses, sample=k) for k in range(poses.p.shape[1]))
            return all(reading.bound <= CONTACT_TOL for reading in readings)
        height = heights(self.engine.bodies[first].hull, poses.R[first], poses.p[first], X_WS=self.bodies[second].X_BS)
        return bool(np.all(height <= CONTACT_TOL))


def _views(cell: Cell, bodies: Sequence[SceneBody]) -> dict[str | None, Sequence[SceneBody]]:
    """The bodies as they are, and with the part on each further holder whose grasp leaves nothing open."""
    views: dict[str | None, Sequence[SceneBody]] = {None: bodies}
    for grasp in cell.closures:
        if len(grasp.axes) == 6:
            held = part_body(cell, cell.part, grasp)
            views[grasp.robot] = [held if body.kind is Kind.PART else body for body in bodies]
    return views


def _configurations(cell: Cell) -> dict[str, Array]:
    """Reference configuration and random ones within the limits, by robot, shape (CONFIGURATION_COUNT + 1, n)."""
    return {robot.name: _random_configurations(robot.model, generator(robot.name)) for robot in cell.robots}


def _random_configurations(model: RobotModel, rng: np.random.Generator) -> Array:
    """Reference configuration first, then random ones."""
    lower = np.where(np.isfinite(model.lower), model.lower, -UNLIMITED_RANGE)
    upper = np.where(np.isfinite(model.upper), model.upper, UNLIMITED_RANGE)
    q = rng.uniform(lower, upper, size=(CONFIGURATION_COUNT + 1, len(model.joints)))
    q[0] = 0.0
    return q


def _stands(design: Design, cell: Cell, pair: ScenePair) -> bool:
    """Let a robot whose foot has no body stand with its first link in the surroundings."""
    limit = cell.checks.standing_depth_mm.si
    reason = f"stands on it, as the foot has no body: may touch, at most {MM * limit:g} mm deep"
    design.excluded.append(Excluded(pair.first, pair.second, reason, LeftOutKind.STANDING))
    design.mounted.append(
        MountedPair(first=pair.first, second=pair.second, mount=Mount.STANDING, limit=limit, moves=True)
    )
    return True


def _near_links(design: Design, sampled: _Sampled, pair: ScenePair) -> bool:
    """Leave out two near links of one robot's file that always touch; the others are checked for contact only."""
    if sampled.always_touch(pair, None):
        configurations = f"the reference configuration and at {CONFIGURATION_COUNT} random ones"
        reason = f"touch at {configurations}: caused by their shapes, not by the motion"
        design.excluded.append(Excluded(pair.first, pair.second, reason))
    else:
        reason = "checked for contact only: two joints apart, their distance is set by the robot's design"
        design.watched.append(replace(pair, rule=Rule.CONTACT, reason=reason))
    return True


def _is_behind_flange(a: SceneBody, b: SceneBody, cell: Cell) -> bool:
    """Whether a tool, or a part that no tool holds, is on a flange without a body, and the other is the link before."""
    mounted, link = (b, a) if a.kind is Kind.LINK else (a, b)
    robot = cell.robot(str(link.robot))
    grips = any(grasp.robot == robot.name and grasp.bodies is not None for grasp in cell.part.held_by)
    if mounted.kind is not Kind.TOOL and (mounted.kind is not Kind.PART or robot.tool.bodies or grips):
        return False
    return link.kind is Kind.LINK and LinkTree(robot.model).carrier(robot.model.flange_link) == link.link


def _mount_behind(design: Design, sampled: _Sampled, pair: ScenePair, holder: str | None) -> None:
    """Let a tool or part on a flange without a body touch the link before it; how deep is judged over the motion."""
    cell, ends = sampled.cell, [sampled.views[holder][index] for index in (pair.first, pair.second)]
    grasps = [grasp for grasp in cell.part.held_by if grasp.robot == ends[0].robot]
    is_grip = Kind.PART in (ends[0].kind, ends[1].kind)
    limit = grasps[0].depth if is_grip else MOUNT_DEPTH
    kind, mount = (LeftOutKind.GRIP, Mount.GRIP) if is_grip else (LeftOutKind.MOUNTED, Mount.MOUNT)
    reason = f"mounted on it, as the flange has no body: may touch, at most {MM * limit:g} mm deep"
    design.excluded.append(Excluded(pair.first, pair.second, reason, kind))
    design.mounted.append(MountedPair(first=pair.first, second=pair.second, mount=mount, limit=limit, moves=True))


def _relaxed(pair: ScenePair, sampled: _Sampled, holder: str | None) -> ScenePair:
    """The pair, checked for contact only where the distance between the two is a matter of their mounting."""
    poses, ends = sampled.poses(holder), [pair.first, pair.second]
    first, second = (sampled.engine.bodies[end].shape for end in ends)
    why = _why_fixed(first, second, poses.R[ends].tobytes(), poses.p[ends].tobytes(), pair.demand)
    return pair if why is None else replace(pair, rule=Rule.CONTACT, reason=f"checked for contact only: {why}")


@lru_cache(maxsize=1024)
def _why_fixed(first: Solid, second: Solid, R: bytes, p: bytes, demand: float) -> str | None:
    """How the mounting of two bodies sets their distance; None where it does not.

    A cell is made computable more than once, with the same robots at the same places.
    """
    engine, nearest, farthest = Engine([prepare("first", first), prepare("second", second)]), np.inf, -np.inf
    poses = BodyPoses(np.frombuffer(R).reshape(2, -1, 3, 3), np.frombuffer(p).reshape(2, -1, 3))
    for sample in range(poses.p.shape[1]):
        distance = measure(engine, (0, 1), poses, sample=sample).bound
        nearest, farthest = min(nearest, distance), max(farthest, distance)
        if farthest >= demand - ROUNDING and farthest - nearest > CONSTANT_DISTANCE_TOL:
            return None  # whatever it is elsewhere
    if farthest < demand - ROUNDING:
        return "closer than the required clearance in every configuration by the mounting"
    return "their distance is fixed by the mounting"
