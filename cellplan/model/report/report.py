"""Report: every verified statement with its margin, where and when it is worst, and the series behind the plots."""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from enum import StrEnum

from cellplan.geometry.transforms import Array
from cellplan.model.cell.acceleration import UNKNOWN_ACCELERATIONS, MotionAccelerations
from cellplan.model.cell.cell import RobotRows
from cellplan.model.motion.plan import Phase
from cellplan.model.presented import Presented
from cellplan.model.report.between_rows import BetweenRows
from cellplan.model.report.check_kinds import CHECK_KINDS, CheckKind
from cellplan.model.report.forces import NO_FORCES, ForceReport
from cellplan.model.report.greatest_feed import GreatestFeed
from cellplan.model.report.left_out import LeftOut
from cellplan.model.report.skew import SkewReport
from cellplan.model.report.smoothing import ListedErrors
from cellplan.model.report.stops import StopReport
from cellplan.model.robot.payload import LoadUse
from cellplan.model.robot.repeatability import Repeatability
from cellplan.model.robot.torque import RobotTorques
from cellplan.model.task.clocked_path import Spans
from cellplan.model.units import MM, DisplayUnit, joint_unit, rounded_down

CAUTION = (
    "offline result: run first at reduced speed; not a safety function; the risk assessment stays with the integrator"
)

REDUCED_SPEED = 0.25  # [m/s] of the tool tip: what ISO 10218-1 allows while people are near

ASSUMPTION = "every joint moves linearly from each sample to the next"  # between the samples
MARGIN = "the required clearance must cover controller deviation, calibration errors and elasticity"

Point = tuple[float, float, float]


class ClearanceClass(StrEnum):
    """Classes of pairs of bodies."""

    ROBOT_ROBOT = "robot_robot"
    SELF = "self"
    PART = "part"
    ENVIRONMENT = "environment"


@dataclass(frozen=True, slots=True)
class Check:
    """One verified statement.

    Attributes:
        name: What was checked, one of ``CHECK_KINDS``.
        subject: Robot and joint, task, or pair of bodies.
        passed: The verdict.
        message: One line of text: what, by how much, where, when.
        value: The worst value, in ``unit``.
        limit: The allowed value, in ``unit``.
        unit: Unit of value and limit as printed.
        at_s: Time of the worst value in [s]; None without a time.
    """

    name: str
    subject: str
    passed: bool
    message: str
    _: KW_ONLY
    value: float
    limit: float
    unit: str
    at_s: float | None

    def __post_init__(self) -> None:
        """A name that is not in the catalogue does not exist."""
        if self.name not in CHECK_KINDS:
            raise ValueError(f"check: expected one of {', '.join(CHECK_KINDS)}, got '{self.name}'")

    @property
    def kind(self) -> CheckKind:
        """What a check of this name is."""
        return CHECK_KINDS[self.name]

    @property
    def severity(self) -> float:
        """Number by which checks of one kind are ranked: it grows with the excess over the limit."""
        return self.kind.severity(self.value, self.limit)

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<Check {self.name} of '{self.subject}' {'passed' if self.passed else 'failed'}: {self.message}>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskAccuracy:
    """Tool error of one task on the part, recomputed from the written tables."""

    task: str  # name of the task
    robot: str  # name of the operator
    position_error: Array  # position error in P in [m], shape (N, 3); unconstrained components are zero
    orientation_error: Array  # rotation vector of ``R_PT,desired R_PT^T`` in P in [rad], shape (N, 3); likewise
    path_length: float  # length of the path on the surface in [m]
    start_s: float  # instant at which the path begins
    end_s: float  # instant at which the path is done
    between: BetweenRows | None = None  # errors between the rows; None where they were not evaluated
    # largest distance in [m] of a smooth path from the straight lines between its points, else None
    path_bulge: float | None = None
    judged_from: float = 0.0  # time in [s] from which its errors are judged: 0 unless the tool needs time to settle
    lean: float | None = (
        None  # largest angle in [rad] of a tool's axis from the desired one, where it may lean; or None
    )
    process_off: Spans = ()  # stretches of time in [s] along its path, from rapid to rapid, in which its process is off
    runs: tuple[float, float] = (0.0, 0.0)  # lengths in [m] of the run-in and of the run-out, which are in the path
    process_on: tuple[float, float] = (0.0, 0.0)  # times in [s] between which its process is on, rapids included
    listed: ListedErrors | None = None  # errors against the points of its file, where its path was smoothed; or None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosureAccuracy:
    """How far the tool of a further holder strays from its grasp, recomputed from the written tables."""

    robot: str  # name of the holder
    axes: tuple[int, ...]  # components that the grasp keeps, in the order x, y, z, rx, ry, rz
    position_error: Array  # position error in P in [m], shape (N, 3); components that the grasp leaves open are zero
    orientation_error: Array  # rotation vector of ``R_PT,desired R_PT^T`` in P in [rad], shape (N, 3); likewise
    between: BetweenRows | None = None  # errors between the rows; None where they were not evaluated


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolDepth:
    """How deep the tool of one task stands in the part, or beyond it, along the tool's axis."""

    task: str  # name of the task
    robot: str  # name of the operator
    depth: float  # largest depth in [m]; 0 when the tool is free or just touches
    at_s: float | None  # its instant in [s]; None where a path is judged before it has a clock
    limit: float  # depth that is allowed in [m]
    body: str  # deepest element of the tool: ``axis``, or the name of a body


@dataclass(frozen=True, slots=True, kw_only=True)
class Standoff:
    """How far the tip of one task's tool is from the part along its path, in [m]."""

    task: str  # name of the task
    # smallest and largest distance from the nearest point of the part; 0 where the tip is inside it
    nearest: tuple[float, float]
    # the same along the tool's axis; inf where the axis does not meet the part ahead of the tip
    along: tuple[float, float]
    worst_nearest: float  # distance from the nearest point where the tip is farthest from what the task states
    worst_along: float  # the same along the tool's axis
    at_s: float | None  # instant in [s] of these two; None where a path is judged before it has a clock
    is_off: bool  # whether the tip is not where the task states, or not at the surface where it states nothing
    excused: Mapping[str, float]  # length of path in [m] of each stretch, by its name, that the task excuses


@dataclass(frozen=True, slots=True, kw_only=True)
class JointUse:
    """How one joint is used, in [rad] or [m], and where it is worst."""

    robot: str
    joint: str
    is_revolute: bool
    min: float
    max: float
    lower: float
    upper: float
    margin: float
    margin_at_s: float
    peak_velocity: float
    velocity_limit: float
    peak_velocity_at_s: float
    travel: float

    @property
    def display_unit(self) -> DisplayUnit:
        """Unit in which its positions are printed."""
        return joint_unit(is_revolute=self.is_revolute)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSpeed:
    """How fast a robot moves in the world, between the samples."""

    tool_peak: float  # largest speed of the tool tip in [m/s]
    tool_peak_at_s: float  # its instant
    share_above_reduced: float  # share of the cycle, 0..1, in which the tool tip is faster than ``REDUCED_SPEED``
    axis_peak: float  # largest speed of a point on a joint axis (shoulder, elbow, wrist) in [m/s]
    axis: str  # the joint whose axis that is
    axis_peak_at_s: float  # its instant


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceMinimum:
    """Smallest distance of one class over the whole motion."""

    # distance in [m], never above the truth; 0 when the pair touches; None when there is no such pair
    minimum: float | None = None
    pair: tuple[str, str] | None = None  # names of the two bodies, None when there is no such pair
    at_s: float | None = None  # instant in [s] at which the pair was found to be nearest
    # whether it is proved, between the samples too, that nothing touches and either that the demanded distance is kept
    # or that it is not. Otherwise ``minimum`` is what is proved, and may be 0 without a contact.
    certified: bool = False
    exact: bool = True  # whether the truth is above ``minimum`` by no more than 0.1 mm; otherwise it is a lower bound
    # where the two bodies are nearest, in the world in [m]; None when they touch or are not known
    points: tuple[Point, Point] | None = None
    # how far the real things may stick out of the two bodies in [m], each None when it is not stated
    accuracies: tuple[float | None, float | None] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosePair:
    """One of the closest pairs of the whole motion: distance in [m], never above the truth, and its instant in [s]."""

    pair: tuple[str, str]
    clearance_class: ClearanceClass
    distance: float
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """A stretch of time in which two bodies touch."""

    pair: tuple[str, str]
    clearance_class: ClearanceClass
    first_s: float
    last_s: float
    is_allowed: bool
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClearanceReport:
    """Results on distances."""

    minima: Mapping[ClearanceClass, ClearanceMinimum]  # smallest distance per class
    contacts: tuple[Contact, ...]  # everything that touches, allowed or not
    exclusions: tuple[tuple[str, str, str], ...]  # pairs that were not checked, as (first, second, reason)
    pair_count: int  # pairs that were checked
    curve_times: Array  # times of the plotted curve in [s], shape (K,)
    # per class a distance in [m] that is kept all through the stretch of the program (one of 200) that holds the
    # instant, shape (K,) each; exact to 0.1 mm at the minimum, elsewhere below what is reached in the middle of the
    # stretch by no more than about a twentieth and a millimetre
    curves: Mapping[ClearanceClass, Array]
    closest: tuple[ClosePair, ...] = ()  # the closest pairs that are to keep the demanded distance, nearest first
    # pairs that were not found to touch or to come nearer than demanded, and not proved not to
    not_certified: tuple[tuple[str, str], ...] = ()
    distance_queries: int = 0  # number of distance queries to the collision engine
    contact_queries: int = 0  # number of contact queries
    cut_steps: int = 0  # number of steps between samples that had to be searched in finer steps
    left_out: tuple[LeftOut, ...] = ()  # what was not judged in full, but for two links of one robot's file


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Conditioning:
    """How far the motion stays from singularities (mixed units: metres and radians)."""

    # smallest singular value of the cooperation Jacobian's constrained rows J, over the joints that may move, shape
    # (N,)
    stack: Array
    # smallest by largest singular value of J, shape (N,): 1 when all directions are alike, 0 when it is singular
    condition: Array
    manipulability: Array  # ``sqrt(det(J J^T))``, the product of the singular values of J, shape (N,)
    # smallest singular value of each operator's own block and of each holder's, shape (N,) each
    robots: Mapping[str, Array]

    @property
    def squared_condition(self) -> Array:
        """Smallest by largest singular value of ``J J^T``, as [Vargas2012]_ draws it, shape (N,)."""
        return self.condition**2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Report(Presented):
    """The verdict of one run and everything behind it.

    Attributes:
        cell: Name of the cell.
        mode: Which robots moved.
        tasks: Names of the tasks of the run.
        checks: Every verified statement.
        accuracy: Tool errors, one entry per task.
        joints: One entry per joint of every robot.
        clearance: Distances.
        conditioning: Distance of the motion from singularities; None where no robot works on a task.
        motion_share: Share of all joint travel per robot, 0..1, and the busiest joint of each, as (share, joint).
        speeds: Speeds of each robot in the world.
        times: The common clock in [s], shape (N,).
        q: Positions read back from the tables in [rad] or [m], shape (N, n), by robot.
        qd: Speeds between the samples, shape (N - 1, n), by robot.
        closures: Closure errors, one entry per holder but the first.
        repeatability: Whether the joints come back with the tools; None when not all tools come back.
        depths: Depth of tools in the part, one entry per task on it.
        standoffs: Distance of tool tips from the part, one entry per task on it.
        accelerations: Accelerations, jerk and process speeds.
        loads: Load of each robot.
        forces: Torques by processes and weights, what holders exert on the part, and grips.
        torques: Torques of each robot, or why they are not known.
        phases: All phases on the nominal time of the program; times of this report count from the begin of its own.
        idle: Names of the robots that stand at their homes all the time.
        phase: Name of the phase that it is for; None for the only one of a program.
        skew: How far the clocks of controllers may be apart; None for a cell that states no controllers.
        stops: What happens at worst when one robot stops; None where no controller states how its robots go on.
        greatest_feeds: Greatest feed of each process that has one feed, and holds it.
    """

    cell: str
    mode: str
    tasks: tuple[str, ...]
    checks: tuple[Check, ...]
    accuracy: tuple[TaskAccuracy, ...]
    joints: tuple[JointUse, ...]
    clearance: ClearanceReport
    conditioning: Conditioning | None
    motion_share: Mapping[str, tuple[float, str]]
    speeds: Mapping[str, RobotSpeed]
    times: Array
    q: RobotRows
    qd: Mapping[str, Array]
    closures: tuple[ClosureAccuracy, ...] = ()
    repeatability: Repeatability | None = None
    depths: tuple[ToolDepth, ...] = ()
    standoffs: tuple[Standoff, ...] = ()
    accelerations: MotionAccelerations = UNKNOWN_ACCELERATIONS
    loads: tuple[LoadUse, ...] = ()
    forces: ForceReport = NO_FORCES
    torques: tuple[RobotTorques, ...] = ()
    phases: tuple[Phase, ...] = ()
    idle: tuple[str, ...] = ()
    phase: str | None = None
    skew: SkewReport | None = None
    stops: StopReport | None = None
    greatest_feeds: tuple[GreatestFeed, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    @property
    def cycle_time(self) -> float:
        """Length of the common clock in [s]."""
        return float(self.times[-1])

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<Report of '{self.cell}', {self.phase or self.mode}, {self.cycle_time:g} s, {verdict([self])}>"


def verdict(reports: Sequence[Report]) -> str:
    """Checks that passed and the smallest clearance, or checks that failed and the first of them."""
    checks = [check for report in reports for check in report.checks]
    failed = [check.message for check in checks if not check.passed]
    if failed:
        return f"failed: {len(failed)} of {len(checks)} checks; {failed[0]}"
    distances = (minimum for report in reports for minimum in report.clearance.minima.values())
    known = [
        (distance.minimum, distance.pair)
        for distance in distances
        if distance.minimum is not None and distance.pair is not None
    ]
    if not known:
        return f"passed: {len(checks)} checks"
    least, pair = min(known)
    return f"passed: {len(checks)} checks; smallest clearance {rounded_down(MM * least):.1f} mm, {' - '.join(pair)}"
