"""Scene: a cell made computable, built once: its kinematic chains, its bodies and the pairs that must keep apart."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cellplan.collision.bodies import BodyPoses, checked_poses, prepare
from cellplan.collision.continuous.motion_bound import Pair
from cellplan.collision.engine import Engine
from cellplan.collision.self_test import prove_engine
from cellplan.collision.separation import heights
from cellplan.collision.static_contact import first_touching
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.shapes import HalfSpace
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.cell import Cell
from cellplan.model.left_out import LeftOut
from cellplan.scene.bodies import SceneBody, body_poses, is_ground, scene_bodies
from cellplan.scene.collision_pairs import CollisionPairs
from cellplan.scene.mounting import MountedPair
from cellplan.scene.pairs import ScenePair


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A cell made computable; safe to send to another process.

    Attributes:
        cell: The cell.
        chains: Kinematic chain of each robot, by name.
        bodies: All solids, half-spaces last.
        pairs: Pairs that are watched.
        exclusions: Pairs that are not watched, as (first, second, reason).
        mounted: Pairs that may touch and of which the depth is judged.
        left_out: What is not judged in full, but for two links of one robot's file.
        engine: The solid bodies in the order of ``bodies``, then the surfaces of tools outside their contact zones.
        cut_from: The tool body that each of these last ones is cut from.
        solid_rows: Indices of the pairs that the engine watches, shape (S,), ascending.
        solid_pairs: ``ScenePair.solids`` of each of them, shape (S, 2).
        ground_rows: Indices of the pairs of a solid and a half-space, shape (G,).
    """

    cell: Cell
    chains: Mapping[str, ScrewChain]
    bodies: tuple[SceneBody, ...]
    pairs: tuple[ScenePair, ...]
    exclusions: tuple[tuple[str, str, str], ...]
    mounted: tuple[MountedPair, ...]
    left_out: tuple[LeftOut, ...]
    engine: Engine
    cut_from: tuple[int, ...]
    solid_rows: Indices = field(init=False)
    solid_pairs: Indices = field(init=False)
    ground_rows: Indices = field(init=False)

    def __post_init__(self) -> None:
        """Collect the indices of solids and half-spaces once: whole batches of pairs are bounded by them."""
        solids = [(row, pair.solids) for row, pair in enumerate(self.pairs) if pair.solids is not None]
        ground = [row for row, pair in enumerate(self.pairs) if pair.is_ground]
        object.__setattr__(self, "solid_rows", np.array([row for row, _ in solids], dtype=np.intp))
        object.__setattr__(self, "solid_pairs", np.array([ends for _, ends in solids], dtype=np.intp).reshape(-1, 2))
        object.__setattr__(self, "ground_rows", np.array(ground, dtype=np.intp))

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
        found = CollisionPairs.of(cell, bodies, engine=Engine(solids), chains=chains)
        return cls(
            cell=cell,
            chains=chains,
            bodies=bodies,
            pairs=found.watched,
            exclusions=found.exclusions,
            mounted=found.mounted,
            left_out=found.left_out,
            engine=Engine([*solids, *found.outside]),
            cut_from=found.cut_from,
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
            among: Which of ``pairs`` are examined, shape (len(pairs),); all when None.
        """
        examined = np.ones(len(self.pairs), dtype=bool) if among is None else among
        poses = self.body_poses(q[None])
        row = self._first_on_ground(poses, self.ground_rows[examined[self.ground_rows]])
        if row is None:
            solids = examined[self.solid_rows]
            place = first_touching(self.engine, self.solid_pairs[solids], poses, sample=0)
            row = None if place is None else int(self.solid_rows[solids][place])
        return None if row is None else self.names(self.pairs[row])

    def _first_on_ground(self, poses: BodyPoses, rows: Indices) -> int | None:
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
