"""Robots of a cell: model, place, tool, start posture, weights and limits."""

from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import Field, Tag, model_validator

from cellplan.files.schema.mounting import AttachmentEntry, HangingEntry, PedestalEntry, RailBodyEntry, WallEntry
from cellplan.files.schema.path import JointPathEntry
from cellplan.files.schema.tool import GripperEntry, ToolEntry
from cellplan.model.settings.acceleration import AccelerationChoice, CycleTime
from cellplan.model.settings.controllers import RobotControlEntry
from cellplan.model.settings.entry import (
    Angle,
    Coordinate,
    Direction,
    Entry,
    Name,
    OneOf,
    PoseEntry,
    SlidingSpeed,
    Text,
    by_kind,
    require_unique,
    rule,
    setting,
)
from cellplan.model.settings.robot import FARTHEST, BodyAccuracyEntry, InertiasChoice, JointPosition, PayloadEntry
from cellplan.model.settings.task import LONGEST_S
from cellplan.model.settings.units import Deg, DegPerS, DegPerS2, DegPerS3, InSi, Mm, MmPerS2, MmPerS3, Quantity, Within

LARGEST_JOINT_DEG: Final = 3600.0  # ten turns: a wider range is a wrong unit
FASTEST_DEG_S: Final = 3_600.0  # ten turns a second: faster is a wrong unit
STEEPEST: Final = 1e9  # deg/s2 or mm/s2, as in robot files
STRONGEST: Final = 1e7  # [N m] or [N] no drive has more
WEIGHT_RANGE: Final = (1e-6, 1e6)  # beyond it the weighted pseudo-inverse loses all its digits
AXIS_LIMIT: Final = 64  # joints of one robot
ORDER_LIMIT: Final = 400  # tasks and marks of one robot
SOLID_LIMIT: Final = 50  # solids of a track or a carriage

JointAngle = Annotated[Deg, Within(ge=-LARGEST_JOINT_DEG, le=LARGEST_JOINT_DEG)]
TurningSpeed = Annotated[DegPerS, Within(gt=0.0, le=FASTEST_DEG_S)]
TurningAcceleration = Annotated[DegPerS2, Within(gt=0.0, le=STEEPEST)]
SlidingAcceleration = Annotated[MmPerS2, Within(gt=0.0, le=STEEPEST)]
TurningJerk = Annotated[DegPerS3, Within(gt=0.0, le=STEEPEST)]
SlidingJerk = Annotated[MmPerS3, Within(gt=0.0, le=STEEPEST)]
Torque = Annotated[InSi, Within(gt=0.0, le=STRONGEST)]
Weight = Annotated[float, Field(ge=WEIGHT_RANGE[0], le=WEIGHT_RANGE[1])]

TURNING_LIMITS: Final = ("lower_deg", "upper_deg", "velocity_deg_s", "acceleration_deg_s2", "jerk_deg_s3", "torque_nm")
SLIDING_LIMITS: Final = ("lower_mm", "upper_mm", "velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3", "force_n")

OTHERS: Final = "others"  # key of all joints that do not lead to the flange, where they are locked together
LOCK_WORDS: Final = "a number, or zero for the key others"
POSTURE_WORDS: Final = "auto or a list of joint angles"
POSITION_WORDS: Final = (
    "auto, the name of a configuration in the SRDF, or a mapping with one key per joint (a1_deg, rail_mm)"
)
SERVICE_WORDS: Final = "a list of joint angles or a mapping with one key per joint (a1_deg, rail_mm)"
MOST_SEAMS: Final = 10_000  # between two services
ARGUMENT_WORDS: Final = "a text, a number, true or false"

Configuration = Annotated[
    Annotated[Literal["auto"], Tag(f"<{POSTURE_WORDS}>")] | Annotated[tuple[Angle, ...], Tag("<list>")],
    by_kind(POSTURE_WORDS, list=tuple),
]
NamedConfiguration = Annotated[
    Annotated[Text, Tag(f"<{POSITION_WORDS}>")] | Annotated[dict[str, JointPosition], Tag("<mapping>")],
    by_kind(POSITION_WORDS, mapping=dict),
]
ServicePosture = Annotated[
    Annotated[tuple[Angle, ...], Tag("<list>")] | Annotated[dict[str, JointPosition], Tag("<mapping>")],
    by_kind(SERVICE_WORDS, list=tuple, mapping=dict),
]
XacroArgument = Annotated[
    Annotated[str, Tag(f"<{ARGUMENT_WORDS}>")]
    | Annotated[bool, Tag("<boolean>")]
    | Annotated[int | float, Tag("<number>")],
    by_kind(ARGUMENT_WORDS, boolean=bool, number=(int, float)),
]


LockedPosition = Annotated[
    Annotated[Literal["zero"], Tag(f"<{LOCK_WORDS}>")] | Annotated[JointPosition, Tag("<number>")],
    by_kind(LOCK_WORDS, number=(int, float)),
]


class JointSumEntry(Entry):
    """A range of a sum of joint angles, which a dress pack bears."""

    joints: Annotated[tuple[Text, ...], Field(min_length=2, max_length=AXIS_LIMIT)] = Field(
        description="Revolute joints whose angles are added."
    )
    range_deg: tuple[Angle, Angle] = Field(description="Least and largest sum.")

    @model_validator(mode="after")
    def _is_range(self) -> Self:
        """The smaller angle comes first, and each joint once."""
        low, high = self.range_deg
        if not low < high:
            raise rule(f"expected [low, high], got [{low:g}, {high:g}]: the smaller angle comes first", "range_deg")
        require_unique(self.joints, "joints")
        return self


class IntervalEntry(Entry):
    """After how much work a tool is cleaned."""

    seams: Annotated[int, Field(ge=1, le=MOST_SEAMS)] = Field(
        description="Number of tasks that the robot does between two services at most."
    )


class ServiceEntry(Entry):
    """Cleaning of a torch, or whatever else a tool needs after some work."""

    at: ServicePosture = Field(description="Configuration in which the robot stands meanwhile.")
    takes_s: Annotated[float, Field(gt=0.0, le=LONGEST_S)] = Field(description="Time for which it stands there.")
    every: IntervalEntry = Field(description="How often.")


class LimitsEntry(Entry):
    """Limits of one joint: they tighten those of the model, or supply what it lacks."""

    lower_deg: JointAngle | None = setting(None, "Lowest angle of a revolute joint.")
    upper_deg: JointAngle | None = setting(None, "Highest angle of a revolute joint.")
    velocity_deg_s: TurningSpeed | None = setting(None, "Largest speed of a revolute joint.")
    acceleration_deg_s2: TurningAcceleration | None = setting(None, "Largest acceleration of a revolute joint.")
    jerk_deg_s3: TurningJerk | None = setting(None, "Largest jerk of a revolute joint.")
    torque_nm: Torque | None = setting(None, "Largest torque of the drive of a revolute joint, behind its gears.")
    lower_mm: Coordinate | None = setting(None, "Lowest position of a prismatic joint.")
    upper_mm: Coordinate | None = setting(None, "Highest position of a prismatic joint.")
    velocity_mm_s: SlidingSpeed | None = setting(None, "Largest speed of a prismatic joint.")
    acceleration_mm_s2: SlidingAcceleration | None = setting(None, "Largest acceleration of a prismatic joint.")
    jerk_mm_s3: SlidingJerk | None = setting(None, "Largest jerk of a prismatic joint.")
    force_n: Torque | None = setting(None, "Largest force of the drive of a prismatic joint.")
    wrap: bool = setting(False, "Whether a continuous joint may turn without end.")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """One unit, lower below upper, and either limits or none."""
        turning = [name for name in TURNING_LIMITS if getattr(self, name) is not None]
        sliding = [name for name in SLIDING_LIMITS if getattr(self, name) is not None]
        if turning and sliding:
            raise rule(f"expected degrees or millimetres, got both ({turning[0]} and {sliding[0]})", sliding[0])
        for unit in ("deg", "mm"):
            lower, upper = getattr(self, f"lower_{unit}"), getattr(self, f"upper_{unit}")
            if lower is not None and upper is not None and not lower < upper:
                raise rule(f"expected a number above lower_{unit} = {lower:g}, got {upper:g}", f"upper_{unit}")
            if self.wrap and (lower is not None or upper is not None):
                raise rule("expected either lower and upper limits or wrap: true, got both", "wrap")
        return self

    @property
    def unit(self) -> str | None:
        """``deg`` or ``mm``; None when neither occurs."""
        given = self.model_dump(exclude_none=True, exclude={"wrap"})
        return None if not given else "mm" if any(name in SLIDING_LIMITS for name in given) else "deg"


class RailEntry(Entry):
    """A rail that carries the robot: a prismatic joint before its first one."""

    name: Name = setting("rail", "Name of the joint, in tables, start postures and reports.")
    axis: Direction = Field(description="Direction of the rail in the base frame: one of +x, -x, … or a vector.")
    lower_mm: Coordinate = Field(description="Lowest position.")
    upper_mm: Coordinate = Field(description="Highest position.")
    velocity_mm_s: SlidingSpeed = Field(description="Largest speed.")
    acceleration_mm_s2: SlidingAcceleration | None = setting(None, "Largest acceleration, if known.")
    jerk_mm_s3: SlidingJerk | None = setting(None, "Largest jerk, if known.")
    track: tuple[RailBodyEntry, ...] = setting(
        (), "Solids that stand still: ROBOT/track, ROBOT/track_2, ….", max_length=SOLID_LIMIT
    )
    carriage: tuple[RailBodyEntry, ...] = setting(
        (), "Solids that ride along: ROBOT/carriage, ROBOT/carriage_2, ….", max_length=SOLID_LIMIT
    )

    @model_validator(mode="after")
    def _has_a_range(self) -> Self:
        """Lower below upper."""
        if not self.lower_mm < self.upper_mm:
            raise rule(f"expected a number above lower_mm = {self.lower_mm:g}, got {self.upper_mm:g}", "upper_mm")
        return self


class MountEntry(OneOf):
    """How a robot is mounted: exactly one of the keys."""

    alternatives: ClassVar[tuple[str, ...]] = ("pedestal", "tilted", "hanging", "wall", "rail")

    pedestal: PedestalEntry | None = setting(None, "Upright on a pedestal, as with the key pedestal.")
    tilted: PedestalEntry | None = setting(
        None, "Tilted on an upright column that is cut off along the plane of the base."
    )
    hanging: HangingEntry | None = setting(None, "Upside down below a ceiling.")
    wall: WallEntry | None = setting(None, "On a bracket behind its base, at a wall or elsewhere.")
    rail: RailEntry | None = setting(None, "On a carriage that moves along a rail.")


class RobotEntry(Entry):
    """A robot placed in the cell."""

    model: Text = Field(
        description="Bundled robot, or path of a URDF (.urdf, .xacro) or joint-axis table (.yaml) below the folder of "
        "the cell file."
    )
    package_dirs: tuple[Text, ...] = setting(
        (),
        "Folders in which package://NAME/... of a URDF and $(find NAME)/... of a xacro file are looked up as "
        "FOLDER/NAME/....",
    )
    xacro_args: dict[str, XacroArgument] = setting(
        {},
        "Values of the arguments of a xacro file, by name; its own defaults where absent. Paths count from the cell "
        "file.",
    )
    flange: Text | None = setting(
        None,
        "URDF link taken as the flange; when absent tool0, else flange, else the only last link, where its z is along "
        "the last axis.",
    )
    base: PoseEntry = setting(PoseEntry(), "Pose of the robot's base (root link of a URDF) in the world.")
    bodies: BodyAccuracyEntry | None = setting(
        None, "How good its link bodies are; when absent what the robot's own file says."
    )
    payload: PayloadEntry | None = setting(None, "What it may carry; when absent what the robot's own file says.")
    inertias: InertiasChoice | None = setting(
        None,
        "Masses and inertias of its links: `urdf` takes those of the URDF, with the efforts there as largest torques; "
        "else they are stated here. When absent what a joint-axis table states.",
    )
    srdf: Text | None = setting(
        None,
        "Path of an SRDF (.srdf, .xacro) for a URDF: pairs of its links that are not checked against each other, and "
        "named configurations for start and home.",
    )
    moveit_limits: Text | None = setting(
        None,
        "Path of a joint_limits.yaml of MoveIt for a URDF: limits by joint name, of which the tighter one counts "
        "beside those of the URDF.",
    )
    gripper: GripperEntry | None = setting(
        None, "The gripper that a URDF brings along: how far it is open, and what may work."
    )
    pedestal: PedestalEntry | None = setting(
        None, "Column or box from the floor to the base; it moves with the base and is judged like any body."
    )
    mount: MountEntry | None = setting(
        None, "How the base is mounted, with the bodies that this takes; excludes pedestal."
    )
    tool: ToolEntry = setting(ToolEntry(), "What the robot carries; without it the flange is the tool tip.")
    attachments: tuple[AttachmentEntry, ...] = setting(
        (), "Solids mounted on links, such as hoses, feeders and valve blocks.", max_length=200
    )
    start_deg: Configuration | None = setting(
        None, "Start posture, one angle per joint, for robots with revolute joints only; auto finds one."
    )
    start: NamedConfiguration | None = setting(
        None,
        "Start posture, one key per joint with its unit (a1_deg, rail_mm); auto finds one; else the name of a "
        "configuration in the SRDF (STATE, or GROUP/STATE where several groups have one), with the rail of the cell "
        "at zero or at its nearest limit. Excludes start_deg.",
    )
    home_deg: Configuration | None = setting(
        None,
        "Configuration in which the robot stands while it is idle, one angle per joint, for robots with revolute "
        "joints only; auto finds one near the start.",
    )
    home: NamedConfiguration | None = setting(
        None, "The same with one key per joint with its unit (a1_deg, rail_mm), or by name; excludes home_deg."
    )
    order: tuple[Name, ...] | None = setting(
        None,
        "Its tasks, and the marks of the program at which it waits, in their order; the order of the file, without "
        "marks, when absent. Only with program.",
        max_length=ORDER_LIMIT,
    )
    available: bool = setting(
        True,
        "Whether it can work. One that cannot stands at its home, and its tasks are open to the others: `cellplan "
        "assign` gives them away.",
    )
    joint_sums: tuple[JointSumEntry, ...] = setting(
        (), "Ranges of sums of joint angles, such as a dress pack bears; checked at every row.", max_length=AXIS_LIMIT
    )
    service: ServiceEntry | None = setting(
        None,
        "How its tool is cleaned: on its way to a task with service among the via points before it, or from one with "
        "it after. Only with program.",
    )
    path: JointPathEntry | None = setting(
        None,
        "Path of its joints over the common clock, for the first holder of the part only, in the mode simultaneous; "
        "the other robots then follow their tasks by themselves.",
    )
    null_space: JointPathEntry | None = setting(
        None,
        "Motion of its joints over the common clock of which the tasks leave what moves no tool relative to the part: "
        "its velocities are projected onto their null space. Only changes of the coefficients count.",
    )
    weights: tuple[Weight, ...] | None = setting(
        None, "One positive weight per joint, ones when absent; a larger weight moves that joint less."
    )
    limits: dict[str, LimitsEntry] = setting({}, "Limits by joint name, beside those of the model.")
    acceleration: AccelerationChoice | None = setting(
        None,
        "Accelerations that its joints are judged against; a stated limit of a joint counts first. The cell's when "
        "absent.",
    )
    controller_zero: Text | None = setting(
        None,
        "Path of a YAML file that states how its controller counts the joints, with the keys that controller has in a "
        "robot table; for a URDF, and for other robots whose own file does not state it.",
    )
    controller: RobotControlEntry | None = setting(
        None, "Where it is connected, and how programs of its controller name things."
    )
    controller_share: Annotated[float, Field(gt=0.0, le=1.0)] = setting(
        1.0,
        "Share of the greatest feed that its joint limits allow which its controller reaches, such as 0.85; feeds that "
        "are sought are lower by it.",
    )
    controller_cycle_ms: CycleTime | None = setting(
        None,
        "Cycle of its controller, over which jerk is taken; when absent that of the key controller, else the motion's.",
    )
    locked: dict[str, LockedPosition] = setting(
        {},
        "Positions of URDF joints that do not lead to the flange, by joint name with its unit (finger_mm); `others: "
        "zero` holds all that are not named at zero, or at the nearest position within their limits.",
        json_schema_extra={
            "patternProperties": {
                "_(deg|mm)$": {"type": "number", "minimum": -FARTHEST, "maximum": FARTHEST},
                f"^{OTHERS}$": {"const": "zero"},
            },
            "additionalProperties": False,
        },
    )

    @model_validator(mode="after")
    def _starts_once(self) -> Self:
        """Start posture, home and mount are given at most once each."""
        if self.start_deg is not None and self.start is not None:
            raise rule("expected either start_deg or start, got both", "start")
        if self.home_deg is not None and self.home is not None:
            raise rule("expected either home_deg or home, got both", "home")
        if self.pedestal is not None and self.mount is not None:
            raise rule("expected either pedestal or mount, got both", "mount")
        return self

    @model_validator(mode="after")
    def _locks_once(self) -> Self:
        """Locked joints name their unit, and only the others together are locked without one."""
        joints: set[str] = set()
        for key, position in self.locked.items():
            if (key == OTHERS) != (position == "zero"):
                text = (
                    f"zero, got {position:g}"
                    if key == OTHERS
                    else "a number, got zero: only others may be zero in words"
                )
                raise rule(f"expected {text}", f"locked.{key}")
            joint, _, unit = key.rpartition("_")
            if key != OTHERS and unit not in {"deg", "mm"}:
                raise rule("expected a joint name with its unit, such as finger_mm or flap_deg", f"locked.{key}")
            if joint in joints:
                raise rule(f"expected each joint once, got '{joint}' in deg and in mm", f"locked.{key}")
            joints.add(joint)
        return self

    @property
    def locked_joints(self) -> dict[str, Quantity]:
        """Positions of the joints that are locked by name, without the others."""
        named = {key.rpartition("_"): position for key, position in self.locked.items() if position != "zero"}
        return {joint: Deg(position) if unit == "deg" else Mm(position) for (joint, _, unit), position in named.items()}

    @property
    def locks_others(self) -> bool:
        """Whether every movable joint that does not lead to the flange and is not named is locked."""
        return OTHERS in self.locked

    @property
    def given_start(self) -> tuple[float, ...] | dict[str, Any] | None:
        """Start posture that was written down; None when it is to be found."""
        given = self.start_deg if self.start_deg is not None else self.start
        return None if given is None or isinstance(given, str) else given

    @property
    def given_home(self) -> tuple[float, ...] | dict[str, Any] | None:
        """Home that was written down; None when it is to be found."""
        given = self.home_deg if self.home_deg is not None else self.home
        return None if given is None or isinstance(given, str) else given
