"""Keys by which one task of a cell file stands for several, or for one with a longer path."""

from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from cellplan.files.schema.seam import Dwell, Length, Shift, TravelAngle, WeaveEntry, WorkAngle
from cellplan.model.settings.entry import Entry, SlidingSpeed, rule, setting
from cellplan.model.settings.task import LONGEST_S

MOST_PARTS: Final = 100  # tasks that one may stand for
Count = Annotated[int, Field(ge=1, le=MOST_PARTS)]


class PassEntry(Entry):
    """One pass of a seam: what differs from the keys of the task and of its path."""

    side_mm: Shift | None = setting(None, "As side_mm of the path.")
    out_mm: Shift | None = setting(None, "As out_mm of the path.")
    work_deg: WorkAngle | None = setting(None, "As work_deg of the path.")
    push_deg: TravelAngle | None = setting(None, "As push_deg of the path.")
    drag_deg: TravelAngle | None = setting(None, "As drag_deg of the path.")
    from_mm: Length | None = setting(None, "As from_mm of the path.")
    to_mm: Length | None = setting(None, "As to_mm of the path.")
    reverse: bool | None = setting(None, "As reverse of the path.")
    weave: WeaveEntry | None = setting(None, "As weave of the path.")
    feed_mm_s: SlidingSpeed | None = setting(None, "Feed, that of the process if the task has one.")
    rest_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = setting(
        None, "Time for which the tool rests at the end of the pass, the process off, before it leaves."
    )


class StitchEntry(Entry):
    """A seam with gaps."""

    length_mm: Length = Field(description="Length of each stitch.")
    gap_mm: Length = Field(description="Gap between two stitches.")
    count: Count | None = setting(
        None, "Number of stitches; as many as the path as it is drawn, or its edges, hold when absent; else required."
    )


class TacksEntry(Entry):
    """Tacks before a seam."""

    length_mm: Length = Field(description="Length of each tack.")
    pitch_mm: Length = Field(description="Distance from the begin of a tack to that of the next.")
    count: Count | None = setting(
        None, "Number of tacks; as many as the path as it is drawn, or its edges, hold when absent; else required."
    )

    @model_validator(mode="after")
    def _are_apart(self) -> Self:
        """Tacks do not overlap."""
        if self.pitch_mm <= self.length_mm:
            raise rule(
                f"expected more than the length of a tack, {self.length_mm:g}, got {self.pitch_mm:g}", "pitch_mm"
            )
        return self


class CraterEntry(Entry):
    """The end of a weld: the tool goes back and rests there with the process on, until the crater is filled."""

    back_mm: Length = Field(description="Length by which the tool goes back along its path, held as it came.")
    time_s: Dwell = Field(description="Time for which it rests there; in place of process.off_delay_s.")
