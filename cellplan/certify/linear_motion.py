"""Motion of the whole cell, linear in the joints from each sample to the next, with bounds on its curvature."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.transforms import Array, rotated
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.continuous.motion_bound import Bends, Pair
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StraightMotion:
    """A stretch of a program; see ``collision.continuous.motion_bound.Motion``."""

    scene: Scene
    arms: LeverArms  # the lever arms of the whole program
    q: Array  # stacked joint positions in [rad] or [m], shape (n, nq)
    steps: Array  # by how much each axis moves in each step, without its sign, in [rad] or [m], shape (n - 1, axes)
    poses: BodyPoses  # where the bodies are at the samples
    # largest second derivative of any point of an engine's body in each step, seen from the world, with the step as the
    # unit of time, in [m], shape (n - 1,), by the body
    bend: Mapping[int, Array]
    centres: Mapping[int, Array]  # centres of the bounding spheres in the world in [m], shape (n, 3), by the body

    @classmethod
    def of_cell(cls, scene: Scene, arms: LeverArms, q: Array) -> "StraightMotion":
        """All bodies of the engine."""
        return cls._of(scene, arms, q, scene.body_poses(q), range(len(scene.engine.bodies)))

    @classmethod
    def _of(cls, scene: Scene, arms: LeverArms, q: Array, poses: BodyPoses, bodies: range | Pair) -> "StraightMotion":
        steps, centres = arms.steps(q), scene.engine.centres
        return cls(
            scene=scene,
            arms=arms,
            q=q,
            steps=steps,
            poses=poses,
            bend={index: arms.chain(None, index).bend(steps) for index in bodies},
            centres={index: rotated(poses.R[index], centres[index]) + poses.p[index] for index in bodies},
        )

    def bends(self, pair: Pair) -> Bends:
        """How much the paths of two bodies bend in each step, each seen from the other."""
        steps, (first, second) = self.steps, pair
        there, back = self.arms.chain(first, second), self.arms.chain(second, first)
        apart = self.arms.chain(None, first).reach(steps) + self.arms.chain(None, second).reach(steps)
        reach = np.minimum(np.minimum(there.reach(steps), back.reach(steps)), apart)
        return Bends(second=there.bend(steps), first=back.bend(steps), reach=reach)

    def relative(self, pair: Pair) -> tuple[Array, Array]:
        """Rotations, shape (n, 3, 3), and positions in [m], shape (n, 3), of the second body seen from the first."""
        first, second = pair
        R_AW = np.swapaxes(self.poses.R[first], 1, 2)
        apart = self.poses.p[second] - self.poses.p[first]
        return R_AW @ self.poses.R[second], np.einsum("nij,ni->nj", self.poses.R[first], apart)

    def sphere_bounds(self, pair: Pair) -> Array:
        """Lower bound of the distance of two bounding spheres in each step in [m], shape (n - 1,).

        The line between the centres stays within M/8 of its chords; no point of a chord is nearer to the origin than
        half of the distances of both ends less the length of the chord.
        """
        first, second = pair
        apart = self.centres[second] - self.centres[first]
        gaps = np.sqrt(np.einsum("ij,ij->i", apart, apart))
        chord = np.diff(apart, axis=0)
        low: Array = 0.5 * (gaps[1:] + gaps[:-1] - np.sqrt(np.einsum("ij,ij->i", chord, chord)))
        low -= self.scene.engine.radii[first] + self.scene.engine.radii[second]
        low -= (self.bend[first] + self.bend[second]) / 8.0
        return low

    def part(self, pair: Pair, first: int, last: int) -> "StraightMotion":
        """Two bodies at the samples from the first to the last, both included; what the others do is left out."""
        samples, steps = slice(first, last + 1), slice(first, last)
        return StraightMotion(
            scene=self.scene,
            arms=self.arms,
            q=self.q[samples],
            steps=self.steps[steps],
            poses=BodyPoses(self.poses.R[:, samples], self.poses.p[:, samples]),
            bend={index: self.bend[index][steps] for index in pair},
            centres={index: self.centres[index][samples] for index in pair},
        )

    def finer(self, pair: Pair, step: int, *, parts: int) -> "StraightMotion":
        """One step cut into equal parts, with the poses of two bodies only; those of the others are not numbers."""
        share = np.linspace(0.0, 1.0, parts + 1)[:, None]
        q = (1.0 - share) * self.q[step] + share * self.q[step + 1]
        return self._of(self.scene, self.arms, q, self.scene.pair_poses(pair, q), pair)
