"""Execution: poses of the tools of a real cell on the part when its joints follow the commanded positions."""

from collections.abc import Sequence

import numpy as np

from cellplan.checks.tools.tracking import part_poses, pose_accuracy
from cellplan.geometry.transforms import Array, inverse, rotation_exp
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule
from cellplan.model.report import TaskAccuracy
from cellplan.model.settings.cell_errors import MeasurementEntry
from cellplan.model.task import Frame


class RealCell:
    """A cell with its real geometry, which executes commanded joint positions.

    Its kinematics is that of successive screw displacements, which no planner uses.
    """

    def __init__(self, cell: Cell) -> None:
        """Build the chains of the robots."""
        self._cell = cell
        self._chains = {robot.name: ScrewChain(robot) for robot in cell.robots}

    def tool_poses(self, robots: Sequence[str], q: Array) -> tuple[Array, ...]:
        """Tool tips of some robots on the part, or in the world where a robot's task is given there.

        Args:
            q: Stacked joint positions in [rad] or [m], shape (N, nq).

        Returns:
            Poses X_PT, shape (N, 4, 4) each.
        """
        positions = {robot.name: q[:, self._cell.columns(robot.name)] for robot in self._cell.robots}
        X_WP = part_poses(self._cell, self._chains, positions)
        in_world = {task.robot for task in self._cell.tasks if task.relative_to is Frame.WORLD}
        X_WT = {name: self._chains[name].tool_poses(positions[name]) for name in robots}
        return tuple(X_WT[name] if name in in_world else inverse(X_WP) @ X_WT[name] for name in robots)

    def accuracy(self, schedule: Schedule, q: Array) -> tuple[TaskAccuracy, ...]:
        """True errors of all tasks of a schedule, for stacked joint positions of shape (N, nq)."""
        poses = self.tool_poses([scheduled.task.robot for scheduled in schedule.tasks], q)
        return tuple(pose_accuracy(scheduled, X_PT) for scheduled, X_PT in zip(schedule.tasks, poses, strict=True))


def measured_poses(X_PT: Sequence[Array], system: MeasurementEntry, rng: np.random.Generator) -> tuple[Array, ...]:
    """Measurements of tool poses on the part, shape (N, 4, 4) each.

    Each coordinate of the tip in P, and each component of a small turn about the axes of P, has normal noise of its
    own. Without noise no number is taken from the generator.
    """
    return tuple(_measured(poses, system, rng) for poses in X_PT)


def _measured(X_PT: Array, system: MeasurementEntry, rng: np.random.Generator) -> Array:
    """Poses of one tool with noise."""
    measured = X_PT.copy()
    if system.position_noise_mm > 0.0:
        measured[:, :3, 3] += system.position_noise_mm.si * rng.standard_normal((len(measured), 3))
    if system.orientation_noise_deg > 0.0:
        turns = rotation_exp(system.orientation_noise_deg.si * rng.standard_normal((len(measured), 3)))
        measured[:, :3, :3] = turns @ measured[:, :3, :3]
    return measured
