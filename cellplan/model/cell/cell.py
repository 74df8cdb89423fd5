"""Cell: the content of a cell file, as immutable data."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.shapes import Shape, Solid
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.acceleration import USUAL_ACCELERATION, USUAL_CYCLE, AccelerationRule
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.model.cell.layout import LayoutSettings
from cellplan.model.cell.mounting import Mount
from cellplan.model.cell.rod import Rod
from cellplan.model.origin import Origin
from cellplan.model.presented import Presented
from cellplan.model.robot.robot import Body, JointLimits, JointSum, RobotModel
from cellplan.model.settings.assign import AssignEntry
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.model.settings.forces import GripEntry
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.program import NoTransfers, ProgramEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.task.task import Frame, Service, Task

RobotRows = Mapping[str, Array]  # positions of the joints of each robot in [rad] or [m], by its name, shape (N, n)


class Mode(StrEnum):
    """Which robots move: MODO 1, 2, 3 of Ribeiro 2010, chapter 5; in the last one the part moves between the tasks."""

    SIMULTANEOUS = "simultaneous"
    PAIRWISE = "pairwise"
    PART_AT_REST = "part_at_rest"
    SEMI_COORDINATED = "semi_coordinated"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tool:
    """A tool on a flange: its tip and its solids."""

    X_FT: Array  # tool tip in the flange frame, z out of the tool
    bodies: tuple[Body, ...]  # solids, their poses ``X_BS`` given in F, ``link`` unused
    mass: float | None = None  # mass in [kg]; None when it is not stated
    centre: Array | None = None  # centre of mass in F in [m], shape (3,); None to think of the mass at the tip
    rod: Rod | None = None  # the rod that tip and first bodies follow from; None for a tool without one

    @property
    def is_bare(self) -> bool:
        """Whether there is no tool at all: the tip is the flange and nothing is drawn."""
        return not self.bodies and bool(np.array_equal(self.X_FT, np.eye(4)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """A robot placed in the cell.

    Attributes:
        name: Name in the cell.
        model: Its data sheet.
        X_WB: Base in the world.
        tool: Its tool.
        start: Start posture in [rad] or [m], shape (n,); None when it is to be searched.
        weights: Joint weights, positive, shape (n,): a larger one moves that joint less.
        home: Configuration while it is idle in [rad] or [m], shape (n,); None when it is to be searched.
        acceleration: Accelerations that its joints are checked against.
        controller_cycle: Cycle of its controller in [s], over which jerk is computed.
        controller_share: Share of the greatest feed by its limits that its controller reaches.
        attachments: Solids mounted on its links, their poses ``X_BS`` in B while all joints read zero.
        pedestal: What the base stands on, hangs from or is fixed to; None for a base on the floor or on an obstacle.
        gripper: Names of link bodies of its model that make up a gripper, which may work on the part as a tool does.
        order: Names of its tasks and marks in the order of work; empty for the order of the cell's tasks.
        path: Its joints over the whole clock; None where they follow from the tasks.
        null_space: Joint motion over the whole clock, projected onto the null space of the tasks; None for none.
        control: Where it is connected; None when no controller is stated.
        service: How its tool is cleaned; None when it is not.
        joint_sums: Ranges of sums of its joint angles.
    """

    name: str
    model: RobotModel
    X_WB: Array
    tool: Tool
    start: Array | None
    weights: Array
    home: Array | None = None
    acceleration: AccelerationRule = USUAL_ACCELERATION
    controller_cycle: float = USUAL_CYCLE
    controller_share: float = 1.0
    attachments: tuple[Body, ...] = ()
    pedestal: Mount | None = None
    gripper: tuple[str, ...] = ()
    order: tuple[str, ...] = ()
    path: JointSpline | None = None
    null_space: JointSpline | None = None
    control: RobotControlEntry | None = None
    service: Service | None = None
    joint_sums: tuple[JointSum, ...] = ()

    @property
    def bodies_at_work(self) -> tuple[Body, ...]:
        """What may touch the part near the tool tip: the tool's bodies and the gripper's, with their poses in F."""
        X_FB = inverse(self.model.X_BF)
        gripper_bodies = (body for body in self.model.bodies if body.name in self.gripper)
        return (*self.tool.bodies, *(replace(body, X_BS=X_FB @ body.X_BS) for body in gripper_bodies))

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<Robot '{self.name}': {self.model.name}, {len(self.model.joints)} joints>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grasp:
    """A robot holding the part.

    The first holder carries the part frame. The tool of each further one is tied to it: it has a pose on the part that
    never changes ([Ribeiro2010]_ 4.5).
    """

    robot: str  # name of the holder
    X_PT: Array  # the holder's tool tip in the part frame
    # components of the tool's motion on the part that a further holder keeps at zero, in the order x, y, z, rx, ry, rz
    axes: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
    depth: float = 0.002  # by how much in [m] what grips may reach into the part
    # names of the bodies that grip, as reports show them; None for all that is rigid with the flange
    bodies: tuple[str, ...] | None = None
    # of robot, gripper and grip at the tip in [N/m] and [N m/rad], infinite for components that it leaves open; None
    # when it is not stated
    stiffness: tuple[float, float] | None = None
    closure_error: tuple[float, float] = (0.0, 0.0)  # by how much it is off the grasp in the real cell, [m] and [rad]
    grip: GripEntry | None = None  # pads that hold the part by friction; None for another fastening, or not stated

    @property
    def name(self) -> str:
        """What the grasp is called among the tasks; no task can have such a name."""
        return f"{self.robot}@part"

    @property
    def is_spin_free(self) -> bool:
        """A grasp always constrains the rotation about the tool's own axis."""
        return False

    @property
    def tilt(self) -> float:
        """A grasp leaves the tool's axis no angle."""
        return 0.0

    @property
    def relative_to(self) -> Frame:
        """The tool is tied to the part."""
        return Frame.PART


Relation = Task | Grasp  # what asks for a tool's motion: a task, or the grasp of a further holder


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """The workpiece.

    Attributes:
        shape: The solid.
        X_PS: Pose of the shape's frame in the part frame P.
        held_by: The robots that hold it; empty when it is fixed in the world.
        X_WP: Pose in the world when no robot holds it; None otherwise.
        mass: Mass in [kg]; None when it is not stated.
        centre: Centre of mass in P in [m], shape (3,); None when it is not stated.
        accuracy: Distance in [m] by which the real part may stick out of the shape: that of a mesh from its drawing.
    """

    shape: Solid
    X_PS: Array
    held_by: tuple[Grasp, ...]
    X_WP: Array | None
    mass: float | None = None
    centre: Array | None = None
    accuracy: float = 0.0

    def __post_init__(self) -> None:
        """Check that the place of the part is stated."""
        if not self.held_by and self.X_WP is None:
            raise ValueError("part: expected a holder or a pose in the world, got neither")

    @property
    def X_CP(self) -> Array:
        """The part in the tool frame of its positioner, in W when no robot holds it, shape (4, 4)."""
        if self.held_by:
            return inverse(self.held_by[0].X_PT)
        if self.X_WP is None:
            raise ValueError("part: expected a pose in the world")
        return self.X_WP

    def __repr__(self) -> str:
        """One line without arrays."""
        holders = ", ".join(grasp.robot for grasp in self.held_by)
        return f"<Part: {type(self.shape).__name__}, {f'held by {holders}' if holders else 'fixed in the world'}>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """A fixed obstacle in the cell."""

    name: str
    shape: Shape
    X_WS: Array


class Timing(StrEnum):
    """What times the motion along the path."""

    AS_WRITTEN = "as_written"
    FASTEST = "fastest"
    CYCLE = "cycle"


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionSettings:
    """Mode and clock."""

    mode: Mode  # which robots move
    duration: float | None  # length of the common clock in [s]; None when it ends with the last task
    step: float  # time between two rows in [s]: that of the grid, where there is one
    cyclic: bool = False  # whether all joints are to end where they started
    locked: tuple[LockedJointEntry, ...] = ()  # joints that fail during the motion
    # what times the motion along the path: the time laws, or the limits of the joints
    timing: Timing = Timing.AS_WRITTEN
    cycle: float | None = None  # time in [s] that each phase of a program takes; None unless the timing demands one
    # time in [s] in which a joint without a stated limit of jerk is taken to build up its acceleration where a program
    # is retimed; None for no limit
    build_up: float | None = 0.05
    grid: float | None = None  # grid of the controller in [s], on which all rows lie; None for rows of every step
    is_leximin: bool = False  # whether greatest feeds of tasks that are done together are sought one after the other
    # step in [s] of a method that goes from row to row, as ``step_s`` says; None where it is that of the rows
    finer: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell(Presented):
    """Robots, part, tasks and surroundings.

    Attributes:
        name: Name of the cell and of its output folder.
        robots: In the order of the file: the order of the stacked joint vector.
        part: The workpiece.
        tasks: In the order of the file.
        obstacles: The environment.
        motion: Mode and clock.
        solver: Method and gains.
        checks: Required clearance and tolerances.
        origin: The document that the cell was read from.
        inputs: SHA-256 of every file that was read, by the path as written.
        remarks: Key of the cell file, and what was not read of the file that it names.
        program: Cycles, marks and places of the part; ``NoTransfers`` where it does not go from home to home.
        layout: What a layout search may change; None for a cell that was built in Python.
        controllers: Its controllers by name; empty when none are stated.
        assign: What an assignment may choose; None where nothing is said of it.
    """

    name: str
    robots: tuple[Robot, ...]
    part: Part
    tasks: tuple[Task, ...]
    obstacles: tuple[Obstacle, ...]
    motion: MotionSettings
    solver: SolverEntry
    checks: ChecksEntry
    origin: Origin
    inputs: Mapping[str, str]
    remarks: tuple[tuple[str, str], ...] = ()
    program: ProgramEntry = NoTransfers()  # noqa: RUF009 - frozen
    layout: LayoutSettings | None = None
    controllers: Mapping[str, ControllerEntry] = field(default_factory=dict)
    assign: AssignEntry | None = None

    def with_values(self, values: Mapping[str, object]) -> "Cell":
        """The cell of the same document with other values, validated like those of the file.

        Addresses are key paths of the cell file: ``motion.duration_s``, ``robots.kuka.base.x_mm``,
        ``tasks.seam.path.polyline.points_mm[2]``. Named entries are addressed by name, list elements by index; the
        components of a pose may be given as ``x_mm``, ``y_mm``, ``z_mm``, ``roll_deg``, ``pitch_deg``, ``yaw_deg``.

        Args:
            values: Values in the units of the cell file, by address; None leaves a key out, so that its default holds.

        Raises:
            InvalidFileError: Everything that is wrong with the changed cell, one located line each.
            InputError: The cell was not read from a file, or was changed in Python since.
        """
        if self.origin.source is None:
            raise InputError(f"cell '{self.name}': expected a cell that was read from a file, got one built in Python")
        return self.origin.source.with_values(self, values)

    def robot(self, name: str) -> Robot:
        """The robot of that name."""
        return self.robots[self.index(name)]

    def index(self, name: str) -> int:
        """Index of a robot in ``robots``."""
        return next(index for index, robot in enumerate(self.robots) if robot.name == name)

    @property
    def carrier(self) -> int | None:
        """Index of the positioner that carries the part frame; None for a part at a fixed pose."""
        return self.index(self.part.held_by[0].robot) if self.part.held_by else None

    @cached_property
    def joint_limits(self) -> JointLimits:
        """Limits of all joints in the order of the stacked joint vector."""
        return JointLimits.of(joint for robot in self.robots for joint in robot.model.joints)

    def task(self, name: str) -> Task:
        """The task of that name."""
        return next(task for task in self.tasks if task.name == name)

    @property
    def positioners(self) -> tuple[str, ...]:
        """Names of the robots that hold the part, the one that carries the part frame first."""
        return tuple(grasp.robot for grasp in self.part.held_by)

    @property
    def closures(self) -> tuple[Grasp, ...]:
        """Grasps of all holders but the first: each closes a loop over the part and the world."""
        return self.part.held_by[1:]

    @property
    def relations(self) -> tuple[Relation, ...]:
        """All tasks, then the closures: the block rows of the whole cooperation Jacobian."""
        return (*self.tasks, *self.closures)

    def columns(self, robot: str) -> slice:
        """Slice of a robot's joints in the stacked joint vector."""
        first = 0
        for placed in self.robots:
            last = first + len(placed.model.joints)
            if placed.name == robot:
                return slice(first, last)
            first = last
        raise KeyError(robot)

    @property
    def joint_count(self) -> int:
        """Length of the stacked joint vector."""
        return sum(len(robot.model.joints) for robot in self.robots)

    def __repr__(self) -> str:
        """One line without arrays."""
        robots, tasks = (", ".join(entry.name for entry in named) for named in (self.robots, self.tasks))
        return f"<Cell '{self.name}': robots {robots}; tasks {tasks}; {self.motion.mode}>"


def joint_at(cell: Cell, column: int) -> tuple[str, str]:
    """Names of the robot and of its joint at a place in the stacked joint vector of a cell."""
    return [(robot.name, joint) for robot in cell.robots for joint in robot.model.joint_names][column]


def stacked_positions(cell: Cell, q: RobotRows) -> Array:
    """Positions of all robots side by side, shape (N, nq), from those of each robot in [rad] or [m], (N, n)."""
    return np.concatenate([q[robot.name] for robot in cell.robots], axis=1)
