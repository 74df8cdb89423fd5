"""Paths with rapids and stops of their own: of CAM, and outlines of drawings."""

from typing import Annotated, Final, Literal

from pydantic import Field, Tag

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import pose
from cellplan.model.settings.entry import (
    Coordinate,
    Entry,
    FrameAngle,
    PlaneCoordinates,
    PoseEntry,
    SlidingSpeed,
    Text,
    by_kind,
    setting,
)
from cellplan.model.settings.task import FARTHEST_STAND_OFF_MM
from cellplan.model.settings.units import Deg, Mm, MmPerS, Within

CAM_WORDS: Final = "a file name or {file: part.apt, transfer_mm_s: 250}"
MOST_JOINED_MM: Final = 1.0  # points farther apart than this are two points of a path


class ProgrammedEntry(Entry):
    """Base of paths with rapids, and corners of which some are stops."""

    transfer_mm_s: SlidingSpeed = setting(MmPerS(250.0), "Speed of rapids; the process is off on them.")
    rounding_mm: Annotated[Mm, Within(gt=0.0, le=MOST_JOINED_MM)] = setting(
        Mm(0.01), "Largest distance of a corner that is passed without a stop from the straight sides."
    )
    stop_deg: Annotated[Deg, Within(gt=0.0, le=90.0)] = setting(
        Deg(20.0), "Change of direction beyond which the tool stops at a corner."
    )


class CamEntry(ProgrammedEntry):
    """Tool targets from a file of CAM, with feeds and rapids."""

    file: Text = Field(description="File of the points.")
    at: PoseEntry = setting(PoseEntry(), "Pose of the file's frame in the part frame.")


class GcodeEntry(CamEntry):
    """Tool targets from G-code."""

    chord_mm: Annotated[Mm, Within(gt=0.0, le=MOST_JOINED_MM)] = setting(
        Mm(0.01), "Largest distance of an arc from the straight sides that stand for it."
    )


CamChoice = Annotated[
    Annotated[Text, Tag(f"<{CAM_WORDS}>")] | Annotated[CamEntry, Tag("<mapping>")], by_kind(CAM_WORDS, mapping=dict)
]
GcodeChoice = Annotated[
    Annotated[Text, Tag(f"<{CAM_WORDS}>")] | Annotated[GcodeEntry, Tag("<mapping>")], by_kind(CAM_WORDS, mapping=dict)
]


class FlatPoseEntry(Entry):
    """Where a drawing lies in a plane, and how it is turned."""

    x_mm: Coordinate = setting(Mm(0.0), "Position of its origin along x.")
    y_mm: Coordinate = setting(Mm(0.0), "Likewise along y.")
    turn_deg: FrameAngle = setting(Deg(0.0), "Turn about its origin, counterclockwise as it is seen.")

    @property
    def matrix(self) -> Array:
        """The pose in [m] and [rad], shape (4, 4)."""
        return pose((self.x_mm.si, self.y_mm.si, 0.0), (0.0, 0.0, self.turn_deg.si))


class OutlineEntry(ProgrammedEntry):
    """Contours of a layer of a DXF drawing: chained lines, arcs, ellipses and splines."""

    file: Text = Field(description="DXF file.")
    unit: Literal["mm", "cm", "m", "inch", "ft"] | None = setting(
        None, "Unit of the drawing; required where the file states none ($INSUNITS), which must be the same."
    )
    at: FlatPoseEntry = setting(FlatPoseEntry(), "Pose of the drawing in the frame of the face or of the projection.")
    contours: tuple[Annotated[int, Field(ge=1)], ...] | None = setting(
        None,
        "Numbers of the contours, from 1, in the order in which they are run along; absent: all. They are numbered in "
        "the order of the file.",
        min_length=1,
    )
    order: Literal["file", "nearest"] = setting(
        "file", "Order of the contours: as listed, or the one next that begins nearest."
    )
    start_at_mm: PlaneCoordinates | None = setting(
        None, "Point of the drawing; closed contours begin where they are nearest to it."
    )
    join_mm: Annotated[Mm, Within(gt=0.0, le=MOST_JOINED_MM)] = setting(
        Mm(0.01), "Ends of curves that are no farther apart are joined."
    )
    chord_mm: Annotated[Mm, Within(gt=0.0, le=MOST_JOINED_MM)] = setting(
        Mm(0.01), "Largest distance of the contours on the part from the straight sides that stand for them."
    )
    lift_mm: Annotated[Mm, Within(gt=0.0, le=FARTHEST_STAND_OFF_MM)] = setting(
        Mm(20.0), "Height of rapids above the highest point of the contours, out of the face or the side of the part."
    )


OUTLINE_WORDS: Final = "a file name or {file: logo.dxf, unit: mm}"
OutlineChoice = Annotated[
    Annotated[Text, Tag(f"<{OUTLINE_WORDS}>")] | Annotated[OutlineEntry, Tag("<mapping>")],
    by_kind(OUTLINE_WORDS, mapping=dict),
]
