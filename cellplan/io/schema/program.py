"""Programs from home to home: cycles, marks, and where the part lies before and after."""

from typing import Annotated, Final

from pydantic import Field, Tag

from cellplan.io.schema.common import Entry, Name, PoseEntry, by_kind
from cellplan.io.schema.task import FARTHEST_STAND_OFF_MM, LONGEST_S, MOST_CYCLES
from cellplan.io.schema.units import Mm, Within

MARK_LIMIT: Final = 200
MARK_WORDS: Final = "a name or {name: m1, dwell_s: 0.5}"
StraightMove = Annotated[Mm, Within(gt=0.0, le=FARTHEST_STAND_OFF_MM)]


class MarkEntry(Entry):
    """A point at which robots wait for one another."""

    name: Name = Field(description="Name of the mark, unlike that of any task.")
    dwell_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = Field(
        default=0.0, description="Time for which all robots of the cell stand still at the mark."
    )


MarkChoice = Annotated[
    Annotated[Name, Tag(f"<{MARK_WORDS}>")] | Annotated[MarkEntry, Tag("<mapping>")],
    by_kind(MARK_WORDS, mapping=dict),
]


class PartPlaceEntry(Entry):
    """A place at which the part lies without a robot that holds it."""

    at: PoseEntry = Field(description="Pose of the part frame in the world.")
    rests_on: Name | None = Field(
        default=None, description="Body of the environment that the part may touch there; none when absent."
    )
    approach_mm: StraightMove = Field(
        default=Mm(50.0),
        description="Length of the straight move of the holder to the part before it grips, or away from it after it "
        "lets go, along its tool axis.",
    )
    lift_mm: StraightMove = Field(
        default=Mm(50.0),
        description="Height over which the part is moved straight up from its place, or down to it.",
    )


class ProgramEntry(Entry):
    """A program from home to home: transfer moves lead from the homes to the tasks, between them, and back."""

    cycles: Annotated[int, Field(ge=1, le=MOST_CYCLES)] = Field(
        default=1, description="How often all of the program is done."
    )
    marks: tuple[MarkChoice, ...] = Field(
        default=(),
        max_length=MARK_LIMIT,
        description="Points at which robots wait for one another. A mark stands in the order of every robot that takes "
        "part: these go on when all of them have come to it. A robot without the mark in its order does not take part.",
    )
    attach: PartPlaceEntry | None = Field(
        default=None,
        description="Where the part lies as an obstacle until it is gripped; held from the beginning when absent.",
    )
    detach: PartPlaceEntry | None = Field(
        default=None, description="Where the part is put down after the last task; held to the end when absent."
    )

    @property
    def all_marks(self) -> tuple[MarkEntry, ...]:
        """The marks, those given by name only with their defaults."""
        return tuple(mark if isinstance(mark, MarkEntry) else MarkEntry(name=mark) for mark in self.marks)
