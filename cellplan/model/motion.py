"""Schedule, motion and program: where each tool must be, what all joints do, and what is written for each robot."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.solver import Integrator
from cellplan.model.task import Task


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskSchedule:
    """One task on the common clock of N instants.

    Attributes:
        task: The task.
        X_PT: Reference tool tip in P at each instant, shape (N, 4, 4); held still before the start and after the end.
        V_PT_P: Reference twist of the tool relative to the part in P, linear first, shape (N, 6).
        travelled: Length of path behind the tool in [m], shape (N,); it grows from cycle to cycle.
        length: Length of the path on the surface in [m], of one cycle.
        end: Instant in [s] at which the path is done.
        cycle_ends: Instants in [s] at which the tool has come back to the pose of its start, all constrained
            components together, one per cycle; none when it does not come back.
    """

    task: Task
    X_PT: Array
    V_PT_P: Array
    travelled: Array
    length: float
    end: float
    cycle_ends: tuple[float, ...] = ()


class DesiredMotion(Protocol):
    """Where every tool must be at any instant, not at those of the clock only."""

    @property
    def times(self) -> Array:
        """Instants of the clock in [s], shape (N,)."""

    @property
    def jumps(self) -> Array:
        """Instants in [s], increasing, at which the speed of a tool may jump, or its rate."""

    def poses(self, times: Array) -> tuple[Array, ...]:
        """Reference tool tips in P of all tasks at instants in [s], shape (M,), shape (M, 4, 4) each."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Schedule:
    """All tasks on one clock.

    Attributes:
        times: Instants in [s], evenly spaced from 0, shape (N,).
        tasks: The tasks that are worked on.
        desired: Where their tools must be between these instants; None where nobody knows, and errors are looked at
            at the instants of the clock only.
    """

    times: Array
    tasks: tuple[TaskSchedule, ...]
    desired: DesiredMotion | None = None

    @property
    def step(self) -> float:
        """Time between two instants in [s]."""
        return float(self.times[-1] / (len(self.times) - 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class NearestSingular:
    """The robot that is nearest to a singular configuration.

    Attributes:
        robot: Its name.
        task: Name of its task or grasp.
        smallest: Smallest singular value of its own Jacobian in the rows that the task constrains.
        stack: Smallest singular value of the Jacobian of all robots and tasks together.
    """

    robot: str
    task: str
    smallest: float
    stack: float

    @property
    def words(self) -> str:
        """The same as the end of a sentence."""
        return (
            f"nearest to a singular configuration is '{self.robot}' on '{self.task}': smallest singular value "
            f"{self.smallest:.2g}, of all robots together {self.stack:.2g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """How finely a motion was resolved, and what that took.

    Attributes:
        integrator: What carried the joints from the start on; ``euler_from`` tells where the accurate one gave up.
        panels: Stretches of time on each of which all joints are one polynomial.
        nodes: Instants at which the joints were solved for.
        sweeps: Passes over all nodes of a panel, added up.
        solves: Systems of equations that were solved.
        error_between: Bound of the tool error at the nodes and between them, in [m] or [rad]; None when nobody looked,
            as with Euler's steps.
        euler_from: Instant in [s] from which on Euler's steps had to be taken; None when they never had to.
        lost: The robot that is nearest to a singular configuration at that instant; None when none is.
    """

    integrator: Integrator
    panels: int
    nodes: int
    sweeps: int
    solves: int
    error_between: float | None = None
    euler_from: float | None = None
    lost: NearestSingular | None = None

    def __post_init__(self) -> None:
        """Check at the door that every figure is one."""
        counts = (self.panels, self.nodes, self.sweeps, self.solves)
        if min(counts) < 0:
            raise ValueError(f"resolution: expected counts of at least 0, got {counts}")
        for figure in (self.error_between, self.euler_from):
            if figure is not None and not 0.0 <= figure < math.inf:  # also what is not a number
                raise ValueError(f"resolution: expected a finite number of at least 0, got {figure}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Joint positions of all robots on the common clock.

    Attributes:
        times: Instants in [s], shape (N,).
        q: Stacked joint positions in [rad] or [m], shape (N, nq), in the order of ``Cell.robots``.
        iterations: How often the method looked at the tasks for each step, shape (N - 1,); None when nobody counted.
        slack: By how much each step leaves the tasks on purpose, as the norm of the twist that it gives up (metres
            and radians per second as they come), shape (N - 1,); None when nobody measured it.
        resolution: How finely it was resolved; None when nobody kept account.
    """

    times: Array
    q: Array
    iterations: Array | None = None
    slack: Array | None = None
    resolution: Resolution | None = None

    def __post_init__(self) -> None:
        """Check at the door that nothing is missing or not finite."""
        if self.q.shape[:1] != self.times.shape:
            raise ValueError(f"motion: {len(self.q)} rows for {len(self.times)} instants")
        if not np.all(np.isfinite(self.q)):
            raise ValueError("motion: a joint position is not finite")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointTable:
    """What one robot is told to do: the content of its written table, read back.

    Attributes:
        robot: Name of the robot.
        joints: Joint names in the order of the columns.
        times: Instants in [s], shape (N,).
        q: Joint positions in [rad] or [m], shape (N, n).
    """

    robot: str
    joints: tuple[str, ...]
    times: Array
    q: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Program:
    """One rendered joint table per robot: file text by robot name."""

    tables: dict[str, str]
