"""Requirements of the checks, as a cell file states them."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from cellplan.model.settings.entry import Entry, Reason, SlidingSpeed, Text, rule, setting
from cellplan.model.settings.units import Deg, Mm, Within

WIDEST_CONTACT_MM: Final = 50.0  # farther from its tip a tool that touches the part collides with it
DEEPEST_CUT_MM: Final = 100.0  # a tool that is to stand deeper in the part is no tool that works on its surface

ToolDepth = Annotated[Mm, Within(ge=0.0, le=DEEPEST_CUT_MM)]


class ExclusionEntry(Entry):
    """A pair of bodies that the collision check leaves out."""

    bodies: tuple[Text, Text] = Field(
        description="Two bodies: ROBOT/LINK (all pieces of it), ROBOT/tool, ROBOT/tool_2, ROBOT/pedestal, "
        "ROBOT/ATTACHMENT, ROBOT (all of it), part or a name of the environment."
    )
    reason: Reason = Field(description="Why they may touch; it is repeated in the report.")

    @model_validator(mode="after")
    def _names_a_pair(self) -> Self:
        """Two different bodies."""
        if self.bodies[0] == self.bodies[1]:
            raise rule("expected two different bodies, got the same twice", "bodies[1]")
        return self


class StopEntry(Entry):
    """What is demanded when one robot stops and the robots of other controllers go on until they have braked."""

    depth_mm: Annotated[Mm, Within(ge=0.0, le=1000.0)] | None = setting(
        None, "Largest depth of a tool in the part; it is only reported when absent."
    )
    clearance_mm: Annotated[Mm, Within(ge=0.0, le=10_000.0)] | None = setting(
        None, "Smallest distance of all that must not touch; it is only reported when absent."
    )

    @model_validator(mode="after")
    def _demands_something(self) -> Self:
        """At least one of the two."""
        if self.depth_mm is None and self.clearance_mm is None:
            raise rule("expected depth_mm, clearance_mm or both, got neither")
        return self


class ChecksEntry(Entry):
    """Requirements of the checks."""

    clearance_mm: Annotated[Mm, Within(ge=0.0, le=10_000.0)] = setting(
        Mm(5.0), "Smallest allowed distance between things that must not touch."
    )
    body_accuracy: Literal["report", "add"] = setting(
        "report",
        "What to do with the stated accuracy of link bodies: report it beside the distances, or add that of both "
        "bodies to the demanded clearance of each pair.",
    )
    contact_zone_mm: Annotated[Mm, Within(ge=0.0, le=WIDEST_CONTACT_MM)] = setting(
        Mm(20.0), "Radius round the tool tip within which tool and part may touch."
    )
    tool_depth_mm: ToolDepth = setting(
        Mm(1.0), "Largest length of tool inside the part or beyond it, along the tool's axis from where it enters."
    )
    closure_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] = setting(
        Mm(0.003), "Largest distance of a further holder's tool from its grasp on the part."
    )
    closure_deg: Annotated[Deg, Within(gt=0.0, le=180.0)] = setting(
        Deg(0.001), "Largest angle between a further holder's tool and its grasp on the part."
    )
    standing_depth_mm: Annotated[Mm, Within(ge=0.0, le=1000.0)] = setting(
        Mm(5.0),
        "How deep bodies that never move may reach into each other where one stands on the other: a base in a floor "
        "or plinth, a fixed part on a table.",
    )
    part_acceleration_m_s2: Annotated[float, Field(gt=0.0, le=10_000.0)] | None = setting(
        None,
        "Largest allowed acceleration in the world of any corner of the bounding box of a part that is held; it is "
        "only reported when absent.",
    )
    tool_speed_mm_s: SlidingSpeed | None = setting(
        None, "Largest allowed speed of any tool tip in the world; it is only reported when absent."
    )
    stop: StopEntry | None = setting(
        None,
        "Demands on the time after one robot stopped, while robots of other controllers go on; only reported when "
        "absent.",
    )
    exclude: tuple[ExclusionEntry, ...] = setting((), "Pairs left out of the collision check.")

    @property
    def adds_accuracy(self) -> bool:
        """Whether the accuracy of both bodies is added to the demanded clearance of a pair."""
        return self.body_accuracy == "add"
