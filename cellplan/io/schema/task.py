"""Tasks of a cell: what each operator does on the part, where and when."""

from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import ConfigDict, Field, Tag, model_validator

from cellplan.io.schema.closed_shapes import CircleEntry, PlaneWord, RectangleEntry, RhombusEntry
from cellplan.io.schema.common import (
    DIRECTION_WORDS,
    Angle,
    Coordinate,
    Direction,
    Entry,
    Name,
    Size,
    Text,
    Vector,
    by_kind,
    one_of_keys,
    require_each_once,
    require_one,
    rule,
)
from cellplan.io.schema.robot import SlidingSpeed
from cellplan.io.schema.units import Deg, Mm, Within

PATHS: Final = ("circle", "rectangle", "rhombus", "polyline", "csv")
SHORTEST_SIDE_MM: Final = 1e-3  # sides shorter than a micrometre have no direction
FARTHEST_STAND_OFF_MM: Final = 5_000.0  # no tool backs off farther
DEEPEST_CUT_MM: Final = 100.0  # a tool that is to stand deeper in the part is no tool that works on its surface
EXCLUDED_BY_PROCESS: Final = ("duration_s", "feed_mm_s", "time_law", "settle_s")
LONGEST_S: Final = 1e6  # [s] eleven days: longer is a wrong unit
MOST_CYCLES: Final = 10_000  # more turns of one path are a shift, not a job

Seconds = Annotated[float, Field(gt=0.0, le=LONGEST_S)]

TOOL_AXIS_WORDS: Final = f"normal, {DIRECTION_WORDS}"
LAW_WORDS: Final = "constant, trapezoid, quintic or {trapezoid: {ramp: 0.25}}"
CORNER_WORDS: Final = "stop or {blend_mm: 2}"
CSV_WORDS: Final = "a file name or {file: path.csv, smooth: true, closed: false}"


class PolylineEntry(Entry):
    """Points joined by straight sides in the order they are listed: two coordinates each in a plane, or three."""

    points_mm: tuple[tuple[Coordinate, ...], ...] = Field(
        min_length=2, description="Points, all [u, v] on the plane's axes or all [x, y, z] in the part frame."
    )
    plane: PlaneWord | None = Field(
        default=None, description="Plane of the part frame; required with [u, v], not with [x, y, z]."
    )
    closed: bool = Field(default=False, description="Whether the last point is joined to the first.")

    @model_validator(mode="after")
    def _is_drawable(self) -> Self:
        """Points of one dimension, a plane where one is needed, no side without length."""
        sizes = [len(point) for point in self.points_mm]
        for index, size in enumerate(sizes):
            if size not in {2, 3} or size != sizes[0]:
                allowed = sizes[0] if sizes[0] in {2, 3} else "2 or 3"
                raise rule(f"expected a list of {allowed} numbers, got {size}", f"points_mm[{index}]")
        if sizes[0] == 2 and self.plane is None:
            raise rule("missing, expected the plane of the points: xy, yz or xz", "plane")
        if sizes[0] == 3 and self.plane is not None:
            raise rule("unexpected key, points [x, y, z] need no plane", "plane")
        if self.closed and len(sizes) < 3:
            raise rule(f"expected at least 3 points for a closed path, got {len(sizes)}", "points_mm")
        self._require_sides()
        return self

    def _require_sides(self) -> None:
        """Refuse equal neighbours, and on a closed path a last point on the first."""
        points = self.points_mm
        pairs = list(zip(points, points[1:], range(1, len(points)), strict=False))
        if self.closed:
            pairs.append((points[0], points[-1], len(points) - 1))
        for a, b, index in pairs:
            if sum((u - v) ** 2 for u, v in zip(a, b, strict=True)) < SHORTEST_SIDE_MM**2:
                other = "first" if self.closed and a is points[0] and index == len(points) - 1 else "point before"
                raise rule(f"expected another point than the {other}, got the same", f"points_mm[{index}]")


class CsvEntry(Entry):
    """Tool targets from a CSV file."""

    file: Text = Field(
        description="File with the header x_mm,y_mm,z_mm and optionally i,j,k or qw,qx,qy,qz, and t_s for a trajectory "
        "that brings its own clock."
    )
    smooth: bool = Field(
        default=True, description="Whether the points are joined by a smooth curve instead of straight sides."
    )
    closed: bool = Field(
        default=False,
        description="Whether the last point is joined to the first; a closed trajectory ends with its first row again.",
    )


CsvChoice = Annotated[
    Annotated[Text, Tag(f"<{CSV_WORDS}>")] | Annotated[CsvEntry, Tag("<mapping>")],
    by_kind(CSV_WORDS, mapping=dict),
]
ToolAxis = Annotated[
    Annotated[Literal["normal", "+x", "-x", "+y", "-y", "+z", "-z"], Tag(f"<{TOOL_AXIS_WORDS}>")]
    | Annotated[Vector, Tag("<list>")],
    by_kind(TOOL_AXIS_WORDS, list=tuple),
]


class RampEntry(Entry):
    """Settings of the trapezoid law."""

    ramp: Annotated[float, Field(gt=0.0, le=0.5)] = Field(
        default=0.25, description="Share of the time of each stretch spent speeding up, and the same slowing down."
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


class PathEntry(Entry):
    """Exactly one path, and its projection onto the part."""

    model_config: ClassVar[ConfigDict] = ConfigDict(json_schema_extra=one_of_keys(*PATHS))

    circle: CircleEntry | None = Field(default=None, description="Circle.")
    rectangle: RectangleEntry | None = Field(default=None, description="Rectangle.")
    rhombus: RhombusEntry | None = Field(default=None, description="Rhombus.")
    polyline: PolylineEntry | None = Field(default=None, description="Points joined by straight sides.")
    csv: CsvChoice | None = Field(default=None, description="Tool targets from a file.")
    project: Direction | None = Field(
        default=None,
        description="Side of the part, as a direction in the part frame, from which the path is projected onto the "
        "part; absent: not projected.",
    )
    offset_mm: Coordinate | None = Field(
        default=None,
        description="Shift of a planar path that is not projected along the plane's normal axis; 0 when absent.",
    )

    @model_validator(mode="after")
    def _is_one_path(self) -> Self:
        """Exactly one path; an offset goes with a planar path that is not projected."""
        require_one(self, PATHS)
        if self.offset_mm is not None and not self.is_planar:
            raise rule("unexpected key, only a path in a plane has an offset", "offset_mm")
        if self.offset_mm is not None and self.project is not None:
            raise rule("unexpected key, a projected path lies on the surface", "offset_mm")
        return self

    @property
    def is_planar(self) -> bool:
        """Whether the path is drawn in a plane of the part frame."""
        if self.polyline is not None:
            return self.polyline.plane is not None
        return self.csv is None


class ToleranceEntry(Entry):
    """Largest allowed tool error on the part."""

    position_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] = Field(
        default=Mm(0.1), description="Largest position error."
    )
    orientation_deg: Annotated[Deg, Within(gt=0.0, le=180.0)] = Field(
        default=Deg(0.01), description="Largest orientation error."
    )
    between_rows_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] | None = Field(
        default=None,
        description="Largest position error between the rows of the tables, where joints move evenly from row to row; "
        "position_mm when left out. A larger one is for steps that something else prescribes.",
    )
    between_rows_deg: Annotated[Deg, Within(gt=0.0, le=180.0)] | None = Field(
        default=None, description="Likewise for the orientation; orientation_deg when left out."
    )


class ProcessEntry(Entry):
    """A process that demands a feed: welding, sealing, dispensing."""

    feed_mm_s: SlidingSpeed = Field(
        description="Demanded speed of the tool along its path on the surface, but for the ramps beside each stop."
    )
    tolerance_percent: Annotated[float, Field(gt=0.0, le=50.0)] = Field(
        default=5.0, description="By how much the speed between two rows may differ from the feed."
    )
    on_delay_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = Field(
        default=0.0, description="Time for which the tool rests at the start of its path with the process on."
    )
    off_delay_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = Field(
        default=0.0, description="Time for which the tool rests at the end of its path with the process on."
    )
    ramp_s: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=0.1,
        description="Time in which the tool comes from rest to the feed and back, at both ends of the path and at "
        "corners at which it stops; the process is on, the feed is not judged.",
    )


ToolDepth = Annotated[Mm, Within(ge=0.0, le=DEEPEST_CUT_MM)]
StandOff = Annotated[Mm, Within(ge=0.0, le=FARTHEST_STAND_OFF_MM)]
TaskAxis = Literal["x", "y", "z", "rx", "ry", "rz"]


class TaskEntry(Entry):
    """One operator's work on the part."""

    robot: Name = Field(description="Robot that does the task; a robot has at most one.")
    relative_to: Literal["part", "world"] = Field(
        default="part",
        description="Frame that path, tool axis and axes are given in. With world, a robot that holds the part (the "
        "first under held_by) carries it along the path; any other moves its tool through the cell.",
    )
    path: PathEntry = Field(description="Path of the tool tip on the part.")
    tool_axis: ToolAxis | None = Field(
        default=None,
        description="Direction of the tool's z axis in the part frame; normal, the default, points into the surface or "
        "takes the file's orientations.",
    )
    tool_x: Direction = Field(
        default="+x",
        description="Direction in the part frame onto which the tool's x axis is aligned as closely as possible.",
    )
    tool_turn_deg: Angle = Field(
        default=Deg(0.0),
        description="Angle by which the tool turns about its own z axis, evenly over the length of the path, "
        "and on by as much in every further cycle.",
    )
    axes: tuple[TaskAxis, ...] = Field(
        default=("x", "y", "z", "rx", "ry", "rz"),
        min_length=1,
        description="Components of the motion that are prescribed, in the part frame.",
    )
    free: tuple[Literal["spin"], ...] = Field(
        default=(), description="[spin] leaves the rotation about the tool's z axis open."
    )
    tolerance: ToleranceEntry = Field(default=ToleranceEntry(), description="Largest allowed tool error.")
    start_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = Field(
        default=None, description="Start of the path on the common clock; when absent 0, or the end of the approach."
    )
    duration_s: Seconds | None = Field(
        default=None,
        description="Time for the whole path, all cycles together; when absent what motion.duration_s leaves. Excludes "
        "feed_mm_s.",
    )
    feed_mm_s: SlidingSpeed | None = Field(
        default=None, description="Largest speed along the path on the surface; excludes duration_s."
    )
    process: ProcessEntry | None = Field(
        default=None,
        description="Process with a demanded feed; it is on from the start of the path, when an approach is over, to "
        "its end. Excludes duration_s, feed_mm_s, time_law and settle_s.",
    )
    dwell_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = Field(
        default=0.0,
        description="Time for which the tool rests at the end of its path, the process off, before it leaves.",
    )
    repeat: Annotated[int, Field(ge=1, le=MOST_CYCLES)] = Field(
        default=1, description="Number of cycles along the path; more than one only for a closed path."
    )
    approach_mm: StandOff = Field(
        default=Mm(0.0),
        description="Distance from which the tool approaches the start of its path, along its own axis.",
    )
    approach_s: Seconds = Field(default=0.5, description="Time for the approach, which ends when the path starts.")
    retract_mm: StandOff = Field(
        default=Mm(0.0), description="Distance to which the tool retracts from the end of its path, along its own axis."
    )
    retract_s: Seconds = Field(default=0.5, description="Time for the retraction.")
    settle_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = Field(
        default=0.0,
        description="Time after the start during which the tool may converge to its path: its error is reported "
        "and not judged. Shorter than the task.",
    )
    tool_depth_mm: ToolDepth | None = Field(
        default=None,
        description="Largest depth of the tool in the part, for processes that cut; checks.tool_depth_mm when absent.",
    )
    time_law: TimeLawChoice | None = Field(
        default=None, description="Law of each stretch between stops; the motion's when absent."
    )
    corners: CornerChoice | None = Field(
        default=None, description="Stop at corners or round them; the motion's when absent."
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """Duration or feed; each word once; only a path on the part can be projected onto its surface."""
        if self.duration_s is not None and self.feed_mm_s is not None:
            raise rule("expected either duration_s or feed_mm_s, got both", "feed_mm_s")
        for key in EXCLUDED_BY_PROCESS if self.process else ():
            if getattr(self, key):
                raise rule("unexpected key, process decides how fast the tool moves along its path", key)
        if self.relative_to == "world" and self.path.project is not None:
            raise rule("unexpected key, a path in the world is not projected onto the part", "path.project")
        if self.relative_to == "world" and self.tool_depth_mm is not None:
            raise rule("unexpected key, a tool in the world does not work on the part", "tool_depth_mm")
        for name, words in (("axes", self.axes), ("free", self.free)):
            require_each_once(words, name)
        if self.start_s is not None and self.start_s < self.approaching_s:
            raise rule(f"expected at least approach_s = {self.approach_s:g}, got {self.start_s:g}", "start_s")
        if self.settle_s and self.approach_mm:
            raise rule("expected no time to settle, as the tool comes to its path by an approach", "settle_s")
        return self

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
