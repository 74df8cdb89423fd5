"""Motion task: what one call of the planner resolves."""

from collections.abc import Sequence
from dataclasses import dataclass

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell, Grasp
from cellplan.model.motion import Schedule
from cellplan.planning.timing.timed_path import TimedTasks


@dataclass(frozen=True, slots=True, eq=False)
class MotionTask:
    """The coupled motion of one phase: the tasks that are worked on together and the robots that move for them.

    Attributes:
        cell: The cell; its solver names method and integrator.
        schedule: The tasks, sampled at the times of the clock, and where that is known their desired motion between
            these times.
        moving: Names of the robots that carry the part or work on it; all others stand still.
        start: Stacked configuration at the first sample, shape (nq,), in [rad] or [m].
    """

    cell: Cell
    schedule: Schedule
    moving: Sequence[str]
    start: Array

    @property
    def timed(self) -> TimedTasks:
        """The desired motion at any time.

        Raises:
            TypeError: It is known at the samples only.
        """
        desired = self.schedule.desired
        if not isinstance(desired, TimedTasks):
            raise TypeError("motion task: expected a desired motion between samples, got none")
        return desired

    @property
    def grasps(self) -> tuple[Grasp, ...]:
        """Grasps of the further holders that move: their tools keep their poses on the part."""
        return tuple(grasp for grasp in self.cell.closures if grasp.robot in self.moving)
