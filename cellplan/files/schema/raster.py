"""Rasters of a face, as written in a cell file."""

from typing import Annotated, Final

from pydantic import Field

from cellplan.files.schema.programmed import ProgrammedEntry
from cellplan.model.settings.entry import Angle, setting
from cellplan.model.settings.units import Deg, Mm, Within

FARTHEST_MM: Final = 1000.0  # no tool is wider, and none goes on farther past a border


class RasterEntry(ProgrammedEntry):
    """Lines at a constant distance on a face, traversed back and forth."""

    step_mm: Annotated[Mm, Within(ge=0.1, le=FARTHEST_MM)] = Field(
        description="Distance of neighbouring lines, along the face. A tool of the width w whose tracks overlap by a "
        "share o has w (1 - o)."
    )
    direction_deg: Angle = setting(
        Deg(0.0),
        "Direction of the lines in the middle of the face: from +x of the part frame as it lies on the face (+y on a "
        "face across x), counter-clockwise seen from outside. The first line is on its right.",
    )
    overlap_mm: Annotated[Mm, Within(ge=0.0, le=FARTHEST_MM)] = setting(
        Mm(0.0),
        "Distance by which each line goes on past the border with the process on, ever less bent; over holes and gaps "
        "along the face, the narrower ones wholly with the process on.",
    )
    lead_mm: Annotated[Mm, Within(ge=0.0, le=FARTHEST_MM)] = setting(
        Mm(0.0), "Distance by which each line goes on further, straight on, with the process off, to the next line."
    )
    chord_mm: Annotated[Mm, Within(gt=0.0, le=1.0)] = setting(
        Mm(0.01),
        "Largest distance of the lines from the straight sides that stand for them.",
    )
