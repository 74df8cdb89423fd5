"""Tolerance and process of a task, as a cell file states them, and bounds that tasks and programs share."""

from typing import Annotated, Final, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, Tag, model_validator

from cellplan.model.settings.entry import Entry, SlidingSpeed, by_kind, rule, setting
from cellplan.model.settings.forces import ProcessForceEntry
from cellplan.model.settings.runs import RunsEntry
from cellplan.model.settings.units import Deg, Mm, MmPerS, Within

FARTHEST_STAND_OFF_MM: Final = 5_000.0  # no tool backs off farther
LONGEST_S: Final = 1e6  # [s] eleven days: longer is a wrong unit
FREE_WORDS: Final = "spin or {tilt_deg: 10}"
WIDEST_TILT_DEG: Final = 60.0  # beyond it a tool works with its side
FEED_WORDS: Final = "a number above 0 in mm/s, greatest or [low, high]"
USUAL_RAMP: Final = 0.1  # [s]
UNKNOWN_FEED: Final = 0.01  # [m/s] of a process whose greatest feed is not known yet
MOST_CYCLES: Final = 10_000  # more turns of one path are a shift, not a job


class ToleranceEntry(Entry):
    """Largest allowed tool error on the part."""

    position_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] = setting(Mm(0.1), "Largest position error.")
    orientation_deg: Annotated[Deg, Within(gt=0.0, le=180.0)] = setting(Deg(0.01), "Largest orientation error.")
    between_rows_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] | None = setting(
        None,
        "Largest position error between the rows of the tables, where joints move evenly from row to row; position_mm "
        "when left out. A larger one is for steps that something else prescribes.",
    )
    between_rows_deg: Annotated[Deg, Within(gt=0.0, le=180.0)] | None = setting(
        None, "Likewise for the orientation; orientation_deg when left out."
    )

    @property
    def filled(self) -> Self:
        """The same with the errors between the rows written out."""
        return self.changed(
            between_rows_mm=self.between_rows_mm or self.position_mm,
            between_rows_deg=self.between_rows_deg or self.orientation_deg,
        )

    @property
    def between(self) -> tuple[float, float]:
        """Largest position error in [m] and orientation error in [rad] between the rows."""
        return (self.between_rows_mm or self.position_mm).si, (self.between_rows_deg or self.orientation_deg).si


class TiltEntry(Entry):
    """How far the axis of a tool may lean."""

    tilt_deg: Annotated[Deg, Within(gt=0.0, le=WIDEST_TILT_DEG)] = Field(
        description="Largest angle between the tool's axis and the desired one, to any side."
    )


def _has_round_cone(free: "tuple[str | TiltEntry, ...]") -> "tuple[str | TiltEntry, ...]":
    """A tool whose axis may lean may turn about it."""
    if free and "spin" not in free:
        raise rule("expected spin beside tilt_deg: [spin, {tilt_deg: 10}], as a cone is round")
    return free


FreeChoice = Annotated[
    Annotated[Literal["spin"], Tag(f"<{FREE_WORDS}>")] | Annotated[TiltEntry, Tag("<mapping>")],
    by_kind(FREE_WORDS, mapping=dict),
]
Free = Annotated[tuple[FreeChoice, ...], AfterValidator(_has_round_cone)]


def tilt_of(free: Free) -> float:
    """Largest angle in [rad] by which the axis of a tool may lean; 0 where it may not."""
    return max((word.tilt_deg.si for word in free if isinstance(word, TiltEntry)), default=0.0)


class TorchEntry(Entry):
    """How a tool is held to gravity."""

    within_deg: Annotated[Deg, Within(gt=0.0, le=180.0)] = Field(
        description="Largest angle between the axis of the tool and gravity along the path."
    )


Range = tuple[Annotated[Deg, Within(ge=-180.0, le=180.0)], Annotated[Deg, Within(ge=-180.0, le=180.0)]]


class WeldPositionEntry(Entry):
    """How a weld lies to gravity, by the angles of ISO 6947."""

    slope_deg: Range = setting(
        (Deg(-90.0), Deg(90.0)),
        "Smallest and largest angle of the weld axis, along the direction of travel, above the horizontal.",
    )
    rotation_deg: Range = setting(
        (Deg(-180.0), Deg(180.0)),
        "Smallest and largest angle by which the weld face is turned about that axis from where it looks up. The face "
        "looks against the tool.",
    )

    @model_validator(mode="after")
    def _is_ordered(self) -> Self:
        """The smaller angle first."""
        for key, (low, high) in (("slope_deg", self.slope_deg), ("rotation_deg", self.rotation_deg)):
            if low > high:
                raise rule(f"expected [low, high], got [{low:g}, {high:g}]: the smaller angle comes first", key)
        return self

    @property
    def slope(self) -> tuple[float, float]:
        """Smallest and largest slope in [rad]."""
        return self.slope_deg[0].si, self.slope_deg[1].si

    @property
    def rotation(self) -> tuple[float, float]:
        """Smallest and largest rotation in [rad]."""
        return self.rotation_deg[0].si, self.rotation_deg[1].si


def _has_width(feeds: tuple[MmPerS, MmPerS]) -> tuple[MmPerS, MmPerS]:
    """The smaller feed first."""
    if feeds[0] >= feeds[1]:
        raise rule(f"expected [low, high], got [{feeds[0]:g}, {feeds[1]:g}]: the smaller feed comes first")
    return feeds


FeedChoice = Annotated[
    Annotated[Literal["greatest"], Tag(f"<{FEED_WORDS}>")]
    | Annotated[SlidingSpeed, Tag("<number>")]
    | Annotated[tuple[SlidingSpeed, SlidingSpeed], AfterValidator(_has_width), Tag("<list>")],
    by_kind(FEED_WORDS, number=(int, float), list=tuple),
]


class ProcessEntry(RunsEntry):
    """A process that demands a feed: welding, sealing, dispensing."""

    feed_mm_s: FeedChoice | None = setting(
        None,
        "Demanded speed of the tool along its path on the surface, but for the ramps beside each stop: a number, the "
        "greatest that all limits allow, or the greatest within a range, [400, 900]. Not for a path whose file states "
        "the feeds.",
    )
    feed_ratio: Annotated[float, Field(gt=0.0, le=1000.0)] = setting(
        1.0,
        "Ratio of the greatest feeds of tasks that are done together: one of 2 runs twice as fast as one of 1. Only "
        "with greatest or a range.",
    )
    tolerance_percent: Annotated[float, Field(gt=0.0, le=50.0)] = setting(
        5.0, "By how much the speed between two rows may differ from the feed."
    )
    on_delay_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = setting(
        0.0, "Time for which the tool rests at the start of its path with the process on."
    )
    off_delay_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = setting(
        0.0, "Time for which the tool rests at the end of its path with the process on."
    )
    ramp_s: Annotated[float, Field(gt=0.0, le=10.0)] | None = setting(
        None,
        "Time in which the tool comes from rest to the feed and back, at both ends of the path and at corners at "
        "which it stops; the process is on, the feed is not judged. 0.1 without ramp_mm.",
    )
    ramp_mm: Annotated[Mm, Within(gt=0.0, le=10_000.0)] | None = setting(
        None, "Length of path on which it does, in place of ramp_s: all motion then scales with the feed."
    )
    force: ProcessForceEntry | None = setting(
        None,
        "Force and moment that the process exerts on the tool while it is on, not on rapids and runs; absent: not "
        "stated.",
    )

    @property
    def feed(self) -> float:
        """Demanded speed in [m/s], the greatest one of a path with several; a slow one while it is open."""
        if isinstance(self.feed_mm_s, MmPerS):
            return self.feed_mm_s.si
        return 0.0 if self.feed_mm_s is None else self.open_feeds[0] or UNKNOWN_FEED

    @property
    def has_open_feed(self) -> bool:
        """Whether the greatest feed is sought."""
        return self.feed_mm_s is not None and not isinstance(self.feed_mm_s, MmPerS)

    @property
    def open_feeds(self) -> tuple[float, float]:
        """The least and the greatest feed in [m/s] that may be found where it is open."""
        return (self.feed_mm_s[0].si, self.feed_mm_s[1].si) if isinstance(self.feed_mm_s, tuple) else (0.0, np.inf)

    @property
    def scales(self) -> bool:
        """Whether its ramps have lengths, so that all motion scales with the feed."""
        return self.ramp_mm is not None or all(self.has_runs)

    @property
    def ramp(self) -> float:
        """Time in [s] of a ramp on the work: on its length the mean speed is half the feed."""
        if self.ramp_mm is not None:
            return 2.0 * self.ramp_mm.si / self.feed
        return USUAL_RAMP if self.ramp_s is None else self.ramp_s

    def ramps(self, runs: tuple[float, float]) -> tuple[float, float]:
        """Times in [s] of the first ramp and of the last: as long as runs of lengths in [m], on the work without."""
        first, last = (2.0 * run / self.feed if run > 0.0 else self.ramp for run in runs)
        return first, last

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        """Only open feeds have a ratio; a ramp has a time or a length, and a length needs a feed."""
        if self.ramp_mm is not None and self.ramp_s is not None:
            raise rule("expected either ramp_s or ramp_mm, got both", "ramp_mm")
        runs_in, runs_out = self.has_runs
        both, is_excluded = runs_in and runs_out, "unexpected key beside a run in which the tool"
        for key, has_run in (("ramp_s", both), ("ramp_mm", both), ("on_delay_s", runs_in), ("off_delay_s", runs_out)):
            if has_run and getattr(self, key):
                raise rule(f"{is_excluded} {'slows down' if key == 'off_delay_s' else 'comes to its feed'}", key)
        if (runs_in or runs_out) and self.feed_mm_s is None:
            raise rule("unexpected key for a path whose file states the feeds", self.run_key)
        if self.ramp_mm is not None and self.feed_mm_s is None:
            raise rule("unexpected key for a path whose file states the feeds; write ramp_s", "ramp_mm")
        if self.feed_ratio != 1.0 and not self.has_open_feed:
            raise rule("unexpected key, the feed is stated: write feed_mm_s: greatest, or leave it out", "feed_ratio")
        return self

    @property
    def tolerance(self) -> float:
        """Share of the feed by which the speed may differ from it."""
        return self.tolerance_percent / 100.0
