"""Home trials: whether a robot at rest is certainly too near to something, at a few samples of the runs.

What passes here is only likely to be free; what is refused is too near for certain. All other bodies are placed once,
so that hundreds of configurations can be tried.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.distance import is_nearer
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunSamples:
    """Some samples of one run."""

    scene: Scene  # the scene of the run, with those pairs only that the configuration of the robot matters to
    q: Array  # stacked joint positions in [rad] or [m], shape (K, nq)


class HomeTrials:
    """One robot at rest among all other bodies, at some samples of the runs.

    Attributes:
        refused: How often each pair was too near, by the names of its bodies.
    """

    def __init__(self, robot: str, runs: Sequence[RunSamples]) -> None:
        """Place everything else."""
        self.refused: Counter[tuple[str, str]] = Counter()
        self._tables = [_Table(robot, run) for run in runs]

    def add(self, run: int, q: Array) -> None:
        """Include another sample of a run from now on, at the stacked configuration of shape (nq,)."""
        self._tables[run].add(q)

    def is_refused(self, q: Array, *, extra: float = 0.0) -> bool:
        """Whether a configuration in [rad] or [m], shape (n,), is too near to something at one of the samples.

        ``extra`` is a distance in [m] beyond the demanded one that is required from the part and from other robots.
        """
        robot_poses = self._tables[0].placed(q)
        pair = self._tables[0].too_near_alone(robot_poses, extra)  # what stands still is the same in every run
        for table in self._tables:
            if pair is None:
                pair = table.too_near_others(robot_poses, extra)
        if pair is not None:
            self.refused[pair] += 1
        return pair is not None


class _Table:
    """The samples of one run."""

    def __init__(self, robot: str, run: RunSamples) -> None:
        """Sort the pairs of the robot into those that no other robot changes and the others."""
        self._scene, self._robot = run.scene, robot
        solids = range(len(self._scene.engine.bodies))
        self._robot_bodies = [index for index in solids if self._scene.carrier(index).robot == robot]
        self._pairs, rows = self._scene.solid_pairs, self._scene.solid_rows.tolist()
        is_alone = np.array([not _moving_robots(self._scene, row, but=robot) for row in rows], dtype=bool)
        self._alone, self._others = np.flatnonzero(is_alone), np.flatnonzero(~is_alone)
        self._demanded = np.array([self._scene.pairs[row].least_distance for row in rows])
        is_part = np.array([self._scene.pairs[row].clearance_class is ClearanceClass.PART for row in rows], dtype=bool)
        self._has_extra, self._limits = ~is_alone | is_part, self._demanded
        self._q = run.q
        self._poses = self._scene.body_poses(run.q)
        self._order = list(range(len(run.q)))  # samples that refused something lately come first

    def add(self, q: Array) -> None:
        self._q = np.concatenate([self._q, q[None]])
        self._poses = self._scene.body_poses(self._q)
        self._order.insert(0, len(self._q) - 1)

    def placed(self, q: Array) -> BodyPoses:
        """Poses of all bodies with the robot in a configuration, at one sample; those of other robots do not matter."""
        stacked = self._q[:1].copy()
        stacked[0, self._scene.cell.columns(self._robot)] = q
        return self._scene.body_poses(stacked)

    def too_near_alone(self, robot_poses: BodyPoses, extra: float) -> tuple[str, str] | None:
        """Names of the first pair nearer than it may be, of those that no other robot changes, or None."""
        self._limits = self._demanded + extra * self._has_extra
        row = self._on_ground(robot_poses)
        if row is None:
            row = self._among(self._alone, robot_poses, sample=0)
        return None if row is None else self._scene.names(self._scene.pairs[row])

    def too_near_others(self, robot_poses: BodyPoses, extra: float) -> tuple[str, str] | None:
        """The same of the other pairs, at all samples."""
        self._limits = self._demanded + extra * self._has_extra
        self._poses.R[self._robot_bodies] = robot_poses.R[self._robot_bodies]
        self._poses.p[self._robot_bodies] = robot_poses.p[self._robot_bodies]
        for place, sample in enumerate(self._order):
            row = self._among(self._others, self._poses, sample=sample)
            if row is not None:
                self._order.insert(0, self._order.pop(place))
                return self._scene.names(self._scene.pairs[row])
        return None

    def _on_ground(self, poses: BodyPoses) -> int | None:
        for row in self._scene.ground_rows.tolist():
            pair = self._scene.pairs[row]
            if self._scene.ground_heights(pair, poses)[0] < pair.least_distance:
                return int(row)
        return None

    def _among(self, places: np.ndarray, poses: BodyPoses, *, sample: int) -> int | None:
        """The first of some pairs of solids that is too near at one sample."""
        engine, pairs = self._scene.engine, self._pairs[places]
        centres = engine.sphere_centres(poses, sample=sample)
        apart = centres[pairs[:, 0]] - centres[pairs[:, 1]]
        reach = engine.radii[pairs[:, 0]] + engine.radii[pairs[:, 1]] + self._limits[places]
        for place in places[np.einsum("ij,ij->i", apart, apart) <= reach**2]:
            pair = (int(self._pairs[place, 0]), int(self._pairs[place, 1]))
            if is_nearer(engine, pair, poses, sample=sample, limit=float(self._limits[place])):
                return int(self._scene.solid_rows[place])
        return None


def _moving_robots(scene: Scene, row: int, *, but: str) -> set[str]:
    """Robots other than one that move a body of a pair."""
    pair = scene.pairs[row]
    ends = [scene.bodies[pair.first], scene.bodies[pair.second]]
    return {str(body.robot) for body in ends if not body.is_at_rest} - {but}
