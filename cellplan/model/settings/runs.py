"""Runs of a process, as a cell file states them: where its tool comes to the feed before the work and to rest after."""

from typing import Annotated, Final, Literal, Self

import numpy as np
from pydantic import Field, PlainSerializer, Tag, model_validator

from cellplan.model.settings.entry import Entry, by_kind, rule, setting
from cellplan.model.settings.units import Mm, Within

AUTO: Final = "auto"
RUN_WORDS: Final = "a number in mm or auto"
LONGEST_RUN_MM: Final = 10_000.0  # longer is a wrong unit
LONGEST_LEAD_S: Final = 10.0  # no valve is slower
USUAL_RUN: Final = 0.02  # [m] of a run that is to be as long as the limits need, while that is not known

RunChoice = Annotated[
    Annotated[Literal["auto"], Tag(f"<{RUN_WORDS}>")]
    | Annotated[Mm, Within(ge=0.0, le=LONGEST_RUN_MM), PlainSerializer(float), Tag("<number>")],  # of a union of two
    by_kind(RUN_WORDS, number=(int, float)),
]


class RunsEntry(Entry):
    """Run-in and run-out of a process."""

    run_in_mm: RunChoice = setting(
        Mm(0.0),
        "Length along the tangent on which the tool comes to the start of its path and to the feed, the process off; "
        "auto for as much as the limits of the joints need.",
    )
    run_out_mm: RunChoice = setting(
        Mm(0.0), "Likewise behind the end of its path, on which the tool slows down to rest."
    )
    run_arc_mm: Annotated[Mm, Within(ge=0.0, le=LONGEST_RUN_MM)] = setting(
        Mm(0.0),
        "Radius of a quarter circle between each run and the path, tangential to both, in the plane across the tool: "
        "a closed contour begins and ends without a corner. Runs of 0 mm then are the arcs alone.",
    )
    run_arc_side: Literal["left", "right"] = setting(
        "left", "Side of the path, in its direction and seen against the tool, on which these arcs are."
    )
    lift_mm: Annotated[Mm, Within(ge=0.0, le=1000.0)] = setting(
        Mm(0.0),
        "Height, against the tool at the end of the path, from which the tool comes down on its run-in and to which it "
        "goes up on its run-out, tangential at the path.",
    )
    lead_s: Annotated[float, Field(ge=0.0, le=LONGEST_LEAD_S)] = setting(
        0.0,
        "Time by which the process is switched before the tool comes to the start of its path, and before it comes to "
        "the end: the lag of a valve. Only with both runs.",
    )
    run_tolerance_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] | None = setting(
        None,
        "Largest position error on the runs, at least that of the task, which holds when left out; between rows it is "
        "larger by the same factor.",
    )

    @property
    def has_runs(self) -> tuple[bool, bool]:
        """Whether there is a run-in, and a run-out."""
        return bool(self.run_in_mm or self.run_arc_mm), bool(self.run_out_mm or self.run_arc_mm)

    @property
    def straights(self) -> tuple[float, float]:
        """Lengths in [m] of both runs along their tangents; usual ones while they are not known."""
        in_, out = (USUAL_RUN if run == AUTO else run.si for run in (self.run_in_mm, self.run_out_mm))
        return in_, out

    @property
    def runs(self) -> tuple[float, float]:
        """Lengths in [m] of both runs with their arcs, but for their lift."""
        first, last = (straight + 0.5 * np.pi * self.run_arc_mm.si for straight in self.straights)
        return first, last

    @property
    def arc(self) -> float:
        """Radius of the arcs in [m], positive to the left."""
        return self.run_arc_mm.si if self.run_arc_side == "left" else -self.run_arc_mm.si

    @property
    def run_key(self) -> str:
        """The key that states a run."""
        return next(key for key in ("run_in_mm", "run_out_mm", "run_arc_mm") if getattr(self, key))

    @model_validator(mode="after")
    def _has_what_it_shapes(self) -> Self:
        """What shapes a run needs one; a lead needs both, as a process begins and ends at rest without."""
        for key in ("lift_mm", "run_tolerance_mm"):
            if getattr(self, key) and not any(self.has_runs):
                raise rule("unexpected key without a run: write run_in_mm or run_out_mm", key)
        if self.lead_s and not all(self.has_runs):
            raise rule("expected run_in_mm and run_out_mm beside it, as the tool moves when the valve opens", "lead_s")
        return self
