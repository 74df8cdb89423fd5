"""Task: what one operator does on the part, as the user wrote it."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import turns
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.model.origin import Origin
from cellplan.model.settings.task import ProcessEntry, ToleranceEntry, TorchEntry, WeldPositionEntry
from cellplan.model.task.seam import Seam, Stretch, Weave
from cellplan.model.task.smoothing import Smoothing

TIME_TOLERANCE: Final = 1e-9  # [s] times nearer than this are the same: rounding of sums of durations


class PlaneName(StrEnum):
    """Plane of the part frame that a planar path is drawn in; the first letter is its first axis."""

    XY = "xy"
    YZ = "yz"
    XZ = "xz"


class OffPart(StrEnum):
    """Stretch of a path on which a tool tip may be off the part."""

    RUN_IN = "run_in"
    RUN_OUT = "run_out"
    CUT = "cut"


class RunDirection(StrEnum):
    """Direction of a closed path, seen from outside the surface."""

    COUNTERCLOCKWISE = "counterclockwise"
    CLOCKWISE = "clockwise"


@dataclass(frozen=True, slots=True, kw_only=True)
class CirclePath:
    """Circle in a plane of the part frame."""

    plane: PlaneName  # the plane
    center: tuple[float, float]  # centre on the plane's two axes in [m]
    radius: float  # radius in [m]
    start: tuple[float, float] = (1.0, 0.0)  # unit direction on the plane's axes from the centre to the start
    direction: RunDirection = RunDirection.COUNTERCLOCKWISE  # way round, seen from outside the surface


@dataclass(frozen=True, slots=True, kw_only=True)
class PolygonPath:
    """Corners joined by straight sides, in a plane of the part frame (rectangle, rhombus, planar polyline)."""

    plane: PlaneName  # the plane
    corners: tuple[tuple[float, float], ...]  # corner points on the plane's two axes in [m]; the first is the start
    is_closed: bool  # whether the last corner is joined to the first
    # way round of a closed path, seen from outside the surface; None: as the corners are listed
    direction: RunDirection | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpacePolylinePath:
    """Points in the part frame joined by straight sides."""

    points: tuple[tuple[float, float, float], ...]
    is_closed: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledPath:
    """Tool targets from a file: positions, and orientations where the file gives them."""

    source: str  # file name for messages
    points: Array  # tool tip positions in [m], shape (N, 3), expressed in P
    axes: Array | None  # unit tool axes pointing into the part, shape (N, 3), or None
    rotations: Array | None  # tool orientations, shape (N, 3, 3), or None; at most one of axes and rotations is given
    is_smooth: bool  # whether a curve is interpolated through the points instead of straight sides
    is_closed: bool  # whether the last point is joined to the first
    join: float = 0.0  # distance in [m] within which points of the file were joined to the point before; 0 for none
    # line of each point in the file, for messages; empty where they follow one another from line 2
    lines: tuple[int, ...] = ()
    smoothing: Smoothing | None = None  # how points and axes were smoothed; None where they are those of the file

    @property
    def listed(self) -> "SampledPath":
        """The path by the points and axes of its file."""
        return self if self.smoothing is None else self.smoothing.listed

    @property
    def tool_axes(self) -> Array | None:
        """Unit tool axes, shape (N, 3); None where the file gives no orientation."""
        return self.axes if self.rotations is None else self.rotations[:, :, 2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgrammedPath(SampledPath):
    """Tool targets of a CAM file with the speed of each straight side; it begins and ends with the process on."""

    speeds: Array  # speed of each side in [m/s]: the feed of the file, or the stated one of rapids, shape (N - 1,)
    is_rapid: Flags  # whether the process is off on each side, shape (N - 1,)
    is_run: Flags | None = None  # whether each side is a run to the work or from it, the process off; None for no side
    rounding: float  # largest distance in [m] of a rounded corner from the sides
    stop_angle: float  # change of direction in [rad] from which on a corner is a stop

    @property
    def inner_stops(self) -> Flags:
        """Whether the tool stops at each inner point, by the directions of the file, shape (N - 2,)."""
        return (turns(self.listed.points) > self.stop_angle) | np.diff(self.is_rapid)

    @property
    def feeds(self) -> Array:
        """Different feeds of the process in [m/s], increasing."""
        return np.unique(self.speeds[~self.is_rapid])

    @property
    def is_on(self) -> Flags:
        """Whether the process is on on each side, shape (N - 1,)."""
        return ~self.is_rapid if self.is_run is None else ~(self.is_rapid | self.is_run)

    @property
    def holds_one_feed(self) -> bool:
        """Whether the process is on all along the path, at one feed."""
        return len(self.feeds) == 1 and not self.is_rapid.any()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimedPath:
    """Trajectory from a file: tool targets with the times at which they are passed."""

    source: str  # file name for messages
    times: Array  # times in [s] from the start of the task, increasing from 0, shape (N,)
    points: Array  # tool tip positions in [m], shape (N, 3), expressed in P
    axes: Array | None  # unit tool axes pointing into the part, shape (N, 3), or None
    rotations: Array | None  # tool orientations, shape (N, 3, 3), or None; at most one of axes and rotations is given
    is_closed: bool  # whether the last row repeats the first and the trajectory may go on from there

    def __post_init__(self) -> None:
        """Check that times increase and that nothing is missing or not finite."""
        fewest = 4 if self.is_closed else 2
        if len(self.times) < fewest or self.points.shape != (len(self.times), 3):
            raise ValueError(f"trajectory '{self.source}': expected at least {fewest} times with a point each")
        if not np.all(np.isfinite(self.points)) or self.times[0] != 0.0 or not np.all(np.diff(self.times) > 0.0):
            raise ValueError(f"trajectory '{self.source}': expected finite points at times that increase from 0")

    @property
    def duration(self) -> float:
        """Time for one cycle in [s]."""
        return float(self.times[-1])

    @property
    def is_smooth(self) -> bool:
        """Whether a curve is interpolated through the points: always, a trajectory has a speed everywhere."""
        return True


PathSpec = CirclePath | PolygonPath | SpacePolylinePath | SampledPath | TimedPath | SeamLine


class Frame(StrEnum):
    """What a tool's path is given in, and what the tool's motion is measured against."""

    PART = "part"
    WORLD = "world"


class TimeLawKind(StrEnum):
    """How the position on a path grows with time."""

    CONSTANT = "constant"
    TRAPEZOID = "trapezoid"
    QUINTIC = "quintic"
    STEADY = "steady"  # of a process: its feed, but for smooth ramps of a given time at both ends


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeLaw:
    """Time law of one stretch of path; ``ramp`` is the share of the time spent speeding up (trapezoid only)."""

    kind: TimeLawKind
    ramp: float = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class StraightMove:
    """Move along the tool's axis, to a path or away from it: ``distance`` in [m], ``duration`` in [s]."""

    distance: float
    duration: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Service:
    """Where and how long the tool of a robot is cleaned, and how often."""

    posture: Array  # configuration of the robot meanwhile in [rad] or [m], shape (n,)
    takes: float  # time in [s] for which it stands there
    most: int  # number of tasks after which the tool is cleaned at the latest, before the next one


ViaPoint = Array | Service | None  # a configuration, a service, or None for home


def configuration_of(point: ViaPoint, home: Array) -> Array:
    """The configuration of a robot at a via point, shape (n,), as its home."""
    return home if point is None else point.posture if isinstance(point, Service) else point


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """One operator's work on the part.

    Attributes:
        name: Name of the task.
        robot: Name of the operator.
        path: The path as written.
        seam: Walls beside the path, and how the tool is held to them; None where ``tool_axis`` or a file says so.
        stretch: The part of the path that is run along; None for all of it.
        weave: How the tip swings about its path; None where it does not, or where the controller weaves.
        project: Unit direction in P naming the side of the part onto which the path is projected (the outward normal
            there), shape (3,); None when the path is used at its place.
        plane_offset: Position of an unprojected planar path along the plane's normal axis in [m].
        tool_axis: ``None`` for the inward surface normal (or the axes of the file), else a unit direction in P.
        tool_x: Direction in P that the tool's x axis leans to, shape (3,).
        spin: Angle in [rad] by which the tool is turned about its own z axis all along the path, from where ``tool_x``
            leads it.
        turn: Angle in [rad] by which the tool turns about its own z axis, uniformly over the path's length; every
            further cycle turns it on.
        axes: Constrained components of the tool's motion in P, in the order x, y, z, rx, ry, rz.
        is_spin_free: Whether rotation about the tool's own axis is left open.
        tilt: Half angle in [rad] of the cone about the desired axis within which the tool's axis may lean, with free
            spin; 0 where it may not.
        tolerance: Largest allowed error.
        start: Start of the path on the common clock in [s]; an approach ends then, and a process is switched on.
        duration: Time for the whole path in [s], all cycles together; None when the feed, a trajectory or the common
            clock decides.
        feed: Largest speed along the path on the surface in [m/s], that of the process if there is one; None when the
            duration decides.
        time_law: Law of each stretch between stops.
        blend: Corner rounding distance in [m]; None means that the tool stops at every corner.
        settle: Time in [s] after the start during which the tool may come from beside its path: errors are reported
            and not judged.
        repeat: Number of passes along a closed path.
        approach: Motion of the tool to the start of its path; None when it starts there.
        retract: Motion of the tool away from the end of its path; None when it stays there.
        process: Process with a demanded feed along the path; None for none.
        dwell: Time in [s] for which the tool rests at the end of its path, the process off, before it leaves.
        relative_to: Frame that path and axes are given in. In the world, the first holder's task says where the part
            is carried; P then reads W in everything that is said of the task.
        tool_depth: Largest depth in [m] that the tool may have in the part, along its axis.
        standoff: Smallest and largest distance in [m] of the tool tip from the part along the path, measured along the
            tool's axis, or to the nearest point where the smallest is zero; None where it is not stated.
        off_part: Stretches of the path on which the tip may be elsewhere.
        torch: How the tool is held to gravity along the path; None for anyhow.
        weld_position: How the weld lies to gravity along the path; None for anyhow.
        is_tack: Whether it is a tack, not a seam.
        after: Names of the tasks of any robots that must be done before it begins.
        start_posture: Configuration of its robot at its start in [rad] or [m], shape (n,); None for that of the robot
            if the task is its first one, and for one that is to be searched otherwise.
        holder_posture: Configuration of the first holder at its start, likewise; None for that holder's start posture.
        holder_moves: Whether the first holder moves while it is done, in a program in which it rests otherwise.
        via_before: Configurations of its robot in [rad] or [m] that it passes in the transfer move to the task, shape
            (n,) each; None for its home, or its service.
        via_after: Likewise in the transfer move from it.
        origin: File and lines that the task was read from; empty for a task made in Python.
    """

    name: str
    robot: str
    path: PathSpec
    seam: Seam | None = None
    stretch: Stretch | None = None
    weave: Weave | None = None
    project: Array | None = None
    plane_offset: float = 0.0
    tool_axis: Array | None = None
    tool_x: Array
    turn: float = 0.0
    axes: tuple[int, ...]
    is_spin_free: bool = False
    tilt: float = 0.0
    tolerance: ToleranceEntry
    start: float = 0.0
    duration: float | None
    feed: float | None = None
    time_law: TimeLaw
    blend: float | None = None
    settle: float = 0.0
    repeat: int = 1
    approach: StraightMove | None = None
    retract: StraightMove | None = None
    process: ProcessEntry | None = None
    dwell: float = 0.0
    relative_to: Frame = Frame.PART
    tool_depth: float = 1e-3
    standoff: tuple[float, float] | None = None
    off_part: tuple[OffPart, ...] = ()
    torch: TorchEntry | None = None
    weld_position: WeldPositionEntry | None = None
    is_tack: bool = False
    after: tuple[str, ...] = ()
    spin: float = 0.0
    start_posture: Array | None = None
    holder_posture: Array | None = None
    holder_moves: bool = False
    via_before: tuple[ViaPoint, ...] = ()
    via_after: tuple[ViaPoint, ...] = ()
    origin: Origin = field(default_factory=Origin, compare=False, repr=False)

    def where(self, key: str = "", *, shared: str = "") -> str:
        """Place of one of the task's keys in its file, ``file:line: tasks.name.key``, for findings.

        Args:
            key: The key below the task; empty for the task itself.
            shared: Key of the cell that gives the value where the task has none of its own; empty for none.
        """
        address = f"tasks.{self.name}.{key}" if key else f"tasks.{self.name}"
        return self.origin.at(shared if shared in self.origin.lines and address not in self.origin.lines else address)

    @property
    def feed_key(self) -> str:
        """Key that gives the feed."""
        return "feed_mm_s" if self.process is None else "process.feed_mm_s"

    @property
    def moves_from(self) -> float:
        """Time in [s] at which the tool starts along its path: after the delay of its process."""
        return self.start + (self.process.on_delay_s if self.process else 0.0)

    @property
    def off_delay(self) -> float:
        """Time in [s] for which the process stays on at the end of the path."""
        return self.process.off_delay_s if self.process else 0.0

    @property
    def leaving(self) -> float:
        """Time in [s] after the end of the path that the delay of the process, the dwell and a retreat take."""
        return self.off_delay + self.dwell + (self.retract.duration if self.retract else 0.0)

    @property
    def has_one_feed(self) -> bool:
        """Whether a process has one feed all along the path; not where its file states several, or rapids."""
        return not isinstance(self.path, ProgrammedPath) or self.path.holds_one_feed

    @property
    def is_on_part(self) -> bool:
        """Whether its path is given on the part."""
        return self.relative_to is Frame.PART

    def time_for_path(self, clock: float | None) -> float | None:
        """Time for the whole path in [s]: its own, or the rest of the common clock; None when neither is given.

        Args:
            clock: Length of the common clock in [s]; None when the clock follows the tasks.
        """
        if self.duration is not None or self.feed is not None or isinstance(self.path, TimedPath):
            return self.duration
        return None if clock is None else clock - self.start - self.leaving

    @property
    def judged_from(self) -> float:
        """Time in [s] from which errors are judged: 0 unless the tool needs time to settle."""
        return self.start + self.settle if self.settle > 0.0 else 0.0

    def first_judged(self, times: Array) -> int:
        """Index of the first of these times in [s], shape (N,), at which errors are judged; at most the last."""
        return first_judged(times, self.judged_from)

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<Task '{self.name}' of robot '{self.robot}': {type(self.path).__name__}, {self.relative_to}>"


def first_judged(times: Array, judged_from: float) -> int:
    """Index of the first of some times in [s], shape (N,), at which errors are judged; at most the last."""
    return min(int(np.searchsorted(times, judged_from - TIME_TOLERANCE)), len(times) - 1)
