"""Schedule, motion and program: desired tool poses, joint positions of all robots, and the tables as text."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.frozen import derive
from cellplan.model.motion.joint_path import JointPath
from cellplan.model.motion.plan import Phase, Plan, rows_of
from cellplan.model.solver import Integrator
from cellplan.model.task.clocked_path import ClockedPath, DemandedSpan, Spans, distinct, run_easing
from cellplan.model.task.task import TIME_TOLERANCE, Task


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clock:
    """Nominal time of every row; a program that runs as it is written has the nominal time as its time."""

    times: Array  # times of the rows in [s], increasing from 0, shape (N,)
    sigma: Array  # nominal time of each row in [s], shape (N,), from 0; it never falls, and stays the same in a dwell

    def __post_init__(self) -> None:
        """Check that both are clocks.

        Raises:
            ValueError: The times do not grow, or the nominal time falls.
        """
        if self.times.shape != self.sigma.shape or self.times.ndim != 1 or not len(self.times):
            raise ValueError(f"clock: {self.sigma.shape} nominal times for {self.times.shape} times")
        if not np.all(np.isfinite(self.times)) or not np.all(np.isfinite(self.sigma)):
            raise ValueError("clock: a time is not finite")
        if self.times[0] != 0.0 or not np.all(np.diff(self.times) > 0.0):
            raise ValueError("clock: expected times that increase from 0")
        if self.sigma[0] != 0.0 or not np.all(np.diff(self.sigma) >= 0.0):
            raise ValueError("clock: expected a nominal time that starts at 0 and never decreases")

    @classmethod
    def as_written(cls, times: Array) -> Self:
        """The clock of a program whose time is its nominal time."""
        return cls(times=times, sigma=times)

    @property
    def is_as_written(self) -> bool:
        """Whether the nominal time is the time in every row."""
        return bool(np.array_equal(self.times, self.sigma))

    def at(self, times: Array) -> Array:
        """Nominal times at times in [s] between the rows, linear from row to row, shape (M,)."""
        return np.interp(times, self.times, self.sigma)

    def reached_at(self, sigma: Array) -> Array:
        """Times in [s] at which nominal times are reached, shape (M,); the nearer end for those outside."""
        return np.interp(sigma, self.sigma, self.times)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskSchedule:
    """One task on the common clock of N samples."""

    task: Task  # the task
    # reference tool tip in P at each sample, shape (N, 4, 4); held still before the start and after the end
    X_PT: Array
    V_PT_P: Array  # reference twist of the tool relative to the part in P, linear first, shape (N, 6)
    travelled: Array  # length of path behind the tool in [m], shape (N,); it grows from cycle to cycle
    length: float  # length of the path on the surface in [m], of one cycle
    end: float  # time in [s] at which the path is done
    # times in [s] at which the tool has come back to the pose of its start, all constrained components together, one
    # per cycle; none when it does not come back
    cycle_ends: tuple[float, ...] = ()
    # times in [s] at which a stretch of the path with its own start and stop of the time law begins or ends
    stops: tuple[float, ...] = ()
    demanded: tuple[DemandedSpan, ...] = ()  # stretches of time in which the feed of a process is demanded
    process_on: Spans = ()  # stretches of time in [s] in which a process is on; without one, that of the path
    work: tuple[float, float] = (-np.inf, np.inf)  # begin and end in [s] of the work, between the runs of its tool
    runs: tuple[float, float] = (0.0, 0.0)  # lengths in [m] of the run-in and of the run-out, which belong to the path
    # largest distance in [m] of a smooth path from the straight lines between its points, else None
    bulge: float | None = None

    def easing(self, times: Array) -> Array:
        """Share of a position error that counts against the tolerance at times in [s], less on runs, shape (N,)."""
        return run_easing(self.task, (self.begin, self.end), self.work, times)

    @property
    def begin(self) -> float:
        """Time in [s] at which the tool starts along its path."""
        return self.stops[0] if self.stops else self.task.start


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Schedule:
    """All tasks on one clock."""

    times: Array  # times of the samples in [s], evenly spaced from 0, shape (N,)
    tasks: tuple[TaskSchedule, ...]  # the tasks that are worked on, at the samples
    paths: tuple[ClockedPath, ...] = ()  # the same tasks at any time; empty where they are known at the samples only
    # further times in [s] that count as jumps: ends of panels where errors were too large, shape (K,)
    extra_breaks: Array = field(default_factory=lambda: np.zeros(0))
    # nominal times of the samples, which are the times of the paths; None where these are the times
    clock: Clock | None = None

    @property
    def step(self) -> float:
        """Time between two samples in [s]."""
        return float(self.times[-1] / (len(self.times) - 1))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tasks."""
        return tuple(scheduled.task.name for scheduled in self.tasks)

    def woven(self, task: Task) -> ClockedPath | None:
        """The path of a task whose tool weaves about it; None of one that does not, or whose weave is not known."""
        paths = (path for path in self.paths if path.task.name == task.name)
        return next((path for path in paths if path.toolpath.line is not None), None)

    @property
    def is_continuous(self) -> bool:
        """Whether the desired poses are known between the samples too."""
        return len(self.paths) == len(self.tasks)

    @property
    def breaks(self) -> Array:
        """Times in [s], from zero to the end of the clock, between which the motion of all tools is smooth."""
        return self._within_clock([path.breaks for path in self.paths])

    @property
    def jumps(self) -> Array:
        """Breaks other than knots of the paths, at which pieces join smoothly."""
        return self._within_clock([path.jumps for path in self.paths])

    def poses(self, times: Array) -> tuple[Array, ...]:
        """Reference poses X_PT of all tasks at times in [s], shape (M,), shape (M, 4, 4) each.

        Between two samples the nominal time is linear in time.
        """
        nominal = times if self.clock is None else self.clock.at(times)
        return tuple(path.poses(nominal) for path in self.paths)

    def _within_clock(self, nominal_times: Sequence[Array]) -> Array:
        """Times of all paths within the clock, and its ends."""
        end = float(self.times[-1])
        nominal = np.concatenate([np.zeros(0), *nominal_times])
        times = nominal if self.clock is None else self.clock.reached_at(nominal)
        every = np.concatenate([self.extra_breaks, times])
        inner = distinct(every[(every > TIME_TOLERANCE) & (every < end - TIME_TOLERANCE)])
        return np.concatenate([[0.0], inner, [end]])


@dataclass(frozen=True, slots=True, kw_only=True)
class NearestSingular:
    """The robot that is nearest to a singular configuration."""

    robot: str  # its name
    task: str  # name of its task or grasp
    smallest: float  # smallest singular value of its own Jacobian in the rows that the task constrains
    stack: float  # smallest singular value of the Jacobian of all robots and tasks together

    @property
    def words(self) -> str:
        """The values as text."""
        return (
            f"closest to a singularity: robot '{self.robot}' on task '{self.task}': smallest singular value "
            f"{self.smallest:.2g}, of all robots together {self.stack:.2g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """Nodes and effort of a motion of the accurate mode."""

    # what integrated the joints from the start on; ``euler_from`` is where the accurate one failed
    integrator: Integrator
    panels: int  # intervals of time on each of which all joints are one polynomial
    nodes: int  # times at which the joints were solved for
    sweeps: int  # passes over all nodes of a panel, added up
    solves: int  # systems of equations that were solved
    # bound of the tool error at the nodes and between them, in [m] or [rad]; None when it is unknown, as with Euler's
    # steps
    error_between: float | None = None
    # time in [s] from which on Euler's steps had to be taken; None when they never had to
    euler_from: float | None = None
    # the robot that is nearest to a singular configuration at that time; None when none is
    lost: NearestSingular | None = None

    def __post_init__(self) -> None:
        """Check that every figure is one."""
        counts = (self.panels, self.nodes, self.sweeps, self.solves)
        if min(counts) < 0:
            raise ValueError(f"resolution: expected counts of at least 0, got {counts}")
        for figure in (self.error_between, self.euler_from):
            if figure is not None and not 0.0 <= figure < math.inf:  # also what is not a number
                raise ValueError(f"resolution: expected a finite number of at least 0, got {figure}")


class PiecePhase(NamedTuple):
    """A phase of a piece of a program."""

    place: int  # its number among the phases of the program, those of all cycles
    phase: Phase
    rows: slice  # its rows in the piece, both ends included


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Phases of a program that follow one another without a gap: they are played in one go."""

    rows: slice  # its rows in the program, both ends included
    phases: tuple[PiecePhase, ...]

    @property
    def name(self) -> str | None:
        """Its name among several, that of its only phase; None for a program in one piece."""
        return self.phases[0].phase.label if len(self.phases) == 1 else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Joint positions of all robots in the rows of a program, or of one phase of it.

    Attributes:
        times: Times of the rows in [s], shape (N,).
        q: Stacked joint positions in [rad] or [m], shape (N, nq), in the order of ``Cell.robots``.
        sigma: Nominal time of each row in [s], shape (N,); the time itself where it is not given.
        plan: The phases of the program on its nominal time; without phases for the motion of a single one.
        iterations: Iterations of the method in each step, shape (N - 1,); None when they were not counted.
        slack: Norm of the twist residual that each step accepts (mixed units: m/s and rad/s), shape (N - 1,); None when
            it was not measured.
        resolution: Nodes and effort of the accurate mode; None when not recorded.
        path: The motion between the rows too, over the nominal time; None where only the rows are known.
    """

    times: Array
    q: Array
    sigma: Array = field(default_factory=lambda: np.empty(0))
    plan: Plan = field(default_factory=Plan)
    iterations: Array | None = None
    slack: Array | None = None
    resolution: Resolution | None = None
    path: JointPath | None = None

    def __post_init__(self) -> None:
        """Check that nothing is missing or not finite."""
        if self.q.shape[:1] != self.times.shape:
            raise ValueError(f"motion: {len(self.q)} rows for {len(self.times)} times")
        if not np.all(np.isfinite(self.q)):
            raise ValueError("motion: a joint position is not finite")
        if not len(self.sigma):
            derive(self, sigma=self.times)
        if self.sigma.shape != self.times.shape:
            raise ValueError(f"motion: {len(self.sigma)} nominal times for {len(self.times)} times")

    @property
    def gaps(self) -> dict[int, str]:
        """Names of interruptions of the program, by the first row after each."""
        return self.plan.gaps(self.sigma)

    def rows(self, phase: Phase) -> slice:
        """The rows of a phase, both ends included."""
        return rows_of(phase, self.sigma)

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """The program in pieces: one for each phase, or one of all phases that lead from home to home."""
        numbers, pieces = itertools.count(), list[Piece]()
        for in_program, group in itertools.groupby(self.plan.phases, key=lambda phase: phase.in_program):
            if in_program:
                phases = [(next(numbers), phase, self.rows(phase)) for phase in group]
                first, end = phases[0][2].start, phases[-1][2].stop
                placed = (PiecePhase(k, p, slice(rows.start - first, rows.stop - first)) for k, p, rows in phases)
                pieces.append(Piece(rows=slice(first, end), phases=tuple(placed)))
        return tuple(pieces)

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<Motion of {self.q.shape[1]} joints, {len(self.times)} samples, {float(self.times[-1]):g} s>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointTable:
    """The joint positions of one robot: the content of its written table, read back."""

    robot: str  # name of the robot
    joints: tuple[str, ...]  # joint names in the order of the columns
    times: Array  # times of the rows in [s], shape (N,)
    q: Array  # joint positions in [rad] or [m], shape (N, n)
    # name of what is not part of the program, by the first row after it
    gaps: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClockTable:
    """What happens at each row of a program: the content of its written clock."""

    times: Array  # times of the rows in [s], shape (N,)
    sigma: Array  # nominal time of each row in [s], shape (N,)
    phases: tuple[str, ...]  # name of the phase of each row
    lengths: Mapping[str, Array]  # length of path in [m] behind the tool of each task, shape (N,), by task
    process: Mapping[str, Flags]  # whether the tool of each task is on its path, shape (N,), by task
    # name of what is not part of the program, by the first row after it
    gaps: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Program:
    """A program as text.

    Attributes:
        tables: The joint table of every robot, by robot name.
        clock: What happens at each row of these; empty where it is not written.
    """

    tables: dict[str, str]
    clock: str = ""
