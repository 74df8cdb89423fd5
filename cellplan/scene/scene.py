"""Scene: a cell made computable, built once: its kinematic chains, its bodies and the pairs that must keep apart."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace

import numpy as np

from cellplan.collision.bodies import BodyPoses, CollisionBody, checked_poses, prepare
from cellplan.collision.continuous.motion_bound import Pair
from cellplan.collision.engine import Engine
from cellplan.collision.overlap.contact_zone import outside_zone
from cellplan.collision.self_test import prove_engine
from cellplan.collision.separation import heights
from cellplan.collision.static_contact import Flags, PairIndices, first_touching
from cellplan.geometry.shapes import HalfSpace, Solid
from cellplan.geometry.transforms import Array, inverse
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.cell import Cell, Robot
from cellplan.model.left_out import LeftOut, LeftOutKind
from cellplan.model.task import Frame
from cellplan.model.units import MM
from cellplan.scene.bodies import Kind, SceneBody, body_poses, is_ground, scene_bodies
from cellplan.scene.grips import GripWatch, grip_watch
from cellplan.scene.left_out import left_out
from cellplan.scene.mounting import MountedPair, grasp_of, mounted_pair
from cellplan.scene.pairs import Excluded, Rule, ScenePair, sort_pairs
from cellplan.scene.permanent_contacts import apply_design

_Outside = dict[tuple[Solid, bytes], tuple[CollisionBody | None, bool]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A cell made computable; safe to send to another process.

    Attributes:
        cell: The cell.
        chains: Kinematic chain of each robot, by name.
        bodies: All solids, half-spaces last.
        pairs: Pairs that are watched.
        solid_rows: Which of these pairs the engine watches, shape (S,), ascending.
        solid_pairs: The two engine bodies that must not touch in each of them, shape (S, 2): the bodies themselves, or
            what sticks out of the contact zone of a tool at work, and the part.
        ground_rows: Which pairs are a solid and a half-space, shape (G,).
        exclusions: Pairs that are not watched, as (first, second, reason).
        mounted: Pairs that may touch and of which the depth is judged.
        left_out: What is not judged in full, but for two links of one robot's file.
        engine: The solid bodies in the order of ``bodies``, then what of tools lies outside their contact zones.
        cut_from: The tool body that each of these last ones is cut from.
    """

    cell: Cell
    chains: Mapping[str, ScrewChain]
    bodies: tuple[SceneBody, ...]
    pairs: tuple[ScenePair, ...]
    solid_rows: PairIndices
    solid_pairs: PairIndices
    ground_rows: PairIndices
    exclusions: tuple[tuple[str, str, str], ...]
    mounted: tuple[MountedPair, ...]
    left_out: tuple[LeftOut, ...]
    engine: Engine
    cut_from: tuple[int, ...]

    @classmethod
    def from_cell(cls, cell: Cell) -> "Scene":
        """Build the chains and bodies of a cell and sort its pairs.

        Raises:
            InputError: Two bodies share a name, or an exclusion names something that is no body.
            SelfTestError: The collision engine fails a test with a known answer.
        """
        prove_engine()
        chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
        bodies = tuple(sorted(scene_bodies(cell), key=is_ground))
        solids = [prepare(body.name, body.shape) for body in bodies if not isinstance(body.shape, HalfSpace)]
        pairs, excluded = sort_pairs(cell, bodies)
        engine = Engine(solids)
        design = apply_design(cell, bodies, pairs, engine=engine, chains=chains)
        watch = _at_work(cell, bodies, design.kept, solids=len(solids))
        excluded += design.excluded
        return cls(
            cell=cell,
            chains=chains,
            bodies=bodies,
            pairs=tuple(watch.pairs),
            solid_rows=np.array([row for row, pair in enumerate(watch.watched) if pair is not None], dtype=np.intp),
            solid_pairs=np.array([pair for pair in watch.watched if pair is not None], dtype=np.intp).reshape(-1, 2),
            ground_rows=np.array(
                [row for row, pair in enumerate(watch.pairs) if is_ground(bodies[pair.second])], dtype=np.intp
            ),
            exclusions=_named(bodies, excluded),
            mounted=(*_mounted(cell, bodies, excluded, watch.pairs), *design.mounted),
            left_out=left_out(cell, bodies, watch.pairs, excluded, engine=engine),
            engine=Engine([*solids, *(body for _, body in watch.cut)]),
            cut_from=tuple(tool for tool, _ in watch.cut),
        )

    def body_poses(self, q: Array) -> BodyPoses:
        """Poses of the engine's bodies for stacked joint positions in [rad] or [m], shape (N, nq)."""
        own = {robot.name: q[:, self.cell.columns(robot.name)] for robot in self.cell.robots}
        poses = body_poses([body for body in self.bodies if not is_ground(body)], self.chains, own)
        return checked_poses([*poses, *(poses[tool] for tool in self.cut_from)])

    def pair_poses(self, pair: Pair, q: Array) -> BodyPoses:
        """Poses of two of the engine's bodies only; those of the others are not numbers, so that nothing uses them."""
        carriers = [self.carrier(index) for index in pair]
        names = {body.robot or self.cell.robots[0].name for body in carriers}  # one robot at least: it counts the rows
        own = {name: q[:, self.cell.columns(name)] for name in sorted(names)}
        found = checked_poses(body_poses(carriers, self.chains, own))
        R, p = (np.full((len(self.engine.bodies), *part.shape[1:]), np.nan) for part in (found.R, found.p))
        R[list(pair)], p[list(pair)] = found.R, found.p
        return BodyPoses(R, p)

    def carrier(self, index: int) -> SceneBody:
        """The body of the scene that one of the engine's bodies is, or is cut from."""
        solids = len(self.engine.bodies) - len(self.cut_from)
        return self.bodies[index if index < solids else self.cut_from[index - solids]]

    def ground_heights(self, pair: ScenePair, poses: BodyPoses) -> Array:
        """Distance of a solid above a half-space at each sample in [m], shape (N,); zero or less where they touch."""
        body = self.engine.bodies[pair.first]
        above = heights(body.hull, poses.R[pair.first], poses.p[pair.first], X_WS=self.bodies[pair.second].X_BS)
        return above - body.looseness

    def touching(self, q: Array, *, among: Flags | None = None) -> tuple[str, str] | None:
        """Names of the first two bodies that must not touch but do, at one stacked configuration of shape (nq,).

        Args:
            q: Stacked joint positions in [rad] or [m], shape (nq,).
            among: Which of ``pairs`` are looked at, shape (len(pairs),); all when None.
        """
        looked_at = np.ones(len(self.pairs), dtype=bool) if among is None else among
        poses = self.body_poses(q[None])
        row = self._first_on_ground(poses, self.ground_rows[looked_at[self.ground_rows]])
        if row is None:
            solids = looked_at[self.solid_rows]
            place = first_touching(self.engine, self.solid_pairs[solids], poses, sample=0)
            row = None if place is None else int(self.solid_rows[solids][place])
        return None if row is None else self.names(self.pairs[row])

    def _first_on_ground(self, poses: BodyPoses, rows: PairIndices) -> int | None:
        """The first of some pairs of which the solid touches a half-space at the first sample, or None."""
        centres = self.engine.sphere_centres(poses, sample=0)
        for row in rows:
            pair = self.pairs[row]
            X_WS = self.bodies[pair.second].X_BS
            is_far = (centres[pair.first] - X_WS[:3, 3]) @ X_WS[:3, 2] > self.engine.radii[pair.first]
            if not is_far and self.ground_heights(pair, poses)[0] <= 0.0:
                return int(row)
        return None

    def names(self, pair: ScenePair) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        return self.bodies[pair.first].name, self.bodies[pair.second].name


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Watch:
    """Watched pairs, what the engine watches of each, and the bodies cut from tools with the tools' indices."""

    pairs: list[ScenePair]
    watched: list[Pair | None]
    cut: list[tuple[int, CollisionBody]]


def _at_work(cell: Cell, bodies: tuple[SceneBody, ...], pairs: list[ScenePair], *, solids: int) -> _Watch:
    """Say what the engine watches of each pair, and give tools at work on the part the rule of the contact zone."""
    watch = _Watch(pairs=[], watched=[], cut=[])
    at_work = {task.robot for task in cell.tasks if task.relative_to is Frame.PART}
    outside: _Outside = {}
    for pair in pairs:
        if _is_tool_at_work(bodies, pair, at_work):
            _watch_tool(watch, cell, bodies, pair=pair, next_index=solids + len(watch.cut), known=outside)
            continue
        grasp = grasp_of(bodies[pair.first], bodies[pair.second], cell)
        if grasp is not None:
            holder = min((pair.first, pair.second), key=lambda index: bodies[index].kind is Kind.PART)
            found = grip_watch(cell, bodies[holder], grasp)
            _watch_grip(watch, pair, found, holder=holder, next_index=solids + len(watch.cut))
            continue
        watch.pairs.append(pair)
        watch.watched.append(None if is_ground(bodies[pair.second]) else (pair.first, pair.second))
    return watch


def _is_tool_at_work(bodies: tuple[SceneBody, ...], pair: ScenePair, at_work: Set[str]) -> bool:
    """Whether a pair is the part and the tool of one of the robots that have a task on it."""
    ends = bodies[pair.first], bodies[pair.second]
    tool, part = ends if ends[1].kind is Kind.PART else ends[::-1]
    return part.kind is Kind.PART and tool.kind is Kind.TOOL and tool.robot in at_work


def _watch_tool(
    watch: _Watch, cell: Cell, bodies: tuple[SceneBody, ...], *, pair: ScenePair, next_index: int, known: _Outside
) -> None:
    """Watch what sticks out of the contact zone; a tool body that does not reach into the zone is like any other."""
    tool, part = sorted((pair.first, pair.second), key=lambda index: bodies[index].kind is Kind.PART)
    zone = cell.checks.contact_zone
    outside, is_in_zone = _outside_zone(cell, bodies[tool], known)
    if not is_in_zone:
        watch.pairs.append(pair)
        watch.watched.append((tool, part))
        return
    reason = f"at work: may touch within {MM * zone:g} mm of the tool tip; checked for contact outside it"
    watch.pairs.append(replace(pair, rule=Rule.PROCESS, reason=reason))
    watch.watched.append(None if outside is None else (next_index, part))
    if outside is not None:
        watch.cut.append((tool, outside))


def _watch_grip(watch: _Watch, pair: ScenePair, found: GripWatch, *, holder: int, next_index: int) -> None:
    """Watch what of a further holder's flange and tool sticks out of the zone in which it grips."""
    part = pair.second if holder == pair.first else pair.first
    watch.pairs.append(replace(pair, rule=found.rule, reason=found.reason))
    if found.outside is None:
        watch.watched.append((holder, part) if found.is_whole else None)
        return
    watch.watched.append((next_index, part))
    watch.cut.append((holder, found.outside))


def _mounted(
    cell: Cell, bodies: tuple[SceneBody, ...], excluded: list[Excluded], watched: list[ScenePair]
) -> list[MountedPair]:
    """Pairs of which the depth is judged: grips and what stands, unless the user left them out."""
    kinds = (LeftOutKind.GRIP, LeftOutKind.STANDING)
    ends = [(pair.first, pair.second) for pair in excluded if pair.kind in kinds]
    ends += [(pair.first, pair.second) for pair in watched if pair.rule in {Rule.GRIP, Rule.CONTACT}]
    found = (mounted_pair(bodies[first], bodies[second], (first, second), cell) for first, second in sorted(ends))
    return [pair for pair in found if pair is not None]


def _outside_zone(cell: Cell, body: SceneBody, known: _Outside) -> tuple[CollisionBody | None, bool]:
    """What of a tool's solid lies outside its contact zone, and whether any lies inside; equal tools are cut once."""
    if isinstance(body.shape, HalfSpace):
        return None, False
    tip = _tip(cell.robot(str(body.robot)), body)
    key = (body.shape, tip.tobytes())
    if key not in known:
        surface, is_in_zone = outside_zone(body.shape, tip, cell.checks.contact_zone)
        known[key] = (prepare(body.name, surface) if is_in_zone and surface is not None else None), is_in_zone
    outside, is_in_zone = known[key]
    return (None if outside is None else replace(outside, name=body.name)), is_in_zone


def _tip(robot: Robot, body: SceneBody) -> Array:
    """Tool tip in the frame of one of the tool's solids, shape (3,)."""
    tip: Array = (inverse(body.X_BS) @ robot.model.X_BF @ robot.tool.X_FT)[:3, 3]
    return tip


def _named(bodies: tuple[SceneBody, ...], excluded: list[Excluded]) -> tuple[tuple[str, str, str], ...]:
    """Exclusions by name, in the order of the bodies."""
    ordered = sorted(excluded, key=lambda pair: (pair.first, pair.second))
    return tuple((bodies[pair.first].name, bodies[pair.second].name, pair.reason) for pair in ordered)
