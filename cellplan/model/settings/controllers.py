"""Controllers of a cell, where each robot is connected, and what is demanded when one robot stops."""

import re
from collections.abc import Set
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import AfterValidator, Field, Tag, WithJsonSchema, model_validator

from cellplan.model.settings.acceleration import CycleTime
from cellplan.model.settings.entry import Angle, Coordinate, Entry, Name, PoseEntry, Text, by_kind, rule, setting
from cellplan.model.settings.process_statements import Distance, ProcessStatementsEntry, require_process
from cellplan.model.settings.units import Ms, Within

LARGEST_FACTOR: Final = 1_000.0  # [-] a larger coupling is a mistake
Factor = Annotated[float, Field(ge=-LARGEST_FACTOR, le=LARGEST_FACTOR)]
IDENTIFIER: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
IDENTIFIER_WORDS: Final = "a name of 1 to 32 ASCII letters, digits or '_' that begins with a letter"
SIGNAL_WORDS: Final = "a name or a whole number from 0"
SLOWEST_MS: Final = 10_000.0  # ten seconds: longer latencies and reactions are a wrong unit
LONGEST_BRAKE_S: Final = 60.0  # no arm brakes for a minute
LAST_SIGNAL: Final = 65_535
LAST_GROUP: Final = 8
LAST_MACHINE: Final = 16
LAST_FRAME: Final = 999
MOST_DECIMALS: Final = 9
TASK_LIMIT: Final = 64
SIGNAL_LIMIT: Final = 64
FRAME_LIMIT: Final = 64
LEVEL_LIMIT: Final = 8


class ControllerZeroEntry(Entry):
    """Joint positions of the controller: sign * model + zero + sum of factor * controller position of another joint."""

    zero_deg: dict[str, Angle] = setting(
        {}, "By revolute joint, what the controller shows while the model reads zero; 0 when absent."
    )
    zero_mm: dict[str, Coordinate] = setting(
        {}, "By prismatic joint, what the controller shows while the model reads zero; 0 when absent."
    )
    sign: dict[str, Literal[1, -1]] = setting(
        {}, "By joint, -1 where the controller counts the other way round; 1 when absent."
    )
    coupling: dict[str, dict[str, Factor]] = setting(
        {}, "By joint, the factors of the controller positions of earlier joints of its kind that are added."
    )
    limits_deg: dict[str, tuple[Angle, Angle]] = setting(
        {},
        "By revolute joint, the smallest and the largest position that the controller allows of what it shows: of a "
        "coupled joint too, whose range in the model depends on the others.",
    )
    source: Text = setting("not stated", "Where this is known from.")

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        """An empty entry would confirm a counting that was never stated."""
        if not self.model_fields_set:
            raise rule("expected zero_deg, zero_mm, sign or coupling, or the source that says there are none, got none")
        return self


def _identifier(text: str) -> str:
    """Refuse what no controller takes as a name."""
    if not IDENTIFIER.fullmatch(text):
        raise rule(f"expected {IDENTIFIER_WORDS}, got {text[:40]!r}")
    return text


Identifier = Annotated[
    str, AfterValidator(_identifier), WithJsonSchema({"type": "string", "pattern": f"^{IDENTIFIER.pattern}$"})
]
Signal = Annotated[
    Annotated[Identifier, Tag(f"<{SIGNAL_WORDS}>")] | Annotated[int, Field(ge=0, le=LAST_SIGNAL), Tag("<number>")],
    by_kind(SIGNAL_WORDS, number=int),
]
Delay = Annotated[Ms, Within(ge=0.0, le=SLOWEST_MS)]
FrameNumber = Annotated[int, Field(ge=0, le=LAST_FRAME)]
PartFrameNumber = Annotated[int, Field(ge=1, le=LAST_FRAME)]
KindName = Literal["abb", "fanuc", "kuka", "reis", "ros", "staubli", "ur", "yaskawa", "other"]


class ControllerEntry(Entry):
    """A controller of the cell; robots on different controllers share no clock."""

    NAMES: ClassVar[Set[str]] = frozenset({"tasks", "process", "position_levels_mm"})  # keys that no proof depends on
    kind: KindName = Field(description="Maker of the controller, or what drives the robot.")
    tasks: dict[Identifier, Identifier] = setting(
        {},
        "By name of a task of an ABB controller, its mechanical unit: {T_ROB1: ROB_1}; only for kind abb.",
        max_length=TASK_LIMIT,
    )
    latency_ms: Delay | None = setting(None, "Time by which a robot follows what is sent to it; absent: not stated.")
    skew_ms: Delay | None = setting(
        None, "Largest difference between its clock and those of the other controllers; absent: not stated."
    )
    reaction_ms: Delay | None = setting(
        None, "Time for which its robots go on after a robot of another controller stopped; absent: not stated."
    )
    brake_s: Annotated[float, Field(ge=0.0, le=LONGEST_BRAKE_S)] | None = setting(
        None, "Time in which its robots then brake on their path; absent: not stated."
    )
    process: ProcessStatementsEntry | None = setting(
        None, "How its programs begin and end a process; absent: not stated."
    )
    position_levels_mm: tuple[Distance, ...] = setting(
        (),
        "Distances from a point within which motions with PL=1, PL=2 and so on are rounded, as set on the "
        "controller, rising; only for kind yaskawa. Absent: not stated, and no small corner is rounded.",
        max_length=LEVEL_LIMIT,
    )

    @model_validator(mode="after")
    def _has_process_of_its_kind(self) -> Self:
        """Process statements are those of the maker."""
        if self.process is not None:
            require_process(self.process, self.kind)
        return self

    @model_validator(mode="after")
    def _has_rising_levels_of_yaskawa_only(self) -> Self:
        """A larger position level rounds more; only Yaskawa has them."""
        levels = self.position_levels_mm
        if levels and self.kind != "yaskawa":
            raise rule(f"unexpected key, it applies to kind yaskawa only, got {self.kind}", "position_levels_mm")
        if any(second <= first for first, second in pairwise((0.0, *levels))):
            raise rule(f"expected rising distances above 0, got {list(levels)}", "position_levels_mm")
        return self

    @model_validator(mode="after")
    def _has_tasks_of_abb_only(self) -> Self:
        """Tasks belong to ABB; names that differ by case only are one name there."""
        if self.tasks and self.kind != "abb":
            raise rule(f"unexpected key, it applies to kind abb only, got {self.kind}", "tasks")
        for what, names in (("task", list(self.tasks)), ("mechanical unit", list(self.tasks.values()))):
            lower = [name.lower() for name in names]
            for index, task in enumerate(self.tasks):
                if lower[index] in lower[:index]:
                    raise rule(f"expected each {what} once, got '{names[index]}' twice", f"tasks.{task}")
        return self


class HandshakeEntry(Entry):
    """Signals with which a robot waits for others, as its own controller names them."""

    output: Signal = Field(description="Output that it sets: a name, or its number.")
    inputs: dict[Name, Signal] = Field(
        min_length=1,
        max_length=SIGNAL_LIMIT,
        description="By robot of the cell, the input that is wired to the output of that robot.",
    )


class RobotControlEntry(Entry):
    """Where a robot is connected, and how programs of its controller name things."""

    NAMES: ClassVar[Set[str]] = frozenset(
        {"task", "group", "machine", "decimals", "tool_number", "base_number", "frames", "handshake", "step_register"}
    )  # keys that no proof depends on
    id: Name = Field(description="Name of its controller under controllers.")
    task: Identifier | None = setting(None, "Name of its task among the tasks of the controller; only for kind abb.")
    group: Annotated[int, Field(ge=1, le=LAST_GROUP)] | None = setting(
        None, "Number of its motion group; only for the kinds fanuc and yaskawa."
    )
    decimals: Annotated[int, Field(ge=0, le=MOST_DECIMALS)] | None = setting(
        None,
        "Decimals of a degree or millimetre (of a radian in URScript) in programs of its controller's own language: "
        "fanuc_ls, inform, krl, rapid, urscript and val3; those of the format when absent, and in all other formats.",
    )
    machine: Annotated[int, Field(ge=2, le=LAST_MACHINE)] | None = setting(
        None, "Number of a positioner in MACHINE_DEF of its controller, where 1 is the arm; only for kind kuka."
    )
    cycle_ms: CycleTime | None = setting(
        None, "Cycle at which its controller takes positions; the same as controller_cycle_ms, of which one is enough."
    )
    tool_number: FrameNumber | None = setting(
        None, "Number of its tool on the controller; absent: tool 0, or the tool of the cell."
    )
    base_number: FrameNumber | None = setting(
        None, "Number of its base frame on the controller; absent: the base of the robot."
    )
    frames: tuple[PartFrameNumber, ...] = setting(
        (),
        "Numbers of the frames of the part on the controller, one for each pose of the part in which the robot works, "
        "in the order of first use; not stated when absent.",
        max_length=FRAME_LIMIT,
    )
    base: PoseEntry | None = setting(
        None, "Base that its controller counts from, in the base of the model; {}: the same. Absent: not stated."
    )
    tool_frame: PoseEntry | None = setting(
        None,
        "Flange that its controller counts tools from, in the flange of the model; {}: the same. Absent: not stated.",
    )
    handshake: HandshakeEntry | None = setting(None, "Signals with which it waits for other robots; none when absent.")
    step_register: Signal | None = setting(
        None,
        "Variable, or number of the register, in which its program keeps the step that an escape program begins from; "
        "cell_step, or register 24 of kind ur, 81 of kind fanuc, or variable D081 of kind yaskawa, when absent.",
    )

    @model_validator(mode="before")
    @classmethod
    def _states_no_zero(cls, given: Any) -> Any:
        """Refuse the zero of a controller, which the robot's own file states."""
        keys = [key for key in ControllerZeroEntry.model_fields if isinstance(given, dict) and key in given]
        if keys:
            text = (
                f"unexpected key, the zero of a controller is no part of a cell: move {', '.join(keys)} to the key "
                "controller of the robot's own file, or, for a URDF, to a file that controller_zero names"
            )
            raise rule(text, keys[0])
        return given
