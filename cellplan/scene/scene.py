"""Scene: a cell made computable, built once: its kinematic chains, its bodies and the pairs that must keep apart."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.frozen import derive
from cellplan.geometry.shapes import Box, Cylinder, HalfSpace, Solid
from cellplan.geometry.transforms import is_rigid
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.mounting import Bracket
from cellplan.model.report.left_out import LeftOut, LeftOutKind
from cellplan.model.robot.robot import BASE
from cellplan.scene.bodies import Kind, SceneBody, body_poses, is_ground, link_displacements, scene_bodies, solid_poses
from cellplan.scene.collision.bodies import BodyPoses, prepare
from cellplan.scene.collision.continuous.motion_bound import Pair
from cellplan.scene.collision.distance import first_touching, measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.self_test import prove_engine
from cellplan.scene.collision.separation import heights
from cellplan.scene.collision_pairs import CollisionPairs
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain
from cellplan.scene.mounting import MountedPair, is_of_one_robot
from cellplan.scene.near import NearPairs, near_pairs, near_table_of
from cellplan.scene.pairs import Excluded, Rule, ScenePair, StraightMotion

SAME_SIZE: Final = 1e-12  # [m] by which the height of a column may differ by rounding
Entry = tuple[int, int, LeftOutKind, str]  # both bodies, kind and reason
KIND: Final = {Rule.CONTACT: LeftOutKind.CONTACT_ONLY, Rule.PROCESS: LeftOutKind.AT_WORK, Rule.GRIP: LeftOutKind.GRIP}
NO_BODY_REASON: Final = "none of its links has a body: contacts of its arm are not checked"
FIXED_REASON: Final = "all of them are fixed: not checked against each other"


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """A cell made computable; safe to send to another process."""

    cell: Cell
    chains: Chains  # kinematic chain of each robot, by name
    bodies: tuple[SceneBody, ...]  # all solids, half-spaces last
    pairs: tuple[ScenePair, ...]  # pairs that are watched
    excluded: tuple[Excluded, ...]  # pairs that are not watched
    mounted: tuple[MountedPair, ...]  # pairs that may touch and of which the depth is judged
    engine: Engine  # the solids in the order of ``bodies``, then the surfaces of tools outside their zones
    cut_from: tuple[int, ...]  # the tool body that each of these last ones is cut from
    straight: StraightMotion | None = None  # pairs that are watched on a part of a straight move only, not in ``pairs``
    solid_rows: Indices = field(init=False)  # indices of the pairs that the engine watches, shape (S,), ascending
    solid_pairs: Indices = field(init=False)  # ``ScenePair.solids`` of each of them, shape (S, 2)
    ground_rows: Indices = field(init=False)  # indices of the pairs of a solid and a half-space, shape (G,)

    near_table = cached_property(near_table_of)  # links, bodies and watched pairs as arrays

    def __post_init__(self) -> None:
        """Collect the indices of solids and half-spaces once: whole batches of pairs are bounded by them."""
        solids = [row for row, pair in enumerate(self.pairs) if pair.solids is not None]
        derive(
            self,
            solid_rows=np.array(solids, dtype=np.intp),
            solid_pairs=np.array([self.pairs[row].solids for row in solids], dtype=np.intp).reshape(-1, 2),
            ground_rows=np.array([row for row, pair in enumerate(self.pairs) if pair.is_ground], dtype=np.intp),
        )

    @classmethod
    def from_cell(cls, cell: Cell) -> "Scene":
        """Build the chains and bodies of a cell and sort its pairs.

        ``InputError`` where two bodies share a name, or an exclusion names no body; ``SelfTestError`` where the
        collision engine fails a test with a known answer.
        """
        prove_engine()
        chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
        bodies = tuple(sorted(scene_bodies(cell), key=is_ground))
        solids = [prepare(body.name, body.shape) for body in bodies if not isinstance(body.shape, HalfSpace)]
        collision_pairs = CollisionPairs.of(cell, bodies, engine=Engine(solids), chains=chains)
        return cls(
            cell=cell,
            chains=chains,
            bodies=bodies,
            pairs=collision_pairs.watched,
            excluded=collision_pairs.excluded,
            mounted=collision_pairs.mounted,
            engine=Engine([*solids, *collision_pairs.outside]),
            cut_from=collision_pairs.cut_from,
        )

    @property
    def exclusions(self) -> tuple[tuple[str, str, str], ...]:
        """Pairs that are not watched, as (first, second, reason)."""
        return tuple(
            (self.bodies[pair.first].name, self.bodies[pair.second].name, pair.reason) for pair in self.excluded
        )

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """What is not judged in full, except links of one robot's file; bodies at rest are measured in milliseconds."""
        return left_out(self.cell, self.bodies, self.pairs, self.excluded, engine=self.engine)

    def moved(self, X_WB: Mapping[str, Array]) -> "Scene":
        """The scene with some robots elsewhere, and what stands on or below their bases with them.

        Hulls and engine are kept; only columns whose height changes are made anew. Where a column comes or goes, or a
        robot without a foot stands with its first link in the surroundings, the scene is built by ``from_cell``, which
        takes as long as that does. A column that touches a link of its own robot in
        every configuration is not refused here; it shows as a contact.

        Bases are in the world, shape (4, 4), by name of the robot; ``ValueError`` where one is not finite or not rigid.
        """
        cell = with_bases(self.cell, X_WB)
        placed = None if any(stands_by_link(cell, name) for name in X_WB) else placed_columns(cell, self.bodies, X_WB)
        if placed is None:
            return Scene.from_cell(cell)
        chains = {name: ScrewChain(cell.robot(name)) for name in X_WB}
        bodies = tuple(placed.get(index, body) for index, body in enumerate(self.bodies)) if placed else self.bodies
        changed = {index: body for index, body in placed.items() if body.shape is not self.bodies[index].shape}
        made = {index: prepare(body.name, body.shape) for index, body in changed.items()}  # type: ignore[arg-type]
        engine = self.engine.with_bodies(made) if made else self.engine
        other = replace(self, cell=cell, chains={**self.chains, **chains}, bodies=bodies, engine=engine)
        poses = {index: body.X_BS for index, body in placed.items()}
        derive(other, near_table=self.near_table.moved(poses, made))  # as the property keeps it, not made anew
        return other

    def near(self, q: Array, within: float) -> NearPairs:
        """All watched pairs nearer than a distance in [m] at some configurations, with points, normals and gradients.

        The distances are quick, not proved: a search asks them, ``certify`` judges what it finds. Bodies that never
        move against each other and those of which the depth is judged (``mounted``) are not among the watched pairs.

        Joint positions are stacked, in [rad] or [m], shape (K, nq).
        """
        return near_pairs(self.near_table, self, q, within)

    def body_poses(self, q: Array) -> BodyPoses:
        """Poses of the engine's bodies for stacked joint positions in [rad] or [m], shape (N, nq)."""
        return solid_poses(self.bodies, self.cut_from, link_displacements(self.cell, self.chains, q))

    def pair_poses(self, pair: Pair, q: Array) -> BodyPoses:
        """Poses of two of the engine's bodies only; those of the others are not numbers, so that nothing uses them."""
        carriers = [self.carrier(index) for index in pair]
        names = {body.robot or self.cell.robots[0].name for body in carriers}  # one robot at least: it counts the rows
        positions = {name: q[:, self.cell.columns(name)] for name in sorted(names)}
        poses = body_poses(carriers, self.chains, positions)
        R, p = (np.full((len(self.engine.bodies), *part.shape[1:]), np.nan) for part in (poses.R, poses.p))
        R[list(pair)], p[list(pair)] = poses.R, poses.p
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
        """Names of the first two bodies that must not touch but do, or None.

        Args:
            q: Stacked joint positions in [rad] or [m], shape (nq,).
            among: Which of ``pairs`` are examined, shape (len(pairs),); all when None.
        """
        examined = np.ones(len(self.pairs), dtype=bool) if among is None else among
        poses = self.body_poses(q[None])
        row = _first_on_ground(self, poses, self.ground_rows[examined[self.ground_rows]])
        if row is None:
            solids = examined[self.solid_rows]
            place = first_touching(self.engine, self.solid_pairs[solids], poses, sample=0)
            row = None if place is None else int(self.solid_rows[solids][place])
        return None if row is None else self.names(self.pairs[row])

    def names(self, pair: ScenePair) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        return self.bodies[pair.first].name, self.bodies[pair.second].name


def _first_on_ground(scene: Scene, poses: BodyPoses, rows: Indices) -> int | None:
    """The first of some pairs of which the solid touches a half-space at the first sample, or None."""
    centres = scene.engine.sphere_centres(poses, sample=0)
    for row in rows:
        pair = scene.pairs[row]
        X_WS = scene.bodies[pair.second].X_BS
        is_far = (centres[pair.first] - X_WS[:3, 3]) @ X_WS[:3, 2] > scene.engine.radii[pair.first]
        if not is_far and scene.ground_heights(pair, poses)[0] <= 0.0:
            return int(row)
    return None


def left_out(
    cell: Cell, bodies: Sequence[SceneBody], pairs: Sequence[ScenePair], excluded: Sequence[Excluded], *, engine: Engine
) -> tuple[LeftOut, ...]:
    """What was left out, or has a weaker rule than clearance, in the order of the bodies.

    Then come the surroundings among themselves, and robots whose links have no bodies.

    Bodies that never move and keep the demanded clearance are not listed: nothing was excused there.
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


def with_bases(cell: Cell, X_WB: Mapping[str, Array]) -> Cell:
    """The cell with some bases elsewhere; see ``Scene.moved``."""
    names = [robot.name for robot in cell.robots]
    for name, X in X_WB.items():
        if name not in names:
            raise ValueError(f"moved: expected names of robots ({', '.join(names)}), got '{name}'")
        if np.shape(X) != (4, 4):
            raise _not_rigid(name, X)
    if X_WB and not is_rigid(np.array(list(X_WB.values()), dtype=float)):
        raise next(_not_rigid(name, X) for name, X in X_WB.items() if not is_rigid(np.array(X, dtype=float)[None]))
    robots = [replace(robot, X_WB=X_WB[robot.name]) if robot.name in X_WB else robot for robot in cell.robots]
    return replace(cell, robots=tuple(robots))


def _not_rigid(name: str, X: Array) -> ValueError:
    """The error of a base that is no displacement."""
    return ValueError(f"moved: expected a rigid displacement of shape (4, 4) as base of '{name}', got {X}")


def stands_by_link(cell: Cell, robot: str) -> bool:
    """Whether a robot's foot has no body, so that its first link may stand in the surroundings; see ``stands_on``."""
    bodies = cell.robot(robot).model.bodies
    return bool(bodies and cell.obstacles) and all(body.link != BASE for body in bodies)


def placed_columns(cell: Cell, bodies: Sequence[SceneBody], X_WB: Mapping[str, Array]) -> dict[int, SceneBody] | None:
    """The columns below or above the bases of moved robots, by the index of their bodies; None where one comes or goes.

    A column whose height stays keeps its solid.
    """
    placed = dict[int, SceneBody]()
    for name in X_WB:
        robot = cell.robot(name)
        if robot.pedestal is None or isinstance(robot.pedestal, Bracket):
            continue
        solid = robot.pedestal.solid(robot.X_WB)
        index = next((i for i, body in enumerate(bodies) if body.kind is Kind.PEDESTAL and body.robot == name), None)
        if (solid is None) is not (index is None):
            return None
        if solid is not None and index is not None:
            shape = bodies[index].shape
            same = isinstance(shape, Box | Cylinder) and _is_same(shape, solid[0])
            placed[index] = replace(bodies[index], shape=shape if same else solid[0], X_BS=solid[1])
    return placed


def _is_same(shape: Box | Cylinder, other: Solid) -> bool:
    """Whether two upright columns of one kind are as high."""
    if isinstance(shape, Box):
        return isinstance(other, Box) and abs(shape.size[2] - other.size[2]) <= SAME_SIZE
    return isinstance(other, Cylinder) and abs(shape.length - other.length) <= SAME_SIZE
