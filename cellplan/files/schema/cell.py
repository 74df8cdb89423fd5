"""A whole cell file: robots, part, tasks, surroundings, motion, solver and checks."""

from typing import Annotated, Final, Literal, Self

from pydantic import AfterValidator, Field, Tag, WithJsonSchema, model_validator

from cellplan.files.schema.closed_shapes import PlaneWord
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.schema.shapes import ObstacleEntry, PartShapeEntry, StepEntry
from cellplan.files.schema.task import CornerChoice, Seconds, TaskAxis, TaskEntry, TimeLawChoice
from cellplan.files.schema.tool import Mass
from cellplan.model.settings.acceleration import AccelerationChoice, CycleTime
from cellplan.model.settings.assign import AssignEntry
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.settings.entry import (
    Coordinates,
    Entry,
    Name,
    PoseEntry,
    Text,
    by_kind,
    require_unique,
    rule,
    setting,
)
from cellplan.model.settings.forces import GripEntry
from cellplan.model.settings.layout import LayoutEntry
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.program import ProgramEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.settings.units import Deg, Mm, Ms, NmPerDeg, NPerMm, Within

SCHEMA_VERSION: Final = 1
ROBOT_LIMIT: Final = 64
TASK_LIMIT: Final = 200
OBSTACLE_LIMIT: Final = 500
GRIP_LIMIT: Final = 200  # bodies of one gripper
LARGEST_STIFFNESS: Final = 1e6  # [N/mm] or [Nm/deg]: no arm is stiffer
SAMPLE_LIMIT: Final = 2_000_000  # tables longer than this fill disks, not controllers
ALL_AXES: Final[tuple[TaskAxis, ...]] = ("x", "y", "z", "rx", "ry", "rz")


class GraspEntry(Entry):
    """A robot that holds the part."""

    robot: Name = Field(description="Robot that holds the part (a positioner).")
    at: PoseEntry = setting(PoseEntry(), "Pose of the holder's tool tip in the part frame.")
    axes: tuple[TaskAxis, ...] = setting(
        ALL_AXES,
        "Components of its motion on the part that a further holder keeps at zero, in the part frame; the first "
        "holder carries the part frame and has all six.",
        min_length=1,
    )
    depth_mm: Annotated[Mm, Within(ge=0.0, le=1000.0)] = setting(
        Mm(2.0), "Largest penetration of the part by the bodies that grip."
    )
    grip_bodies: tuple[Text, ...] | None = setting(
        None,
        "The bodies that grip: links, or bodies as reports name them, that are rigid with the flange. They may touch "
        "the part, up to depth_mm; nothing else may. All that is rigid with the flange when absent.",
        min_length=1,
        max_length=GRIP_LIMIT,
    )
    stiffness_n_mm: Annotated[NPerMm, Within(gt=0.0, le=LARGEST_STIFFNESS)] | None = setting(
        None, "Stiffness of robot, gripper and grip at the tool tip, in N per mm; for internal forces between holders."
    )
    stiffness_nm_deg: Annotated[NmPerDeg, Within(gt=0.0, le=LARGEST_STIFFNESS)] | None = setting(
        None, "Likewise of a rotation about the tip, in Nm per deg."
    )
    closure_error_mm: Annotated[Mm, Within(ge=0.0, le=1000.0)] = setting(
        Mm(0.0), "Distance by which a further holder is off its grasp in the real cell, in any direction."
    )
    closure_error_deg: Annotated[Deg, Within(ge=0.0, le=180.0)] = setting(Deg(0.0), "Likewise its angle.")
    grip: GripEntry | None = setting(None, "Grip that holds the part by friction; absent: it is fastened otherwise.")

    @model_validator(mode="after")
    def _has_unique_axes(self) -> Self:
        """Each axis once; a stiffness for each kind of component that the grasp has."""
        require_unique(self.axes, "axes")
        keys = ("stiffness_n_mm", "stiffness_nm_deg")
        for key, other, components in (*zip(keys, keys[::-1], ("xyz", ("rx", "ry", "rz")), strict=True),):
            if getattr(self, key) is None and getattr(self, other) is not None and set(components) & set(self.axes):
                raise rule(f"missing, expected beside {other}, as the grasp keeps {' '.join(components)}", key)
        return self


class MirrorEntry(Entry):
    """A mirror."""

    plane: PlaneWord = Field(description="Plane of the part frame.")


class PartEntry(Entry):
    """The workpiece, held by robots or fixed in the world."""

    geometry: PartShapeEntry | None = setting(None, "Shape of the part; required without step.")
    step: StepEntry | None = setting(None, "The part from a STEP file, in place of geometry.")
    held_by: tuple[GraspEntry, ...] = setting(
        (),
        "The robots that hold the part, the one that carries the part frame first; none: fixed in the world.",
        max_length=ROBOT_LIMIT,
    )
    at: PoseEntry | None = setting(
        None, "Pose of the part frame in the world; required exactly when no robot holds the part."
    )
    mass_kg: Mass | None = setting(
        None, "Mass, for the payload and for weights that grow with the load; absent: not stated."
    )
    centre_mm: Coordinates | None = setting(
        None, "Centre of mass in the part frame, for the payload; when absent that of the shape with uniform density."
    )

    @model_validator(mode="after")
    def _has_one_shape(self) -> Self:
        """A shape, or a STEP file."""
        if self.geometry is None and self.step is None:
            raise rule("missing, expected the shape of the part, or step: with a STEP file", "geometry")
        if self.geometry is not None and self.step is not None:
            raise rule("unexpected key, geometry gives the shape already", "step")
        return self

    mirror: MirrorEntry | None = setting(
        None,
        "The part and all tasks on it are mirrored across a plane of the part frame: push stays push, left and right "
        "are exchanged. What holds the part stays.",
    )

    @model_validator(mode="after")
    def _stands_somewhere(self) -> Self:
        """Held by robots, the first of them in all components, or placed in the world."""
        if self.held_by and self.at is not None:
            raise rule("unexpected key, the part is placed by the robot that holds it", "at")
        if not self.held_by and self.at is None:
            raise rule("missing, expected the pose of the part in the world, or a robot under held_by", "at")
        if self.centre_mm is not None and self.mass_kg is None:
            raise rule("unexpected key, a centre of mass requires mass_kg", "centre_mm")
        if self.held_by and set(self.held_by[0].axes) != set(ALL_AXES):
            words = "unexpected key, the first holder carries the part frame; further holders may leave axes open"
            raise rule(words, "held_by[0].axes")
        for key in ("closure_error_mm", "closure_error_deg"):
            if self.held_by and getattr(self.held_by[0], key):
                words = "unexpected key, the first holder carries the part frame; errors are those of further holders"
                raise rule(words, f"held_by[0].{key}")
        return self


class CycleEntry(Entry):
    """A cycle time that a program is to take."""

    cycle_s: Seconds = Field(
        description="Time that the program takes, or each phase of it in the mode pairwise; a multiple of step_s."
    )


WHOLE_STEPS: Final = 1e-6  # [-] of a step: rounding of a quotient
TIMING_WORDS: Final = "as_written, fastest or {cycle_s: …}"
TimingChoice = Annotated[
    Annotated[Literal["as_written", "fastest"], Tag(f"<{TIMING_WORDS}>")] | Annotated[CycleEntry, Tag("<mapping>")],
    by_kind(TIMING_WORDS, mapping=dict),
]

BUILD_UP_WORDS: Final = "a number of seconds or unlimited"
BuildUpChoice = Annotated[
    Annotated[Literal["unlimited"], Tag(f"<{BUILD_UP_WORDS}>")]
    | Annotated[Annotated[float, Field(ge=0.001, le=10.0)], Tag("<number>")],
    by_kind(BUILD_UP_WORDS, number=(int, float)),
]


class MotionEntry(Entry):
    """Who moves, and the common clock."""

    mode: Literal["simultaneous", "pairwise", "part_at_rest", "semi_coordinated"] = setting(
        "simultaneous",
        "Who moves: all robots; the positioner and one operator at a time; the operators only; the positioner and the "
        "operators in turn (only with program).",
    )
    duration_s: Seconds | None = setting(
        None,
        "Length of the common clock; every task ends within it. When absent, every task has a time of its own "
        "(duration_s, feed_mm_s or a file with times) and the clock ends with the last one.",
    )
    step_s: Seconds = setting(0.001, "Time between two rows; with grid_ms that of the solver only.")
    grid_ms: CycleTime | None = setting(
        None,
        "Grid of the controllers, 2, 4, 8 or 12 for example: all rows lie on it. A multiple of step_s; when absent "
        "the rows are step_s apart.",
    )
    timing: TimingChoice = setting(
        "as_written",
        "When the joints are where: as the durations, feeds and time laws say; as fast as all joints can go along the "
        "path that these give, all robots together, so that tools keep their paths on the part; or in a given time, "
        "slower than that everywhere alike. Feeds are then upper limits.",
    )
    jerk_build_up_s: BuildUpChoice = setting(
        0.05,
        "Time in which a joint without a stated limit of jerk is taken to build up its full acceleration in a retimed "
        "program; unlimited takes none.",
    )
    greatest_feeds: Literal["common", "leximin"] = setting(
        "common",
        "Which feeds are the greatest where several tasks that are done together have feed_mm_s: greatest or a range: "
        "common, all in their ratios (process.feed_ratio); leximin, each as great as the others leave it, the least "
        "one first.",
    )
    controller_cycle_ms: CycleTime = setting(Ms(4.0), "Cycle of the controllers, over which jerk is taken.")
    time_law: TimeLawChoice = setting("quintic", "Law of each stretch of path between stops.")
    corners: CornerChoice = setting("stop", "Stop at corners, or round them.")
    cyclic: bool = setting(False, "Whether all joints are to end where they started.")
    locked_joints: tuple[LockedJointEntry, ...] = setting(
        (), "Joints that fail during the motion; the others compensate where they can."
    )

    @model_validator(mode="after")
    def _has_a_sensible_clock(self) -> Self:
        """At least one step, a bounded number of samples, and a cycle of whole steps."""
        if self.grid_ms is not None and not _is_multiple(self.row_step, self.step_s):
            raise rule(f"expected a multiple of step_s = {self.step_s:g} s, got {self.grid_ms:g}", "grid_ms")
        if isinstance(self.timing, CycleEntry) and not _is_multiple(self.timing.cycle_s, self.row_step):
            grid = f"step_s = {self.step_s:g}" if self.grid_ms is None else f"grid_ms = {self.grid_ms:g}"
            raise rule(f"expected a multiple of {grid}, got {self.timing.cycle_s:g}", "timing.cycle_s")
        if self.duration_s is None:
            return self
        if self.step_s > self.duration_s:
            raise rule(f"expected a step of at most duration_s = {self.duration_s:g}, got {self.step_s:g}", "step_s")
        if self.duration_s / self.step_s > SAMPLE_LIMIT:
            steps = self.duration_s / self.step_s
            raise rule(f"expected at most {SAMPLE_LIMIT} samples (duration_s / step_s), got {steps:.9g}", "step_s")
        return self

    @property
    def row_step(self) -> float:
        """Time between two rows in [s]."""
        return self.step_s if self.grid_ms is None else self.grid_ms.si


def _is_multiple(time: float, step: float) -> bool:
    """Whether a time is a whole number of steps, at least one, but for rounding."""
    return round(time / step) >= 1 and abs(time / step - round(time / step)) <= WHOLE_STEPS


def _is_known_version(version: int) -> int:
    """Refuse files of another version."""
    if version != SCHEMA_VERSION:
        raise rule(f"expected {SCHEMA_VERSION}, the version that this program reads, got {version}")
    return version


Version = Annotated[int, AfterValidator(_is_known_version), WithJsonSchema({"const": SCHEMA_VERSION})]


class CellDocument(Entry):
    """A whole cell file."""

    cellplan: Version = Field(description="Version of the file format.")
    name: Name = Field(description="Name of the cell and of its output folder.")
    robots: dict[Name, RobotEntry] = Field(
        min_length=1, max_length=ROBOT_LIMIT, description="Robots by name; their order is the order of the joints."
    )
    controllers: dict[Name, ControllerEntry] | None = setting(
        None,
        "Controllers by name, each with at least one robot that names it under its key controller; absent: nothing is "
        "known of them.",
        max_length=ROBOT_LIMIT,
    )
    part: PartEntry = Field(description="The workpiece.")
    tasks: dict[Name, TaskEntry] = Field(min_length=1, max_length=TASK_LIMIT, description="Tasks by name.")
    environment: dict[Name, ObstacleEntry] = setting(
        {}, "Fixed obstacles in the cell by name.", max_length=OBSTACLE_LIMIT
    )
    motion: MotionEntry = Field(description="Who moves, and the common clock.")
    program: ProgramEntry | None = setting(
        None,
        "A program from home to home, with any number of tasks for each robot; {} for all its defaults. When absent "
        "the program begins and ends with the tasks, of which a robot has at most one.",
    )
    assign: AssignEntry | None = setting(None, "What `cellplan assign` may choose of a program; not used by solve.")
    acceleration: AccelerationChoice | None = setting(
        None,
        "Accelerations that the joints of all robots are judged against, where a robot says nothing of its own: "
        "{full_speed_in_s: [0.25, 0.25, 0.25, 0.15]} when absent. A stated limit of a joint counts before it; "
        "unlimited leaves also those unjudged that a robot file states.",
    )
    solver: SolverEntry = setting(SolverEntry(), "Resolution method, integrator and their settings.")
    checks: ChecksEntry = setting(ChecksEntry(), "Requirements of the checks.")
    layout: LayoutEntry | None = setting(None, "What a layout search may change; not used by solve.")
