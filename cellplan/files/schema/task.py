"""Tasks of a cell: what each operator does on the part, where and when."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, Tag, WithJsonSchema, model_validator

from cellplan.files.schema.expansion import MOST_PARTS, CraterEntry, PassEntry, StitchEntry, TacksEntry
from cellplan.files.schema.robot import Configuration
from cellplan.files.schema.seam import OF_FEED, PathEntry
from cellplan.model.settings.checks import ToolDepth
from cellplan.model.settings.entry import (
    DIRECTION_WORDS,
    NAME_PATTERN,
    Angle,
    Direction,
    Entry,
    Name,
    Size,
    SlidingSpeed,
    Vector,
    by_kind,
    require_unique,
    rule,
    setting,
)
from cellplan.model.settings.robot import JointPosition
from cellplan.model.settings.task import (
    FARTHEST_STAND_OFF_MM,
    LONGEST_S,
    MOST_CYCLES,
    Free,
    ProcessEntry,
    ToleranceEntry,
    TorchEntry,
    WeldPositionEntry,
)
from cellplan.model.settings.units import Deg, Mm, MmPerS, Within
from cellplan.model.units import MM

EXCLUDED_BY_PROCESS: Final = ("duration_s", "feed_mm_s", "time_law", "settle_s")
EXCLUDED_BY_FILE: Final = (*EXCLUDED_BY_PROCESS, "corners", "tool_turn_deg")  # of a path with rapids

Seconds = Annotated[float, Field(gt=0.0, le=LONGEST_S)]

TOOL_AXIS_WORDS: Final = f"normal, {DIRECTION_WORDS}"
LAW_WORDS: Final = "constant, trapezoid, quintic or {trapezoid: {ramp: 0.25}}"
CORNER_WORDS: Final = "stop or {blend_mm: 2}"
AFTER_WORDS: Final = "the name of a task or a list of names"
VIA_WORDS: Final = "home, service, a list of joint angles or a mapping with one key per joint (a1_deg, rail_mm)"
MOST_VIA: Final = 20
POSITION_WORDS: Final = "auto or a mapping with one key per joint (a1_deg, rail_mm)"

ToolAxis = Annotated[
    Annotated[Literal["normal", "+x", "-x", "+y", "-y", "+z", "-z"], Tag(f"<{TOOL_AXIS_WORDS}>")]
    | Annotated[Vector, Tag("<list>")],
    by_kind(TOOL_AXIS_WORDS, list=tuple),
]
OneRobot = Annotated[
    Name,
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "pattern": NAME_PATTERN},
                {"type": "array", "items": {"type": "string", "pattern": NAME_PATTERN}, "minItems": 1},
            ]
        }
    ),
]


class RampEntry(Entry):
    """Settings of the trapezoid law."""

    ramp: Annotated[float, Field(gt=0.0, le=0.5)] = setting(
        0.25, "Share of the time of each stretch spent speeding up, and the same slowing down."
    )


class TrapezoidEntry(Entry):
    """The trapezoid law with its ramp."""

    trapezoid: RampEntry = Field(description="Settings of the trapezoid law.")


class BlendEntry(Entry):
    """Rounded corners."""

    blend_mm: Size = Field(description="Distance from a corner at which its rounding begins.")


TimeLawChoice = Annotated[
    Annotated[Literal["constant", "trapezoid", "quintic"], Tag(f"<{LAW_WORDS}>")]
    | Annotated[TrapezoidEntry, Tag("<mapping>")],
    by_kind(LAW_WORDS, mapping=dict),
]
CornerChoice = Annotated[
    Annotated[Literal["stop"], Tag(f"<{CORNER_WORDS}>")] | Annotated[BlendEntry, Tag("<mapping>")],
    by_kind(CORNER_WORDS, mapping=dict),
]


AfterChoice = Annotated[
    Annotated[Name, Tag(f"<{AFTER_WORDS}>")] | Annotated[tuple[Name, ...], Tag("<list>")],
    by_kind(AFTER_WORDS, list=tuple),
]
PositionChoice = Annotated[
    Annotated[Literal["auto"], Tag(f"<{POSITION_WORDS}>")] | Annotated[dict[str, JointPosition], Tag("<mapping>")],
    by_kind(POSITION_WORDS, mapping=dict),
]


ViaPoint = Annotated[
    Annotated[Literal["home", "service"], Tag(f"<{VIA_WORDS}>")]
    | Annotated[tuple[Angle, ...], Tag("<list>")]
    | Annotated[dict[str, JointPosition], Tag("<mapping>")],
    by_kind(VIA_WORDS, list=tuple, mapping=dict),
]
ViaPoints = Annotated[tuple[ViaPoint, ...], Field(max_length=MOST_VIA)]


class ViaEntry(Entry):
    """Configurations that the robot of a task passes in transfer moves, at rest in each of them, in their order.

    In that of its service it stands for as long as that takes.
    """

    before: ViaPoints = setting((), "On its way to the task.")
    after: ViaPoints = setting((), "On its way from the task.")


StandOff = Annotated[Mm, Within(ge=0.0, le=FARTHEST_STAND_OFF_MM)]
TaskAxis = Literal["x", "y", "z", "rx", "ry", "rz"]


class TaskEntry(Entry):
    """One operator's work on the part."""

    robot: OneRobot = Field(
        description="Robot that does the task, or any, or a list of robots for `cellplan assign` to choose from; "
        "without program a robot has at most one."
    )
    relative_to: Literal["part", "world"] = setting(
        "part",
        "Frame that path, tool axis and axes are given in. With world, a robot that holds the part (the first under "
        "held_by) carries it along the path; any other moves its tool through the cell.",
    )
    after: AfterChoice | None = setting(
        None, "Tasks, of any robots, that must be done before this one begins; only with program."
    )
    start_deg: Configuration | None = setting(
        None,
        "Start posture of its robot for this task, one angle per joint; auto finds one. When absent that of the robot "
        "for its first task, and auto for later ones. Only with program.",
    )
    start: PositionChoice | None = setting(
        None, "The same with one key per joint with its unit (a1_deg, rail_mm); excludes start_deg."
    )
    holder_deg: tuple[Angle, ...] | None = setting(
        None,
        "Configuration of the first holder in which this task begins, and in which it is done in the modes "
        "part_at_rest and semi_coordinated; the holder's start posture when absent. Only with program.",
    )
    holder: dict[str, JointPosition] | None = setting(
        None, "The same with one key per joint with its unit (a1_deg, rail_mm); excludes holder_deg.", min_length=1
    )
    holder_moves: bool | None = setting(
        None,
        "Whether the first holder moves while the task is done, from that configuration on, in the mode "
        "semi_coordinated: as much of the motion as it can is its own, as the joint weights of the other robots count "
        "a thousandfold. Tasks that begin together all have it or none. false when absent.",
    )
    via: ViaEntry | None = setting(
        None, "Configurations that its robot passes in the transfer moves to the task and from it; only with program."
    )
    path: PathEntry = Field(description="Path of the tool tip on the part.")
    tool_axis: ToolAxis | None = setting(
        None,
        "Direction of the tool's z axis in the part frame; normal, the default, points into the surface or takes the "
        "file's orientations.",
    )
    tool_x: Direction = setting(
        "+x", "Direction in the part frame onto which the tool's x axis is aligned as closely as possible."
    )
    spin_deg: Angle = setting(
        Deg(0.0),
        "Angle by which the tool is turned about its own z axis, all along the path, from where tool_x leads it.",
    )
    tool_turn_deg: Angle = setting(
        Deg(0.0),
        "Angle by which the tool turns about its own z axis, evenly over the length of the path, and on by as much in "
        "every further cycle.",
    )
    axes: tuple[TaskAxis, ...] = setting(
        ("x", "y", "z", "rx", "ry", "rz"),
        "Components of the motion that are prescribed, in the part frame.",
        min_length=1,
    )
    free: Free = setting(
        (),
        "[spin] leaves the rotation about the tool's z axis open; with [spin, {tilt_deg: 10}] that axis may lean as "
        "well, within a cone about the desired one. The method quadratic_program uses it, others keep the axis.",
    )
    tolerance: ToleranceEntry = setting(ToleranceEntry(), "Largest allowed tool error.")
    start_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = setting(
        None, "Start of the path on the common clock; when absent 0, or the end of the approach."
    )
    duration_s: Seconds | None = setting(
        None,
        "Time for the whole path, all cycles together; when absent what motion.duration_s leaves. Excludes feed_mm_s.",
    )
    feed_mm_s: SlidingSpeed | None = setting(None, "Largest speed along the path on the surface; excludes duration_s.")
    process: ProcessEntry | None = setting(
        None,
        "Process with a demanded feed; it is on from the start of the path, when an approach is over, to its end. "
        "Excludes duration_s, feed_mm_s, time_law and settle_s.",
    )
    dwell_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = setting(
        0.0, "Time for which the tool rests at the end of its path, the process off, before it leaves."
    )
    repeat: Annotated[int, Field(ge=1, le=MOST_CYCLES)] = setting(
        1, "Number of cycles along the path; more than one only for a closed path."
    )
    approach_mm: StandOff = setting(
        Mm(0.0),
        "Distance from which the tool approaches the start of its path, along its own axis. With program the default "
        "is 30 for a task on the part.",
    )
    approach_s: Seconds = setting(0.5, "Time for the approach, which ends when the path starts.")
    retract_mm: StandOff = setting(
        Mm(0.0),
        "Distance to which the tool retracts from the end of its path, along its own axis. With program the default "
        "is 30 for a task on the part.",
    )
    retract_s: Seconds = setting(0.5, "Time for the retraction.")
    settle_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = setting(
        0.0,
        "Time after the start during which the tool may converge to its path: its error is reported and not judged. "
        "Shorter than the task.",
    )
    tool_depth_mm: ToolDepth | None = setting(
        None, "Largest depth of the tool in the part, for processes that cut; checks.tool_depth_mm when absent."
    )
    standoff_mm: tuple[StandOff, StandOff] | None = setting(
        None,
        "Smallest and largest distance of the tool tip from the part along the path, below the surface to "
        "tool_depth_mm: along the tool's axis, or to the nearest point where the smallest is 0. When absent a tip "
        "with a process is within 2 mm of the part.",
    )
    torch: TorchEntry | None = setting(None, "How the tool is held to gravity along the path; anyhow when absent.")
    weld_position: WeldPositionEntry | None = setting(
        None, "How the weld lies to gravity along the path; anyhow when absent."
    )
    passes: tuple[PassEntry, ...] | None = setting(
        None,
        "Passes of the seam, one after the other, each a task: NAME_1, NAME_2 and so on.",
        min_length=1,
        max_length=MOST_PARTS,
    )
    stitch: StitchEntry | None = setting(
        None, "Stitches of the seam, one after the other, each a task: NAME_1, NAME_2 and so on; excludes passes."
    )
    tacks: TacksEntry | None = setting(
        None, "Tacks that are done before the seam, each a task with tack: true: NAME_t1, NAME_t2 and so on."
    )
    crater: CraterEntry | None = setting(None, "How the weld ends; only with a process.")
    skip: bool | None = setting(None, "Whether the task is left out, and its name wherever it stands.")
    tack: bool = setting(False, "Whether it is a tack, which program.tacks_first has before all seams.")
    off_part: tuple[Literal["run_in", "run_out", "cut"], ...] = setting(
        (),
        "Stretches of the path on which the tip need not keep that distance: its begin, its end, and where a cut "
        "leaves the part between them.",
    )
    time_law: TimeLawChoice | None = setting(None, "Law of each stretch between stops; the motion's when absent.")
    corners: CornerChoice | None = setting(None, "Stop at corners or round them; the motion's when absent.")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """Duration or feed; each word once; only a path on the part can be projected onto its surface."""
        if self.duration_s is not None and self.feed_mm_s is not None:
            raise rule("expected either duration_s or feed_mm_s, got both", "feed_mm_s")
        for key in EXCLUDED_BY_PROCESS if self.process else ():
            if getattr(self, key):
                raise rule("unexpected key, process decides how fast the tool moves along its path", key)
        if not self.path.has_feeds and self.process is not None and self.process.feed_mm_s is None:
            raise rule("missing, expected the demanded feed, a number above 0 in mm/s", "process.feed_mm_s")
        if self.relative_to == "world" and (self.path.project is not None or self.path.is_on_part):
            key = "relative_to" if self.path.is_on_part else "path.project"
            projected = "unexpected key, a path in the world is not projected onto the part"
            raise rule("expected part for a path on the part, got world" if self.path.is_on_part else projected, key)
        if self.path.is_seam and self.tool_axis is not None:
            raise rule("unexpected key, the walls and angles of the path say how the tool is held", "tool_axis")
        if self.start_deg is not None and self.start is not None:
            raise rule("expected either start_deg or start, got both", "start")
        if self.holder_deg is not None and self.holder is not None:
            raise rule("expected either holder_deg or holder, got both", "holder")
        for name, words in (
            ("axes", self.axes),
            ("free", tuple("spin" if word == "spin" else "tilt_deg" for word in self.free)),
            ("off_part", self.off_part),
            ("after", self.preceding),
        ):
            require_unique(words, name)
        if self.spin_deg and self.free:
            raise rule("unexpected key, the spin is free: leave out one of them", "spin_deg")
        if self.start_s is not None and self.start_s < self.approaching_s:
            raise rule(f"expected at least approach_s = {self.approach_s:g}, got {self.start_s:g}", "start_s")
        if self.settle_s and self.approach_mm:
            raise rule("expected no time to settle, as the tool comes to its path by an approach", "settle_s")
        return self

    @model_validator(mode="after")
    def _agrees_with_file(self) -> Self:
        """A file that states feeds decides how fast the tool moves; a path with rapids has stops of its own."""
        if self.path.outline is not None and self.process is None:
            raise rule("missing, expected the feed along an outline, such as {feed_mm_s: 20}", "process")
        if self.path.raster is not None and not isinstance(self.process and self.process.feed_mm_s, MmPerS):
            raise rule("expected a process with a stated feed along a raster, such as {feed_mm_s: 100}", "process")
        by = "file of the path states the feeds" if self.path.has_feeds else "process has the feed"
        for key in EXCLUDED_BY_FILE if self.path.is_programmed else ():
            if getattr(self, key):
                raise rule(f"unexpected key, the {by}, and the entry of the path the stops", key)
        if self.path.has_feeds and self.process is not None and self.process.feed_mm_s is not None:
            raise rule("unexpected key, the file of the path states the feeds", "process.feed_mm_s")
        for key in self.path.seam_keys if self.path.has_feeds else ():
            raise rule("unexpected key, a path of CAM is used as it stands in the file", f"path.{key}")
        if self.path.is_programmed and self.repeat > 1:
            raise rule(f"expected 1 for a path with rapids and stops of its own, got {self.repeat}", "repeat")
        return self

    @model_validator(mode="after")
    def _agrees_with_part(self) -> Self:
        """Only a tool on the part is deep in it or off it; the smallest distance comes first."""
        for key in ("tool_depth_mm", "standoff_mm", "off_part") if self.relative_to == "world" else ():
            if getattr(self, key) not in (None, ()):
                raise rule("unexpected key, a tool in the world does not work on the part", key)
        if self.standoff_mm is not None and self.standoff_mm[0] > self.standoff_mm[1]:
            low, high = (f"{value:g}" for value in self.standoff_mm)
            raise rule(f"expected [low, high], got [{low}, {high}]: the smaller distance comes first", "standoff_mm")
        return self

    @model_validator(mode="after")
    def _agrees_with_parts(self) -> Self:
        """A seam has passes or stitches; a crater is filled by a process."""
        if self.passes is not None and self.stitch is not None:
            raise rule("expected either passes or stitch, got both", "stitch")
        if self.crater is None:
            return self
        if self.process is None:
            raise rule("expected a process, which fills the crater", "crater")
        if self.process.off_delay_s:
            raise rule("unexpected key, crater.time_s is this time: leave out one of them", "process.off_delay_s")
        if self.path.back_mm is not None:
            raise rule("unexpected key, crater.back_mm is this length: leave out one of them", "path.back_mm")
        return self

    @model_validator(mode="after")
    def _agrees_with_weave(self) -> Self:
        """Times of a weave become lengths by the feed of the process, and leave the tool some of each period."""
        weave = self.path.weave
        if weave is None:
            return self
        key = next((key for key in OF_FEED if getattr(weave, key)), None)
        if self.process is None and key is not None:
            raise rule("expected a process, whose feed says how long it is along the path", f"path.weave.{key}")
        if self.process is not None:
            weave.require_strokes(MM * self.process.feed)
        return self

    @property
    def preceding(self) -> tuple[str, ...]:
        """Names of the tasks that come before it."""
        return (self.after,) if isinstance(self.after, str) else self.after or ()

    @property
    def given_start(self) -> tuple[float, ...] | dict[str, float] | None:
        """Start posture that was written down; None when it is to be found."""
        given = self.start_deg if self.start_deg is not None else self.start
        return None if given is None or isinstance(given, str) else given

    @property
    def given_holder(self) -> tuple[float, ...] | dict[str, float] | None:
        """Configuration of the first holder that was written down; None for that holder's start posture."""
        return self.holder_deg if self.holder_deg is not None else self.holder

    @property
    def approaching_s(self) -> float:
        """Time before the path that an approach takes."""
        return self.approach_s if self.approach_mm else 0.0

    @property
    def leaving_s(self) -> float:
        """Time after the path that the delay of a process, the dwell and the retraction take."""
        off_delay = self.process.off_delay_s if self.process else 0.0
        return off_delay + self.dwell_s + (self.retract_s if self.retract_mm else 0.0)

    @property
    def begins_s(self) -> float:
        """Start of the path on the common clock."""
        return self.approaching_s if self.start_s is None else self.start_s
