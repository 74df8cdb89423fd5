"""Report: every verified statement with its margin, where and when it is worst, and the series behind the plots."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from cellplan.geometry.transforms import Array
from cellplan.model.cell.acceleration import UNKNOWN_ACCELERATIONS, MotionAccelerations
from cellplan.model.motion.plan import Phase
from cellplan.model.presented import Presented
from cellplan.model.report.between_rows import BetweenRows
from cellplan.model.report.check_kinds import CHECK_KINDS, CheckKind
from cellplan.model.report.left_out import LeftOut
from cellplan.model.report.skew import SkewReport
from cellplan.model.report.stops import StopReport
from cellplan.model.report.verdict import verdict
from cellplan.model.robot.payload import LoadUse
from cellplan.model.robot.repeatability import Repeatability
from cellplan.model.units import DisplayUnit, joint_unit

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One verified statement.

    Attributes:
        name: What was checked, one of ``CHECK_KINDS``.
        subject: Robot and joint, task, or pair of bodies.
        passed: The verdict.
        value: The worst value, in ``unit``.
        limit: The allowed value, in ``unit``.
        unit: Unit of value and limit as printed.
        at_s: Time of the worst value in [s]; None without a time.
        message: One line of text: what, by how much, where, when.
    """

    name: str
    subject: str
    passed: bool
    value: float
    limit: float
    unit: str
    at_s: float | None
    message: str

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
    """Tool error of one task on the part, recomputed from the written tables.

    Attributes:
        task: Name of the task.
        robot: Name of the operator.
        position_error: Position error in P in [m], shape (N, 3); unconstrained components are zero.
        orientation_error: Rotation vector of ``R_PT,desired R_PT^T`` in P in [rad], shape (N, 3); likewise.
        path_length: Length of the path on the surface in [m].
        path_bulge: Largest distance in [m] of a smooth path from the straight lines between its points, else None.
        start_s: Instant at which the path begins.
        end_s: Instant at which the path is done.
        between: Errors between the rows; None where they were not evaluated.
        judged_from: Time in [s] from which its errors are judged: 0 unless the tool needs time to settle.
    """

    task: str
    robot: str
    position_error: Array
    orientation_error: Array
    path_length: float
    start_s: float
    end_s: float
    between: BetweenRows | None = None
    path_bulge: float | None = None
    judged_from: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosureAccuracy:
    """How far the tool of a further holder strays from its grasp, recomputed from the written tables.

    Attributes:
        robot: Name of the holder.
        axes: Components that the grasp keeps, in the order x, y, z, rx, ry, rz.
        position_error: Position error in P in [m], shape (N, 3); components that the grasp leaves open are zero.
        orientation_error: Rotation vector of ``R_PT,desired R_PT^T`` in P in [rad], shape (N, 3); likewise.
        between: Errors between the rows; None where they were not evaluated.
    """

    robot: str
    axes: tuple[int, ...]
    position_error: Array
    orientation_error: Array
    between: BetweenRows | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolDepth:
    """How deep the tool of one task stands in the part, or beyond it, along the tool's axis.

    Attributes:
        task: Name of the task.
        robot: Name of the operator.
        depth: Largest depth in [m]; 0 when the tool is free or just touches.
        at_s: Its instant in [s]; None where a path is judged before it has a clock.
        limit: Depth that is allowed in [m].
        body: Deepest element of the tool: ``axis``, or the name of a body.
    """

    task: str
    robot: str
    depth: float
    at_s: float | None
    limit: float
    body: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Standoff:
    """How far the tip of one task's tool is from the part along its path, in [m].

    Attributes:
        task: Name of the task.
        nearest: Smallest and largest distance from the nearest point of the part; 0 where the tip is inside it.
        along: The same along the tool's axis; inf where the axis does not meet the part ahead of the tip.
        worst_nearest: Distance from the nearest point where the tip is farthest from what the task states.
        worst_along: The same along the tool's axis.
        at_s: Instant in [s] of these two; None where a path is judged before it has a clock.
        is_off: Whether the tip is not where the task states, or not at the surface where it states nothing.
        excused: Length of path in [m] of each stretch, by its name, that the task excuses.
    """

    task: str
    nearest: tuple[float, float]
    along: tuple[float, float]
    worst_nearest: float
    worst_along: float
    at_s: float | None
    is_off: bool
    excused: Mapping[str, float]


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
    """How fast a robot moves in the world, between the samples.

    Attributes:
        tool_peak: Largest speed of the tool tip in [m/s].
        tool_peak_at_s: Its instant.
        share_above_reduced: Share of the cycle, 0..1, in which the tool tip is faster than ``REDUCED_SPEED``.
        axis_peak: Largest speed of a point on a joint axis (shoulder, elbow, wrist) in [m/s].
        axis: The joint whose axis that is.
        axis_peak_at_s: Its instant.
    """

    tool_peak: float
    tool_peak_at_s: float
    share_above_reduced: float
    axis_peak: float
    axis: str
    axis_peak_at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceMinimum:
    """Smallest distance of one class over the whole motion.

    Attributes:
        minimum: Distance in [m], never above the truth; 0 when the pair touches; None when there is no such pair.
        pair: Names of the two bodies, None when there is no such pair.
        at_s: Instant in [s] at which the pair was found to be nearest.
        certified: Whether it is proved, between the samples too, that nothing touches and either that the demanded
            distance is kept or that it is not. Otherwise ``minimum`` is what is proved, and may be 0 without a contact.
        exact: Whether the truth is above ``minimum`` by no more than 0.1 mm; otherwise it is a lower bound.
        points: Where the two bodies are nearest, in the world in [m]; None when they touch or are not known.
        accuracies: How far the real things may stick out of the two bodies in [m], each None when it is not stated.
    """

    minimum: float | None = None
    pair: tuple[str, str] | None = None
    at_s: float | None = None
    certified: bool = False
    exact: bool = True
    points: tuple[Point, Point] | None = None
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
    """Results on distances.

    Attributes:
        minima: Smallest distance per class.
        contacts: Everything that touches, allowed or not.
        exclusions: Pairs that were not checked, as (first, second, reason).
        pair_count: Pairs that were checked.
        curve_times: Times of the plotted curve in [s], shape (K,).
        curves: Per class a distance in [m] that is kept all through the stretch of the program (one of 200) that holds
            the instant, shape (K,) each; exact to 0.1 mm at the minimum, elsewhere below what is reached in the
            middle of the stretch by no more than about a twentieth and a millimetre.
        closest: The closest pairs that are to keep the demanded distance, nearest first.
        not_certified: Pairs that were not found to touch or to come nearer than demanded, and not proved not to.
        distance_queries: Number of distance queries to the collision engine.
        contact_queries: Number of contact queries.
        cut_steps: Number of steps between samples that had to be searched in finer steps.
        left_out: What was not judged in full, but for two links of one robot's file.
    """

    minima: Mapping[ClearanceClass, ClearanceMinimum]
    contacts: tuple[Contact, ...]
    exclusions: tuple[tuple[str, str, str], ...]
    pair_count: int
    curve_times: Array
    curves: Mapping[ClearanceClass, Array]
    closest: tuple[ClosePair, ...] = ()
    not_certified: tuple[tuple[str, str], ...] = ()
    distance_queries: int = 0
    contact_queries: int = 0
    cut_steps: int = 0
    left_out: tuple[LeftOut, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Conditioning:
    """How far the motion stays from singularities (mixed units: metres and radians).

    Attributes:
        stack: Smallest singular value of the cooperation Jacobian's constrained rows J, over the joints that may move,
            shape (N,).
        condition: Smallest by largest singular value of J, shape (N,): 1 when all directions are alike, 0 when it is
            singular.
        manipulability: ``sqrt(det(J J^T))``, the product of the singular values of J, shape (N,).
        robots: Smallest singular value of each operator's own block and of each holder's, shape (N,) each.
    """

    stack: Array
    condition: Array
    manipulability: Array
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
        phases: All phases on the nominal time of the program; times of this report count from the begin of its own.
        idle: Names of the robots that stand at their homes all the time.
        phase: Name of the phase that it is for; None for the only one of a program.
        skew: How far the clocks of controllers may be apart; None for a cell that states no controllers.
        stops: What happens at worst when one robot stops; None where no controller states how its robots go on.
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
    q: Mapping[str, Array]
    qd: Mapping[str, Array]
    closures: tuple[ClosureAccuracy, ...] = ()
    repeatability: Repeatability | None = None
    depths: tuple[ToolDepth, ...] = ()
    standoffs: tuple[Standoff, ...] = ()
    accelerations: MotionAccelerations = UNKNOWN_ACCELERATIONS
    loads: tuple[LoadUse, ...] = ()
    phases: tuple[Phase, ...] = ()
    idle: tuple[str, ...] = ()
    phase: str | None = None
    skew: SkewReport | None = None
    stops: StopReport | None = None

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
