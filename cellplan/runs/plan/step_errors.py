"""Tool errors between the rows of a retimed program: how fast the nominal time may pass for a tolerance to hold."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.measures.tool_errors import error_lengths, part_poses, relative_to_task_frame
from cellplan.model.cell.cell import Relation
from cellplan.model.motion.joint_path import JointPath
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.scene.scene import Scene

POINTS: Final = 2000  # [-] nominal times at which the bend of the joint path is taken
HALF_STEP: Final = 1e-3  # [s] of nominal time, but for short paths
SHARES: Final = tuple(tenth / 10.0 for tenth in range(1, 10))  # [-] of a step at which errors are taken
SAFELY: Final = 1.02  # [-] by which a speed is lowered more than the square root of an error asks for
PER_BEND: Final = 6.5  # [-] a step of length h errs by b h^2 / 8; out of rest, where b grows with time, b h^2 / 6.8


class StepErrors:
    """Errors of all tools in steps along a joint path, in which the joints move linearly."""

    def __init__(self, scene: Scene, paths: Sequence[ClockedPath], path: JointPath) -> None:
        """Take the bend of the joint path once."""
        self._scene, self._paths, self._path = scene, tuple(paths), path
        half = min(HALF_STEP, 0.25 * path.end)
        self._at = np.linspace(half, path.end - half, POINTS + 1)
        middle = 0.5 * (path.at(self._at - half) + path.at(self._at + half))
        self._root = np.sqrt(8.0 / PER_BEND * self._shares(self._at, middle)) / (2.0 * half)
        self._tightened = self._root.copy()

    def steepness(self, sigma: Array, step: float) -> Array:
        """Reciprocal of the largest rate of the nominal time with which steps of a length in [s] keep the tolerances.

        Args:
            sigma: Nominal times in [s], shape (N,).
            step: Time between two rows in [s].
        """
        return step * np.interp(sigma, self._at, self._root)

    def largest(self, sigma: Array) -> Array:
        """Largest error in each step between nominal times in [s], as a share of what is allowed, shape (N - 1,)."""
        q, errors = self._path.at(sigma), np.zeros(len(sigma) - 1)
        for share in SHARES:
            between = (1.0 - share) * q[:-1] + share * q[1:]
            nominal = (1.0 - share) * sigma[:-1] + share * sigma[1:]
            errors = np.maximum(errors, self._shares(nominal, between))
        return errors

    def tighten(self, sigma: Array) -> bool:
        """Make the motion slower from now on where steps miss a tolerance.

        Args:
            sigma: Nominal times of rows in [s], shape (N,).

        Returns:
            Whether no step misses one.
        """
        errors = self.largest(sigma)
        for k in np.flatnonzero(errors > 1.0).tolist():
            ends = np.searchsorted(self._at, sigma[[max(0, k - 1), min(len(sigma) - 1, k + 2)]])
            around = slice(int(ends[0]), int(ends[1]) + 1)
            factor = (SAFELY * errors[k]) ** 0.5
            self._tightened[around] = np.maximum(self._tightened[around], factor * self._root[around])
        self._root = self._tightened.copy()
        return bool(errors.max() <= 1.0)

    def _shares(self, sigma: Array, q: Array) -> Array:
        """Largest error at each nominal time in [s] with these joints, as a share of what is allowed, shape (N,)."""
        cell, chains = self._scene.cell, self._scene.chains
        by_robot = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}
        X_WP = part_poses(cell, chains, by_robot)
        closure = cell.checks.closure_mm.si, cell.checks.closure_deg.si
        relations: list[tuple[Relation, Array, tuple[float, float]]] = [
            *((path.task, path.poses(sigma), path.task.tolerance.between) for path in self._paths),
            *((grasp, grasp.X_PT[None], closure) for grasp in cell.closures),
        ]
        worst = np.zeros(len(sigma))
        for relation, desired, allowed in relations:
            X_WT = chains[relation.robot].tool_poses(by_robot[relation.robot])
            shares = error_lengths(relative_to_task_frame(relation, X_WT, X_WP), desired, relation) / allowed
            worst = np.maximum(worst, shares.max(axis=1))
        return worst
